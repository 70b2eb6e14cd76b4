"""Strips of land between two parcels that lead from behind them to the street."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from typing import NamedTuple

import numpy as np

from ...measure.parcel_shape import corner_deviation, rectangle_ratio, undesirable
from ..halving.mosaic import Mosaic
from ..halving.rings import Edge
from ..rules import ParcelRules

#: The line between two parcels may bend by so much to be followed (metres).
STRAIGHT = 0.5
#: Shares of the strip that are taken from the parcel on the left.
SHARES = (0.5, 0.0, 1.0)
#: So many strips are compared, along the shortest lines first.
ENOUGH = 8


class Line(NamedTuple):
    """The line between two parcels, from the street to the land behind.

    Attributes
    ----------
    left, right
        Faces on its sides, seen from the street.
    street, behind
        Its ends, vertices.
    """

    left: int
    right: int
    street: int
    behind: int


def give_way(mosaic: Mosaic, target: int, parcels: list[int], rules: ParcelRules) -> int | None:
    """Lead a strip of `flag_width` from a face to the street, between two parcels.

    Parameters
    ----------
    mosaic
        A block.
    target
        A face that does not touch the street.
    parcels
        Faces that may give land; changed in place.
    rules
        Parcels keep `min_frontage` and the least area, and none becomes undesirable for it.

    Returns
    -------
    int or None
        The face with its strip; None if there is no place for one.
    """
    lines = sorted(
        lines_to_street(mosaic, target, parcels),
        key=lambda line: math.dist(mosaic.xy[line.street], mosaic.xy[line.behind]),
    )
    tried: list[tuple[float, Line, float]] = []
    saved = mosaic.save()
    for line in lines:
        for share in SHARES:
            cost = _try(mosaic, line, share, rules)
            mosaic.restore(saved)
            saved = mosaic.save()
            if math.isfinite(cost):
                tried.append((cost, line, share))
        if len(tried) >= ENOUGH:
            break
    for _, line, share in sorted(tried, key=lambda t: t[0]):
        cut = _cut(mosaic, line, share, rules.flag_width)
        joined = mosaic.join([target, *cut[1]]) if cut is not None else None
        if cut is None or joined is None:
            mosaic.restore(saved)
            saved = mosaic.save()
            continue
        for old, new in cut[0].items():
            parcels[parcels.index(old)] = new
        return joined
    return None


def lines_to_street(mosaic: Mosaic, target: int, parcels: Collection[int]) -> Iterator[Line]:
    """Yield the straight lines between two parcels that lead from a face to the street.

    Parameters
    ----------
    mosaic, target, parcels
        See `give_way`.
    """
    owner = {edge: face for face in parcels for edge in mosaic.edges(face)}
    onwards: dict[int, list[Edge]] = {}
    for edge in owner:
        onwards.setdefault(edge[0], []).append(edge)
    for loop in mosaic.refine(target):
        for vertex in loop:
            # lines from the vertex that have a parcel on each side
            for edge in onwards.get(vertex, ()):
                line = _follow(mosaic, edge, owner, onwards)
                if line is not None:
                    yield line


def _follow(
    mosaic: Mosaic, edge: Edge, owner: dict[Edge, int], onwards: dict[int, list[Edge]]
) -> Line | None:
    """Follow the line between two parcels from the inside to the street."""
    one, two = owner[edge], owner.get((edge[1], edge[0]))
    if two is None or two == one:
        return None
    start, chain = edge[0], [edge[0], edge[1]]
    while True:
        here = chain[-1]
        ways = [
            e for e in onwards.get(here, ())
            if owner[e] == one and owner.get((e[1], e[0])) == two and e[1] != chain[-2]
        ]  # fmt: skip
        if not ways or len(chain) > 50:
            break
        chain.append(ways[0][1])
    ends = [e for e in onwards.get(chain[-1], ()) if mosaic.is_front(e)]
    if not ends or chain[-1] == start:
        return None
    xy = np.array([mosaic.xy[v] for v in chain])
    way = xy[-1] - xy[0]
    size = float(np.hypot(*way))
    off = np.abs((xy - xy[0]) @ np.array([-way[1], way[0]])) / max(size, 1e-9)
    if size < 1.0 or off.max() > STRAIGHT:
        return None
    # going in from the street, the face on the left of the outward edge lies on the right
    return Line(left=two, right=one, street=chain[-1], behind=start)


def _cut(
    mosaic: Mosaic, line: Line, share: float, width: float
) -> tuple[dict[int, int], list[int]] | None:
    """Cut a strip along a line; return what parcels become, and the pieces of the strip."""
    (sx, sy), (bx, by) = mosaic.xy[line.street], mosaic.xy[line.behind]
    size = math.dist((sx, sy), (bx, by))
    wx, wy = (bx - sx) / size, (by - sy) / size
    become, pieces = {}, []
    for face, off in ((line.left, share * width), (line.right, -(1 - share) * width)):
        if abs(off) < 1e-9:
            continue
        parts = mosaic.cut(face, (sx - off * wy, sy + off * wx), (wx, wy))
        ends = [{v for loop in mosaic.faces[part] for v in loop} for part in parts]
        strip = [p for p, v in zip(parts, ends) if line.street in v and line.behind in v]
        if len(parts) != 2 or len(strip) != 1:
            return None
        pieces.append(strip[0])
        become[face] = next(part for part in parts if part != strip[0])
    return become, pieces


def _try(mosaic: Mosaic, line: Line, share: float, rules: ParcelRules) -> float:
    """Return what a strip costs; infinite if it may not be."""
    before = {face: mosaic.polygons([face])[0] for face in (line.left, line.right)}
    cut = _cut(mosaic, line, share, rules.flag_width)
    if cut is None:
        return math.inf
    cost = math.dist(mosaic.xy[line.street], mosaic.xy[line.behind]) / 1000
    if sum(mosaic.frontage(piece) for piece in cut[1]) < 0.9 * rules.flag_width:
        return math.inf
    for old, new in cut[0].items():
        if mosaic.area(new) < rules.least_area or mosaic.frontage(new) < rules.min_frontage:
            return math.inf
        shapes = np.array([before[old], mosaic.polygons([new])[0]], dtype=object)
        ratio = rectangle_ratio(shapes)
        bad = undesirable(corner_deviation(shapes), ratio)
        if bad[1] and not bad[0]:
            return math.inf
        # rather from wide parcels, and rather where nothing bends
        lost = mosaic.area(new) / rules.area
        cost += max(0.0, 1.0 - lost) + max(0.0, float(ratio[1] - ratio[0]))
    return cost
