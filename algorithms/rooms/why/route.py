"""Reasons why no route of a level has the length or the treasure rooms that are asked for."""

from __future__ import annotations

import dataclasses
import math
import time
from collections.abc import Callable
from typing import Optional

import numpy as np

from ...network.requirements.budget import LeastLength, LengthBudget
from ...network.structure import structure
from ...progress import Progress
from ..program.index import RoomIndex
from ..search.passing import passing_bound
from ..types import FloatArray
from .reason import Reason

#: Seconds for the least length of a route.
SECONDS = 4.0
#: Share that sums may be off by rounding.
ROUNDING = 1e-6


def route_reasons(index: RoomIndex, progress: Optional[Progress] = None) -> list[Reason]:
    """Look for limits of a level's route that no level keeps.

    Parameters
    ----------
    index
        The problem.
    progress
        Asked for cancellation.
    """
    if index.problem.kind != "level":
        return []
    found = _treasures(index)
    for limit in index.problem.network.requirements:
        if isinstance(limit, LeastLength) and limit.hard:
            found += _too_short(index, limit)
        if isinstance(limit, LengthBudget) and limit.hard:
            found += _too_long(index, limit, _stop(progress))
    return found


def most_blocks(index: RoomIndex) -> int:
    """Return a number of blocks that no tiling exceeds: each cell counts its part of the least."""
    size = [len(faces) for faces in index.problem.placements.faces]
    cells = np.flatnonzero(index.problem.floor).tolist()
    return math.floor(_best(index, cells, [1.0 / own for own in size]) + ROUNDING)


def longest_route(index: RoomIndex, lengths: FloatArray) -> float:
    """Return a length that no route exceeds.

    All of the route lies inside blocks (CND-x eq. 20). Each cell counts its part of the longest
    route through a block there; where branches are forbidden two edges at most meet at a vertex.

    Parameters
    ----------
    index
        The problem.
    lengths
        Shape (e,). Length of each edge.
    """
    network = index.problem.network
    ends = network.mesh.edges.tolist()
    metres = np.where(network.candidate, lengths, 0.0).tolist()
    single = math.isinf(network.branches)
    parts = []
    for inner, faces in zip(index.problem.placements.inner, index.problem.placements.faces):
        at: dict[int, list[float]] = {}
        for e in inner:
            for v in ends[e]:
                at.setdefault(v, []).append(metres[e])
        most = [sorted(own)[-2:] if single else own for own in at.values()]
        parts.append(0.5 * math.fsum(x for own in most for x in own) / len(faces))
    return _best(index, np.flatnonzero(index.problem.floor).tolist(), parts)


def _best(index: RoomIndex, cells: list[int], parts: list[float]) -> float:
    """Return the sum over cells of the greatest part of a placement there."""
    return math.fsum(max((parts[r] for r in index.by_face[f]), default=0.0) for f in cells)


def _treasures(index: RoomIndex) -> list[Reason]:
    """Look for more dead ends than there can be blocks."""
    asked = index.problem.treasures
    if asked is None:
        return []
    most = most_blocks(index)
    # the block of the start is none of them
    if asked.least < most:
        return []
    rooms = asked.least - (1 if len(asked.apart) == 1 else 0)
    own = "start and goal" if len(asked.apart) == 1 else "the start"
    return [
        Reason(
            f"{rooms} treasure rooms beside {own} are asked for, and at most {most} blocks of "
            "these shapes fit into the outline.",
            "Ask for fewer treasure rooms, take a smaller module or add smaller shapes.",
        )
    ]


def _too_short(index: RoomIndex, limit: LeastLength) -> list[Reason]:
    """Look for a least length that no route comes to."""
    most = longest_route(index, limit.steps / 1000)
    if limit.least <= most * (1 + ROUNDING):
        return []
    return [
        Reason(
            f"The route is to be at least {limit.least:g} m long, and no route through blocks of "
            f"these shapes is longer than {most:.0f} m.",
            "Ask for a shorter route, or take a smaller module or larger shapes.",
        )
    ]


def _too_long(index: RoomIndex, limit: LengthBudget, stop: Callable[[], bool]) -> list[Reason]:
    """Look for a greatest length that every route exceeds."""
    problem = index.problem
    alone = dataclasses.replace(
        problem.network,
        length=limit.lengths,
        edge_factor=np.ones(len(limit.lengths)),
        weight_length=1.0,
        weight_distance=0.0,
        requirements=(),
    )
    least = passing_bound(structure(alone), index, stop)
    # a millimetre for each cell: lengths count in whole ones
    slack = ROUNDING * least + 1e-3 * float(problem.floor.sum())
    if not limit.most < least - slack < math.inf:
        return []
    return [
        Reason(
            f"The route is to be at most {limit.most:g} m long, and every route through blocks of "
            f"these shapes is longer than {least:.0f} m.",
            "Allow a longer route, or take a larger module or larger shapes.",
        )
    ]


def _stop(progress: Optional[Progress]) -> Callable[[], bool]:
    """Return whether the time for a question is over."""
    end = time.monotonic() + SECONDS

    def stop() -> bool:
        return time.monotonic() > end or (progress is not None and progress.cancelled())

    return stop
