"""Print and draw how well designs predict the traffic on them; see `correlation`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import pearsonr, rankdata, spearmanr

from _correlation_pictures import plans, scatter
from _correlation_study import ROOT, Row, read, rows
from _pages import write

FILES = ROOT / "figures" / "traffic"
PAGE = ROOT / "docs" / "traffic.md"
PICTURES = ROOT / "docs" / "images" / "traffic"
HEADS = (
    "| scenario | L, m | d, m | out, assigned | out, SUMO | rank of d / SUMO "
    "| within, assigned | within, SUMO | rank / SUMO |",
    "|---|---|---|---|---|---|---|---|---|",
)


@dataclass(frozen=True)
class Agreement:
    """How a figure of the design goes with one of the simulator: ranks, and straight lines."""

    spearman: float
    pearson: float


def agreement(promised: Sequence[float], driven: Sequence[float]) -> Agreement:
    """Return the correlations of two figures of the same scenarios."""
    return Agreement(
        float(spearmanr(promised, driven).statistic), float(pearsonr(promised, driven).statistic)
    )


def table(found: list[Row]) -> list[str]:
    """Return the table of a site, the ground as it is last."""
    designs = [row for row in found if row.has_exits]
    ranks = {
        key: rankdata(values, method="min")
        for key, values in (
            ("d", [row.distance for row in designs]),
            ("out", [row.kinds["out"].driven_metres for row in designs]),
            ("assigned", [row.kinds["within"].metres for row in designs]),
            ("within", [row.kinds["within"].driven_metres for row in designs]),
        )
    }
    lines = list(HEADS)
    for at, row in enumerate(designs):
        out, within = row.kinds["out"], row.kinds["within"]
        lines.append(
            f"| {row.name}: {row.says} | {row.length:,.0f} | {row.distance:.0f} "
            f"| {out.metres:.0f} m, {out.seconds:.1f} s "
            f"| {out.driven_metres:.0f} m, {out.driven_seconds:.1f} s "
            f"| {ranks['d'][at]:.0f} / {ranks['out'][at]:.0f} "
            f"| {within.metres:.0f} m, {within.seconds:.1f} s "
            f"| {within.driven_metres:.0f} m, {within.driven_seconds:.1f} s "
            f"| {ranks['assigned'][at]:.0f} / {ranks['within'][at]:.0f} |"
        )
    for row in found:
        if not row.has_exits:
            within = row.kinds["within"]
            lines.append(
                f"| {row.name}: {row.says} | | | | | | {within.metres:.0f} m, "
                f"{within.seconds:.1f} s | {within.driven_metres:.0f} m, "
                f"{within.driven_seconds:.1f} s | |"
            )
    return lines


def words(found: list[Row]) -> list[str]:
    """Return what the table says, in sentences."""
    designs = [row for row in found if row.has_exits]
    metres = {row.name: row.kinds["within"].driven_metres for row in found}
    first, second = sorted((row.name for row in designs), key=lambda name: metres[name])[:2]
    said = []
    for text, promised, driven in (
        ("ways out, *d* of the program against SUMO", [row.distance for row in designs],
         [row.kinds["out"].driven_metres for row in designs]),
        ("ways within, assigned against SUMO", [row.kinds["within"].metres for row in designs],
         [row.kinds["within"].driven_metres for row in designs]),
    ):  # fmt: skip
        own = agreement(promised, driven)
        said.append(f"{text}: ranks agree by {own.spearman:.2f} (Spearman), "
                    f"lengths by {own.pearson:.3f} (Pearson)")  # fmt: skip
    now = next(row.name for row in found if not row.has_exits)
    times = np.mean([
        kind.driven_seconds / kind.seconds for row in designs for kind in row.kinds.values()
    ])  # fmt: skip
    return [
        f"Correlation of {said[0]}; of {said[1]}. SUMO's times are {times:.2f} of the assigned "
        f"ones on the mean. Best for trips within is {first}: the next, {second}, has "
        f"{metres[second] / metres[first] - 1:.0%} longer ways, the streets that are there "
        f"{metres[now] / metres[first] - 1:.0%}.",
    ]


def main() -> None:
    """Design, drive, print, draw and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="sites; all where none is named")
    parser.add_argument("--folder", type=Path, help="pictures into here; the page stays as it is")
    given = parser.parse_args()
    folder = given.folder or PICTURES
    folder.mkdir(parents=True, exist_ok=True)
    for name in given.names or sorted(path.stem for path in FILES.glob("*.json")):
        try:
            asked = read(FILES / f"{name}.json")
        except FileNotFoundError as error:
            sys.exit(str(error))
        print(asked["says"], flush=True)
        found = []
        for row in rows(asked):
            print(f"  {row.name}: {row.says}", flush=True)
            found.append(row)
        body = [*table(found), "", *words(found)]
        print("\n".join(body), flush=True)
        for kind, draw in (("plans", plans), ("plot", scatter)):
            path = folder / f"correlation_{name}_{kind}.png"
            draw(found, asked, path)
        if given.folder is None:
            write(PAGE, name, body, "scripts/correlation")


if __name__ == "__main__":
    main()
