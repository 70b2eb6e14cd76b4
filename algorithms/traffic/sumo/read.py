"""What SUMO writes: streets, ways, trips and traffic."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, NamedTuple
from xml.etree import ElementTree  # nosec B405: only files that SUMO has just written are read

from .write import read_edge_id

_TELEPORT = re.compile(r"Teleporting vehicle 'v(\d+)'; (.*?), lane='(:?\w+?)_\d+', time=(\d+)")


class Arrival(NamedTuple):
    """A trip that has arrived: seconds, metres along lanes and junctions, seconds."""

    delay: float
    time: float
    distance: float
    waiting: float
    loss: float


class Traffic(NamedTuple):
    """What was on an edge: vehicles, their seconds and metres, seconds waited and lost."""

    vehicles: float
    seconds: float
    metres: float
    waiting: float
    loss: float


@dataclass(frozen=True)
class Statistics:
    """What the simulator counted: vehicles, by the end."""

    inserted: int
    running: int
    waiting: int
    teleports: int
    collisions: int


class Teleport(NamedTuple):
    """A vehicle that was moved on: its trip, why, on which edge, at which second."""

    trip: int
    reason: str
    edge: str
    time: float


def read_edges(path: Path) -> set[str]:
    """Read the names of the edges of a network, without those inside junctions."""
    edges = _elements(path, "edge")
    return {edge.attrib["id"] for edge in edges if edge.get("function") is None}


def read_ways(path: Path) -> dict[int, str]:
    """Read the ways that were found: edges in order, by trip."""
    found = {}
    for vehicle in _elements(path, "vehicle"):
        route = vehicle.find("route")
        if route is not None and route.get("edges"):
            found[int(vehicle.attrib["id"][1:])] = route.attrib["edges"]
    return found


def read_arrivals(path: Path) -> dict[int, Arrival]:
    """Read the trips that have arrived."""
    names = ("departDelay", "duration", "routeLength", "waitingTime", "timeLoss")
    return {
        int(info.attrib["id"][1:]): Arrival(*(float(info.attrib[name]) for name in names))
        for info in _elements(path, "tripinfo")
        # some are moved on to the very end of their way ("vaporized"); these have arrived, too
    }


def read_traffic(path: Path) -> dict[tuple[int, bool], Traffic]:
    """Read the traffic of edges, by part and whether it runs back."""
    found = {}
    for edge in _elements(path, "edge"):
        seconds = float(edge.get("sampledSeconds", "0"))
        found[read_edge_id(edge.attrib["id"])] = Traffic(
            # all drive it from its start to its end, where places are
            float(edge.get("entered", "0")) + float(edge.get("departed", "0")),
            seconds,
            seconds * float(edge.get("speed", "0")),
            float(edge.get("waitingTime", "0")),
            float(edge.get("timeLoss", "0")),
        )
    return found


def read_statistics(path: Path) -> Statistics:
    """Read what the simulator counted."""
    found: dict[str, Any] = {}
    root = ElementTree.parse(path).getroot()  # noqa: S314  # nosec B314: written by SUMO
    for tag in ("vehicles", "teleports", "safety"):
        element = root.find(tag)
        found[tag] = {} if element is None else element.attrib
    count: Callable[[str, str], int] = lambda tag, name: int(found[tag].get(name, 0))  # noqa: E731
    return Statistics(
        inserted=count("vehicles", "inserted"),
        running=count("vehicles", "running"),
        waiting=count("vehicles", "waiting"),
        teleports=count("teleports", "total"),
        collisions=count("safety", "collisions"),
    )


def read_teleports(log: str) -> list[Teleport]:
    """Find in the log where vehicles were moved on."""
    return [
        Teleport(int(trip), reason, edge, float(time))
        for trip, reason, edge, time in _TELEPORT.findall(log)
    ]


def _elements(path: Path, tag: str) -> Iterator[ElementTree.Element]:
    """Yield the elements of a name, and forget each when the next is asked for."""
    for _, element in ElementTree.iterparse(path):  # noqa: S314  # nosec B314: written by SUMO
        if element.tag == tag:
            yield element
            element.clear()
