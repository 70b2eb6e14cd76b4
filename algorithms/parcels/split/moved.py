"""Streets of a layer as a mesh, moved there, and back in their rows (UP section 6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, MultiLineString, Polygon

from ...progress import Progress, Silent
from ..roadmesh import StreetMesh
from ..roadmesh.rebuild import mesh_of_layers
from ..rules import ParcelRules
from .cells import fill_regions
from .moving import optimised
from .rules import SplitRules

Floats = npt.NDArray[np.float64]
#: Streets with less of their length on the land have no part in it (metres).
LEAST = 1.0
#: Ends nearer than this to another street or the edge have reached it (metres).
THERE = 1.0
#: What of a street is further from its part in the mesh is not in it (metres).
OFF = 0.05
#: Smaller pieces of land are left out (square metres).
SCRAP = 50.0


@dataclass(frozen=True)
class MovedStreets:
    """Streets after the optimisation.

    Attributes
    ----------
    lines
        One geometry for each street given, shape (n,); the same object where it has not moved.
    move
        How far the vertex went that went furthest, shape (n,), metres.
    problems
        Places and what could not be used there.
    """

    lines: list[shapely.Geometry]
    move: Floats
    problems: list[tuple[shapely.Point, str]]


def move_streets(
    land: shapely.Geometry,
    lines: Sequence[LineString] | npt.NDArray[Any],
    widths: Sequence[float] | Floats,
    rules: ParcelRules,
    *,
    frontage: MultiLineString,
    centre_lines: MultiLineString | None = None,
    fixed: Sequence[bool] | npt.NDArray[np.bool_] = (),
    seed: int = 0,
    progress: Progress | None = None,
) -> MovedStreets:
    """Move the streets of some land so that rows of parcels fit better between them.

    Ends that lie outside the land stay, and what leads there follows. Streets that end in the
    open, and those that they branch off, stay.

    Parameters
    ----------
    land
        Polygon or polygons without what is not to be built on; metres.
    lines, widths
        Centre lines and widths of the streets, n of them, metres.
    rules
        What is asked of parcels.
    frontage
        Its edges along existing streets.
    centre_lines
        Centre lines of these streets where the land reaches to them.
    fixed
        Which streets must stay, n of them; empty for none.
    seed
        Of whatever is random.
    progress
        Told of the work.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    told = progress or Silent()
    found = MovedStreets(list(lines), np.zeros(len(lines)), [])
    stay = list(fixed) or [False] * len(lines)
    for part in shapely.get_parts(land):
        if part.geom_type != "Polygon" or part.area < SCRAP:
            continue
        inside = shapely.length(shapely.intersection(np.array(lines, dtype=object), part))
        own = np.flatnonzero(inside > LEAST).tolist()
        if not own:
            continue
        through, held = _through(part, [lines[k] for k in own])
        streets = [line for line in through if line is not None]
        rows = [k for k, line in zip(own, through) if line is not None]
        if not streets:
            continue
        keep = [at for at, k in enumerate(rows) if stay[k] or held[own.index(k)]]
        mesh, problems = mesh_of_layers(
            part, streets, [float(widths[k]) for k in rows], frontage,
            centre_lines=centre_lines, fixed=keep,
        )  # fmt: skip
        found.problems.extend(problems)
        cells = fill_regions(mesh, sorted(mesh.regions), rules, seed=seed, refine=False)
        after, _ = optimised(mesh, cells, rules, SplitRules(), seed, told)
        _take_back(found, mesh, after, rows)
    return found


def _through(
    land: Polygon, lines: Sequence[LineString]
) -> tuple[list[LineString | None], list[bool]]:
    """Cut off what ends in the open; tell which streets this is a part or a branch of."""
    ring = shapely.boundary(land)
    every = np.array([*lines, ring], dtype=object)
    inside = shapely.intersection(np.array(lines, dtype=object), land)
    noded = shapely.get_parts(shapely.union_all([*inside, ring]))
    _, _, dangles, _ = shapely.polygonize_full(noded)
    loose = []
    for dangle in shapely.get_parts(dangles):
        ends = shapely.points(shapely.get_coordinates(dangle)[[0, -1]])
        # what reaches another street but for a gap is drawn on to it
        alone = [(shapely.distance(every, end) < THERE).sum() < 2 for end in ends]
        if dangle.length > LEAST and any(alone):
            loose.append(dangle)
    if not loose:
        return list(lines), [False] * len(lines)
    open_ = shapely.union_all(loose)
    held = [bool(line.distance(open_) < THERE) for line in lines]
    rest: list[LineString | None] = []
    for line, near in zip(lines, held):
        left = shapely.difference(line, open_.buffer(1e-6)) if near else line
        parts = [p for p in shapely.get_parts(left) if p.length > LEAST]
        longest = max(parts, key=lambda p: p.length, default=None)
        rest.append(None if longest is None else LineString(longest.coords))
    return rest, held


def _take_back(
    found: MovedStreets, before: StreetMesh, after: StreetMesh, rows: Sequence[int]
) -> None:
    """Give streets the places that their edges have now."""
    edges: dict[int, list[tuple[int, int]]] = {}
    for (a, b), edge in before.edges.items():
        if edge.street >= 0:
            edges.setdefault(edge.street, []).append((a, b))
    step = np.hypot(*(after.xy[: len(before.xy)] - before.xy).T)
    for street, own in edges.items():
        row = rows[street]
        ends = np.unique(np.array(own))
        move = float(step[ends].max())
        if move == 0.0:
            continue
        found.move[row] = max(found.move[row], move)
        found.lines[row] = _moved(found.lines[row], before.xy, after.xy, own, ends)


def _moved(
    line: shapely.Geometry,
    before: Floats,
    after: Floats,
    edges: Sequence[tuple[int, int]],
    ends: npt.NDArray[np.int64],
) -> shapely.Geometry:
    """Put a street together of its edges in the mesh, and of what is not in it."""
    pairs = np.array(edges)
    old = shapely.union_all(shapely.linestrings(before[pairs]))
    new = list(shapely.linestrings(after[pairs]))
    for part in shapely.get_parts(shapely.difference(line, shapely.buffer(old, OFF))):
        if part.length < OFF:
            continue
        xy = shapely.get_coordinates(part).copy()
        for at in (0, -1):
            away = np.hypot(*(before[ends] - xy[at]).T)
            if away.min() < 3 * OFF:
                xy[at] = after[ends[int(away.argmin())]]
        new.append(LineString(xy))
    merged = shapely.line_merge(shapely.multilinestrings(new))
    if merged.geom_type != "LineString":
        return merged
    # in the direction that it had
    given = shapely.get_coordinates(line)
    back = np.hypot(*(shapely.get_coordinates(merged)[[0, -1]] - given[0]).T)
    return shapely.reverse(merged) if back[1] < back[0] else merged
