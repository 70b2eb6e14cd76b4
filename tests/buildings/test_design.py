"""A zone laid out from its ground to its details."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely
from platwright.buildings.design import lay_out
from platwright.buildings.details.parking import places_needed
from platwright.buildings.remarks import shortfalls
from platwright.buildings.rules import LayoutRules
from platwright.buildings.tables import shipped_types
from platwright.buildings.types import SYMMETRICAL
from platwright.buildings.zone import Patch

from .hand_made import ORIGIN, RULES, SIZE, TYPES, make_layout, make_zone

QUICK = LayoutRules(far=0.6, method="staged", iterations=1)


def told(parking: float) -> tuple[list[str], int, float]:
    """Lay a zone out and return what is told of parking, the places that there are, and needed."""
    types = tuple(dataclasses.replace(kind, parking=parking) for kind in TYPES)
    layout = lay_out(make_zone(), types, QUICK)
    texts = [own.problem for own in layout.findings if "parking" in own.problem]
    assert all(own.action for own in layout.findings)
    return texts, sum(layout.details.places), float(places_needed(types, layout.placements).sum())


def test_parking_that_has_no_room_is_told_with_numbers():
    texts, there, needed = told(3.0)
    assert there < 0.9 * needed
    assert len(texts) == 1
    assert str(there) in texts[0]
    assert str(int(np.ceil(needed))) in texts[0]


@pytest.mark.parametrize("parking", [0.0, 0.2])
def test_parking_that_there_is_is_no_problem(parking):
    texts, there, needed = told(parking)
    assert there >= needed
    assert not texts


def test_what_is_missing_of_the_floor_area_ratio_is_told_as_it_was_asked():
    rules = dataclasses.replace(QUICK, far=2.6, density=0.3, green=0.6)
    layout = lay_out(make_zone(), TYPES, rules)
    texts = " ".join(own.problem for own in layout.findings)
    assert "less than 2.60 that is asked" in texts
    assert "less than 0.60 that is asked" in texts


@pytest.mark.parametrize("method", ["staged", "optimise"])
def test_symmetry_uses_all_ground_beside_its_axis_and_keeps_the_avenue_free(method):
    # halves of 35 m beside the avenue: too narrow for the long type, wide enough for the others
    long, short = shipped_types("mixed")[1], shipped_types("mixed")[0]
    zone = make_zone(bend=0.0)
    x0, y0 = ORIGIN
    ground = shapely.box(x0, y0, x0 + 94.0, y0 + SIZE[1])
    access = shapely.MultiLineString([[(x0, y0), (x0 + 94.0, y0)]])
    patch = Patch(ground, access, residences=SYMMETRICAL, facilities=0)
    zone = dataclasses.replace(zone, patches=(patch,), convergence_deg=0.0)
    rules = dataclasses.replace(QUICK, method=method, iterations=2)
    layout = lay_out(zone, (long, short), rules)
    assert len(layout.placements) >= 4
    side = np.abs(layout.placements.xy[:, 0] - (x0 + 47.0)) - short.length_m / 2
    assert (side > 4.0).all()


def test_long_ways_and_empty_patches_are_told_with_their_remedies():
    layout = make_layout()
    far = dataclasses.replace(
        layout.paths, length_m=np.where(layout.placements.patch == 0, 180.0, 20.0)
    )
    told = [own.problem for own in shortfalls(dataclasses.replace(layout, paths=far), RULES)]
    assert [text for text in told if "180 m" in text and "patch 1 " in text]
    assert not [text for text in told if "patch 2 " in text]
    bare = tuple(
        dataclasses.replace(own, residences=0, facilities=0) for own in layout.zone.patches
    )
    empty = dataclasses.replace(layout, zone=dataclasses.replace(layout.zone, patches=bare))
    assert [own.problem for own in shortfalls(empty, RULES)] == [
        "All patches of this zone are to stay empty."
    ]
