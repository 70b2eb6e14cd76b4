"""Time the street rows of CND Table 1; see `_table1_rows` for how each row is set up.

The paper's seconds (Gurobi, eight cores) stand beside ours. Ours: seconds to the first valid
design, to within 5 % and 2 % of the best value that is known to us, objective at given times,
bound and gap at the end. The best known values and the designs of the levels above are kept in
`_table1_best.json`; `--update` writes better ones there. Every design is checked by
`check_design`. A row that misses a goal is marked: `!` first design after 0.3 s, `*` not within
2 % after 10 s.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

STORE = Path(__file__).with_name("_table1_best.json")
#: Seconds in which a first valid design is wanted, and in which one within 2 %.
GOALS = (0.3, 2.0, 10.0)
COLUMNS = ("row", "edges", "paper s", "first s", "5 % s", "2 % s")


class Store:
    """Best known values and designs, as a small file of JSON."""

    def __init__(self, path: Path = STORE) -> None:
        self.path = path
        found = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
        self.values: dict[str, float] = found.get("values", {})
        self.levels: dict[str, str] = found.get("levels", {})

    def level(self, name: str, edges: int) -> Any:
        """Return the fixed design of a level above, or None."""
        text = self.levels.get(name)
        if text is None:
            return None
        bits = np.unpackbits(np.frombuffer(bytes.fromhex(text), dtype=np.uint8))
        return bits[:edges].astype(bool)

    def keep_level(self, name: str, active: Any) -> None:
        """Fix the design of a level above."""
        self.levels[name] = np.packbits(active).tobytes().hex()

    def better(self, name: str, value: float) -> bool:
        """Note a value; return whether it is better than the one known."""
        if value >= self.values.get(name, math.inf) - 1e-9:
            return False
        self.values[name] = round(value, 9)
        return True

    def write(self) -> None:
        """Write the file, with what others have written there in the meantime."""
        now = Store(self.path)
        self.values |= {k: v for k, v in now.values.items() if v < self.values.get(k, math.inf)}
        self.levels = {**self.levels, **now.levels}
        found = {"values": dict(sorted(self.values.items())), "levels": self.levels}
        self.path.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


def problem_of(row: Any, all_rows: dict[str, Any], store: Store, options: Any) -> Any:
    """Make the problem of a row; solve and fix the levels above where they are not yet."""
    from platwright.network.solve import solve

    above: list[Any] = []
    for name in row.above:
        upper = all_rows[name]
        problem = upper.build(*above)
        design = store.level(name, len(problem.mesh.edges))
        if design is None:
            print(f"(fixing the design of {name} for {row.name})", file=sys.stderr)
            solver = {"seed": options.seed, "solver": options.solver}
            design = solve(problem, time_limit=options.seconds, **solver).active
            store.keep_level(name, design)
            store.write()
        above.append(design)
    return row.build(*above)


def run_row(row: Any, problem: Any, options: argparse.Namespace) -> dict[str, Any]:
    """Solve one row and check the design."""
    from _benchmark_network import run_ours, run_reference

    found = run_ours(problem, options)
    if options.reference:
        found["reference"] = run_reference(problem, options)
    return {"row": row.name, "edges": len(problem.mesh.edges), "paper": row.paper, **found}


def reached(history: list[list[float]], value: float) -> float:
    """Return the seconds after which a value was reached, infinite if never."""
    return min((when for when, found in history if found <= value + 1e-9), default=math.inf)


def finish(found: dict[str, Any], best: float) -> None:
    """Add what depends on the best known value."""
    found["best"] = best
    history = found.get("history", [])
    for name, share in (("within5", 1.05), ("within2", 1.02)):
        found[name] = reached(history, share * best) if math.isfinite(best) else math.inf
    found["marks"] = ("!" if found["first"] > GOALS[0] else "") + (
        "*" if found["within2"] > GOALS[2] else ""
    )


def line(found: dict[str, Any], options: argparse.Namespace) -> str:
    """Return a row of the printed table."""
    paper = "-" if found["paper"] is None else f"{found['paper']:g}"
    cells = [found["row"] + found["marks"], str(found["edges"]), paper]
    cells += [f"{found[key]:.2f}" for key in ("first", "within5", "within2")]
    cells += [f"{value:.6g}" for value in found["at"]]
    cells += [f"{found['best']:.6g}", f"{found['bound']:.6g}", f"{found['gap']:.1%}"]
    cells.append(f"{found.get('seconds', math.nan):.1f}")
    if options.reference:
        theirs = found["reference"]
        cells += [f"{theirs['value']:.6g}", f"{theirs['bound']:.6g}"]
    return "| " + " | ".join(cells) + " |"


def summary(table: list[dict[str, Any]]) -> str:
    """Return how many rows reach the goals."""
    count = len(table)
    first = sum(found["first"] <= GOALS[0] for found in table)
    soon, later = (sum(found["within2"] <= goal for found in table) for goal in GOALS[1:])
    return (
        f"{count} rows: first design in {GOALS[0]} s in {first}; within 2 % of the best known "
        f"in {GOALS[1]:g} s in {soon}, in {GOALS[2]:g} s in {later}."
    )


def wanted(row: Any, options: argparse.Namespace) -> bool:
    """Tell whether a row is asked for."""
    figure = row.name.split()[0]
    return row.level in options.levels and (
        not options.rows or row.name in options.rows or figure in options.rows
    )


def main(options: argparse.Namespace) -> list[dict[str, Any]]:
    """Run the rows that are asked for, print them and return them."""
    from _table1_rows import rows

    store = Store()
    all_rows = {row.name: row for row in rows()}
    heads = [*COLUMNS, *(f"@{t:g} s" for t in options.at), "best known", "bound", "gap", "s"]
    heads += ["reference", "its bound"] if options.reference else []
    print("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
    table: list[dict[str, Any]] = []
    for row in all_rows.values():
        if not wanted(row, options):
            continue
        began = time.monotonic()
        problem = problem_of(row, all_rows, store, options)
        prepared = time.monotonic() - began
        found = {**run_row(row, problem, options), "prepared": prepared}
        if store.better(row.name, found.get("value", math.inf)) and options.update:
            store.write()
        finish(found, store.values.get(row.name, math.inf))
        table.append(found)
        print(line(found, options), flush=True)
    print(summary(table))
    if options.json:
        Path(options.json).write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    return table
