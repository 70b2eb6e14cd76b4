"""Parking: which rows of bays are laid, so that buildings have theirs near."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial.distance import cdist

from ...levels import MAJOR
from ..types import RESIDENCE, BuildingType, Floats, Placements
from ..zone import Zone
from .bays import ACROSS, ALONG, FROM_BUILDING, FROM_PATH, BayKind, Row, rows_of_patch
from .taken import Taken, shapes

#: Floor area for which facilities state their parking places, square metres.
PER_FLOOR = 100.0
#: Rows keep this distance from rows along another street, metres.
APART = 1.0


def places_needed(types: Sequence[BuildingType], placed: Placements) -> Floats:
    """Give the parking places that buildings ask for, shape (n,), in parts of places.

    Parameters
    ----------
    types
        Residences ask per dwelling, facilities per 100 m2 of floor.
    placed
        The buildings.
    """
    asked = [
        t.parking * (t.dwellings if t.use == RESIDENCE else t.floor_area_m2 / PER_FLOOR)
        for t in types
    ]
    return np.array(asked, dtype=float)[placed.type]


def lay_parking(
    zone: Zone, types: Sequence[BuildingType], placed: Placements, taken: Taken
) -> list[Row]:
    """Lay rows of bays beside streets until buildings have what they ask for.

    Cars stand at right angles to the street, except on major streets. Where that does not give
    enough, they stand along streets as well.

    Parameters
    ----------
    zone
        The ground.
    types, placed
        The buildings.
    taken
        Their ground and that of paths.

    Returns
    -------
    list of Row
    """
    left = places_needed(types, placed)
    if not left.any():
        return []
    chosen: list[Row] = []
    for kind in (ACROSS, ALONG):
        rows = _candidates(zone, kind, taken, chosen)
        if left.sum() > 1e-6 and rows:
            opened, left = _open(rows, placed.xy, left)
            chosen += opened
    return chosen


def _candidates(zone: Zone, kind: BayKind, taken: Taken, chosen: Sequence[Row]) -> list[Row]:
    """Find rows that have room."""
    blocked = shapely.STRtree(
        np.concatenate(
            [
                taken.aprons(FROM_BUILDING),
                taken.strips(FROM_PATH),
                shapely.buffer(shapes([row.polygon for row in chosen]), APART),
            ]
        )
    )
    rows = [
        row
        for k, patch in enumerate(zone.patches)
        for row in rows_of_patch(patch.access, k, kind, taken, blocked)
    ]
    if kind is ACROSS and rows:
        calm = ~_on_major(zone, rows)
        rows = [row for row, yes in zip(rows, calm) if yes]
    return rows


def _on_major(zone: Zone, rows: Sequence[Row]) -> npt.NDArray[np.bool_]:
    """Tell which rows lie along a major street, shape (r,)."""
    if not zone.corridors:
        return np.zeros(len(rows), dtype=bool)
    beside = shapely.points([row.corner + row.way * row.length / 2 for row in rows])
    lines = shapes([corridor.line for corridor in zone.corridors])
    half = np.array([corridor.width_m / 2 for corridor in zone.corridors])
    nearest = np.argmin(shapely.distance(beside[:, None], lines[None, :]) - half, axis=1)
    major = np.array([corridor.level == MAJOR for corridor in zone.corridors])
    return np.asarray(major[nearest])


def _open(rows: Sequence[Row], xy: Floats, left: Floats) -> tuple[list[Row], Floats]:
    """Open the row nearest to whoever lacks most, let all around use it, and so on.

    Returns
    -------
    rows
        The rows that are opened, in the order of the candidates.
    left
        What buildings still lack, shape (n,).
    """
    left = left.copy()
    away = cdist(xy, np.array([row.middle for row in rows]))
    boxes = shapes([row.polygon for row in rows])
    one, other = shapely.STRtree(boxes).query(boxes, predicate="dwithin", distance=0.1)
    shut = np.zeros(len(rows), dtype=bool)
    opened: dict[int, Row] = {}
    while left.sum() > 1e-6 and not shut.all():
        neediest = int(np.argmax(left))
        at = int(np.argmin(np.where(shut, np.inf, away[neediest])))
        row = rows[at]
        row = row.shortened(min(row.places, max(1, math.ceil(left.sum() - 1e-6))))
        opened[at] = row
        shut[other[one == at]] = True
        room = float(row.places)
        for near in np.argsort(away[:, at], kind="stable"):
            used = min(room, float(left[near]))
            left[near] -= used
            room -= used
            if room <= 0:
                break
    return [opened[at] for at in sorted(opened)], left
