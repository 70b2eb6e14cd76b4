"""How much traffic runs on each street, and how far and long everybody travels."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, ClassVar

from qgis.core import QgsProcessingParameterDefinition

from .. import compat, deps, fields, parameters
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool
from ..traffic_fields import ASSIGNED_STREETS, TRAFFIC_PLACES
from . import trafficinputs

#: Numbers by key, with the name that the library gives them.
_NUMBERS = {
    "TOTAL_LENGTH": "total_length",
    "DESIGN_LENGTH": "design_length",
    "MEAN_DISTANCE": "distance_mean",
    "DISTANCE_OUT": "distance_out",
    "DISTANCE_IN": "distance_in",
    "DISTANCE_WITHIN": "distance_within",
    "DISTANCE_THROUGH": "distance_through",
    "MEAN_TIME": "time_mean",
    "TIME_OUT": "time_out",
    "TIME_IN": "time_in",
    "TIME_WITHIN": "time_within",
    "TIME_THROUGH": "time_through",
    "VEHICLES": "vehicles",
    "UNSERVED": "unserved",
    "VEHICLE_KM": "vehicle_km",
    "VEHICLE_HOURS": "vehicle_hours",
    "MAX_USE": "max_use",
    "GATES_FOUND": "gates",
    "ACHIEVED_GAP": "gap",
}


class AssignTraffic(Tool):
    """Sends trips over a network of streets."""

    about = About(
        name="assigntraffic",
        title="Assign traffic",
        group="measure",
        tags=(
            "traffic", "flow", "assignment", "shortest path", "equilibrium", "demand", "trips",
            "congestion", "volume", "capacity", "through-traffic", "BPR", "platwright",
        ),
        summary="Sends the traffic of a site over its streets: vehicles per hour, speed and use of "
        "each street; mean distance and time of trips out, in, within and through.",
        paragraphs=(
            "The traffic of a site is its area times the vehicles per hour and square kilometre, "
            "so it is the same for all designs of that site. It is spread evenly over the ground, "
            "and each bit of ground uses the nearest street inside. Flows between gates come on "
            "top: evenly over all pairs, or as a table or lines give them.",
            "By the shortest time everybody takes the quickest way on free streets. In equilibrium "
            "streets slow down as they fill (curve of the Bureau of Public Roads), and trips are "
            "spread until nobody has a quicker way left.",
            "Each feature of the result is a street between two junctions. Its flow is the mean "
            "over its length, since trips begin and end along it. Junctions themselves take no "
            "time, nor do turns; for signals, queues and right of way use a simulator.",
        ),
        picture="Vehicles per hour on each street, most where ways out of the site meet.",
        references=("CND", "BPR", "BFW"),
    )  # fmt: skip
    layers: ClassVar = {
        "STREETS": ASSIGNED_STREETS,
        "PLACES": TRAFFIC_PLACES,
        "PROBLEMS": fields.PROBLEMS,
    }
    numbers: ClassVar = {
        "TOTAL_LENGTH": "Length of all streets (m)",
        "DESIGN_LENGTH": "Length of the streets that were not there before (m)",
        "MEAN_DISTANCE": "Mean distance of all trips (m)",
        "DISTANCE_OUT": "Mean distance of trips out of the site (m; empty without any)",
        "DISTANCE_IN": "Mean distance of trips into the site (m; empty without any)",
        "DISTANCE_WITHIN": "Mean distance of trips within the site (m; empty without any)",
        "DISTANCE_THROUGH": "Mean distance of trips from gate to gate (m; empty without any)",
        "MEAN_TIME": "Mean time of all trips (s)",
        "TIME_OUT": "Mean time of trips out of the site (s; empty without any)",
        "TIME_IN": "Mean time of trips into the site (s; empty without any)",
        "TIME_WITHIN": "Mean time of trips within the site (s; empty without any)",
        "TIME_THROUGH": "Mean time of trips from gate to gate (s; empty without any)",
        "VEHICLES": "Vehicles per hour that arrive",
        "UNSERVED": "Vehicles per hour that find no way",
        "VEHICLE_KM": "Kilometres that all vehicles of an hour drive together",
        "VEHICLE_HOURS": "Hours that they drive together",
        "MAX_USE": "Largest volume / capacity",
        "GATES_FOUND": "Gates where traffic enters and leaves",
        "ACHIEVED_GAP": "Share of the time that better ways would save (empty: no equilibrium)",
        "SECONDS": "Time of the computation (s)",
    }
    needs = deps.LAYERS

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield what travels where, then how ways are chosen."""
        shared = list(trafficinputs.inputs())
        basic = [p for p in shared if not p.flags() & compat.ADVANCED]
        yield from basic
        yield parameters.choice(
            "METHOD",
            "Ways",
            "How trips choose their way.",
            {
                "shortest time": "the quickest way on free streets",
                "equilibrium": "streets slow down as they fill, until nobody has a quicker way",
            },
            default="shortest time",
        )
        yield from (p for p in shared if p.flags() & compat.ADVANCED)
        yield from _curve()

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read the layers and assign."""
        from ...algorithms.traffic.equilibrium import EquilibriumRules
        from ...algorithms.traffic.run import report_traffic

        start = time.monotonic()
        rules = EquilibriumRules(
            alpha=request.number("ALPHA"),
            beta=request.number("BETA"),
            gap=request.number("GAP"),
            seconds=request.number("TIME_LIMIT"),
        )
        rules.check()
        given = trafficinputs.read(request, progress.part(0.0, 0.5))
        method = request.word("METHOD")
        options = replace(given.options, method=method, equilibrium=rules)
        report = report_traffic(given.traffic, options, progress.part(0.5, 1.0))
        numbers = {key: report.numbers[name] for key, name in _NUMBERS.items()}
        numbers["SECONDS"] = time.monotonic() - start
        _tell(report, rules.gap, progress)
        asked: dict[str, Any] = {**given.asked, "method": method}
        if method != "shortest time":
            asked.update(alpha=rules.alpha, beta=rules.beta, gap=rules.gap)
        return Result(
            crs=given.crs,
            layers={
                "STREETS": report.streets,
                "PLACES": report.places,
                "PROBLEMS": report.problems,
            },
            numbers=numbers,
            specification=to_json(asked),
            keep=True,
        )


def _curve() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield how streets slow down, and when the search for an equilibrium ends."""
    yield parameters.number(
        "ALPHA",
        "Delay on a full street",
        "Equilibrium: a full street takes 1 + this times as long as a free one.",
        default=0.15,
        minimum=0.0,
        maximum=100.0,
        advanced=True,
    )
    yield parameters.number(
        "BETA",
        "Power of the delay",
        "Equilibrium: the delay grows with this power of volume / capacity.",
        default=4.0,
        minimum=1.0,
        maximum=20.0,
        advanced=True,
    )
    yield parameters.number(
        "GAP",
        "Wished gap",
        "Equilibrium: ends where better ways would save this share of all time.",
        default=1e-4,
        minimum=1e-9,
        maximum=0.5,
        advanced=True,
    )
    yield parameters.number(
        "TIME_LIMIT",
        "Time limit",
        "Equilibrium: ends after so long with the best flows so far.",
        unit="s",
        default=60.0,
        minimum=0.1,
        advanced=True,
    )


def _tell(report: Any, wished: float, progress: FeedbackProgress) -> None:
    """Say in the log what a planner should know."""
    gap = report.numbers["gap"]
    if math.isfinite(gap):
        text = f"Equilibrium after {report.assignment.rounds} rounds, gap {gap:.2g}."
        progress.info(text)
        if gap > wished:
            progress.warn(f"{text} More time would bring it below {wished:g}.")
    if report.numbers["unserved"] > 0:
        progress.warn(f"{report.numbers['unserved']:.3g} vehicles per hour find no way.")
    if len(report.problems):
        progress.warn(f"The layer of problems has {len(report.problems)}, each with its place.")
