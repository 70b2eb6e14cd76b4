"""What kind of junction streets make: by their number and by the angles between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .graph import FloatArray, IntArray, StreetGraph
from .turns import leaving

#: Over how much of a street its direction at a junction is measured (metres).
REACH = 15.0
#: A street goes straight on where it turns by no more than this (degrees).
STRAIGHT = 30.0
#: What a node may be, beside nothing where two streets go on in each other.
KINDS = ("dead end", "T", "Y", "X", "K", "star")

Words = npt.NDArray[np.object_]


@dataclass(frozen=True, eq=False)
class JunctionKinds:
    """What the n nodes of a graph are.

    Attributes
    ----------
    degree
        Shape (n,). Number of street ends.
    kind
        Shape (n,). "dead end": one street. "T": three, two of which go straight on in each other.
        "Y": three others. "X": four that cross, each going straight on. "K": four others. "star":
        five or more. Empty for two streets, which make no junction.
    deviation
        Shape (n,). How far the angles between neighbouring streets are from those of the kind, on
        average, in degrees: 90, 90 and 180 for a T, equal ones for all others; of two streets the
        turn. NaN for dead ends.
    """

    degree: IntArray
    kind: Words
    deviation: FloatArray


def junction_kinds(
    graph: StreetGraph, straight: float = STRAIGHT, reach: float = REACH
) -> JunctionKinds:
    """Tell what kind of junction each node is.

    Parameters
    ----------
    graph
        The streets, metres.
    straight
        Greatest turn of a street that goes straight on, degrees.
    reach
        Over how much of a street its direction is measured, metres; a shorter edge counts as a
        whole.

    Examples
    --------
    >>> from shapely.geometry import LineString
    >>> from .graph import build_graph
    >>> lines = [LineString([(0, 0), (100, 0)]), LineString([(50, 0), (50, 60)])]
    >>> sorted(junction_kinds(build_graph(lines)).kind.tolist())
    ['T', 'dead end', 'dead end', 'dead end']
    """
    degree = graph.degrees
    kind = np.full(len(degree), "", dtype=object)
    deviation = np.full(len(degree), np.nan)
    kind[degree == 1] = "dead end"
    kind[degree >= 5] = "star"
    if not len(graph.ends):
        return JunctionKinds(degree, kind, deviation)
    for many, nodes, gaps in _gaps(graph, degree, reach):
        if many == 2:
            deviation[nodes] = np.abs(gaps - 180.0).mean(axis=1)
            continue
        deviation[nodes] = np.abs(gaps - 360.0 / many).mean(axis=1)
        if many == 3:
            through = np.abs(gaps.max(axis=1) - 180.0) <= straight
            kind[nodes] = np.where(through, "T", "Y")
            off = np.abs(np.sort(gaps, axis=1) - (90.0, 90.0, 180.0)).mean(axis=1)
            deviation[nodes[through]] = off[through]
        elif many == 4:
            across = gaps[:, [0, 1]] + gaps[:, [1, 2]]
            crossing = (np.abs(across - 180.0) <= straight).all(axis=1)
            kind[nodes] = np.where(crossing, "X", "K")
    return JunctionKinds(degree, kind, deviation)


def _gaps(
    graph: StreetGraph, degree: IntArray, reach: float
) -> list[tuple[int, IntArray, FloatArray]]:
    """Angles between neighbouring streets at nodes, by number of streets.

    Returns
    -------
    list
        The number k of streets from 2 on, the nodes that have so many, shape (m,), and the angles
        from each street to the next one around, shape (m, k), degrees.
    """
    away = leaving(graph.lines, reach).reshape(-1, 2)
    angle = np.degrees(np.arctan2(away[:, 1], away[:, 0]))
    node = graph.ends.ravel()
    order = np.lexsort((angle, node))
    first = np.cumsum(degree) - degree
    found = []
    for many in np.unique(degree[degree >= 2]).tolist():
        nodes = np.flatnonzero(degree == many)
        around = angle[order[first[nodes][:, None] + np.arange(many)]]
        gaps = np.diff(around, axis=1, append=around[:, :1] + 360.0)
        found.append((int(many), nodes, gaps))
    return found
