"""Links as the paper writes them: a list of all paths (CND section 4.2 L1, equations 7-8)."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import numpy as np

from ...errors import InputError
from ..requirements.corridor import SLACK, step_lengths
from ..requirements.links import Link
from .model import NetworkModel

#: More paths than this are not listed.
MOST_PATHS = 20_000


def list_paths(model: NetworkModel, link: Link) -> list[list[int]]:
    """List all paths of a link without repeated vertices, over usable and existing edges.

    Parameters
    ----------
    model
        Tells the usable edges.
    link
        The link. Of a route without branches inner vertices are off existing streets, and all
        edges are new.

    Returns
    -------
    list of list of int
        Edges of each path, in order.

    Raises
    ------
    InputError
        If there are more than `MOST_PATHS`.
    """
    index, problem = model.index, model.index.problem
    length = step_lengths(problem, hops=link.hops)
    around: dict[int, list[int]] = defaultdict(list)
    old = [] if link.private else np.flatnonzero(problem.existing).tolist()
    for e in [*index.edges, *old]:
        for v in index.ends[e]:
            around[v].append(e)
    limit = link.limit + SLACK * max(1.0, link.limit)
    found: list[list[int]] = []
    stack: list[tuple[int, float, list[int], frozenset[int]]] = [
        (link.start, 0.0, [], frozenset([link.start]))
    ]
    while stack:
        v, far, path, seen = stack.pop()
        if v == link.end:
            found.append(path)
            if len(found) > MOST_PATHS:
                raise InputError(
                    f"More than {MOST_PATHS} paths join vertices {link.start} and {link.end}.",
                    "List them on small meshes only, or give a smaller tolerance.",
                )
            continue
        if link.private and v != link.start and index.street[v]:
            continue
        for e in around[v]:
            w = index.vertex_of(e, v)
            reached = far + float(length[e])
            if w not in seen and reached <= limit:
                stack.append((w, reached, [*path, e], seen | {w}))
    return found


def add_paths(model: NetworkModel, link: Link) -> None:
    """Add equations 7 and 8: an indicator for every path, of which one must be 1.

    With N edges on a path, E their variables and P the indicator,
    ``-N + 1 <= N P - sum E <= 0``; existing edges are left out. Where nothing may branch off
    (CND figure 6d), P is 0 if another edge at an inner vertex is active.

    Parameters
    ----------
    model
        The model.
    link
        The link; where it is soft, a slack in equation 8 costs its penalty.
    """
    linear = model.linear
    one: list[tuple[Any, float]] = []
    for path in list_paths(model, link):
        mine = [model.edge[e] for e in path if e in model.edge]
        if not mine:
            return
        present = linear.binary()
        one.append((present, 1.0))
        count = float(len(mine))
        row = [(x, -1.0) for x in mine]
        # where branches forbid a path it may be active without being one
        low = -np.inf if link.private else 1.0 - count
        linear.row([*row, (present, count)], low=low, high=0.0)
        if link.private:
            _keep_clear(model, link, path, present)
    if not link.hard:
        one.append((linear.real(1.0, link.penalty), 1.0))
    if not one:
        one.append((linear.real(0.0), 1.0))
    linear.row(one, low=1.0)


def _keep_clear(model: NetworkModel, link: Link, path: list[int], present: Any) -> None:
    """Let a path be present only if no other edge meets its inner vertices."""
    index = model.index
    inner = {v for e in path for v in index.ends[e]} - {link.start, link.end}
    for e in sorted({e for v in inner for e in index.incident[v]} - set(path)):
        model.linear.row([(present, 1.0), (model.edge[e], 1.0)], high=1.0)
