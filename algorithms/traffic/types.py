"""The types that flow through this room: streets as links, places, and what travels between."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

BoolArray = npt.NDArray[np.bool_]
FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

#: Kinds of trips (CND section 4.1, traffic types).
INTERIOR_BOUNDARY = "interior-boundary"
BOUNDARY_INTERIOR = "boundary-interior"
INTERIOR_INTERIOR = "interior-interior"
BOUNDARY_BOUNDARY = "boundary-boundary"
KINDS = (INTERIOR_BOUNDARY, BOUNDARY_INTERIOR, INTERIOR_INTERIOR, BOUNDARY_BOUNDARY)


@dataclass(frozen=True, eq=False)
class TrafficNetwork:
    """Streets as m pieces between n nodes; a piece is two links, or one where it is one-way.

    Attributes
    ----------
    nodes
        Shape (n, 2). Positions in the working CRS, metres.
    ends
        Shape (m, 2). Nodes at the start and the end of each piece, as it is drawn.
    lines
        Shape (m,). From start to end.
    feature
        Shape (m,). Position in the layer of the feature that each piece is a part of.
    direction
        Shape (m,). 1 where traffic runs from start to end only, -1 where it runs from end to
        start only, 0 for both.
    speed
        Shape (m,). Free speed, metres per second.
    capacity
        Shape (m,). Vehicles per hour that a direction carries, all lanes together.
    lanes
        Shape (m,). Lanes of each direction.
    level
        Shape (m,). Level of the street, 1 to 4; see `levels`.
    existing
        Shape (m,). Streets that were there before the design.
    crs
        Working CRS, in metres.
    """

    nodes: FloatArray
    ends: IntArray
    lines: npt.NDArray[np.object_]
    feature: IntArray
    direction: IntArray
    speed: FloatArray
    capacity: FloatArray
    lanes: IntArray
    level: IntArray
    existing: BoolArray
    crs: CRS

    @property
    def length(self) -> FloatArray:
        """Shape (m,), metres."""
        return np.asarray(shapely.length(self.lines), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Places:
    """Where trips begin and end, p of them: on pieces of streets, or at their ends.

    Interior places come first, then the gates: nodes where traffic enters and leaves.

    Attributes
    ----------
    piece
        Shape (p,). Piece of street that each place lies on; for a gate any piece at its node.
    along
        Shape (p,). Metres from the start of the piece.
    node
        Shape (p,). Node of the network for gates, -1 for interior places.
    weight
        Shape (p,). Share of the interior's trips that begin or end here; 0 for gates. They add
        up to 1 where there are interior places.
    name
        Shape (p,). What the planner calls a gate; empty for interior places.
    """

    piece: IntArray
    along: FloatArray
    node: IntArray
    weight: FloatArray
    name: npt.NDArray[np.object_]

    @property
    def gates(self) -> BoolArray:
        """Shape (p,). Places where traffic enters and leaves."""
        return self.node >= 0


@dataclass(frozen=True, eq=False)
class Demand:
    """Trips between places.

    Attributes
    ----------
    places
        The p places.
    trips
        By kind of trip (see `KINDS`), an array of shape (p, p): vehicles per hour from the place
        of the row to that of the column.
    """

    places: Places
    trips: Mapping[str, FloatArray]

    @property
    def total(self) -> FloatArray:
        """Shape (p, p). Vehicles per hour of all kinds."""
        size = len(self.places.piece)
        total = np.zeros((size, size))
        for trips in self.trips.values():
            total += trips
        return total


@dataclass(frozen=True, eq=False)
class Flows:
    """Traffic on the m pieces of a network, however it was computed.

    Attributes
    ----------
    ahead, back
        Shape (m,). Vehicles per hour from start to end of each piece, and from end to start.
    time_ahead, time_back
        Shape (m,). Seconds that a vehicle takes; that of a free road where nothing travels.
    trips, distance, time
        By kind of trip and under "all": vehicles per hour that arrive, their mean way in metres,
        and their mean time in seconds (NaN where there are none).
    unserved
        Vehicles per hour that find no way.
    """

    ahead: FloatArray
    back: FloatArray
    time_ahead: FloatArray
    time_back: FloatArray
    trips: Mapping[str, float]
    distance: Mapping[str, float]
    time: Mapping[str, float]
    unserved: float
