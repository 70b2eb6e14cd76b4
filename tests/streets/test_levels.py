"""Each street level by its own settings, and what the layers say of levels."""

from __future__ import annotations

import pytest
import shapely
from platwright.levels import LEVEL_NAMES, SPEEDS
from platwright.network.level_settings import LevelSettings
from platwright.network.specification import FORBID, Specification
from platwright.progress import Silent
from platwright.site import BoundaryStreet
from platwright.streets import design_streets, plan_layers
from platwright.streets.hierarchy import speed_kmh
from platwright.streets.levels import TIME_SHARES, time_share
from platwright.streets.program import BLIND_END, asked_at
from shapely.geometry import LineString

from .conftest import make_site


def of_level(plan, level):
    return [s.problem for s in plan.network.solved if s.level == level]


def test_the_programs_of_a_level_take_its_settings(square):
    settings = {
        2: LevelSettings(weight_length=2.0, weight_distance=0.5, dead_ends=1.5, coverage=2),
        3: LevelSettings(weight_length=0.5),
    }
    plan = design_streets([square], Specification(level_settings=settings)).plans[0]
    (collectors,) = of_level(plan, 2)
    assert collectors.weight_length == 2.0
    assert collectors.weight_distance == 0.5
    assert collectors.dead_ends == 1.5
    assert collectors.cover_radius == 2
    assert of_level(plan, 3)
    for problem in of_level(plan, 3):
        assert problem.weight_length == 0.5
        assert problem.weight_distance == 0.0
        assert problem.dead_ends == FORBID
        assert problem.cover_radius == 1


def test_dead_ends_of_one_level_stay_there():
    site = make_site(
        shapely.box(0, 0, 430, 290),
        frontage=[LineString([(0, 0), (430, 0)])],
        streets=(BoundaryStreet(LineString([(-50, 0), (480, 0)]), "South Street"),),
    )
    settings = {3: LevelSettings(dead_ends=0.0, weight_length=4.0)}
    plan = design_streets([site], Specification(level_settings=settings)).plans[0]
    ends = [xy for s in plan.segments for xy in (s.line.coords[0], s.line.coords[-1])]
    blind = [
        s
        for s in plan.segments
        for xy in (s.line.coords[0], s.line.coords[-1])
        if ends.count(xy) == 1 and xy[1] > 1
    ]
    assert all(s.level == 4 for s in blind)
    level = plan.network.level
    mesh = plan.network.ground.mesh
    for s in plan.network.solved:
        if s.level == 2:
            degree = {}
            for u, v in mesh.edges[s.design.active].tolist():
                degree[u], degree[v] = degree.get(u, 0) + 1, degree.get(v, 0) + 1
            tips = [v for v, n in degree.items() if n == 1]
            on_street = set(mesh.edges[plan.network.ground.street].ravel().tolist())
            assert set(tips) <= on_street
    assert set(level.tolist()) <= {0, 2, 3}


def test_shares_of_the_time():
    spec = Specification(level_settings={2: LevelSettings(time_share=0.2)})
    assert time_share(spec, 2) == 0.2
    assert time_share(spec, 3) == TIME_SHARES[3]


class Clock(Silent):
    """Notes the stages and when they began."""

    def __init__(self) -> None:
        self.stages: list[str] = []

    def stage(self, text: str, fraction: float) -> None:
        assert 0 <= fraction <= 1
        self.stages.append(text)


def test_culs_de_sac_may_end_blind_whatever_the_rest_may():
    spec = Specification()
    assert asked_at(spec, 2) is spec
    assert asked_at(spec, 4).dead_ends == BLIND_END
    own = Specification(coverage=1, level_settings={4: LevelSettings(dead_ends=3.0)})
    assert asked_at(own, 4).dead_ends == 3.0
    assert asked_at(own, 4).coverage_unit == "metres"
    wide = Specification(level_settings={4: LevelSettings(coverage=2)})
    assert (asked_at(wide, 4).coverage, asked_at(wide, 4).coverage_unit) == (2, "edges")


def test_layers_name_every_level_and_its_speed(field):
    settings = {2: LevelSettings(speed_kmh=40.0), 3: LevelSettings(speed_kmh=25.0)}
    spec = Specification(level_settings=settings)
    clock = Clock()
    rows = plan_layers(design_streets([field], spec, progress=clock))["streets"]
    assert any("ollectors" in text for text in clock.stages)
    assert set(rows["level"]) == {2, 3}
    for row in rows.itertuples():
        assert row.level_name == {2: "collector", 3: "local"}[row.level]
        assert row.speed_kmh == {2: 40.0, 3: 25.0}[row.level]


def test_speeds_fall_with_the_level():
    speeds = [speed_kmh(Specification(), level) for level in sorted(SPEEDS)]
    assert speeds == [65.0, 50.0, 30.0, 20.0]
    assert sorted(LEVEL_NAMES) == sorted(SPEEDS) == [1, 2, 3, 4]


@pytest.mark.slow
@pytest.mark.parametrize("levels", [1, 2])
def test_culs_de_sac_change_no_street_above_them(field, levels):
    plain = design_streets([field], Specification(levels=levels)).plans[0]
    more = design_streets([field], Specification(levels=levels, cul_de_sacs=True)).plans[0]
    assert plain.network.level.tolist() == more.network.level.tolist()
    above = shapely.union_all([s.line for s in more.segments if not s.blind])
    wished = shapely.union_all([s.line for s in plain.segments])
    assert above.difference(wished.buffer(0.05)).length < 0.1
    assert wished.difference(above.buffer(0.05)).length < 0.1
    assert any(s.blind for s in more.segments)
