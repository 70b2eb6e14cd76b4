"""All topologies worth trying for one part of a site, smoothed and scored."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from shapely.geometry import Polygon

from ..errors import CancelledError
from ..progress import Progress
from .build import Draft, Row, build_draft, plan_rows
from .directions import (
    Labels,
    LabelTable,
    alternatives,
    label_ring,
    label_table,
    main_axis,
)
from .facing import find_facing
from .lattice import Cut, solve_lattice
from .overlap import overlap_cuts
from .quadmesh import BoolArray, FloatArray, IntArray
from .quality import score
from .relax import Smoother
from .rings import Ring, Stations, place_stations, polygon_rings

WEIGHTS = (
    (0.2, 0.05), (0.05, 0.05), (0.5, 0.05), (0.0, 0.05), (0.1, 0.05), (1.0, 0.05),
    (0.2, 0.25), (0.05, 0.25), (0.5, 0.25), (0.0, 0.25), (0.2, 0.01), (0.05, 0.01),
    (0.0, 0.01), (0.2, 0.6), (0.05, 0.6),
)  # fmt: skip
"""Weights of direction and corners that are tried, in this order."""
GUIDED_WEIGHTS = (
    (0.5, 0.05), (1.0, 0.05), (0.2, 0.05), (2.0, 0.05), (0.05, 0.05), (0.5, 0.25), (0.2, 0.25),
    (0.5, 0.01), (0.2, 0.01),
)  # fmt: skip
MOST_LABELS = 6
FEW_LABELS = 3
CHANGE_ROUNDS = 3
MOST_CHANGES = 8
MANY = 150
GOOD = 1.0
"""Score at which no other topology is tried."""
FAIR = 1.85
"""Score under which no search by single changes is made."""
ROWS_FROM = 3.0
"""Score of a plain mesh from which on one with extra rows is tried too."""
CUT_ROUNDS = 5
EXACT = 0.1
"""Distance from the boundary, in edge lengths, up to which a given point itself is met."""

Key = tuple[tuple[tuple[float, int, int], ...], ...]


@dataclass(eq=False)
class PartMesh:
    """The mesh of one part of a site.

    Attributes
    ----------
    rings, stations
        Boundary of the part and the points of it that are vertices.
    labels
        Pieces of the rings.
    draft, smoother
        Topology.
    vertices, arc, held
        Positions (n, 2), arc lengths (n,) of boundary vertices, vertices that stay.
    score
        See `quality.score`.
    lost
        Indices of given points that could not be kept.
    attracted
        Vertex -> index of the point that it was pulled onto.
    tried
        Keys of the labels whose meshes were no better.
    """

    rings: list[Ring]
    stations: list[Stations]
    labels: list[Labels]
    draft: Draft
    smoother: Smoother
    vertices: FloatArray
    arc: FloatArray
    held: BoolArray
    score: float
    lost: list[int] = field(default_factory=list)
    attracted: dict[int, int] = field(default_factory=dict)
    tried: set[Key] = field(default_factory=set)


def check_cancelled(progress: Progress) -> None:
    """Raise CancelledError if the caller wants the work to stop."""
    if progress.cancelled():
        msg = "Cancelled while the candidate mesh was being made."
        raise CancelledError(msg)


def mesh_part(
    part: Polygon,
    h: float,
    points: FloatArray,
    indices: IntArray,
    guide: float | None,
    progress: Progress,
) -> PartMesh | None:
    """Find the best mesh of one cleaned part of a site.

    Parameters
    ----------
    part
        Polygon without anything finer than the mesh, metres.
    h
        Edge length, metres.
    points, indices
        Given points (k, 2) that should become vertices and the caller's indices of them.
    guide
        Direction of the mesh lines, radians, or None for the main axis of the boundary.
    progress
        Asked for cancellation.

    Returns
    -------
    PartMesh or None
        None where no topology fits.
    """
    rings = polygon_rings(part)
    near = np.array(
        [i for i, p in enumerate(points) if _distance(rings, p) < 0.5 * h], dtype=np.int64
    )
    stations, lost = place_stations(rings, h, points[near], indices[near])
    tables = _tables(rings, stations, h, guide)
    best: PartMesh | None = None
    tried: set[Key] = set()
    for labels in _label_variants(tables, guide):
        check_cancelled(progress)
        if len(tried) >= MOST_LABELS or (best is not None and _settled(best, len(tried))):
            break
        tried.add(_key(labels))
        best = _better(best, rings, stations, labels, h, part.area, guide)
    if best is None:
        return None
    best.lost, best.tried = lost, tried
    _pin(best, points, h)
    refine(best, h, part.area, guide)
    return best


def _settled(best: PartMesh, tried: int) -> bool:
    """Tell whether a mesh is good, or large and so poor that more labels are no use."""
    hopeless = tried >= FEW_LABELS and best.score > ROWS_FROM and len(best.draft.faces) > 100
    return best.score < GOOD or hopeless


def improve(
    mesh: PartMesh,
    h: float,
    area: float,
    points: FloatArray,
    guide: float | None,
    progress: Progress,
) -> PartMesh:
    """Search for a better topology by changes of single turns, while that helps.

    Parameters
    ----------
    mesh
        Where to begin.
    h, points, guide, progress
        As for `mesh_part`.
    area
        Area of the part, square metres.

    Returns
    -------
    PartMesh
        The best mesh, possibly the one given.
    """
    tables = _tables(mesh.rings, mesh.stations, h, guide)
    weight = WEIGHTS[1] if guide is None else GUIDED_WEIGHTS[2]
    seen = {_key(mesh.labels), *mesh.tried}
    best = mesh
    for _ in range(CHANGE_ROUNDS):
        changes: list[tuple[float, list[Labels]]] = []
        for r, table in enumerate(tables):
            for cost, other in alternatives(table, weight, best.labels[r]):
                labels = [*best.labels[:r], other, *best.labels[r + 1 :]]
                if _key(labels) not in seen:
                    changes.append((cost, labels))
        changes.sort(key=lambda c: c[0])
        start = best
        long = len(mesh.draft.faces) <= MANY or best.score > ROWS_FROM
        most = MOST_CHANGES if long else MOST_CHANGES // 2
        for _, labels in changes[:most]:
            check_cancelled(progress)
            seen.add(_key(labels))
            best = _better(best, mesh.rings, mesh.stations, labels, h, area, guide) or best
        if best is start or best.score < FAIR:
            break
    if best is not mesh:
        best.lost = mesh.lost
        _pin(best, points, h)
        refine(best, h, area, guide)
    return best


def _key(labels: Sequence[Labels]) -> Key:
    """Return what makes two labellings of all rings equal."""
    return tuple(label.key() for label in labels)


def _better(
    best: PartMesh | None,
    rings: list[Ring],
    stations: list[Stations],
    labels: list[Labels],
    h: float,
    area: float,
    guide: float | None,
) -> PartMesh | None:
    """Return the best of a mesh and those that belong to labels."""
    for draft in _drafts(rings, labels, h):
        found = _smoothed(rings, stations, labels, draft, h, area, guide)
        if best is None or found.score < best.score:
            best = found
        if found.score < ROWS_FROM:
            break
    return best


def _tables(
    rings: Sequence[Ring], stations: Sequence[Stations], h: float, guide: float | None
) -> list[LabelTable]:
    """Prepare the choice of turns for all rings."""
    axis = main_axis(rings) if guide is None else guide
    return [
        label_table(ring, marks, h, axis, outer=r == 0)
        for r, (ring, marks) in enumerate(zip(rings, stations))
    ]


def refine(mesh: PartMesh, h: float, area: float, guide: float | None) -> None:
    """Smooth a mesh to the end; keep the result unless it scores worse."""
    vertices, arc = mesh.smoother.smooth(mesh.vertices, mesh.arc, mesh.held, rounds=3, steps=200)
    value = score(mesh.smoother.topology, vertices, h, area, guide)
    if value < mesh.score + 0.1:
        mesh.vertices, mesh.arc, mesh.score = vertices, arc, value


def _distance(rings: Sequence[Ring], point: FloatArray) -> float:
    """Return the distance of a point to the nearest ring."""
    return min(float(ring.project(point[None])[1][0]) for ring in rings)


def _label_variants(tables: Sequence[LabelTable], guide: float | None) -> Iterator[list[Labels]]:
    """Yield different labels of all rings, the most promising first."""
    weights = WEIGHTS if guide is None else GUIDED_WEIGHTS
    columns = [label_ring(table, weights) for table in tables]
    seen = set()
    for choice in range(len(weights)):
        found = [column[choice] for column in columns]
        labels = [x[1] for x in found if x is not None]
        if len(labels) < len(tables) or _key(labels) in seen:
            continue
        seen.add(_key(labels))
        yield labels


def _drafts(rings: list[Ring], labels: list[Labels], h: float) -> Iterator[Draft]:
    """Yield the meshes that belong to labels: the plain one and the one with extra rows."""
    facing = find_facing(rings, labels, h)
    rows, along, extra = plan_rows(rings, labels, h)
    options: list[tuple[list[Row], dict[int, int], dict[int, int]]] = [([], {}, {})]
    if rows:
        options.append((rows, along, extra))
    for planned, rows_at, steps_at in options:
        cuts: list[Cut] = []
        for _ in range(CUT_ROUNDS):
            solution = solve_lattice(rings, labels, h, facing, rows_at, steps_at, cuts)
            if solution is None:
                break
            draft = build_draft(rings, labels, solution[0], planned)
            if draft is not None:
                yield draft
                break
            new = [c for c in overlap_cuts(rings, labels, solution[0]) if c not in cuts]
            if not new:
                break
            cuts += new


def _smoothed(
    rings: list[Ring],
    stations: list[Stations],
    labels: list[Labels],
    draft: Draft,
    h: float,
    area: float,
    guide: float | None,
) -> PartMesh:
    """Smooth a draft roughly and score it."""
    smoother = Smoother(draft, rings, h)
    held = draft.station >= 0
    vertices, arc = smoother.smooth(draft.vertices, draft.arc, held, rounds=4, steps=40)
    value = score(smoother.topology, vertices, h, area, guide)
    return PartMesh(rings, stations, labels, draft, smoother, vertices, arc, held, value)


def _pin(mesh: PartMesh, points: FloatArray, h: float) -> None:
    """Put the vertices of given points exactly on them where these are near the boundary."""
    for v in np.flatnonzero(mesh.draft.station >= 0).tolist():
        index = int(mesh.stations[mesh.draft.ring[v]].point[mesh.draft.station[v]])
        if index >= 0 and float(np.hypot(*(mesh.vertices[v] - points[index]))) <= EXACT * h:
            mesh.vertices[v] = points[index]
