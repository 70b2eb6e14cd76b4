"""The inputs that both tools of traffic share: streets, gates, flows, and what is usual."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from qgis.core import QgsCoordinateReferenceSystem, QgsProcessingParameterDefinition

from .. import parameters
from ..progress import FeedbackProgress
from ..request import Request

if TYPE_CHECKING:
    from ...algorithms.traffic.run import Traffic, TrafficOptions
    from ...algorithms.traffic.types import Demand, TrafficNetwork

#: Input layers by key and what the library calls them.
_LAYERS = {"SITE": "site", "GATES": "gates", "FLOWS": "flows", "WEIGHTS": "weights",
           "ZONES": "zones"}  # fmt: skip
#: Shares by key, the kind of trip, the usual percentage and what it is.
_SHARES = {
    "SHARE_OUT": ("interior-boundary", 40.0, "out", "Trips that leave the site by a gate."),
    "SHARE_IN": ("boundary-interior", 40.0, "in", "Trips that come into the site by a gate."),
    "SHARE_WITHIN": ("interior-interior", 20.0, "within", "Trips that stay inside the site."),
    "SHARE_THROUGH": ("boundary-boundary", 0.0, "through", "Trips from gate to gate."),
}
#: Levels by the end of the key, with the usual speed in km/h and capacity of a lane.
_LEVELS = {
    "MAJOR": (1, "major streets", 64.4, 900.0),
    "COLLECTOR": (2, "collectors", 48.3, 700.0),
    "LOCAL": (3, "local streets", 32.2, 500.0),
    "CUL_DE_SAC": (4, "culs-de-sac", 32.2, 300.0),
}
NEAREST = "nearest"
OWN = "own"


@dataclass(frozen=True, eq=False)
class Given:
    """Streets and trips as a tool of traffic asked for them.

    Attributes
    ----------
    traffic
        Streets and trips as the library read them.
    options
        What was asked, as the library names it.
    asked
        The same for the record of the layers.
    crs
        CRS of the streets.
    """

    traffic: Traffic
    options: TrafficOptions
    asked: dict[str, Any]
    crs: QgsCoordinateReferenceSystem

    @property
    def streets(self) -> Any:
        """The layer of streets, with rows as `network.feature` counts them."""
        return self.traffic.streets

    @property
    def network(self) -> TrafficNetwork:
        """The streets as a network."""
        return self.traffic.network

    @property
    def demand(self) -> Demand:
        """The trips."""
        return self.traffic.demand

    @property
    def problems(self) -> Any:
        """What was left out or is doubtful, with the columns of a layer of problems."""
        return self.traffic.problems.to_frame(self.traffic.streets.crs)


def inputs() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield the streets, the site, the gates and the traffic."""
    yield parameters.layer(
        "INPUT",
        "Streets",
        "Lines that meet at their ends, such as those of Design streets or of OpenStreetMap. Read "
        "where they are there: level, status, speed_kmh, maxspeed, highway, oneway, lanes, "
        "capacity (vehicles per hour of a direction).",
        "line",
    )
    yield parameters.layer(
        "SITE",
        "Site",
        "Polygons over which the traffic is spread evenly. Empty: the ground between the streets.",
        "polygon",
        optional=True,
    )
    yield parameters.layer(
        "GATES",
        "Gates",
        "Points where traffic enters and leaves: access points, or junctions of Design streets, "
        "of which those with is_sink count. Empty: where streets meet the edge of the site.",
        "point",
        optional=True,
    )
    yield parameters.layer(
        "FLOWS",
        "Given flows",
        "Flows that are added: a table with from, to and vehicles_h (names of gates or zones, or "
        "interior), or lines from gate to gate with vehicles_h.",
        ("line", "table"),
        optional=True,
    )
    yield parameters.number(
        "DENSITY",
        "Vehicles per hour and km2",
        "Traffic of the site itself, spread evenly over its area.",
        default=250.0,
        minimum=0.0,
        maximum=100_000.0,
    )
    yield parameters.number(
        "THROUGH",
        "Vehicles per hour between gates",
        "Further traffic from each gate to all others, spread evenly over the pairs.",
        default=0.0,
        minimum=0.0,
        maximum=1_000_000.0,
    )
    yield from _spread()
    yield from _streets()


