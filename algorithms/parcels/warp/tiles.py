"""From warped templates to plots that tile their regions to the last vertex."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, Polygon

from .batch import Task, Warped, starts
from .form import Form

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Points = npt.NDArray[np.complex128]
#: A cut that ends nearer than this to a vertex of the region ends there (metres).
SNAP = 0.3
#: Error allowed in the area of a tiled region, relative.
AREA_ERROR = 1e-7


@dataclass
class Tiles:
    """The pieces of many warped templates.

    Attributes
    ----------
    polygons
        All pieces, shape (p,).
    start
        Where those of each task begin, shape (tasks + 1,).
    valid
        Which tasks tile their region, shape (tasks,).
    open
        Length of each piece along open edges of its region, shape (p,), metres.
    arc
        Arc length of each vertex of the outlines along its region, shape (r,).
    """

    polygons: npt.NDArray[Any]
    start: Ints
    valid: npt.NDArray[np.bool_]
    open: Floats
    arc: Floats


class _Rings:
    """The outlines of all regions, one after the other with gaps between, to look up at once."""

    def __init__(self, tasks: Sequence[Task]) -> None:
        sides = [task.sides for task in tasks]
        whole = np.array([side.at[-1] for side in sides])
        self.offset = np.concatenate([[0.0], np.cumsum(whole + 1.0)])[:-1]
        self.count = [len(side.points) - 1 for side in sides]
        self.task = np.repeat(np.arange(len(tasks)), self.count)
        self.z = np.concatenate([side.points[:-1] for side in sides])
        self.at = np.concatenate([side.at[:-1] for side in sides])
        self.key = self.at + self.offset[self.task]
        self.loop_key = np.concatenate([s.at + o for s, o in zip(sides, self.offset)])
        self.loop_z = np.concatenate([side.points for side in sides])
        self.loop_shut = np.concatenate([side.shut for side in sides])


def tile(tasks: Sequence[Task], warped: Warped, areas: Floats) -> Tiles:
    """Build the pieces of warped templates.

    Parameters
    ----------
    tasks
        The tasks.
    warped
        Where their templates lie; vertices on outlines are moved to their exact place.
    areas
        Area of each region, shape (tasks,), square metres.

    Returns
    -------
    Tiles
        Every vertex of a region is one of a piece; neighbours share their vertices.
    """
    rings = _Rings(tasks)
    owner = np.repeat(np.arange(len(tasks)), np.diff(warped.ring_start))
    key = _arcs(tasks, warped, rings, owner)
    forms = [task.form for task in tasks]
    ring = np.concatenate([f.ring + s for f, s in zip(forms, warped.vertex_start)])
    warped.points[ring] = np.interp(key, rings.loop_key, rings.loop_z)
    # vertices of the region stay as they are to the last bit
    hit = np.minimum(np.searchsorted(rings.key, key), len(rings.key) - 1)
    same = rings.key[hit] == key
    warped.points[ring[same]] = rings.z[hit[same]]
    polygons, piece_start = _polygons(forms, warped, rings, key)
    valid = _valid(polygons, piece_start, areas)
    open_ = _open(forms, rings, key, warped.ring_start, piece_start)
    return Tiles(polygons, piece_start, valid, open_, key - rings.offset[owner])


def _arcs(tasks: Sequence[Task], warped: Warped, rings: _Rings, owner: Ints) -> Floats:
    """Give the vertices of the outlines their arc length, snapped to vertices of the region."""
    side = np.concatenate([task.form.side for task in tasks])
    corner_start = starts([len(task.sides.corners) for task in tasks])
    corners = np.concatenate([task.sides.corners for task in tasks])
    at = corner_start[owner] + side
    arc = corners[at] + warped.t * (corners[at + 1] - corners[at])
    fixed = warped.t == 0
    key: Floats = arc + rings.offset[owner]
    right = np.clip(np.searchsorted(rings.key, key), 1, len(rings.key) - 1)
    nearest = np.where(
        np.abs(rings.key[right] - key) < np.abs(rings.key[right - 1] - key), right, right - 1
    )
    near = np.abs(rings.key[nearest] - key) < np.where(fixed, 1e-6, SNAP)
    near &= rings.task[nearest] == owner
    snapped = np.where(near, rings.key[nearest], key)
    # two ends must not meet in one vertex
    clash = np.append(np.diff(snapped) <= 1e-9, False)
    clash |= np.roll(clash, 1)
    # nor on a corner of the region that is one of the template
    return np.where(clash & ~fixed, key, snapped)


def _polygons(
    forms: Sequence[Form], warped: Warped, rings: _Rings, key: Floats
) -> tuple[npt.NDArray[Any], Ints]:
    """Build all pieces at once, the vertices of the regions put in."""
    piece_start = starts([len(form.pieces) for form in forms])
    sizes = [len(piece) for form in forms for piece in form.pieces]
    ring_start = starts(sizes)
    vertices = np.concatenate(
        [
            np.concatenate(form.pieces) + start
            for form, start in zip(forms, warped.vertex_start)
        ]
    )  # fmt: skip
    # place in the list of all pieces' vertices after which each edge of an outline begins
    edge_at = np.concatenate(
        [
            ring_start[form.piece_of_edge + first] + form.place_of_edge
            for form, first in zip(forms, piece_start)
        ]
    )
    edge = np.searchsorted(key, rings.key, side="right") - 1
    more = key[edge] != rings.key
    place = np.concatenate([np.arange(len(vertices)), edge_at[edge[more]]])
    order_key = np.concatenate([np.full(len(vertices), -1.0), rings.key[more]])
    z = np.concatenate([warped.points[vertices], rings.z[more]])
    order = np.lexsort((order_key, place))
    piece = np.repeat(np.arange(len(sizes)), sizes)
    z = z[order]
    owner = piece[place[order]]
    loops = shapely.linearrings(np.stack([z.real, z.imag], axis=1), indices=owner)
    return shapely.polygons(loops), piece_start


def _valid(polygons: npt.NDArray[Any], start: Ints, areas: Floats) -> npt.NDArray[np.bool_]:
    """Tell which tasks have simple pieces, counter-clockwise, that add up to their region."""
    xy, owner = shapely.get_coordinates(polygons, return_index=True)
    inner = owner[:-1] == owner[1:]
    # far from the origin the products would lose digits
    first = np.searchsorted(owner, np.arange(len(polygons)))
    local = xy - xy[first][owner]
    cross = local[:-1, 0] * local[1:, 1] - local[:-1, 1] * local[1:, 0]
    area = np.bincount(owner[:-1][inner], cross[inner], minlength=len(polygons)) / 2.0
    good = shapely.is_valid(polygons) & (area > 1.0)
    total = np.add.reduceat(area, start[:-1])
    fine = np.logical_and.reduceat(good, start[:-1])
    return np.asarray(fine & (np.abs(total - areas) <= AREA_ERROR * areas))


def _open(
    forms: Sequence[Form],
    rings: _Rings,
    key: Floats,
    ring_start: Ints,
    piece_start: Ints,
) -> Floats:
    """Add up the open length of the outline along each piece."""
    shut = np.interp(key, rings.loop_key, rings.loop_shut)
    last = np.zeros(len(key), bool)
    last[ring_start[1:] - 1] = True
    ends = np.searchsorted(rings.loop_key, rings.offset) + np.array(rings.count)
    follow, follow_shut = np.roll(key, -1), np.roll(shut, -1)
    follow[last] = rings.loop_key[ends]
    follow_shut[last] = rings.loop_shut[ends]
    length = (follow - key) - (follow_shut - shut)
    piece = np.concatenate([f.piece_of_edge + s for f, s in zip(forms, piece_start)])
    return np.asarray(np.bincount(piece, length, minlength=int(piece_start[-1])), dtype=float)


def centre_lines(task: Task, points: Points, arcs: Floats) -> list[LineString]:
    """Give the centre lines of a warped template.

    Parameters
    ----------
    task
        The task.
    points
        Its vertices, shape (v,).
    arcs
        Arc lengths of the vertices of its outline, shape (r,), metres.
    """
    form, sides = task.form, task.sides
    ring = form.ring.tolist()
    index = {vertex: k for k, vertex in enumerate(ring)} if form.centres else {}
    whole = float(sides.at[-1])
    found = []
    for line in form.centres:
        z = []
        for vertices, weights in line:
            first = index.get(int(vertices[0]), -1)
            on = (first + 1) % len(ring)
            if len(vertices) == 2 and first >= 0 and ring[on] == vertices[1]:
                a = float(arcs[first])
                b = float(arcs[on]) if on else whole
                at = a + float(weights[1]) * (b - a)
                z.append(complex(np.interp(at, sides.at, sides.points)))
            else:
                z.append(complex(weights @ points[vertices]))
        found.append(LineString([(p.real, p.imag) for p in z]))
    return found


def shared_edges(polygons: Sequence[Polygon]) -> list[list[tuple[int, Any]]]:
    """Find what edges each polygon shares with others.

    Parameters
    ----------
    polygons
        Polygons that share vertices.

    Returns
    -------
    list
        For each polygon the index of a neighbour and the edge as a pair of points.
    """
    owner: dict[tuple[Any, Any], int] = {}
    for k, polygon in enumerate(polygons):
        xy = [tuple(point) for point in shapely.get_coordinates(polygon)]
        for a, b in zip(xy[:-1], xy[1:]):
            owner[a, b] = k
    found: list[list[tuple[int, Any]]] = [[] for _ in polygons]
    for (a, b), k in owner.items():
        other = owner.get((b, a))
        if other is not None:
            found[k].append((other, (a, b)))
    return found
