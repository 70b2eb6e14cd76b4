"""Which edges of blocks give no access, and which land is too thin for parcels."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import MultiLineString

from ..site.repair import overlay

#: An edge this near to street space lies along it (metres).
NEAR = 0.02
#: Of an edge that is closed over less than this all is open, and the other way round: property
#: lines along streets are found with a step of 2 m (metres).
BIT = 5.0
#: A drawn line without access closes the edges that lie this near to it (metres) ...
DRAWN = 2.0
#: ... over at least this length, so that a line across a street closes nothing (metres).
LEAST_DRAWN = 6.0
#: Land narrower than this takes no parcel (metres).
THIN = 4.0
#: Smaller thin ends stay with their block (square metres).
SMALL_END = 4.0
#: Corners that are this many times longer than half the width that they leave are thin ends.
_POINTED = 5.0

Geometries = npt.NDArray[Any]


def closed_edges(
    polygons: Geometries, open_land: shapely.Geometry, drawn: shapely.Geometry | None = None
) -> list[MultiLineString]:
    """Give the parts of the rings of polygons that lie along no street.

    Parameters
    ----------
    polygons
        Blocks, shape (n,), metres.
    open_land
        Areas or lines along which there is access: street space, property lines along streets.
    drawn
        Lines beside which there is none whatever lies there, or None.

    Returns
    -------
    list of MultiLineString
        One for each polygon, on its rings. Whole edges wherever they are closed as a whole.
    """
    rings, of_polygon = shapely.get_parts(shapely.boundary(polygons), return_index=True)
    xy, of_ring = shapely.get_coordinates(rings, return_index=True)
    start = np.flatnonzero(of_ring[1:] == of_ring[:-1])
    edges = shapely.linestrings(np.stack([xy[start], xy[start + 1]], axis=1))
    owner = of_polygon[of_ring[start]]
    near = shapely.buffer(open_land, NEAR)
    shapely.prepare(near)
    shut = ~shapely.covers(near, edges)
    edges, owner = edges[shut], owner[shut]
    meets = shapely.intersects(near, edges)
    rest = edges.copy()
    rest[meets] = overlay(shapely.difference, edges[meets], near)
    length, whole = shapely.length(rest), shapely.length(edges)
    bit = np.minimum(BIT, 0.5 * whole)
    rest = np.where(length > whole - bit, edges, rest)
    keep = ~meets | (length >= bit)
    closed: list[list[Any]] = [[] for _ in polygons]
    for at, line in zip(owner[keep].tolist(), rest[keep]):
        closed[at].append(line)
    if drawn is not None and not shapely.is_empty(drawn):
        for at, line in _beside_drawn(polygons, drawn):
            closed[at].append(line)
    return [_merged(lines) for lines in closed]


def _beside_drawn(polygons: Geometries, drawn: shapely.Geometry) -> list[tuple[int, Any]]:
    """Parts of the rings that run along drawn lines, with the polygon of each."""
    beside = shapely.buffer(drawn, DRAWN, cap_style="flat")
    shapely.prepare(beside)
    found = []
    for at in np.flatnonzero(shapely.intersects(beside, shapely.boundary(polygons))).tolist():
        along = shapely.intersection(shapely.boundary(polygons[at]), beside)
        for part in shapely.get_parts(_merged(list(shapely.get_parts(along)))):
            if part.length >= LEAST_DRAWN:
                found.append((at, part))
    return found


def _merged(lines: list[Any]) -> MultiLineString:
    """Give lines as one, joined where they go on."""
    parts = shapely.get_parts(shapely.union_all(lines)) if lines else np.zeros(0, dtype=object)
    parts = parts[shapely.get_type_id(parts) == shapely.GeometryType.LINESTRING]
    if len(parts) == 0:
        return MultiLineString()
    joined = shapely.get_parts(shapely.line_merge(shapely.multilinestrings(parts)))
    return MultiLineString(list(joined))


def without_thin_ends(polygon: shapely.Geometry) -> tuple[list[Any], list[Any]]:
    """Part land on which parcels fit from what is too thin for any.

    Parameters
    ----------
    polygon
        Valid polygon, metres.

    Returns
    -------
    blocks, thin
        Polygons that tile it. Thin: narrower than `THIN` all over, or ends, necks and pointed
        corners that are so.
    """
    with np.errstate(all="ignore"):  # GEOS divides by zero on parallel edges, without harm
        core = shapely.buffer(polygon, -THIN / 2, join_style="mitre", mitre_limit=_POINTED)
        kept = shapely.buffer(core, THIN / 2 + 0.05, join_style="mitre", mitre_limit=_POINTED)
    if shapely.is_empty(core):
        return [], [polygon]
    ends = shapely.get_parts(overlay(shapely.difference, polygon, kept))
    ends = ends[(shapely.get_type_id(ends) == 3) & (shapely.area(ends) > SMALL_END)]
    if len(ends) == 0:
        return [polygon], []
    rest = shapely.get_parts(overlay(shapely.difference, polygon, shapely.union_all(ends)))
    rest = rest[shapely.get_type_id(rest) == 3]
    return list(rest), list(ends)
