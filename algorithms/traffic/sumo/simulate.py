"""Streets and demand in, simulated traffic out."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Optional

import numpy as np

from ...errors import InputError
from ...progress import Deadline, Progress, Share, Silent
from ..types import Demand, TrafficNetwork
from . import read, write
from .find import Sumo, find_sumo
from .options import ITERATED, REROUTING, SimulationOptions
from .parts import Parts, cut
from .result import Findings, Simulation, gather, mean_time
from .run import Runner, SimulationError, scratch
from .trips import Trips, draw

_NET = "streets.net.xml"
_ADDITIONAL = "measures.add.xml"


def simulate(
    network: TrafficNetwork,
    demand: Demand,
    options: Optional[SimulationOptions] = None,
    *,
    sumo: Optional[Sumo] = None,
    progress: Optional[Progress] = None,
) -> Simulation:
    """Simulate traffic in Eclipse SUMO, vehicle by vehicle (CND section 5.1).

    Streets are written with their levels as right of way: a street of a higher level goes first,
    and between equals the one that comes from the right (from the left where one drives on the
    left). There are no traffic lights. Vehicles turn round only at dead ends. Trips begin and end
    at their places, which are nodes of the simulated streets; in which direction a vehicle leaves
    is part of its way.

    Parameters
    ----------
    network, demand
        Streets, and the trips on them; capacities are not used, they come out of the driving.
    options
        How traffic is simulated; None for the usual.
    sumo
        Where the simulator is; None to look for it.
    progress
        Told of stages; asked ten times a second whether to stop.

    Returns
    -------
    Simulation
        The same for the same seed, options, network and demand and the same version of SUMO.

    Raises
    ------
    InputError
        Streets or demand cannot be simulated, or the time limit is reached.
    MissingDependencyError
        SUMO is not installed.
    CancelledError
        The caller cancelled; no process and no file is left, as with any error.
    SimulationError
        A program of SUMO failed.
    """
    options = options or SimulationOptions()
    progress = progress or Silent()
    begin = time.monotonic()
    sumo = sumo or find_sumo()
    if any(len(trips) != len(demand.places.piece) for trips in demand.trips.values()):
        raise InputError("The demand does not fit its places.", "Make both from the same layer.")
    trips = draw(demand, options)
    parts = cut(network, demand.places)
    with scratch() as folder:
        deadline = Deadline(options.time_limit)
        runner = Runner(sumo, folder, progress, deadline)
        drive = _Drive(runner, folder, network, parts, demand, trips, options)
        progress.stage("Writing streets for the simulator", 0.0)
        drive.streets()
        progress.stage("Finding ways", 0.03)
        drive.ways()
        history = drive.all_runs(Share(progress, 0.06, 0.98))
        progress.stage("Reading what was simulated", 0.98)
        return gather(
            network, parts, trips, drive.findings(), options, history,
            time.monotonic() - begin,
        )  # fmt: skip


class _Drive:
    """One demand on one network, driven once or several times.

    Parameters
    ----------
    runner, folder
        How programs are run, and where.
    network, parts, demand, trips, options
        What is simulated.
    """

    def __init__(
        self,
        runner: Runner,
        folder: Path,
        network: TrafficNetwork,
        parts: Parts,
        demand: Demand,
        trips: Trips,
        options: SimulationOptions,
    ) -> None:
        self._runner, self._folder, self._options = runner, folder, options
        self._network, self._parts, self._trips = network, parts, trips
        self._gates = demand.places.gates
        self._nowhere = parts.stops[trips.origin] == parts.stops[trips.destination]
        self._ways: dict[int, str] = {}
        self._log = ""

    def streets(self) -> None:
        """Make the network of the simulator, and check that every street is in it."""
        nodes, edges = write.write_streets(self._folder, self._network, self._parts)
        arguments = [
            "--node-files", nodes.name, "--edge-files", edges.name, "--output-file", _NET,
            "--offset.disable-normalization", "true", "--no-turnarounds.except-deadend", "true",
            "--geometry.remove", "false", "--tls.guess", "false", "--junctions.join", "false",
            "--lefthand", str(self._options.left_hand).lower(), "--no-warnings", "true",
        ]  # fmt: skip
        self._runner.run("netconvert", arguments)
        known = read.read_edges(self._folder / _NET)
        for part, piece in enumerate(self._parts.piece):
            way = int(self._network.direction[piece])
            if any(
                write.edge_id(part, back) not in known
                for back in (False, True)
                if way != (1 if back else -1)
            ):
                raise InputError(
                    "The simulator cannot use a part of this street.",
                    "Clean the streets, for instance with 'Validate street network', and look for "
                    "parts that are very short or lie on each other.",
                    feature=int(self._network.feature[piece]),
                )
        write.write_measures(self._folder / _ADDITIONAL, self._options)

    def ways(self) -> None:
        """Find the ways of all trips on empty streets."""
        self._ways = self._find(())
        if not self._ways:
            raise InputError(
                f"None of the {len(self._trips.kind)} trips finds a way.",
                "Check directions of one-way streets, and whether the streets are connected.",
            )

    def all_runs(self, progress: Share) -> list[float]:
        """Drive as often as asked; return the mean time of trips in each run."""
        options = self._options
        runs = options.iterations if options.routes == ITERATED else 1
        rng = np.random.default_rng(options.seed)
        times = []
        for run in range(runs):
            part = Share(progress, run / runs, (run + 1) / runs)
            text = "Driving" if runs == 1 else f"Driving, {run + 1} of {runs} times"
            part.stage(text, 0.0)
            self._drive(lambda second, part=part, text=text: part.stage(  # type: ignore[misc]
                text, 0.9 * min(1.0, second / options.stop)
            ))  # fmt: skip
            times.append(mean_time(self._arrivals()))
            if run + 1 < runs:
                part.stage("Choosing other ways", 0.9)
                self._improve(rng, 1.0 / (run + 2))
        return times

    def findings(self) -> Findings:
        """Read what the last run wrote."""
        served = np.zeros(len(self._trips.kind), dtype=bool)
        served[list(self._ways)] = True
        return Findings(
            nowhere=self._nowhere,
            unserved=~served & ~self._nowhere,
            arrivals=self._arrivals(),
            traffic=read.read_traffic(self._folder / "measured.xml"),
            statistics=read.read_statistics(self._folder / "statistics.xml"),
            teleports=read.read_teleports(self._log),
        )

    def _arrivals(self) -> dict[int, read.Arrival]:
        return read.read_arrivals(self._folder / "tripinfo.xml")

    def _find(self, weights: tuple[str, ...]) -> dict[int, str]:
        """Return the fastest way of each trip that has one."""
        chosen = np.flatnonzero(~self._nowhere)
        path = self._folder / "trips.rou.xml"
        write.write_trips(path, self._trips, self._parts, self._gates, chosen, self._options)
        arguments = [
            "--net-file", _NET, "--route-files", path.name, "--output-file", "ways.rou.xml",
            "--junction-taz", "true", "--ignore-errors", "true", "--no-warnings", "true",
            "--no-step-log", "true", "--seed", str(self._options.seed), *weights,
        ]  # fmt: skip
        self._runner.run("duarouter", arguments)
        return read.read_ways(self._folder / "ways.rou.xml")

    def _improve(self, rng: np.random.Generator, share: float) -> None:
        """Let a share of the trips change to what would have been fastest in the last run."""
        better = self._find(("--weight-files", "weights.xml"))
        for trip in sorted(self._ways):
            if rng.random() < share:
                self._ways[trip] = better.get(trip, self._ways[trip])

    def _drive(self, on_time: Callable[[float], None]) -> None:
        """Run the simulator once with the ways as they are."""
        options = self._options
        path = self._folder / "vehicles.rou.xml"
        more: list[str] = []
        if options.routes == REROUTING:
            chosen = sorted(self._ways)
            write.write_trips(path, self._trips, self._parts, self._gates, chosen, options)
            more = [
                "--junction-taz", "true", "--device.rerouting.probability", "1",
                "--device.rerouting.period", "60",
            ]  # fmt: skip
        else:
            write.write_vehicles(path, self._trips, self._gates, self._ways, options)
        arguments = [
            "--net-file", _NET, "--route-files", path.name, "--additional-files", _ADDITIONAL,
            "--tripinfo-output", "tripinfo.xml", "--statistic-output", "statistics.xml",
            "--begin", "0", "--end", f"{options.stop:.0f}", "--seed", str(options.seed),
            "--step-log.period", "1", "--time-to-teleport", f"{options.patience:.0f}",
            "--max-depart-delay", "-1", "--duration-log.disable", "true", *more,
        ]  # fmt: skip
        self._log = self._runner.run("sumo", arguments, on_time)


__all__ = ["SimulationError", "simulate"]
