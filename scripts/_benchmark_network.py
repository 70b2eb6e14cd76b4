"""Time the network solver on meshes of the paper's sizes.

Each row is one run of `solve` on a grid of about the size that the paper reports (CND table 1),
in one scenario and with one objective: seconds to the first valid design, objective at given
times, bound and gap at the end; beside it the paper's own model, given to HiGHS for the same
time. The meshes of 535 and 660 edges are ours, cut from grids, since the paper's are not
published: its seconds are no comparison for them.
"""

from __future__ import annotations

import argparse
import importlib.util
import math
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

ROOT = Path(__file__).resolve().parents[1]

#: Names of the objectives and what they change.
OBJECTIVES: dict[str, dict[str, float]] = {
    "length": {},
    "distance": {"weight_length": 0.0, "weight_distance": 1.0},
    "both": {"weight_length": 5.0, "weight_distance": 1.0},
}


def import_library() -> None:
    """Make `platwright` mean the library of this repository."""
    if "platwright" in sys.modules:
        return
    folder = ROOT / "algorithms"
    spec = importlib.util.spec_from_file_location(
        "platwright", folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    if spec is None or spec.loader is None:
        msg = f"{folder} is not a package"
        raise ImportError(msg)
    module = importlib.util.module_from_spec(spec)
    sys.modules["platwright"] = module
    spec.loader.exec_module(module)


def set_clock() -> None:
    """Let runs count the processor time of all their threads instead of the time of day.

    Others on the same machine disturb that little. With two threads at work it is up to twice
    the time that an idle machine would show.
    """
    from platwright import progress

    progress.time = SimpleNamespace(monotonic=time.process_time)


def value_at(history: tuple[tuple[float, float], ...], seconds: float) -> float:
    """Return the best objective known after some seconds, infinite if there was none."""
    return min((value for when, value in history if when <= seconds), default=math.inf)


def run_ours(problem: Any, options: argparse.Namespace) -> dict[str, Any]:
    """Solve a problem and check the design."""
    from platwright.errors import InfeasibleError
    from platwright.network.checks.validation import check_design
    from platwright.network.solve import solve

    try:
        design = solve(
            problem,
            time_limit=options.seconds,
            gap=options.gap,
            seed=options.seed,
            solver=options.solver,
        )
    except InfeasibleError:
        none = [math.inf for _ in options.at]
        return {"first": math.inf, "at": none, "bound": 0.0, "gap": 1.0, "history": []}
    broken = [v.text for v in check_design(problem, design.active) if v.hard]
    if broken:
        msg = f"the design is not valid: {broken[0]}"
        raise ValueError(msg)
    return {
        "first": design.history[0][0],
        "at": [value_at(design.history, t) for t in options.at],
        "value": design.objective,
        "bound": design.bound,
        "gap": design.gap,
        "seconds": design.seconds,
        "stopped": design.stopped,
        "history": [list(entry) for entry in design.history],
    }


def run_reference(problem: Any, options: argparse.Namespace) -> dict[str, float]:
    """Give the paper's own model to HiGHS for the same time."""
    from platwright.mip.solvers import solve_mip
    from platwright.network.evaluate import Evaluator
    from platwright.network.mip.reference import reference_model
    from platwright.network.structure import structure

    began = time.monotonic()
    model = reference_model(structure(problem))
    result = solve_mip(model.linear, time_limit=options.seconds, threads=1)
    value = math.inf
    if result.values is not None:
        value = Evaluator(problem).objective(model.chosen(result.values))
    # with distances its objective is another one: only its design can be compared
    bound = result.bound if problem.weight_distance == 0 else math.nan
    return {"value": value, "bound": bound, "seconds": time.monotonic() - began}


def arguments(given: list[str] | None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--edges", type=int, nargs="+", default=[312, 535, 660, 1012, 1200])
    names = ["boundary", "one sink", "inner"]
    parser.add_argument("--scenario", nargs="+", default=names, choices=names)
    default = ["length", "distance"]
    parser.add_argument("--objective", nargs="+", default=default, choices=sorted(OBJECTIVES))
    parser.add_argument("--seconds", type=float, default=60.0, help="per run")
    parser.add_argument("--at", type=float, nargs="+", default=[2.0, 10.0, 60.0])
    parser.add_argument("--gap", type=float, default=0.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--solver", default="auto")
    parser.add_argument("--no-reference", action="store_true", help="leave the paper's model out")
    clock = "what seconds are; on a busy machine 'cpu': those that all threads worked in all"
    parser.add_argument("--clock", default="wall", choices=["wall", "cpu"], help=clock)
    scale = "meshes of 10,000 edges, with --seconds 300 also of 100,000; see _scale_network.py"
    parser.add_argument("--scale", action="store_true", help=scale)
    table = parser.add_argument_group("the paper's table", "see _table1.py")
    table.add_argument("--table1", action="store_true", help="the street rows of CND table 1")
    table.add_argument("--rows", nargs="+", default=[], help="figures or rows, such as 6a")
    table.add_argument("--levels", type=int, nargs="+", default=[2, 3, 4], choices=[2, 3, 4])
    table.add_argument("--reference", action="store_true", help="the paper's model beside ours")
    table.add_argument("--update", action="store_true", help="keep better values as best known")
    table.add_argument("--json", help="file for all that is measured")
    return parser.parse_args(given)


def main(given: list[str] | None = None) -> list[dict[str, Any]]:
    """Run the benchmark, print a table and return its rows."""
    options = arguments(given)
    import_library()
    if options.clock == "cpu":
        set_clock()
    if options.scale:
        import _scale_network

        return _scale_network.main(options)
    if options.table1:
        import _table1

        return _table1.main(options)
    from platwright.network.examples import PAPER_MESHES, paper_problem

    heads = [f"@{t:g} s" for t in options.at]
    columns = ["edges", "scenario", "objective", "first s", *heads, "end", "bound", "gap", "s"]
    print("| " + " | ".join([*columns, "stopped", "reference", "its bound"]) + " |")
    print("|" + "---|" * (len(columns) + 3))
    rows = []
    for size in options.edges:
        mesh = PAPER_MESHES[size]()
        for scenario in options.scenario:
            for objective in options.objective:
                problem = paper_problem(mesh, scenario, **OBJECTIVES[objective])
                ours = run_ours(problem, options)
                theirs: dict[str, float] = {}
                if not options.no_reference:
                    theirs = run_reference(problem, options)
                row = {"edges": len(mesh.edges), "scenario": scenario, "objective": objective}
                rows.append({**row, **ours, "reference": theirs})
                print(_line(rows[-1]), flush=True)
    return rows


def _line(row: dict[str, Any]) -> str:
    """Return a row of the table."""
    cells = [str(row[key]) for key in ("edges", "scenario", "objective")]
    cells.append(f"{row['first']:.2f}")
    cells += [f"{value:g}" for value in row["at"]]
    end = (row.get("value", math.inf), row["bound"], row["gap"], row.get("seconds", math.nan))
    cells += [f"{end[0]:g}", f"{end[1]:.1f}", f"{end[2]:.0%}", f"{end[3]:.1f}"]
    cells.append(row.get("stopped", "none"))
    theirs = row["reference"]
    cells += [f"{theirs.get('value', math.nan):g}", f"{theirs.get('bound', math.nan):.1f}"]
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
