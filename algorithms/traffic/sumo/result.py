"""What a simulation found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely

from ..types import KINDS, BoolArray, FloatArray, Flows, TrafficNetwork
from .options import SimulationOptions
from .parts import Parts
from .read import Arrival, Statistics, Teleport, Traffic
from .trips import Trips
from .write import read_edge_id

#: Under this name the means of all kinds of trips are kept.
ALL = "all"


@dataclass(frozen=True)
class Counts:
    """What became of every trip that was drawn, warm-up and all.

    `drawn = nowhere + unserved + waiting + inserted` and `inserted = running + arrived`.

    Attributes
    ----------
    drawn
        All trips.
    nowhere
        Those that begin and end at the same place, once places have become nodes.
    unserved
        Those that find no way.
    waiting
        Those that found no room to enter by the end.
    inserted
        Those that entered.
    running
        Those that were still on their way at the end.
    arrived
        Those that arrived.
    teleports
        How often a vehicle that stood too long was moved on.
    collisions
        Collisions; there should be none.
    """

    drawn: int
    nowhere: int
    unserved: int
    waiting: int
    inserted: int
    running: int
    arrived: int
    teleports: int
    collisions: int


@dataclass(frozen=True, eq=False)
class Simulation:
    """Traffic on the m pieces of a network as the simulator measured it.

    Means of trips are of those that depart in the measured time and arrive; trips that go nowhere
    count with a way of 0.

    Attributes
    ----------
    flows
        Flows, times, distances. Flows are vehicle metres per hour over metres, so that a vehicle
        that drives half a piece counts half. `flows.time_ahead` is at the measured mean speed.
    speed_ahead, speed_back
        Shape (m,). Mean speed, metres per second; NaN where nothing travelled.
    waiting_ahead, waiting_back
        Shape (m,). Mean seconds that a vehicle stands on the piece; NaN likewise.
    loss_ahead, loss_back
        Shape (m,). Mean seconds lost on the piece against driving freely; NaN likewise.
    waiting, loss, delay
        By kind of trip and under "all": mean seconds stood, lost in all, and waited to enter the
        streets before the trip began, which is in no other figure; NaN where there are no trips.
    finished
        By kind and under "all": share of the trips of the measured time that arrived, 0 to 1.
    counts
        What became of every trip.
    history
        Mean seconds of a trip in each iteration; one where nothing was iterated.
    teleports
        Shape (q, 2). Where vehicles were moved on: the node ahead of each, in the working CRS.
    lost
        Shape (p,). Trips that find no way, by the place where they begin.
    entry
        Shape (p,). Mean seconds that trips from each place wait to enter; NaN where there are none.
    seconds
        How long all took on the clock of the wall.
    """

    flows: Flows
    speed_ahead: FloatArray
    speed_back: FloatArray
    waiting_ahead: FloatArray
    waiting_back: FloatArray
    loss_ahead: FloatArray
    loss_back: FloatArray
    waiting: Mapping[str, float]
    loss: Mapping[str, float]
    delay: Mapping[str, float]
    finished: Mapping[str, float]
    counts: Counts
    history: Sequence[float]
    teleports: FloatArray
    lost: FloatArray
    entry: FloatArray
    seconds: float


@dataclass(frozen=True, eq=False)
class Findings:
    """What one run of the simulator wrote, and the trips that it was given.

    Attributes
    ----------
    nowhere, unserved
        Shape (t,). Trips that go nowhere, and that find no way.
    arrivals, traffic, statistics, teleports
        See `read`.
    """

    nowhere: BoolArray
    unserved: BoolArray
    arrivals: Mapping[int, Arrival]
    traffic: Mapping[tuple[int, bool], Traffic]
    statistics: Statistics
    teleports: Sequence[Teleport] = field(default_factory=tuple)


def gather(
    network: TrafficNetwork,
    parts: Parts,
    trips: Trips,
    found: Findings,
    options: SimulationOptions,
    history: Sequence[float],
    seconds: float,
) -> Simulation:
    """Put together what a simulation found."""
    ahead = _street(network, parts, found, options, back=False)
    back = _street(network, parts, found, options, back=True)
    means = _means(trips, found, options)
    measured = trips.depart >= options.begin
    flows = Flows(
        ahead=ahead["flow"],
        back=back["flow"],
        time_ahead=ahead["time"],
        time_back=back["time"],
        trips=means["trips"],
        distance=means["distance"],
        time=means["time"],
        unserved=float((found.unserved & measured).sum() / options.hours),
    )
    return Simulation(
        flows=flows,
        speed_ahead=ahead["speed"],
        speed_back=back["speed"],
        waiting_ahead=ahead["waiting"],
        waiting_back=back["waiting"],
        loss_ahead=ahead["loss"],
        loss_back=back["loss"],
        waiting=means["waiting"],
        loss=means["loss"],
        delay=means["delay"],
        finished=means["finished"],
        counts=_counts(trips, found),
        history=tuple(history),
        teleports=_teleports(parts, found),
        lost=np.bincount(trips.origin[found.unserved], minlength=len(parts.stops)).astype(
            np.float64
        ),
        entry=_entry(trips, found, len(parts.stops)),
        seconds=seconds,
    )


def mean_time(arrivals: Mapping[int, Arrival]) -> float:
    """Return the mean time of trips in seconds, NaN where none arrived."""
    return float(np.mean([one.time for one in arrivals.values()])) if arrivals else float("nan")


def _street(
    network: TrafficNetwork,
    parts: Parts,
    found: Findings,
    options: SimulationOptions,
    *,
    back: bool,
) -> dict[str, FloatArray]:
    """Add up the parts of each piece in one direction."""
    size = len(network.speed)
    driven, metres, seconds, waiting, loss = np.zeros((5, size))
    whole = network.length
    share = shapely.length(parts.lines) / whole[parts.piece]
    for part, piece in enumerate(parts.piece):
        one = found.traffic.get((part, back))
        if one is not None:
            driven[piece] += one.vehicles * share[part]
            seconds[piece] += one.seconds
            metres[piece] += one.metres
            waiting[piece] += one.waiting
            loss[piece] += one.loss
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = np.where((metres > 0) & (driven > 0), metres / seconds, np.nan)
        each = np.where(driven > 0, driven, np.nan)
    return {
        "flow": driven / options.hours,
        "speed": speed,
        "time": whole / np.where(np.isnan(speed), network.speed, speed),
        "waiting": waiting / each,
        "loss": loss / each,
    }


def _means(
    trips: Trips, found: Findings, options: SimulationOptions
) -> dict[str, dict[str, float]]:
    """Return means by kind, of the trips that depart in the measured time."""
    names = {"time": "time", "distance": "distance", "waiting": "waiting", "loss": "loss",
             "delay": "delay"}  # fmt: skip
    means: dict[str, dict[str, float]] = {name: {} for name in (*names, "trips", "finished")}
    measured = trips.depart >= options.begin
    for kind in (*KINDS, ALL):
        chosen = measured if kind == ALL else measured & (trips.kind == KINDS.index(kind))
        numbers = np.flatnonzero(chosen)
        arrived = [found.arrivals[int(trip)] for trip in numbers if int(trip) in found.arrivals]
        # who is there already has arrived without a way, as in an assignment
        there = int(found.nowhere[numbers].sum())
        count = len(arrived) + there
        means["trips"][kind] = count / options.hours
        means["finished"][kind] = count / len(numbers) if len(numbers) else float("nan")
        for name, column in names.items():
            total = sum(getattr(one, column) for one in arrived)
            means[name][kind] = total / count if count else float("nan")
    return means


def _counts(trips: Trips, found: Findings) -> Counts:
    nowhere, unserved = int(found.nowhere.sum()), int(found.unserved.sum())
    counted = found.statistics
    return Counts(
        drawn=len(trips.kind),
        nowhere=nowhere,
        unserved=unserved,
        waiting=len(trips.kind) - nowhere - unserved - counted.inserted,
        inserted=counted.inserted,
        running=counted.running,
        arrived=len(found.arrivals),
        teleports=counted.teleports,
        collisions=counted.collisions,
    )


def _teleports(parts: Parts, found: Findings) -> FloatArray:
    """Return the node at which, or ahead of which, each vehicle stood."""
    nodes = []
    for one in found.teleports:
        if one.edge.startswith(":n"):
            nodes.append(int(one.edge[2:].partition("_")[0]))
        else:
            part, back = read_edge_id(one.edge)
            nodes.append(int(parts.ends[part, 0 if back else 1]))
    return np.asarray(parts.nodes[np.asarray(nodes, dtype=np.int64)] + parts.origin)


def _entry(trips: Trips, found: Findings, size: int) -> FloatArray:
    number = np.fromiter(found.arrivals, dtype=np.int64, count=len(found.arrivals))
    delay = np.asarray([one.delay for one in found.arrivals.values()], dtype=np.float64)
    at = trips.origin[number]
    count = np.bincount(at, minlength=size)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.bincount(at, weights=delay, minlength=size) / count)
