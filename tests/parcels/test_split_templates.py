"""Drawn templates in layouts, the streets that they bring, and connectors to the outside."""

from __future__ import annotations

import dataclasses
from collections import Counter

import numpy as np
import pytest
import shapely
from layout_checks import RULES, UTM, check, ground, site_of
from platwright.parcels.roadmesh import Ground, begin_mesh
from platwright.parcels.split import SplitRules, lay_out, lay_out_sites, site_layers
from platwright.parcels.split.choosing import Chooser, TemplateRules
from platwright.parcels.templates import TemplateLibrary, shipped_library
from platwright.site import BoundaryStreet
from shapely.geometry import LineString, MultiLineString, Polygon, box

SIDE_ROWS = "Cul-de-sac with side rows"


def with_templates(*names: str, **changes: object) -> SplitRules:
    """Few second thoughts, some templates of the shipped library, changed as told."""
    library = shipped_library()
    if changes:
        library = TemplateLibrary(
            [dataclasses.replace(t, **changes) if t.name in names else t for t in library]
        )
    return SplitRules(tries=1, templates=TemplateRules(library, names))


def used(layout) -> Counter:
    mesh = layout.mesh
    return Counter(mesh.labels[r] for r in mesh.regions if r in mesh.labels)


# wide enough for a cul-de-sac between two rows, too deep for rows alone
DEEP = Polygon([(0, 0), (175, 5), (180, 165), (-5, 160)])


def test_a_deep_place_gets_a_cul_de_sac_instead_of_a_street_through():
    layout = lay_out(ground(DEEP), RULES, with_templates(SIDE_ROWS))
    check(layout)
    assert used(layout)[SIDE_ROWS] >= 1
    assert len(layout.streets) >= 1
    assert any(p.use == "street" and p.template == SIDE_ROWS for m in layout.plots for p in m)
    plain = lay_out(ground(DEEP), RULES, SplitRules(tries=1))
    assert plain.mesh.labels == {}
    assert not plain.streets


def test_no_template_is_used_more_often_than_it_may():
    site = box(0, 0, 520, 330)
    for most in (0, 1):
        layout = lay_out(ground(site), RULES, with_templates(SIDE_ROWS, max_uses=most))
        check(layout)
        assert used(layout)[SIDE_ROWS] <= most


def test_a_template_that_must_be_used_is_put_where_it_fits():
    site = box(0, 0, 330, 210)
    name = "Townhouses with a rear lane"
    assert used(lay_out(ground(site), RULES, with_templates(name)))[name] == 0
    layout = lay_out(ground(site), RULES, with_templates(name, min_uses=1))
    check(layout)
    assert used(layout)[name] >= 1


def test_a_template_that_finds_no_place_is_told():
    site = box(0, 0, 130, 60)
    name = "Pentagon with a private park"
    layout = lay_out(ground(site), RULES, with_templates(name, min_uses=2))
    check(layout)
    assert any(name in remark.problem for remark in layout.remarks)


def test_streets_longer_than_fire_engines_like_are_not_used():
    mesh, _ = begin_mesh(ground(box(0, 0, 400, 150)))
    chooser = Chooser(with_templates(SIDE_ROWS).templates, RULES, 9.0)
    assert chooser.choose(mesh, 1, whole=False, rng=None) == ""


@pytest.fixture(scope="module")
def layers():
    """A site beside a road 8 m outside its southern edge, in the layers that go out."""
    south = LineString([(0, 0), (175, 5)])
    site = dataclasses.replace(
        site_of(DEEP),
        street_frontage=MultiLineString([LineString(DEEP.exterior)]),
        boundary_streets=(BoundaryStreet(LineString([(-40, -9), (210, -2)]), "South Road"),),
    )
    assert DEEP.exterior.distance(south) == 0
    done = lay_out_sites([site], RULES, with_templates(SIDE_ROWS))
    return done[0], site_layers(done, UTM)


def test_streets_of_templates_are_drawn_on_to_the_streets_outside(layers):
    _, found = layers
    streets = found["streets"]
    inner = streets[(streets["level"] == 4) & (streets["status"] == "new")]
    assert len(inner) >= 1
    others = streets.drop(inner.index)
    reached = shapely.union_all([*others.geometry, DEEP.exterior])
    for _, street in inner.iterrows():
        start = shapely.Point(street.geometry.coords[0])
        assert reached.distance(start) < 1e-6
        # the way out grows along the street, by its length
        assert street["dist_end_m"] - street["dist_start_m"] == pytest.approx(street["length_m"])
        assert street["direction"] == -1
        assert 8 < street["width_m"] < 20


def test_connectors_lead_to_the_road_outside(layers):
    own, found = layers
    streets = found["streets"]
    connectors = streets[streets["status"] == "connector"]
    road = own.site.boundary_streets[0].line
    assert all(road.distance(shapely.Point(line.coords[-1])) < 1e-6 for line in connectors.geometry)
    new = streets[streets["status"] == "new"]
    ends = [
        shapely.Point(line.coords[k])
        for line in new.geometry
        for k in (0, -1)
        if DEEP.exterior.distance(shapely.Point(line.coords[k])) < 0.05
        and 0.5 < road.distance(shapely.Point(line.coords[k])) < 31
    ]
    assert len(connectors) == len({(round(p.x, 2), round(p.y, 2)) for p in ends})


def test_templates_with_closed_edges_keep_their_street_at_the_open_ones():
    west = LineString([(-5, 160), (0, 0)])
    site = Ground(DEEP, MultiLineString([west]))
    layout = lay_out(site, RULES, with_templates(SIDE_ROWS, "Cul-de-sac"))
    check(layout)
    for line in layout.streets:
        near = min(west.distance(shapely.Point(line.coords[k])) for k in (0, -1))
        inside = min(
            (s.distance(shapely.Point(line.coords[k]))
             for s in [LineString(layout.mesh.xy[[a, b]])
                       for (a, b), e in layout.mesh.edges.items() if e.street >= 0]
             for k in (0, -1)),
            default=np.inf,
        )  # fmt: skip
        assert min(near, inside) < 25
