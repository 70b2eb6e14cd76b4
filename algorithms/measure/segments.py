"""Street segments: streets between junctions and dead ends, however their lines are cut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from .graph import FloatArray, IntArray, StreetGraph, chains


@dataclass(frozen=True, eq=False)
class Segments:
    """Streets between nodes where not exactly two street ends meet, s of them.

    Layers cut streets where a name or a speed limit changes; places where two pieces follow one
    another are neither junctions nor ends of segments, as in OSMnx.

    Attributes
    ----------
    ends
        Shape (s, 2). Nodes of the graph at the start and the end; equal for a ring.
    lines
        Shape (s,). From start to end.
    length
        Shape (s,), metres.
    of_edge
        Shape (e,). Segment that each edge is a piece of.
    """

    ends: IntArray
    lines: npt.NDArray[np.object_]
    length: FloatArray
    of_edge: IntArray

    @property
    def nodes(self) -> IntArray:
        """Nodes of the graph that segments end at, ascending."""
        return np.asarray(np.unique(self.ends), dtype=np.int64)


def street_segments(graph: StreetGraph) -> Segments:
    """Join edges through nodes where two of them meet.

    Parameters
    ----------
    graph
        The streets.

    Examples
    --------
    >>> from shapely.geometry import LineString
    >>> from .graph import build_graph
    >>> two = [LineString([(0, 0), (50, 0)]), LineString([(50, 0), (90, 0)])]
    >>> street_segments(build_graph(two)).length.tolist()
    [90.0]
    """
    count = len(graph.lines)
    found = chains(graph, np.ones(count, dtype=bool), np.zeros(len(graph.nodes), dtype=bool))
    of_edge = np.zeros(count, dtype=np.int64)
    lines = np.empty(len(found), dtype=object)
    for k, chain in enumerate(found):
        of_edge[list(chain.edges)] = k
        lines[k] = chain.line
    return Segments(
        np.array([chain.ends for chain in found], dtype=np.int64).reshape(-1, 2),
        lines,
        np.asarray(shapely.length(lines), dtype=float),
        of_edge,
    )
