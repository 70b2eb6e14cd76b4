"""Reasons why rooms cannot tile a floor, each with the faces that it is about."""

from __future__ import annotations

from typing import Optional

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ...progress import Progress
from ..program.index import RoomIndex
from ..types import Placements
from .reason import Reason
from .route import route_reasons
from .tiling import Tiling, tile

#: Seconds for one question whether the rooms can tile the floor.
SECONDS = 4.0


def why_not(
    index: RoomIndex, *, by_cp: bool = True, progress: Optional[Progress] = None
) -> list[Reason]:
    """Look for what makes a plan impossible, for a few seconds.

    Parameters
    ----------
    index
        The problem.
    by_cp
        Whether CP-SAT may be used; HiGHS otherwise.
    progress
        Asked for cancellation.

    Returns
    -------
    list of Reason
        Nothing where none was found; that does not prove that there is a plan.
    """
    for look in (_sinks, _uncovered, _sizes, _numbers):
        found = look(index)
        if found:
            return found
    found = route_reasons(index, progress)
    if found:
        return found
    return _tilings(index, by_cp, progress)


def _sinks(index: RoomIndex) -> list[Reason]:
    """Look for a sink that a corridor can begin at."""
    network = index.problem.network
    may = network.candidate | network.existing
    reached = np.zeros(len(network.sinks), dtype=bool)
    reached[network.mesh.edges[may].ravel()] = True
    if (network.sinks & reached).any():
        return []
    what = "corridor" if index.problem.kind == "floor" else "route"
    problem = f"No {what} can begin at any sink."
    return [Reason(problem, "Put a sink where cells meet, or allow ways along the outer wall.")]


def _uncovered(index: RoomIndex) -> list[Reason]:
    """Look for faces that no room can cover."""
    bare = [f for f in np.flatnonzero(index.problem.floor).tolist() if not index.by_face[f]]
    if not bare:
        return []
    count = "1 cell fits" if len(bare) == 1 else f"{len(bare)} cells fit"
    return [
        Reason(
            f"{count} into no shape of room.",
            "Add a smaller shape, or make the cells obstacles.",
            tuple(bare),
        )
    ]


def _sizes(index: RoomIndex) -> list[Reason]:
    """Look for pieces of floor whose number of cells no rooms add up to."""
    sizes = sorted({len(faces) for faces in index.problem.placements.faces})
    found = []
    for piece in _pieces(index):
        total = len(piece)
        if _sums(sizes, total):
            continue
        words = ", ".join(str(size) for size in sizes)
        found.append(
            Reason(
                f"{total} connected cells cannot be made of rooms of {words} cells.",
                "Change the obstacles or add a shape of another size.",
                piece,
            )
        )
    return found


def _pieces(index: RoomIndex) -> list[tuple[int, ...]]:
    """Return the connected pieces of floor."""
    floor = index.problem.floor
    pairs = index.problem.network.mesh.edge_faces
    pairs = pairs[(pairs[:, 1] >= 0) & floor[pairs].all(axis=1)]
    size = len(floor)
    matrix = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(size, size))
    _, label = connected_components(matrix, directed=False)
    inside = np.flatnonzero(floor)
    return [tuple(inside[label[inside] == own].tolist()) for own in np.unique(label[inside])]


def _sums(sizes: list[int], total: int) -> bool:
    """Tell whether sizes, each as often as wanted, add up to a total."""
    can = [True] + [False] * total
    for amount in range(1, total + 1):
        can[amount] = any(size <= amount and can[amount - size] for size in sizes)
    return can[total]


def _numbers(index: RoomIndex) -> list[Reason]:
    """Look for numbers of rooms that need more floor than there is, or leave some over."""
    problem = index.problem
    cells = int(problem.floor.sum())
    size = _sizes_of(problem.placements, len(problem.templates))
    needed = sum(t.least * size[i] for i, t in enumerate(problem.templates))
    found = [
        Reason(
            f"{t.least} of '{t.name}' are asked for, and it fits nowhere.",
            "Allow it to be turned, take a smaller module, or ask for none.",
        )
        for i, t in enumerate(problem.templates)
        if t.least > 0 and not size[i]
    ]
    if needed > cells:
        found.append(
            Reason(
                f"The rooms that are asked for at least need {needed} cells, and the floor has "
                f"{cells}.",
                "Ask for fewer rooms, or take a smaller module.",
            )
        )
    limits = [(size[i], t.most) for i, t in enumerate(problem.templates) if size[i]]
    most = sum(own * (cells if limit is None else limit) for own, limit in limits)
    if most < cells:
        found.append(
            Reason(
                f"The rooms that are allowed at most fill {most} cells, and the floor has {cells}.",
                "Allow more rooms of some shape, or take a larger module.",
            )
        )
    return found


def _sizes_of(placements: Placements, count: int) -> list[int]:
    """Return the number of cells of each template, 0 where it has no place."""
    size = [0] * count
    for t, faces in zip(placements.template.tolist(), placements.faces):
        size[t] = len(faces)
    return size


def _tilings(index: RoomIndex, by_cp: bool, progress: Optional[Progress]) -> list[Reason]:
    """Tile the floor without corridors, with and without the limits of numbers."""

    def stop() -> bool:
        return progress is not None and progress.cancelled()

    def ask(**relaxed: bool) -> Tiling:
        return tile(index, seconds=SECONDS, by_cp=by_cp, stop=stop, **relaxed)

    if ask().status != "infeasible":
        return []
    bare = ask(counts=False)
    if stop():
        return []
    if bare.status == "unknown":
        return [Reason("The numbers of rooms cannot be kept.", "Loosen them, or add shapes.")]
    if bare.status == "feasible":
        broken = ask(soft_counts=True)
        words = "; ".join(index.problem.counts[i].text for i in broken.broken)
        return [
            Reason(
                f"The floor can be tiled, but not with these numbers: {words or 'all together'}.",
                "Loosen one of them.",
            )
        ]
    gaps = ask(counts=False, gaps=True)
    places = f"; at best {len(gaps.gaps)} are left over" if gaps.gaps else ""
    return [
        Reason(
            f"No rooms of these shapes cover every cell exactly once{places}.",
            "Add a small shape such as 1x2, make the cells that are left over obstacles, or "
            "change the module.",
            tuple(gaps.gaps),
        )
    ]
