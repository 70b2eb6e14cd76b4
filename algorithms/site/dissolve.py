"""Adjoining polygons become one site; slivers, slits and needles go."""

from __future__ import annotations

from typing import Any, List, Tuple

import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely.geometry import Polygon

from ..progress import Progress
from .repair import GRID, NO_AREA, Geometries, Problems, overlay, rounded
from .watch import aside, ask, chunks, in_chunks

GAP = 1.0
"""Gaps between polygons up to this width are closed, metres."""

NEEDLE = 0.25
"""Parts of a site narrower than twice this are cut off, metres."""

SMALLEST = 1.0
"""Sites below this area are slivers, square metres."""

CRUMB = 0.02
"""Pieces that come off when needles are cut, below this share of the largest, are dropped."""


MITRE = 3.0
"""Sharper corners than this allows (40 degrees) lose their tips as needles do."""

_ROUNDS = 6

_Piece = Tuple[Polygon, List[Any]]


def dissolve(
    polygons: Geometries,
    ids: Geometries,
    layer: str,
    crs: CRS,
    problems: Problems,
    progress: Progress | None = None,
) -> list[tuple[Polygon, list[Any]]]:
    """Dissolve adjoining polygons; disjoint ones stay apart.

    Parameters
    ----------
    polygons
        Valid polygons, shape (n,), metres.
    ids
        Feature id of each, shape (n,).
    layer
        Name of the layer.
    crs
        CRS of the polygons.
    problems
        Takes the findings.
    progress
        Asked for cancellation, or None.

    Returns
    -------
    list of (Polygon, list of ids)
        One polygon per site, exterior counter-clockwise, with the ids of the features it is
        made of; ordered by the first of them.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    # one order of vertices, for buffers differ by a hair with it
    ordered = in_chunks(_canonical, polygons, progress)
    pieces = [(p, [feature]) for p, feature in zip(ordered, ids.tolist())]
    # filling one gap may bring two sites within reach of each other, and cutting a needle may
    # bare another: repeat until nothing changes, so that a prepared site stays as it is
    for _ in range(_ROUNDS):
        after = _round(pieces, layer, crs, problems, progress)
        ask(progress)
        if _same(pieces, after):
            break
        pieces = after
    return after if pieces else []


def _round(
    pieces: list[_Piece], layer: str, crs: CRS, problems: Problems, progress: Progress | None
) -> list[_Piece]:
    """Join what adjoins and clean each result."""
    polygons = np.array([p for p, _ in pieces], dtype=object)
    groups = _groups(polygons, progress)
    single = np.array([m[0] for m in groups if len(m) == 1], dtype=np.intp)
    tidy = np.zeros(len(polygons), dtype=bool)
    tidy[single] = in_chunks(_tidy, polygons[single], progress)
    ordered = in_chunks(_canonical, polygons, progress)
    result: list[_Piece] = []
    ask(progress)
    for members in groups:
        if len(members) == 1 and tidy[members[0]]:
            result.append((ordered[members[0]], pieces[members[0]][1]))
            continue
        own = list(dict.fromkeys(f for k in members for f in pieces[k][1]))
        if len(members) == 1:
            result += _cleaned(polygons[members], own, layer, crs, problems, progress)
            continue
        findings = Problems()
        owners = [pieces[k][1] for k in members]
        joined = aside(_join, polygons[members], progress, owners, layer, crs, findings)
        overlap = np.sum(shapely.area(polygons[members])) - sum(p.area for p, _ in joined)
        if len(joined) < len(members) or overlap > NEEDLE:
            problems.extend(findings)
            result += joined
            continue
        # closing gaps has joined nothing that holds: leave each as it is
        for k in members:
            alone = polygons[k : k + 1]
            result += _cleaned(alone, pieces[k][1], layer, crs, problems, progress)
    return result


def _cleaned(
    alone: Geometries,
    own: list[Any],
    layer: str,
    crs: CRS,
    problems: Problems,
    progress: Progress | None,
) -> list[_Piece]:
    """Clean one polygon, given as an array of shape (1,)."""
    findings = Problems()  # a cancelled thread may still add to it

    def work(polygons: Geometries) -> list[Polygon]:
        return _clean(polygons[0], layer, own[0], crs, findings)

    cleaned = aside(work, alone, progress)
    problems.extend(findings)
    return [(p, own) for p in cleaned]


def _join(
    polygons: Geometries, owners: list[list[Any]], layer: str, crs: CRS, problems: Problems
) -> list[_Piece]:
    """Unite polygons that adjoin, close the gaps between them, clean what comes out."""
    everybody = list(dict.fromkeys(f for own in owners for f in own))
    parts = shapely.get_parts(_close(polygons, layer, everybody[0], crs, problems))
    inside = shapely.point_on_surface(polygons)
    result: list[_Piece] = []
    for part in parts:
        own = everybody
        if len(parts) > 1:  # pieces that lie close but cannot be joined
            mine = np.flatnonzero(shapely.intersects(part, inside))
            own = list(dict.fromkeys(f for k in mine for f in owners[k])) or everybody
        result += [(p, own) for p in _clean(part, layer, own[0], crs, problems)]
    return result


def _tidy(polygons: Geometries) -> npt.NDArray[np.bool_]:
    """Tell which polygons need no cleaning: without holes, needles and not small."""
    core, opened = _opened(polygons)
    plain = shapely.get_num_interior_rings(polygons) == 0
    plain &= ~shapely.is_empty(core) & (shapely.area(polygons) >= SMALLEST)
    plain &= shapely.area(polygons) - shapely.area(opened) < NEEDLE
    return np.asarray(plain)


def _opened(polygons: Any) -> tuple[Any, Any]:
    """Shrink by the width of needles, and grow back: both results."""
    core = _mitred(polygons, -NEEDLE)
    return core, _mitred(core, NEEDLE, MITRE)


def _mitred(geometry: Any, distance: float, limit: float = 5.0) -> Any:
    with np.errstate(all="ignore"):  # GEOS divides by zero on parallel edges, without harm
        return shapely.buffer(geometry, distance, join_style="mitre", mitre_limit=limit)


def _canonical(polygons: Geometries) -> Geometries:
    """Start rings at their lowest point, exteriors counter-clockwise, holes clockwise."""
    result: Geometries = shapely.reverse(shapely.normalize(polygons))
    return result


def _same(before: list[_Piece], after: list[_Piece]) -> bool:
    if len(before) != len(after):
        return False
    a = np.array([p for p, _ in before], dtype=object)
    b = np.array([p for p, _ in after], dtype=object)
    return bool(np.all(shapely.equals_exact(a, b, 0.0)))


def _groups(polygons: Geometries, progress: Progress | None) -> list[npt.NDArray[np.intp]]:
    """Group polygons that lie within `GAP` of each other; indices, in order of the first."""
    n = len(polygons)
    if n == 0:
        return []
    tree = shapely.STRtree(polygons)
    pairs = []
    for part in chunks(polygons):
        ask(progress)
        found = tree.query(polygons[part], predicate="dwithin", distance=GAP)
        pairs.append(found + np.array([[part.start], [0]]))
    ask(progress)
    a, b = np.concatenate(pairs, axis=1)
    graph = coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    _, first = np.unique(label, return_index=True)
    order = np.argsort(label, kind="stable")
    cuts = np.flatnonzero(np.diff(label[order])) + 1
    groups = np.split(order, cuts)
    return [groups[k] for k in np.argsort(first, kind="stable")]


def _close(
    polygons: Geometries, layer: str, feature: object, crs: CRS, problems: Problems
) -> shapely.Geometry:
    """Unite polygons and fill the gaps between them, leaving the other edges as they are."""
    # in floating point, then rounded: several times faster than on the grid all the way
    united = rounded(shapely.union_all(polygons))
    half = GAP / 2
    closed = _mitred(_mitred(united, half), -half)
    gaps = shapely.get_parts(overlay(shapely.difference, closed, united))
    gaps = gaps[shapely.area(gaps) > 0.01]
    # only what lies between two polygons: notches in one of them are its own affair
    between, _ = shapely.STRtree(polygons).query(gaps, predicate="dwithin", distance=2 * GRID)
    gaps = gaps[np.bincount(between, minlength=len(gaps)) > 1]
    if len(gaps) == 0:
        return united
    where = shapely.union_all(gaps)
    what = f"{len(gaps)} gaps or overlaps up to {GAP:g} m wide between adjoining polygons"
    problems.add(layer, feature, what, "closed", "info", where, crs)
    # grown by a grid step: rounding must not leave a hair between gap and polygon
    return rounded(overlay(shapely.union, united, _mitred(where, 2 * GRID)))


def _clean(
    polygon: Polygon, layer: str, feature: object, crs: CRS, problems: Problems
) -> list[Polygon]:
    """Fill slits, cut needles, part rings that touch; drop what is too small."""
    polygon = _fill_slits(polygon, layer, feature, crs, problems)
    pieces: list[Polygon] = []
    for piece in _cut_needles(polygon, layer, feature, crs, problems):
        pieces += _part_touching_rings(piece, layer, feature, crs, problems)
    result: list[Polygon] = []
    pieces.sort(key=lambda p: -p.area)
    for piece in pieces:
        if piece.area < max(SMALLEST, CRUMB * pieces[0].area):
            what = f"a piece of {piece.area:.2f} m2 hangs on by less than {2 * NEEDLE:g} m"
            problems.add(layer, feature, what, "dropped", "warning", piece, crs)
            continue
        # rounded once more: what is given must be what would be read again
        fixed = _canonical(rounded(piece))
        result += [p for p in shapely.get_parts(fixed) if p.area >= SMALLEST]
    return result


def _fill_slits(
    polygon: Polygon, layer: str, feature: object, crs: CRS, problems: Problems
) -> Polygon:
    holes = np.array([Polygon(r) for r in polygon.interiors], dtype=object)
    if len(holes) == 0:
        return polygon
    slit = shapely.is_empty(shapely.buffer(holes, -GAP / 2)) | (shapely.area(holes) < SMALLEST)
    if not np.any(slit):
        return polygon
    for hole in holes[slit]:
        problems.add(layer, feature, f"a hole narrower than {GAP:g} m", "filled", "info", hole, crs)
    return Polygon(polygon.exterior, [h.exterior for h in holes[~slit]])


def _cut_needles(
    polygon: Polygon, layer: str, feature: object, crs: CRS, problems: Problems
) -> list[Polygon]:
    core, opened = _opened(polygon)
    if shapely.is_empty(core):
        what = f"narrower than {2 * NEEDLE:g} m everywhere"
        problems.add(layer, feature, what, "skipped", "error", polygon, crs)
        return []
    needles = shapely.get_parts(overlay(shapely.difference, polygon, opened))
    needles = needles[shapely.area(needles) > NEEDLE]
    if len(needles) == 0:
        return [polygon]
    what = f"{len(needles)} needles narrower than {2 * NEEDLE:g} m"
    where = shapely.union_all(needles)
    problems.add(layer, feature, what, "cut off", "info", where, crs)
    grown = _mitred(where, 2 * GRID)
    rest = shapely.get_parts(rounded(overlay(shapely.difference, polygon, grown)))
    return [p for p in rest if p.area > NO_AREA]


def _part_touching_rings(
    polygon: Polygon, layer: str, feature: object, crs: CRS, problems: Problems
) -> list[Polygon]:
    """Cut a small square where two rings touch, so that every ring is free of the others."""
    if len(polygon.interiors) == 0:
        return [polygon]
    rings = shapely.get_parts(shapely.boundary(polygon))
    a, b = shapely.STRtree(rings).query(rings, predicate="intersects")
    pairs = a < b
    if not np.any(pairs):
        return [polygon]
    touch = shapely.union_all(shapely.intersection(rings[a[pairs]], rings[b[pairs]]))
    what = "holes touch each other or the edge"
    problems.add(layer, feature, what, "parted by a cut of 0.5 m", "info", touch, crs)
    cut = shapely.buffer(touch, NEEDLE, cap_style="square")
    rest = shapely.get_parts(rounded(overlay(shapely.difference, polygon, cut)))
    return [p for p in rest if p.area > NO_AREA]
