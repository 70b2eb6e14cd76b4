"""Time the network solver on large meshes: 10,000 edges in a minute, 100,000 in five.

Each row is one run of `solve`: seconds to prepare the problem, to the first valid design, the
first and the last objective, and the most memory that the whole program has used so far. "cut"
meshes are grids with a block cut away at each corner.
"""

from __future__ import annotations

import argparse
import gc
import math
import resource
import time
from collections.abc import Callable, Iterator
from typing import Any

COLUMNS = ("mesh", "edges", "sinks", "prepared s", "first s", "first", "end", "windows' gain")
#: Most memory that is allowed, in GB.
MEMORY = 4.0


def cases(options: argparse.Namespace) -> Iterator[tuple[str, str, float, Callable[[], Any]]]:
    """Yield name, sinks, seconds and maker of each mesh."""
    from platwright.mesh.grids import grid
    from platwright.network.examples import cut_grid

    corners = ((14, 10), (12, 18), (9, 20), (20, 11))
    minute = min(60.0, options.seconds)
    for sinks in options.scenario:
        yield "70 x 70", sinks, minute, lambda: grid(70, 70)
        yield "cut", sinks, minute, lambda: cut_grid(78, 72, corners)
    if options.seconds > minute:
        for sinks in (name for name in options.scenario if name != "inner"):
            yield "223 x 223", sinks, options.seconds, lambda: grid(223, 223)


def memory() -> float:
    """Return the most memory that was used so far, in GB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9


def main(options: argparse.Namespace) -> list[dict[str, Any]]:
    """Run all cases, print them and return them."""
    from platwright.network.examples import paper_problem

    from _benchmark_network import run_ours

    heads = [*COLUMNS, "s", "GB"]
    print("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
    table = []
    for name, sinks, seconds, make in cases(options):
        began = time.monotonic()
        problem = paper_problem(make(), sinks)
        prepared = time.monotonic() - began
        settings = argparse.Namespace(**{**vars(options), "seconds": seconds})
        found = run_ours(problem, settings)
        first = found["history"][0][1] if found["history"] else math.inf
        end = found.get("value", math.inf)
        found |= {"mesh": name, "edges": len(problem.mesh.edges), "sinks": sinks, "GB": memory()}
        table.append(found)
        cells = [name, str(found["edges"]), sinks, f"{prepared:.1f}", f"{found['first']:.1f}"]
        cells += [f"{first:g}", f"{end:g}", f"{1 - end / first:.1%}"]
        cells += [f"{found.get('seconds', math.nan):.1f}", f"{found['GB']:.2f}"]
        print("| " + " | ".join(cells) + " |", flush=True)
        gc.collect()
    if table[-1]["GB"] > MEMORY:
        print(f"more than {MEMORY:g} GB were used")
    return table
