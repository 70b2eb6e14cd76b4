"""Traffic by the ways of least time: everybody takes one, however many others do (CND 4.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse.csgraph import dijkstra

from ..progress import Progress, Silent
from ..site.watch import ask
from .sections import Sections, cut_at_places
from .types import Demand, FloatArray, Flows, IntArray, TrafficNetwork

#: What goes on here, for those who cancel it.
WORK = "the traffic was assigned"
#: Numbers that a chunk of searches keeps at most: what fits into a second, and the memory.
_CHUNK = 400_000


@dataclass(frozen=True, eq=False)
class Loads:
    """Traffic of every kind on the k links of a network cut at its places.

    Attributes
    ----------
    kinds
        Names of the c kinds.
    flow
        Shape (c, k). Vehicles per hour.
    served
        Shape (c,). Vehicles per hour that arrive.
    missed
        Shape (p,). Vehicles per hour from each place that find no way.
    least
        Vehicle-seconds per hour that all who arrive need on ways of least cost.
    """

    kinds: tuple[str, ...]
    flow: FloatArray
    served: FloatArray
    missed: FloatArray
    least: float


@dataclass(frozen=True, eq=False)
class Assignment:
    """Traffic on a network.

    Attributes
    ----------
    flows
        By piece of street.
    sections
        The network cut at the places.
    loads
        Traffic on its links.
    time
        Shape (k,). Seconds on each link.
    busiest
        Shape (m,). Largest share of the capacity of a direction that is used anywhere on each
        piece.
    gap
        What is left to the equilibrium: share of the time that all would save if each could still
        change to the quickest way; NaN where none was sought.
    rounds
        Assignments that were made.
    """

    flows: Flows
    sections: Sections
    loads: Loads
    time: FloatArray
    busiest: FloatArray
    gap: float
    rounds: int


def assign(network: TrafficNetwork, demand: Demand, progress: Progress | None = None) -> Assignment:
    """Send all trips along the ways of least time on free roads.

    Of several such ways one is taken, always the same.

    Parameters
    ----------
    network
        The streets.
    demand
        The trips.
    progress
        Asked for cancellation, or None.

    Raises
    ------
    CancelledError
        If the caller cancels.

    Examples
    --------
    >>> import geopandas as gpd
    >>> from shapely.geometry import LineString, box
    >>> from .demand import DemandLayers, DemandRules, read_demand
    >>> from .network import read_network
    >>> line = LineString([(500000, 50), (501000, 50)])
    >>> frame = gpd.GeoDataFrame(geometry=[line], crs=32633)
    >>> site = gpd.GeoDataFrame(geometry=[box(500000, 0, 501000, 1000)], crs=32633)
    >>> network, _ = read_network(frame)
    >>> rules = DemandRules(shares={"interior-boundary": 1.0})
    >>> found = assign(network, read_demand(network, DemandLayers(site=site), rules))
    >>> round(found.flows.trips["all"]), round(found.flows.distance["all"], -1)
    (250, 250.0)
    """
    sections = cut_at_places(network, demand.places)
    loads = load(sections, demand, sections.free_time, progress)
    return result(network, sections, loads, sections.free_time)


def load(
    sections: Sections, demand: Demand, cost: FloatArray, progress: Progress | None = None
) -> Loads:
    """Send all trips along ways of least cost.

    Parameters
    ----------
    sections
        The network cut at the places of `demand`.
    demand
        The trips.
    cost
        Shape (k,). Seconds of each link, greater than 0.
    progress
        Asked for cancellation, or None.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    progress = progress or Silent()
    kinds = tuple(demand.trips)
    size = len(demand.places.piece)
    trips = np.array([demand.trips[kind] for kind in kinds]).reshape(len(kinds), size, size)
    flow = np.zeros((len(kinds), len(cost)))
    served, missed, least = np.zeros(len(kinds)), np.zeros(size), 0.0
    rows = np.flatnonzero(trips.sum(axis=(0, 2)) > 0)
    matrix = sections.matrix(cost)
    step = max(1, _CHUNK // max(1, sections.nodes))
    for at in range(0, len(rows), step):
        ask(progress, WORK)
        chunk = rows[at : at + step]
        far, before = dijkstra(matrix, indices=sections.place[chunk], return_predecessors=True)
        own = trips[:, chunk, :]
        reach = np.isfinite(far[:, sections.place])
        missed[chunk] = np.where(reach, 0.0, own).sum(axis=(0, 2))
        own = np.where(reach, own, 0.0)
        served += own.sum(axis=(1, 2))
        least += float((own.sum(axis=0) * np.where(reach, far[:, sections.place], 0.0)).sum())
        flow += _tree_flow(sections, far, before.astype(np.int64), own)
    return Loads(kinds, flow, served, missed, least)


def _tree_flow(
    sections: Sections, far: FloatArray, before: IntArray, trips: FloatArray
) -> FloatArray:
    """Add trips up along trees of ways, from the farthest nodes towards the starts.

    Parameters
    ----------
    sections
        The network.
    far
        Shape (s, q). Cost from each start to each node.
    before
        Shape (s, q). Node before each node on the way, negative for none.
    trips
        Shape (c, s, p). To each place, 0 where it cannot be reached.

    Returns
    -------
    array
        Shape (c, k). Vehicles per hour on each link.
    """
    kinds, starts, _ = trips.shape
    nodes = sections.nodes
    # One more column takes what has arrived at the starts, and what leads nowhere.
    amount = np.zeros((kinds, starts, nodes + 1))
    for k, node in enumerate(sections.place.tolist()):
        amount[:, :, node] += trips[:, :, k]
    amount = amount.reshape(kinds, -1)
    parent = np.where(before >= 0, before, nodes)
    base = np.arange(starts)[:, None] * (nodes + 1)
    order = np.argsort(-far, axis=1, kind="stable")
    child_at = (base + order).T
    parent_at = (base + np.take_along_axis(parent, order, axis=1)).T
    for child, above in zip(child_at, parent_at):
        amount[:, above] += amount[:, child]
    amount = amount.reshape(kinds, starts, nodes + 1)[:, :, :nodes]
    start, node = np.nonzero((before >= 0) & (amount.sum(axis=0) > 0))
    link = sections.link(before[start, node], node)
    count = len(sections.start)
    return np.array([np.bincount(link, own[start, node], minlength=count) for own in amount])


def result(
    network: TrafficNetwork,
    sections: Sections,
    loads: Loads,
    time: FloatArray,
    gap: float = float("nan"),
    rounds: int = 1,
) -> Assignment:
    """Say by piece of street what traffic on links means.

    The flow of a piece is the mean over its length: it changes where trips begin and end on it.

    Parameters
    ----------
    network
        The streets.
    sections, loads
        The network cut at places, and the traffic on its links.
    time
        Shape (k,). Seconds on each link.
    gap, rounds
        See `Assignment`.
    """
    m = len(network.lines)
    size = network.length
    total = loads.flow.sum(axis=0)
    flow, seconds = np.zeros((2, m)), np.full((2, m), np.nan)
    busiest = np.zeros(m)
    for side, use in enumerate((sections.ahead, ~sections.ahead)):
        piece = sections.piece[use]
        flow[side] = np.bincount(piece, (total * sections.length)[use], minlength=m) / size
        open_to = np.bincount(piece, minlength=m) > 0
        seconds[side][open_to] = np.bincount(piece, time[use], minlength=m)[open_to]
        np.maximum.at(busiest, piece, (total / sections.capacity)[use])
    # Loops without a place are no link; nobody uses them.
    free = size / network.speed
    for side, shut in enumerate((network.direction < 0, network.direction > 0)):
        seconds[side] = np.where(np.isnan(seconds[side]) & ~shut, free, seconds[side])
    return Assignment(
        Flows(
            ahead=flow[0],
            back=flow[1],
            time_ahead=seconds[0],
            time_back=seconds[1],
            trips=_by_kind(loads, loads.served),
            distance=_means(loads, loads.flow @ sections.length),
            time=_means(loads, loads.flow @ time),
            unserved=float(loads.missed.sum()),
        ),
        sections,
        loads,
        time,
        busiest,
        gap,
        rounds,
    )


def _by_kind(loads: Loads, values: FloatArray) -> dict[str, float]:
    found = {kind: float(value) for kind, value in zip(loads.kinds, values)}
    return {**found, "all": float(values.sum())}


def _means(loads: Loads, sums: FloatArray) -> dict[str, float]:
    """Return sums by kind, shape (c,), per vehicle that arrives; NaN where none does."""
    served = _by_kind(loads, loads.served)
    return {
        kind: value / served[kind] if served[kind] > 0 else float("nan")
        for kind, value in _by_kind(loads, sums).items()
    }
