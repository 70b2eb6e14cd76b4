"""Streets and trips driven vehicle by vehicle, in the traffic simulator SUMO."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from qgis.core import QgsProcessingParameterDefinition

from ...algorithms.errors import InputError, MissingDependencyError
from .. import compat, deps, fields, parameters
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..simulation_fields import SIMULATED_STREETS
from ..tool import Tool
from . import trafficinputs

#: What trips of each kind are called in the numbers: end of the key, kind of the library, words.
_KINDS = (
    ("MEAN", "all", "all trips"),
    ("OUT", "interior-boundary", "trips out of the site"),
    ("IN", "boundary-interior", "trips into it"),
    ("WITHIN", "interior-interior", "trips within it"),
    ("THROUGH", "boundary-boundary", "trips through it"),
)
_MEANS = {
    "DISTANCE": "Mean distance of {} (m)",
    "TIME": "Mean time of {} (s)",
    "WAITING": "Mean time that {} stand (s)",
    "FINISHED": "Share of {} that arrive (%)",
}
#: With fewer trips means are mostly chance.
FEW = 100
#: The way of finding routes, in the words of the tool and of the library.
_ROUTES = {"fastest when empty": "shortest", "by the moment": "rerouting", "learned": "iterated"}


def _key(mean: str, kind: str) -> str:
    """Return the key of a number, as Assign traffic has it: MEAN_TIME, TIME_OUT."""
    return f"MEAN_{mean}" if kind == "MEAN" else f"{mean}_{kind}"


class SimulateTraffic(Tool):
    """Simulates traffic on any layer of streets."""

    about = About(
        name="simulatetraffic",
        title="Simulate traffic",
        group="measure",
        tags=(
            "traffic", "simulation", "sumo", "vehicles", "flow", "speed", "waiting", "delay",
            "congestion", "routes", "demand", "platwright",
        ),
        summary="Drives trips on streets vehicle by vehicle in the simulator SUMO: flows, speeds "
        "and waiting on each street, distance and time of trips.",
        paragraphs=(
            "Needs Eclipse SUMO (EPL 2.0), which is optional since it is large: tick SUMO in the "
            "tool Install Python packages, or in Settings > Options > Platwright. It runs in "
            "processes of its own that end with the run.",
            "Right of way follows the field level: level 1 goes first; between equals whoever "
            "comes from the right, or from the left where one drives on the left. There are no "
            "traffic lights. Vehicles turn round only at dead ends.",
            "Traffic fills the streets before it is measured. Figures are of the trips that "
            "begin in the measured time and arrive; how many do not is told. Trips that find no "
            "way are counted and never left out silently.",
            "Distances are a little shorter than along centre lines, by 3 to 6 m at each turn, "
            "since corners are cut off. Times on empty streets are 10 to 15 % over length / speed: "
            "drivers are imperfect and turns are slow.",
            "The same seed gives the same traffic with the same version of SUMO.",
        ),
        picture="Vehicles per hour on each street, and the seconds that each loses there.",
        references=("CND", "SUMO"),
    )  # fmt: skip
    layers: ClassVar = {"STREETS": SIMULATED_STREETS, "PROBLEMS": fields.PROBLEMS}
    numbers: ClassVar = {
        **{
            _key(mean, key): text.format(words)
            for mean, text in _MEANS.items()
            for key, _, words in _KINDS
        },
        "MEAN_DELAY": "Mean time that trips wait to enter the streets, in no other figure (s)",
        "TRIPS": "Trips that were drawn, those before the measured time too",
        "ARRIVED": "Of these, trips that arrived",
        "RUNNING": "Trips that were still on their way at the end",
        "NOT_ENTERED": "Trips that found no room to enter by the end",
        "NO_WAY": "Trips that find no way",
        "NOWHERE": "Trips that begin and end at the same place",
        "MOVED_ON": "How often a vehicle that stood too long was moved on",
    }
    needs = deps.LAYERS

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield streets and demand, then how they are driven."""
        shared = list(trafficinputs.inputs())
        yield from (p for p in shared if not p.flags() & compat.ADVANCED)
        yield parameters.choice(
            "ROUTES",
            "How drivers choose their way",
            "Matters where streets are full.",
            {
                "learned": "the time is driven several times, and each time some drivers change "
                "to what would have been their fastest way",
                "by the moment": "by the speeds of the moment, at the start and once a minute",
                "fastest when empty": "the fastest way on empty streets",
            },
            default="learned",
        )
        yield from (p for p in shared if p.flags() & compat.ADVANCED)
        yield from _time()
        yield from _driving()

    def check(self, request: Request) -> None:  # noqa: ARG002
        """Look for SUMO before the run."""
        from ...algorithms.traffic.sumo import find_sumo

        try:
            find_sumo()
        except MissingDependencyError as error:
            msg = (
                f"{error} In QGIS: tick SUMO in Settings > Options > Platwright, or run the tool "
                "'Install Python packages' with SUMO (qgis_process run "
                "platwright:installdependencies --CONSENT=true --SUMO=true)."
            )
            raise MissingDependencyError(msg) from error

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read streets and demand, and drive."""
        import pandas as pd

        from ...algorithms.traffic.network import pieces_layer
        from ...algorithms.traffic.sumo import (
            SimulationOptions,
            problem_points,
            simulate,
            street_columns,
        )

        asked = _asked(request)
        options = SimulationOptions(**asked)
        traffic = trafficinputs.read(request, progress.part(0.0, 0.1))
        name = request.name("INPUT")
        try:
            found = simulate(
                traffic.network, traffic.demand, options, progress=progress.part(0.1, 1.0)
            )
        except InputError as error:
            raise _of_layer(error, traffic.streets, name) from error
        streets = pieces_layer(traffic.network, traffic.streets)
        # by their ids the fields of the layer are found again
        streets.index = traffic.streets.index[traffic.network.feature]
        columns = street_columns(traffic.network, found)
        streets = streets.assign(**{name: columns[name].to_numpy() for name in columns.columns})
        problems = problem_points(traffic.network, traffic.demand.places, found, name)
        problems = problems.to_crs(traffic.streets.crs)
        told = [frame for frame in (traffic.problems, problems) if len(frame)]
        problems = pd.concat(told, ignore_index=True) if told else problems
        _tell(found, progress)
        return Result(
            crs=traffic.crs,
            layers={"STREETS": streets, "PROBLEMS": problems},
            numbers=_numbers(found),
            specification=to_json({**traffic.asked, **asked, "routes": request.word("ROUTES")}),
        )


def _of_layer(error: InputError, streets: Any, layer: str) -> InputError:
    """Return an error that calls a feature by its id where it was called by its position."""
    if error.feature is None:
        return error
    feature = streets.index[int(error.feature)]
    return InputError(error.problem, error.remedy, layer=layer, feature=feature)


def _time() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield how long is simulated."""
    yield parameters.number(
        "HOURS",
        "Measured time",
        "How long traffic is measured.",
        unit="h",
        default=1.0,
        minimum=0.05,
        maximum=24.0,
        advanced=True,
    )
    yield parameters.number(
        "WARM_UP",
        "Time before",
        "The same traffic fills the streets before it is measured.",
        unit="min",
        default=15.0,
        minimum=0.0,
        maximum=240.0,
        advanced=True,
    )
    yield parameters.number(
        "ITERATIONS",
        "Times driven",
        "How often the time is driven where drivers learn their way.",
        default=5,
        minimum=1,
        maximum=100,
        integer=True,
        advanced=True,
    )
    yield parameters.number(
        "TIME_LIMIT",
        "Time limit",
        "The run ends with an error where it takes longer.",
        unit="s",
        default=600.0,
        minimum=1.0,
        maximum=86400.0,
        advanced=True,
    )


