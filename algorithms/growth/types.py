"""What flows through the room: the ground that streets grow into, and what has grown."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import shapely

from .grammar import State

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

#: `Growth.street` of edges that grew.
GROWN = -1


@dataclass(frozen=True)
class Start:
    """A place where growth begins.

    Attributes
    ----------
    xy
        Position, metres.
    direction
        Unit vector in which a street would arrive here; growth turns away from it by the angles
        of its rules.
    state
        State of the node.
    node
        Index of the node of the ground that this is, or -1 for a new one.
    """

    xy: tuple[float, float]
    direction: tuple[float, float]
    state: State
    node: int = -1


@dataclass(frozen=True, eq=False)
class Strip:
    """What of a ground belongs to no site: it lies between them and the streets along their edges.

    Attributes
    ----------
    sites
        Polygon or MultiPolygon. Outside of it new streets only lead to a street, as straight as can
        be.
    streets
        LineString or MultiLineString. The streets to which they lead.
    """

    sites: shapely.Geometry
    streets: shapely.Geometry


@dataclass(frozen=True, eq=False)
class Ground:
    """Where streets may grow, and the streets that are there already; metres.

    The streets that are there are planar: they meet in shared nodes only, and stay where they are.

    Attributes
    ----------
    starts
        Where growth begins, at least one.
    domain
        Polygon or MultiPolygon with holes that grown streets stay in, or None for everywhere.
    nodes
        Shape (n, 2). Vertices of the streets that are there.
    ends
        Shape (e, 2). Straight pieces of those streets, as nodes at both ends.
    street
        Shape (e,). Position of the street that each piece belongs to, at least 0.
    bends
        Shape (n,). Nodes where a street only bends: exactly two pieces of one street meet. New
        streets may join there but are not drawn to them.
    strip
        Which part of the domain is only crossed, or None where there is none.
    """

    starts: tuple[Start, ...]
    domain: shapely.Geometry | None = None
    nodes: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    ends: IntArray = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    street: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    bends: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=bool))
    strip: Strip | None = None


@dataclass(frozen=True)
class Step:
    """One iteration of a growth (the "complexity data" of CS).

    Attributes
    ----------
    iteration
        Number, from 1.
    nodes, segments
        How many grown nodes and grown streets there are after it.
    length
        Length of the grown streets, metres.
    population
        People that the grown streets stand for.
    growing
        Nodes that may still grow.
    seconds
        Since the growth began.
    """

    iteration: int
    nodes: int
    segments: int
    length: float
    population: float
    growing: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Growth:
    """What has grown, with the streets that were there: n nodes, e straight edges; metres.

    The first nodes are those of the ground, in their order. Where a street that was there is
    joined, its piece is split; both parts keep its number.

    Attributes
    ----------
    xy
        Shape (n, 2). Positions.
    road_type
        Shape (n,), str. A key of `ROAD_TYPES`; empty for nodes of the ground that did not grow.
    node_type
        Shape (n,), str. A key of `NODE_TYPES`; empty likewise.
    born
        Shape (n,). Iteration in which each node appeared; 0 for those of the ground and starts.
    incoming_road
        Shape (n,). Road number of the edge by which each node was reached, 0 for none.
    incoming
        Shape (n, 2). Unit vector in which each node was reached; 0 where unknown.
    bends
        Shape (n,). Nodes of the ground where a street only bends, still.
    ends
        Shape (e, 2). Nodes at the start and the end of each edge.
    road
        Shape (e,). Road number, from 1; 0 for streets that were there.
    edge_type
        Shape (e,), str. Road type of each edge, that of the child it was drawn to; empty for
        streets that were there.
    step
        Shape (e,). Iteration in which each edge appeared; 0 for streets that were there.
    street
        Shape (e,). `GROWN`, or the position of the street of the ground that it is a piece of.
    steps
        One entry per iteration.
    stopped
        Why growth stopped, as the rest of the sentence "Growth stopped, because ...".
    left_out
        How many streets were not built, because they had no room.
    """

    xy: FloatArray
    road_type: npt.NDArray[np.str_]
    node_type: npt.NDArray[np.str_]
    born: IntArray
    incoming_road: IntArray
    incoming: FloatArray
    bends: BoolArray
    ends: IntArray
    road: IntArray
    edge_type: npt.NDArray[np.str_]
    step: IntArray
    street: IntArray
    steps: tuple[Step, ...]
    stopped: str
    left_out: int

    @property
    def grown(self) -> BoolArray:
        """Shape (e,). Edges that grew."""
        return np.asarray(self.street == GROWN)

    @property
    def lengths(self) -> FloatArray:
        """Shape (e,). Lengths of the edges, metres."""
        start, end = self.xy[self.ends[:, 0]], self.xy[self.ends[:, 1]]
        return np.asarray(np.hypot(*(end - start).T), dtype=float)

    @property
    def degrees(self) -> IntArray:
        """Shape (n,). Number of edges at each node."""
        return np.bincount(self.ends.ravel(), minlength=len(self.xy)).astype(np.int64)
