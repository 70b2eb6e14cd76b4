"""Draw CND figure 12 again: objective against time, of our search and of the stochastic one.

Both get the same mesh, problem, time and core. The stochastic search is that of CND section 5.4 as
far as the paper tells it (`network.search.annealing`), in many passes of which the best counts.
"""

from __future__ import annotations

import argparse
import importlib
import math
from pathlib import Path
from typing import Any

from _benchmark_network import ROOT, import_library, value_at

COLOURS = {"ours": "#2f6f73", "stochastic": "#c8442c"}


def measured(edges: int, seconds: float, seed: int) -> dict[str, Any]:
    """Run both searches on a mesh of the paper; return what they found when."""
    from platwright.network.examples import PAPER_MESHES, paper_problem
    from platwright.network.search.annealing import anneal
    from platwright.network.solve import solve

    problem = paper_problem(PAPER_MESHES[edges](), "boundary")
    return {
        "edges": edges,
        "stochastic": anneal(problem, time_limit=seconds, seed=seed),
        "ours": solve(problem, time_limit=seconds, seed=seed),
    }


def table(rows: list[dict[str, Any]], times: list[float]) -> str:
    """Return the objectives at some times as a Markdown table."""
    heads = ["edges", "search", "first, s", *(f"at {t:g} s" for t in times), "bound"]
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for row in rows:
        for name in COLOURS:
            design = row[name]
            values = [value_at(design.history, t) for t in times]
            shown = [f"{v:g}" if math.isfinite(v) else "none" for v in values]
            bound = f"{row['ours'].bound:g}"
            cells = [str(row["edges"]), name, f"{design.history[0][0]:.2f}", *shown, bound]
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def draw(rows: list[dict[str, Any]], path: Path, seconds: float) -> None:
    """Draw objective against time, a panel for each mesh."""
    figures = importlib.import_module("matplotlib.figure")
    figure = figures.Figure(figsize=(4.6 * len(rows), 3.4), dpi=130)
    for at, row in enumerate(rows):
        axes = figure.add_subplot(1, len(rows), at + 1)
        for name, colour in COLOURS.items():
            when, values = zip(*row[name].history)
            ends = ((*when, seconds), (*values, values[-1]))
            axes.step(*ends, where="post", color=colour, label=name, linewidth=1.6)
        axes.axhline(
            row["ours"].bound, color="#9c978c", linewidth=1.0, linestyle=":", label="bound"
        )
        axes.set(xscale="log", xlabel="seconds", title=f"{row['edges']} edges", ylim=(0, None))
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
        axes.legend(frameon=False, fontsize=8)
    figure.axes[0].set_ylabel("objective")
    figure.tight_layout()
    figure.savefig(path)


def main(given: list[str] | None = None) -> list[dict[str, Any]]:
    """Run the benchmark, print a table, draw the figure and return the rows."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--edges", type=int, nargs="+", default=[312, 535])
    parser.add_argument("--seconds", type=float, default=60.0, help="of each search")
    parser.add_argument("--seed", type=int, default=1)
    picture = ROOT / "docs" / "images" / "annealing.png"
    parser.add_argument("--picture", type=Path, default=picture)
    options = parser.parse_args(given)
    import_library()
    rows = [measured(edges, options.seconds, options.seed) for edges in options.edges]
    times = [t for t in (2.0, 10.0, 60.0, 300.0) if t <= options.seconds]
    print(table(rows, times))
    draw(rows, options.picture, options.seconds)
    return rows


if __name__ == "__main__":
    main()
