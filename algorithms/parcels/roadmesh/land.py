"""The land of a region: what is left of it when half of every street along it is taken off."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, MultiLineString, Polygon
from shapely.geometry.polygon import orient

from ..edges import EdgeKind
from ..types import Block
from .mesh import StreetMesh
from .streets import dead_ends

#: Corners of street space are as sharp as this (times half the width).
MITRE = 3.0
#: Edges of land whose middle is this near to a closed edge lie on it (metres).
ON_LINE = 0.02
#: Pieces of land that are smaller are street space (square metres).
SCRAP = 25.0


def region_land(
    mesh: StreetMesh, region: int, turning: float = 0.0, blind: Sequence[int] | None = None
) -> list[Polygon]:
    """Land of a region without the street space in it, as polygons.

    Parameters
    ----------
    mesh, region
        The mesh and the number of the region.
    turning
        Radius of the turning circle where a street ends at an edge without a street, metres.
    blind
        The vertices at which streets end so (`dead_ends`) where they are known; None to look.
    """
    polygon = mesh.polygon(region)
    space = [
        _run_space(mesh.xy, run, width, before, after)
        for run, width, before, after in _runs(mesh, region)
    ]
    if turning > 0:
        here = {v for ring in mesh.regions[region].rings for v in ring}
        space += [
            shapely.Point(turning_place(mesh, v, turning)).buffer(turning)
            for v in (dead_ends(mesh) if blind is None else blind)
            if v in here
        ]
    land = shapely.difference(polygon, shapely.union_all(space)) if space else polygon
    return [orient(part) for part in shapely.get_parts(land) if part.area > SCRAP]


def turning_place(mesh: StreetMesh, v: int, radius: float) -> npt.NDArray[np.float64]:
    """Centre of the turning circle of a street that ends at vertex v, shape (2,), metres."""
    (before,) = (w for w in mesh.neighbours(v) if mesh.edge(v, w).street >= 0)
    way = mesh.xy[before] - mesh.xy[v]
    return np.asarray(mesh.xy[v] + way / (np.hypot(*way) or 1.0) * radius)


def region_blocks(
    mesh: StreetMesh, turning: float = 0.0, regions: Sequence[int] | None = None
) -> dict[int, list[Block]]:
    """Blocks of every region, in the order of their numbers; `Block.block_id` counts from 1.

    Parameters
    ----------
    mesh
        The mesh.
    turning
        See `region_land`.
    regions
        Numbers of regions; None for all.
    """
    found: dict[int, list[Block]] = {}
    number = 0
    blind = dead_ends(mesh) if turning > 0 else []
    for region in sorted(mesh.regions) if regions is None else regions:
        closed = closed_edges(mesh, region)
        found[region] = []
        for part in region_land(mesh, region, turning, blind):
            number += 1
            found[region].append(Block(part, lying_on(part, closed), number))
    return found


def closed_edges(mesh: StreetMesh, region: int) -> MultiLineString:
    """Edges of a region without access."""
    lines = [
        LineString(mesh.xy[[a, b]])
        for a, b in mesh.regions[region].edges()
        if mesh.edge(a, b).kind == EdgeKind.CLOSED
    ]
    return MultiLineString(lines)


def lying_on(polygon: Polygon, lines: MultiLineString) -> MultiLineString:
    """Edges of a polygon that lie on lines.

    Parameters
    ----------
    polygon
        Its rings are looked at edge by edge.
    lines
        The lines.
    """
    if lines.is_empty:
        return MultiLineString()
    kept: list[npt.NDArray[np.float64]] = []
    for ring in (polygon.exterior, *polygon.interiors):
        xy = shapely.get_coordinates(ring)
        middles = shapely.points((xy[1:] + xy[:-1]) / 2)
        on = np.flatnonzero(shapely.distance(middles, lines) < ON_LINE)
        kept += [xy[k : k + 2] for k in on]
    return MultiLineString(kept)


def _run_space(
    xy: npt.NDArray[np.float64], run: Sequence[int], width: float, before: bool, after: bool
) -> Polygon:
    """Space of a street along a run of vertices; at convex ends it goes on over the corner."""
    line = xy[list(run)].copy()
    if run[0] == run[-1]:
        return shapely.buffer(
            shapely.linearrings(line), width / 2, join_style="mitre", mitre_limit=MITRE
        )
    for end, inner, convex in ((0, 1, before), (-1, -2, after)):
        if convex:
            way = line[end] - line[inner]
            line[end] = line[end] + way / (np.hypot(*way) or 1.0) * width
    space = shapely.buffer(
        LineString(line), width / 2, cap_style="flat", join_style="mitre", mitre_limit=MITRE
    )
    discs = [
        shapely.Point(line[end]).buffer(width / 2)
        for end, convex in ((0, before), (-1, after))
        if not convex
    ]
    return shapely.union_all([space, *discs])


def _runs(mesh: StreetMesh, region: int) -> list[tuple[list[int], float, bool, bool]]:
    """Find the runs of street edges of one width, and whether their ends are convex."""
    found: list[tuple[list[int], float, bool, bool]] = []
    for ring in mesh.regions[region].rings:
        edges = [mesh.edge(a, b) for a, b in zip(ring, (*ring[1:], ring[0]))]
        widths = np.array([e.width if e.kind == EdgeKind.STREET else 0.0 for e in edges])
        # a run goes round gentle bends only, so that its buffer's corners stay sharp
        n = len(ring)
        xy = mesh.xy[list(ring)]
        on, back = np.roll(xy, -1, axis=0) - xy, xy - np.roll(xy, 1, axis=0)
        turn = np.arctan2(back[:, 0] * on[:, 1] - back[:, 1] * on[:, 0], (back * on).sum(axis=1))
        breaks = np.flatnonzero((widths != np.roll(widths, 1)) | (turn > np.radians(60)))
        if len(breaks) == 0:
            if widths[0] > 0:
                found.append(([*ring, ring[0]], float(widths[0]), True, True))
            continue
        for start, stop in zip(breaks, (*breaks[1:], breaks[0] + n)):
            if widths[start] > 0:
                run = [ring[k % n] for k in range(start, stop + 1)]
                found.append(
                    (run, float(widths[start]), bool(turn[start] > 0), bool(turn[stop % n] > 0))
                )
    return found
