"""Whatever cannot be had must not cost what can: streets above, other meshes, other sites."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import shapely
from platwright.errors import InfeasibleError, MeshError
from platwright.levels import COLLECTOR, LOCAL
from platwright.mesh import quadrangulate
from platwright.network import solve as solve_module
from platwright.network.evaluate import Evaluator
from platwright.network.level_settings import LevelSettings
from platwright.network.specification import Specification
from platwright.progress import Silent
from platwright.streets import (
    NoDesignError,
    Preferences,
    Wishes,
    design_streets,
    no_plan,
    plan_layers,
    solving,
)
from platwright.streets import levels as levels_module
from platwright.streets import plan as plan_module
from platwright.streets.preferences import Zone
from platwright.streets.program import level_problem
from shapely.geometry import LineString

from .conftest import make_site

PAPER = Specification(
    rules="paper",
    block_width=108.0,
    cul_de_sacs=True,
    level_settings={4: LevelSettings(coverage=25.0, coverage_unit="metres")},
    gap=0.4,
    time_limit=5.0,
    levels=1,
)


class Told(Silent):
    """Keeps the warnings."""

    def __init__(self) -> None:
        self.warnings: list[str] = []

    def warn(self, text: str) -> None:
        self.warnings.append(text)


@pytest.mark.parametrize("good", [0, 1])
def test_warnings_about_meshes_that_are_not_taken_are_not_told(monkeypatch, good):
    def two(site, spec, arrivals, progress, *rest):
        def warned(i):
            progress.warn(f"mesh {i}")
            return quadrangulate(site.polygon, (72.0, 60.0)[i])

        return [lambda: warned(0), lambda: warned(1)]

    scores = iter([1.0, 2.0] if good == 0 else [2.0, 1.0])
    monkeypatch.setattr(plan_module, "mesh_choices", two)
    monkeypatch.setattr(plan_module, "_misfit", lambda *_: next(scores))
    told = Told()
    site = make_site(shapely.box(0, 0, 360, 288))
    design_streets([site], Specification(time_limit=4.0), progress=told)
    assert [text for text in told.warnings if text.startswith("mesh")] == [f"mesh {good}"]


def test_a_block_without_culs_de_sac_keeps_its_streets(monkeypatch):
    solve = levels_module.solve_level

    def failing(problem, spec, seconds, progress, name, start=None, **options):
        if name.startswith("Culs"):
            raise InfeasibleError("None was found.")
        return solve(problem, spec, seconds, progress, name, start, **options)

    monkeypatch.setattr(levels_module, "solve_level", failing)
    site = make_site(shapely.box(0, 0, 432, 324))
    told = Told()
    found = design_streets([site], PAPER, progress=told)
    (plan,) = found.plans
    assert {s.level for s in plan.segments} == {3}
    places = plan.network.left
    assert places
    rows = plan_layers(found)["problems"]
    rows = rows[rows["problem"].str.contains("culs-de-sac")]
    assert len(rows) == len(places)
    assert rows.geometry.within(site.polygon).all()
    for place in places:
        where = f"x {place.x:.0f}, y {place.y:.0f}"
        assert any(where in text and "None was found." in text for text in told.warnings)


def test_ground_that_cannot_be_refined_has_no_culs_de_sac(monkeypatch):
    def failing(mesh, ground=None):
        raise MeshError("Too fine.")

    monkeypatch.setattr(plan_module, "subdivide", failing)
    told = Told()
    site = make_site(shapely.box(0, 0, 432, 324))
    (plan,) = design_streets([site], PAPER, progress=told).plans
    assert plan.segments
    assert any("no culs-de-sac: Too fine." in text for text in told.warnings)


def test_what_is_not_found_in_time_is_built_on_from_what_must_be(monkeypatch):
    """A search that fails without a start must not cost the design."""
    begun = []
    solve = solve_module.solve

    def slow(problem, *, start=None, **options):
        begun.append(start)
        if start is None:
            raise InfeasibleError("No street network was found.")
        assert math.isfinite(Evaluator(problem).objective(start))
        return solve(problem, start=start, **options)

    monkeypatch.setattr(solving, "solve", slow)
    site = make_site(shapely.box(0, 0, 288, 288))
    (plan,) = design_streets([site], Specification(time_limit=4.0)).plans
    assert plan.segments
    assert begun[0] is None
    assert not begun[1].any()


def test_what_cannot_be_had_on_one_mesh_is_looked_for_on_the_next(monkeypatch):
    design, calls = plan_module.design_levels, []

    def first_fails(*given, **options):
        calls.append(1)
        if len(calls) == 1:
            raise InfeasibleError("Not on this mesh.")
        return design(*given, **options)

    monkeypatch.setattr(plan_module, "design_levels", first_fails)
    (plan,) = design_streets([make_site(shapely.box(0, 0, 300, 330))], Specification()).plans
    assert plan.segments
    assert len(calls) > 1


def test_no_mesh_gives_the_reason_of_the_network(monkeypatch):
    def fails(*given, **options):
        raise InfeasibleError("On no mesh.")

    monkeypatch.setattr(plan_module, "design_levels", fails)
    with pytest.raises(InfeasibleError, match="On no mesh"):
        design_streets([make_site(shapely.box(0, 0, 300, 330))], Specification())


@pytest.mark.slow
def test_all_sites_without_a_design_have_their_places():
    sites = [
        dataclasses.replace(
            make_site(shapely.box(x, 0, x + 432, 324)), name=f"Site {x}", feature=k, site_id=k + 1
        )
        for k, x in enumerate((0, 1000))
    ]
    required = [LineString([(x + 216, 0), (x + 216, 324)]) for x in (0, 1000)]
    spec = Specification(rules="paper", levels=1, length_budget=30.0, time_limit=4.0)
    with pytest.raises(NoDesignError) as caught:
        design_streets(sites, spec, wishes=Wishes(required=required))
    assert [site.name for site, _ in caught.value.failures] == ["Site 0", "Site 1000"]
    assert "Site 0" in str(caught.value)
    assert "Site 1000" in str(caught.value)
    rows = plan_layers(no_plan(caught.value.failures, spec))["problems"]
    for site in sites:
        own = rows[rows["layer"] == site.name]
        assert len(own) > 1
        assert own.geometry.intersects(site.polygon.buffer(1)).all()


@pytest.mark.slow
def test_one_site_without_a_design_has_its_places():
    site = make_site(shapely.box(0, 0, 432, 324))
    required = [LineString([(216, 0), (216, 324)])]
    spec = Specification(rules="paper", levels=1, length_budget=30.0, time_limit=4.0)
    with pytest.raises(NoDesignError) as caught:
        design_streets([site], spec, wishes=Wishes(required=required))
    ((failed, error),) = caught.value.failures
    assert failed is site
    assert error is caught.value
    assert caught.value.places


@pytest.mark.parametrize("rules", ["planner", "paper"])
def test_a_dense_area_makes_local_streets_dense_and_not_collectors(rules):
    site = make_site(shapely.box(0, 0, 648, 648))
    spec = Specification(rules=rules, edge_length=72.0, gap=0.5, time_limit=1.5)
    plain = design_streets([site], dataclasses.replace(spec, levels=1)).plans[0].network.ground
    west, east = Zone(shapely.box(0, 0, 324, 648), 40.0), Zone(shapely.box(325, 0, 648, 648), 400.0)
    nothing = np.zeros(len(plain.mesh.edges), dtype=bool)
    x = plain.mesh.vertices[:, 0]

    def reach(level, *zones):
        ground = dataclasses.replace(plain, preferences=Preferences(density=list(zones)))
        cover = level_problem(ground, spec, level, nothing).cover
        return {
            side: max(
                (
                    float(np.hypot(*(plain.mesh.vertices[u] - plain.mesh.vertices[v]).T))
                    for v, ball in cover.items()
                    for u in ball
                    if (x[v] < 320) == (side == "west")
                ),
                default=0.0,
            )
            for side in ("west", "east")
        }

    for level in (COLLECTOR, LOCAL):
        usual, own = reach(level), reach(level, west, east)
        if level == LOCAL:
            assert own["west"] < usual["west"]
        else:
            assert own["west"] == pytest.approx(usual["west"])
        # where it is the wider range it counts for both: fewer places need a street, from farther
        assert own["east"] == 0 or own["east"] > usual["east"]