def _spread() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield how the traffic of the site is spread."""
    for key, (_, usual, word, text) in _SHARES.items():
        yield parameters.number(
            key,
            f"Share of trips {word}",
            f"{text} Only the ratios of the four shares count.",
            unit="percent",
            default=usual,
            minimum=0.0,
            advanced=True,
        )
    yield parameters.choice(
        "GATE_CHOICE",
        "Which gate",
        "By which gate trips leave and enter.",
        {NEAREST: "that of the least time on free streets", "all": "all gates evenly"},
        default=NEAREST,
        advanced=True,
    )
    yield parameters.number(
        "GATE_REACH",
        "Gates are at most this far from streets",
        "A gate farther than this from any end or junction of streets is left out.",
        unit="m",
        default=50.0,
        minimum=0.1,
        advanced=True,
    )
    yield parameters.layer(
        "WEIGHTS",
        "Spread over",
        "Points or polygons, such as buildings or parcels, that the traffic comes from; empty for "
        "the whole area of the site.",
        ("point", "polygon"),
        optional=True,
        advanced=True,
    )
    yield parameters.field(
        "WEIGHT_FIELD",
        "Field with the weight",
        "How much comes from each of them, such as its dwellings. Empty: its area.",
        "WEIGHTS",
    )
    yield parameters.layer(
        "ZONES",
        "Zones",
        "Polygons with a field name, which given flows may name as from and to.",
        "polygon",
        optional=True,
        advanced=True,
    )
    yield parameters.number(
        "PART_LENGTH",
        "Places stand for",
        "The traffic beside so many metres of street begins and ends at one place.",
        unit="m",
        default=50.0,
        minimum=5.0,
        advanced=True,
    )


def _streets() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield what is taken of streets."""
    yield parameters.choice(
        "SPEEDS",
        "Speeds",
        "Which speeds count.",
        {OWN: "those of the fields speed_kmh or maxspeed, else by level", "level": "by level"},
        default=OWN,
        advanced=True,
    )
    for end, (_, what, speed, capacity) in _LEVELS.items():
        yield parameters.number(
            f"SPEED_{end}",
            f"Speed on {what} (km/h)",
            "On a free street.",
            default=speed,
            minimum=3.0,
            maximum=150.0,
            advanced=True,
        )
        yield parameters.number(
            f"CAPACITY_{end}",
            f"Vehicles per hour and lane of {what}",
            "Where the field capacity does not say it.",
            default=capacity,
            minimum=1.0,
            maximum=10_000.0,
            advanced=True,
        )


def read(request: Request, progress: FeedbackProgress) -> Given:
    """Read the layers, and say what travels from where to where.

    Raises
    ------
    InputError
        A layer or a number cannot be used.
    CancelledError
        The planner cancels.
    """
    from ...algorithms.traffic.demand import DemandLayers, DemandRules
    from ...algorithms.traffic.run import TrafficOptions, read_traffic
    from ...algorithms.traffic.speeds import StreetRules

    by_level = {level: end for end, (level, *_) in _LEVELS.items()}
    rules = StreetRules(
        speeds={level: request.number(f"SPEED_{end}") for level, end in by_level.items()},
        capacities={level: request.number(f"CAPACITY_{end}") for level, end in by_level.items()},
        own_speeds=request.word("SPEEDS") == OWN,
    )
    demand = DemandRules(
        density=request.number("DENSITY"),
        shares={kind: request.number(key) for key, (kind, *_) in _SHARES.items()},
        nearest_gate=request.word("GATE_CHOICE") == NEAREST,
        through=request.number("THROUGH"),
        part_m=request.number("PART_LENGTH"),
        gate_reach_m=request.number("GATE_REACH"),
    )
    rules.check()
    demand.check()
    frames = {
        key: request.frame(key, progress.part(0.1 * at, 0.1 * (at + 1)))
        for at, key in enumerate(("INPUT", *_LAYERS))
    }
    layers: dict[str, Any] = {name: frames[key] for key, name in _LAYERS.items()}
    layers["weight_field"] = request.field("WEIGHT_FIELD")
    names = {name: request.name(key) for key, name in _LAYERS.items()}
    options = TrafficOptions(streets=rules, demand=demand)
    traffic = read_traffic(
        frames["INPUT"],
        DemandLayers(**layers, names=names),
        options,
        request.name("INPUT"),
        progress.part(0.6, 1.0),
    )
    numbers = (
        "DENSITY", "THROUGH", *_SHARES, "GATE_REACH", "PART_LENGTH",
        *(f"{kind}_{end}" for kind in ("SPEED", "CAPACITY") for end in _LEVELS),
    )  # fmt: skip
    # by the keys of the inputs, so that a report calls them by their titles
    asked = {
        **{key.lower(): request.number(key) for key in numbers},
        **{key.lower(): request.word(key) for key in ("GATE_CHOICE", "SPEEDS")},
    }
    return Given(traffic, options, asked, request.crs("INPUT"))
