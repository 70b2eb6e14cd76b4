"""Give the collectors of real sites to the fast model and to the paper's own: same solver and time.

The rules are those of the paper (CND section 4: coverage, no dead ends, none too close, zigzags
priced), the mesh and the streets around are those of the site. Each problem is given to HiGHS
three times, for the same time: as windows and bounds by the search of this library, as the fast
model in one run, and as the paper's own model (CND equations 1-6 and 9-14) in one run. The last
row is what the library does by default where OR-Tools is installed. Every design found is checked
and priced by the same exact objective.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyogrio
from platwright.errors import InfeasibleError, PlatwrightError
from platwright.mip.solvers import solve_mip
from platwright.network.checks.validation import check_design
from platwright.network.cp import ortools_access
from platwright.network.evaluate import Evaluator
from platwright.network.mip.model import NetworkModel, flow_model
from platwright.network.mip.reference import reference_model
from platwright.network.problem import NetworkProblem
from platwright.network.solve import solve
from platwright.network.specification import Specification
from platwright.network.structure import Structure, structure
from platwright.site import prepare_sites
from platwright.streets import arriving_streets, site_mesh, survey
from platwright.streets.adopt import adopt_streets
from platwright.streets.make_way import make_way
from platwright.streets.program import COLLECTOR, level_problem

ROOT = Path(__file__).resolve().parents[1]
#: Access points nearer than this share of the block width are one arriving street.
SPACING = 0.5


@dataclass(frozen=True)
class Outcome:
    """What a run found: (seconds, objective) of each improvement, and a proven bound."""

    history: tuple[tuple[float, float], ...]
    bound: float
    seconds: float

    def at(self, seconds: float) -> float:
        """Return the best objective after some seconds, infinite if there was none."""
        return min((value for when, value in self.history if when <= seconds), default=math.inf)

    @property
    def value(self) -> float:
        """Best objective."""
        return self.at(math.inf)

    @property
    def gap(self) -> float:
        """Share of the objective that is not proven; 1 without a design or a bound."""
        if not (math.isfinite(self.value) and math.isfinite(self.bound)):
            return 1.0
        return max(0.0, (self.value - self.bound) / self.value) if self.value > 0 else 0.0


def data_folder() -> Path:
    """Folder of the real test data: PLATWRIGHT_TEST_DATA or ../shared/data."""
    given = os.environ.get("PLATWRIGHT_TEST_DATA")
    return Path(given) if given else ROOT.parent / "shared" / "data"


def site_problem(file: Path, spec: Specification) -> NetworkProblem:
    """Return the collector problem of a site file.

    Parameters
    ----------
    file
        With layers site, streets and perhaps obstacles.
    spec
        What is asked; its edge length is that of the mesh.
    """
    names = [name for name, _ in pyogrio.list_layers(file)]
    site, roads = (gpd.read_file(file, layer=name) for name in ("site", "streets"))
    obstacles = gpd.read_file(file, layer="obstacles") if "obstacles" in names else None
    one = prepare_sites(site, roads, obstacles).sites[0]
    arrivals = arriving_streets(one, SPACING * spec.block_width)
    mesh, adopted = adopt_streets(site_mesh(one, spec, arrivals), one, ())
    ground = survey(one, make_way(mesh, one), spec, attracted=arrivals, adopted=adopted)
    return level_problem(ground, spec, COLLECTOR, np.zeros(len(ground.mesh.edges), dtype=bool))


def checked(problem: NetworkProblem, active: np.ndarray) -> None:
    """Raise an error if a design breaks a hard rule."""
    broken = [v.text for v in check_design(problem, active) if v.hard]
    if broken:
        msg = f"the design is not valid: {broken[0]}"
        raise ValueError(msg)


def by_search(problem: NetworkProblem, solver: str, seconds: float, seed: int) -> Outcome:
    """Solve by the search of this library."""
    began = time.monotonic()
    try:
        design = solve(problem, time_limit=seconds, seed=seed, solver=solver)
    except InfeasibleError:
        return Outcome((), -math.inf, time.monotonic() - began)
    checked(problem, design.active)
    return Outcome(design.history, design.bound, time.monotonic() - began)


def by_model(
    problem: NetworkProblem, build: Callable[[Structure], NetworkModel], seconds: float
) -> Outcome:
    """Build a model and hand it to the solver; building counts.

    With distances the paper's objective is another one: then there is no bound, and its designs
    are priced by ours.
    """
    began = time.monotonic()
    model = build(structure(problem))
    found: list[tuple[float, dict[str, float]]] = []
    result = solve_mip(
        model.linear,
        time_limit=seconds - (time.monotonic() - began),
        threads=1,
        on_incumbent=lambda values: found.append((time.monotonic() - began, values)),
    )
    spent = time.monotonic() - began
    if result.values is not None:
        found.append((spent, result.values))
    price = Evaluator(problem)
    history: list[tuple[float, float]] = []
    for when, values in found:
        active = model.chosen(values)
        value = price.objective(active)
        if math.isfinite(value) and (not history or value < history[-1][1] - 1e-9):
            checked(problem, active)
            history.append((when, value))
    foreign = build is reference_model and problem.weight_distance > 0
    return Outcome(tuple(history), -math.inf if foreign else result.bound, spent)


def arguments(given: list[str] | None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="01,02,10,11,12", help="first letters of files")
    parser.add_argument("--seconds", type=float, default=20.0, help="per run")
    parser.add_argument("--at", type=float, nargs="+", default=[2.0, 10.0])
    parser.add_argument("--block-width", type=float, default=72.0, metavar="M")
    parser.add_argument("--edge-length", type=float, metavar="M", help="of the mesh")
    parser.add_argument("--weight-distance", type=float, default=0.0)
    sinks = ("streets", "boundary", "access")
    parser.add_argument("--sinks", default="streets", choices=sinks)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(given)
    options.at = [t for t in options.at if t < options.seconds]
    return options


def main(given: list[str] | None = None) -> list[tuple[str, str, Outcome]]:
    """Run the benchmark, print a table and return its rows."""
    options = arguments(given)
    wanted = [word for word in options.only.split(",") if word]
    every = sorted((data_folder() / "sites").glob("*.gpkg"))
    if not every:
        print(f"SKIPPED: there are no real sites in {data_folder()} (PLATWRIGHT_TEST_DATA)")
        every = [ROOT / "data" / "helsinki" / "helsinki_yard.gpkg"]
        wanted = []
    spec = Specification(
        rules="paper",
        sink_mode=options.sinks,
        block_width=options.block_width,
        block_length=2 * options.block_width,
        edge_length=options.edge_length,
        weight_distance=options.weight_distance,
    )
    heads = ["site", "edges", "run", "first s", *(f"@{t:g} s" for t in options.at)]
    heads += [f"@{options.seconds:g} s", "bound", "gap", "s"]
    print("| " + " | ".join(heads) + " |")
    print("|" + "---|" * len(heads))
    rows = []
    for file in every:
        if wanted and not file.name.startswith(tuple(wanted)):
            continue
        try:
            problem = site_problem(file, spec)
        except PlatwrightError as error:
            print(f"{file.stem}: {error}")
            continue
        runs: dict[str, Callable[[], Outcome]] = {
            "search": partial(by_search, problem, "highs", options.seconds, options.seed),
            "fast model": partial(by_model, problem, flow_model, options.seconds),
            "paper's model": partial(by_model, problem, reference_model, options.seconds),
        }
        if ortools_access.available():
            runs["search, CP-SAT"] = partial(
                by_search, problem, "cpsat", options.seconds, options.seed
            )
        for name, run in runs.items():
            outcome = run()
            print(_line(file.stem[:20], problem, name, outcome, options), flush=True)
            rows.append((file.stem, name, outcome))
    return rows


def _line(
    site: str, problem: NetworkProblem, name: str, outcome: Outcome, options: argparse.Namespace
) -> str:
    """Return a row of the table."""
    first = outcome.history[0][0] if outcome.history else math.inf
    cells = [site, str(int(problem.candidate.sum())), name, f"{first:.2f}"]
    cells += [_number(outcome.at(t)) for t in (*options.at, math.inf)]
    cells += [_number(outcome.bound), f"{outcome.gap:.0%}", f"{outcome.seconds:.1f}"]
    return "| " + " | ".join(cells) + " |"


def _number(value: float) -> str:
    """Return a number, or that there is none."""
    return f"{value:.1f}" if math.isfinite(value) else "none"


if __name__ == "__main__":
    main()
