"""What SUMO reads: streets, vehicles, and what it is to measure.

Every part of a street is an edge "s<part>a" from its start to its end, and "s<part>b" back; a trip
is a vehicle "v<trip>"; a node is a junction "n<node>". All texts are numbers and words of our own,
so that nothing needs to be escaped.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import shapely

from ..types import BoolArray, TrafficNetwork
from .options import SimulationOptions
from .parts import Parts
from .trips import Trips

#: Type of all vehicles.
_CAR = '<vType id="car" vClass="passenger" speedFactor="1" speedDev="{:.3f}"/>\n'
#: Length of the intervals by which routes of a next run are chosen, seconds.
PERIOD = 300


def edge_id(part: int, back: bool) -> str:
    """Return the name of an edge."""
    return f"s{part}{'b' if back else 'a'}"


def read_edge_id(name: str) -> tuple[int, bool]:
    """Return the part and whether the edge runs back; the inverse of `edge_id`."""
    return int(name[1:-1]), name.endswith("b")


def write_streets(folder: Path, network: TrafficNetwork, parts: Parts) -> tuple[Path, Path]:
    """Write junctions and edges for netconvert; return both files."""
    nodes, edges = folder / "streets.nod.xml", folder / "streets.edg.xml"
    with nodes.open("w", encoding="utf-8") as file:
        file.write("<nodes>\n")
        file.writelines(
            f'<node id="n{number}" x="{x:.3f}" y="{y:.3f}"/>\n'
            for number, (x, y) in enumerate(parts.nodes)
        )
        file.write("</nodes>\n")
    with edges.open("w", encoding="utf-8") as file:
        file.write("<edges>\n")
        for part, number in enumerate(parts.piece):
            file.writelines(_edges(network, parts, part, int(number)))
        file.write("</edges>\n")
    return nodes, edges


def _edges(network: TrafficNetwork, parts: Parts, part: int, piece: int) -> Iterable[str]:
    way = int(network.direction[piece])
    points = shapely.get_coordinates(parts.lines[part])
    # two directions share the centre line, one alone is on it
    spread = "right" if way == 0 else "center"
    # level 1 goes before 2, and so on
    priority = max(1, 5 - int(network.level[piece]))
    for back in (False, True):
        if way == (1 if back else -1):
            continue
        one, other = parts.ends[part][::-1] if back else parts.ends[part]
        shape = " ".join(f"{x:.3f},{y:.3f}" for x, y in (points[::-1] if back else points))
        yield (
            f'<edge id="{edge_id(part, back)}" from="n{one}" to="n{other}" shape="{shape}" '
            f'numLanes="{max(1, int(network.lanes[piece]))}" priority="{priority}" '
            f'speed="{network.speed[piece]:.3f}" spreadType="{spread}"/>\n'
        )


def write_trips(
    path: Path, trips: Trips, parts: Parts, gates: BoolArray, chosen: Iterable[int],
    options: SimulationOptions,
) -> None:  # fmt: skip
    """Write trips between junctions, whose ways are still to be found.

    Parameters
    ----------
    path
        The file.
    trips, parts
        The trips, and the streets with their places.
    gates
        Shape (p,). Places at which vehicles enter at speed; elsewhere they start from rest.
    chosen
        Which trips.
    options
        How drivers are.
    """
    with path.open("w", encoding="utf-8") as file:
        file.write(f"<routes>\n{_CAR.format(options.speed_deviation)}")
        for trip in chosen:
            one, other = parts.stops[trips.origin[trip]], parts.stops[trips.destination[trip]]
            file.write(
                f'<trip id="v{trip}" {_departure(trips, gates, trip)} '
                f'fromJunction="n{one}" toJunction="n{other}"/>\n'
            )
        file.write("</routes>\n")


def write_vehicles(
    path: Path, trips: Trips, gates: BoolArray, ways: Mapping[int, str],
    options: SimulationOptions,
) -> None:  # fmt: skip
    """Write vehicles with their ways: the edges in order, by trip."""
    with path.open("w", encoding="utf-8") as file:
        file.write(f"<routes>\n{_CAR.format(options.speed_deviation)}")
        for trip in sorted(ways):
            file.write(
                f'<vehicle id="v{trip}" {_departure(trips, gates, trip)}>'
                f'<route edges="{ways[trip]}"/></vehicle>\n'
            )
        file.write("</routes>\n")


def _departure(trips: Trips, gates: BoolArray, trip: int) -> str:
    speed = "max" if gates[trips.origin[trip]] else "0"
    return (
        f'type="car" depart="{trips.depart[trip]:.0f}" departLane="best" departSpeed="{speed}" '
        'arrivalPos="max"'
    )


def write_measures(path: Path, options: SimulationOptions) -> None:
    """Ask for the traffic of every edge: over the measured time, and by short intervals."""
    path.write_text(
        "<additional>\n"
        f'<edgeData id="measured" file="measured.xml" begin="{options.begin:.0f}" '
        f'end="{options.end:.0f}" excludeEmpty="true"/>\n'
        f'<edgeData id="weights" file="weights.xml" period="{PERIOD}" excludeEmpty="true"/>\n'
        "</additional>\n",
        encoding="utf-8",
    )
