"""Time growth from the four grammars that ship.

Each row is one growth on open ground: processor time and wall time, what grew, and the exponent
of time against streets over all sizes of its grammar. Beside it are the seconds that CitySprout
itself needs (measured once, elsewhere, up to 10,000 streets). As a baseline of this machine and
run, the growth as published is repeated at small sizes with a search through everything, as
CitySprout does it, in place of the grids. Each growth has a process of its own, so that its memory
is its own. At the end stands how the planar growths meet what is asked of them.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import resource
import time
from pathlib import Path
from typing import Any

from _benchmark_network import import_library

#: Seconds of CitySprout at 500, 2,000, 5,000 and 10,000 streets.
CITYSPROUT = {
    "organic": {500: 0.23, 2000: 4.8, 5000: 30.0, 10_000: 111.0},
    "grid": {500: 0.34, 2000: 5.1, 5000: 30.0, 10_000: 173.0},
    "hex": {500: 0.33, 2000: 4.3, 5000: 30.0, 10_000: 263.0},
    "line": {500: 0.30, 2000: 4.7, 5000: 31.0, 10_000: 180.0},
}
#: Most CPU seconds of planar growths by streets, and most exponent of time against streets.
GOALS, EXPONENT = {10_000: 2.0, 100_000: 30.0}, 1.2
COLUMNS = (
    "grammar", "mode", "streets", "nodes", "km", "dead ends", "CPU s", "wall s", "us/street",
    "CitySprout s", "times faster", "not built", "memory MB",
)  # fmt: skip


def run(name: str, segments: int, mode: str, seed: int) -> dict[str, Any]:
    """Grow once and return what it took."""
    from platwright.growth.grammar import State
    from platwright.growth.grammars.shipped import shipped_grammar
    from platwright.growth.grow.gardener import Gardener
    from platwright.growth.rules import GrowthRules
    from platwright.growth.types import Ground, Start
    from platwright.progress import Silent

    ground = Ground((Start((0.0, 0.0), (0.0, 1.0), State("m", "Start")),))
    rules = GrowthRules(
        shipped_grammar(name), max_segments=segments, seed=seed, as_published=mode != "planar"
    )
    processor, wall = time.process_time(), time.perf_counter()
    gardener = Gardener(ground, rules, Silent())
    if mode == "no grid":
        search_everything(gardener)
    growth = gardener.run()
    return {
        "grammar": name,
        "mode": mode,
        "size": segments,
        "streets": int(growth.grown.sum()),
        "nodes": len(growth.xy),
        "km": float(growth.lengths.sum() / 1000),
        "dead ends": int((growth.degrees == 1).sum()),
        "CPU s": time.process_time() - processor,
        "wall s": time.perf_counter() - wall,
        "left": dict(sorted(gardener.builder.left.items())),
        # the most that this process ever used, libraries included
        "memory MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def apart(name: str, segments: int, mode: str, seed: int) -> dict[str, Any]:
    """Grow once in a process of its own."""
    with multiprocessing.get_context("spawn").Pool(1, import_library) as pool:
        pool.apply(run, (name, 500, mode, 0))  # imports are not counted
        return pool.apply(run, (name, segments, mode, seed))


def search_everything(gardener: Any) -> None:
    """Give all grids of a growth cells so large that every search looks at everything."""
    per = 1e-12
    for grid in (gardener.columns.points, gardener.columns.lines, *gardener.chooser.kept.values()):
        grid.per = per


def exponent(rows: list[dict[str, Any]]) -> float:
    """Return the slope of log time against log streets, NaN for fewer than two sizes."""
    x = [math.log(row["streets"]) for row in rows]
    y = [math.log(row["CPU s"]) for row in rows]
    if len(rows) < 2:
        return math.nan
    mean_x, mean_y = sum(x) / len(x), sum(y) / len(y)
    square = sum((v - mean_x) ** 2 for v in x)
    return sum((v - mean_x) * (w - mean_y) for v, w in zip(x, y)) / square


def verdicts(rows: list[dict[str, Any]]) -> list[str]:
    """Say how the planar growths meet what is asked of them, a line for each goal."""
    planar = [row for row in rows if row["mode"] == "planar"]
    lines = []
    for size, most in GOALS.items():
        seconds = [row["CPU s"] for row in planar if row["size"] == size]
        if seconds:
            worst, word = max(seconds), "met" if max(seconds) < most else "MISSED"
            lines.append(f"- {size:,} streets in {most:g} s: {word}, {worst:.2f} s at most")
    names = sorted({row["grammar"] for row in planar})
    series = [[row for row in planar if row["grammar"] == name] for name in names]
    slopes = [exponent(one) for one in series if len(one) > 1]
    if slopes:
        word = "met" if max(slopes) <= EXPONENT else "MISSED"
        lines.append(f"- exponent {EXPONENT:g}: {word}, {max(slopes):.2f} at most")
    return lines


def arguments(given: list[str] | None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    sizes = [5000, 10_000, 20_000, 50_000, 100_000]
    parser.add_argument("--streets", type=int, nargs="+", default=sizes)
    names = sorted(CITYSPROUT)
    parser.add_argument("--grammar", nargs="+", default=names, choices=names)
    parser.add_argument(
        "--mode", nargs="+", default=["planar", "published"], choices=["planar", "published"]
    )
    parser.add_argument("--seed", type=int, default=42)
    parser.add_argument("--repeat", type=int, default=1, help="the least time of so many counts")
    baseline = "streets of the runs that search through everything"
    parser.add_argument(
        "--baseline", type=int, nargs="*", default=[1000, 2000, 5000], help=baseline
    )
    parser.add_argument("--json", help="file for all that is measured")
    return parser.parse_args(given)


def main(given: list[str] | None = None) -> list[dict[str, Any]]:
    """Run the benchmark, print a table and return its rows."""
    options = arguments(given)
    print("| " + " | ".join(COLUMNS) + " |")
    print("|" + "---|" * len(COLUMNS))
    rows: list[dict[str, Any]] = []
    slopes: list[str] = []
    plans = [(mode, sorted(options.streets)) for mode in options.mode]
    if options.baseline:
        plans.append(("no grid", sorted(options.baseline)))
    for name in options.grammar:
        for mode, sizes in plans:
            series = []
            for size in sizes:
                runs = [apart(name, size, mode, options.seed) for _ in range(options.repeat)]
                series.append(min(runs, key=lambda row: row["CPU s"]))
                print(_line(series[-1]), flush=True)
            slopes.append(f"- {name}, {mode}: time ~ streets^{exponent(series):.2f}")
            rows += series
    print("\nExponents over the sizes above:\n" + "\n".join(slopes))
    print("\nMemory is the peak of the whole process, with all libraries.")
    print("\n" + "\n".join(verdicts(rows)))
    if options.json:
        Path(options.json).write_text(json.dumps(rows, indent=1), encoding="utf-8")
    return rows


def _line(row: dict[str, Any]) -> str:
    """Return a row of the table."""
    theirs = CITYSPROUT[row["grammar"]].get(row["size"])
    left = ", ".join(f"{reason} {count}" for reason, count in row["left"].items())
    cells = [
        row["grammar"],
        row["mode"],
        f"{row['streets']:,}",
        f"{row['nodes']:,}",
        f"{row['km']:,.0f}",
        f"{row['dead ends']:,}",
        f"{row['CPU s']:.2f}",
        f"{row['wall s']:.2f}",
        f"{1e6 * row['CPU s'] / row['streets']:.0f}",
        f"{theirs:g}" if theirs else "",
        f"{theirs / row['CPU s']:,.0f}" if theirs else "",
        left,
        f"{row['memory MB']:.0f}",
    ]
    return "| " + " | ".join(cells) + " |"


if __name__ == "__main__":
    main()