def _driving() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield how one drives."""
    yield parameters.flag(
        "LEFT_HAND", "Drive on the left", "As in the United Kingdom.", default=False, advanced=True
    )
    yield parameters.number(
        "PATIENCE",
        "Longest standing",
        "A vehicle that stands longer is moved on along its way, so that a knot does not stop "
        "everything; that is counted.",
        unit="s",
        default=300.0,
        minimum=10.0,
        maximum=36000.0,
        advanced=True,
    )
    yield parameters.number(
        "SEED",
        "Seed",
        "Of departures and drivers; the same seed gives the same traffic.",
        default=0,
        minimum=0,
        maximum=2**31 - 1,
        integer=True,
        advanced=True,
    )


def _asked(request: Request) -> dict[str, Any]:
    """Return the options of the simulation by their names in the library."""
    return {
        "hours": request.number("HOURS"),
        "warm_up": request.number("WARM_UP"),
        "routes": _ROUTES[request.word("ROUTES")],
        "iterations": request.integer("ITERATIONS"),
        "seed": request.integer("SEED"),
        "left_hand": request.flag("LEFT_HAND"),
        "patience": request.number("PATIENCE"),
        "time_limit": request.number("TIME_LIMIT"),
    }


def _numbers(found: Any) -> dict[str, float]:
    """Return the numbers of the tool; kinds without trips have none."""
    means = {
        "DISTANCE": found.flows.distance,
        "TIME": found.flows.time,
        "WAITING": found.waiting,
        "FINISHED": {kind: 100.0 * share for kind, share in found.finished.items()},
    }
    counts = found.counts
    return {
        **{_key(mean, key): by[kind] for mean, by in means.items() for key, kind, _ in _KINDS},
        "MEAN_DELAY": found.delay["all"],
        "TRIPS": counts.drawn,
        "ARRIVED": counts.arrived,
        "RUNNING": counts.running,
        "NOT_ENTERED": counts.waiting,
        "NO_WAY": counts.unserved,
        "NOWHERE": counts.nowhere,
        "MOVED_ON": counts.teleports,
    }


def _tell(found: Any, progress: FeedbackProgress) -> None:
    """Say in the log what a planner should know."""
    counts = found.counts
    if len(found.history) > 1:
        times = ", ".join(f"{seconds:.1f}" for seconds in found.history)
        progress.info(f"Mean time of trips each time it was driven (s): {times}.")
    if counts.drawn < FEW:
        progress.warn(
            f"There are only {counts.drawn} trips: chance decides much. More hours tell more."
        )
    if counts.unserved:
        progress.warn(
            f"{counts.unserved} of {counts.drawn} trips find no way; the layer of problems says "
            "from where."
        )
    if counts.running + counts.waiting:
        progress.warn(
            f"{counts.running} trips were still on their way at the end, and {counts.waiting} had "
            "found no room to enter: the streets are too full for this demand."
        )
    if counts.teleports:
        progress.warn(f"Vehicles that stood too long were moved on {counts.teleports} times.")
    progress.info(f"Driven in {found.seconds:.1f} s.")
