"""Design, check and draw the figures of the paper again; see figures/README.md.

Usage: _figures.py [NAME ...], such as 2a 8d; without a name, all of them. Ends with an error if a
design breaks what was asked for, or figures do not relate to each other as in the paper.
"""

from __future__ import annotations

import operator
import sys

from _figures_design import FIGURES, ROOT, FigureError, Numbers, design, read
from _figures_drawing import draw

PICTURES = ROOT / "docs" / "images" / "figures"
#: What holds between figures: the one, its number, how it compares, and the other or a limit.
RELATIONS = [
    ("2b", "mean", "<", "2a"),
    ("2a", "length", "<", "2b"),
    ("2c", "within", "<", "2b"),
    ("2f", "mean", "<", "2e"),
    ("2e", "length", "<", "2f"),
    ("2g", "within", "<", "2f"),
    ("6b", "mean", "<", "6a"),
    ("6a", "length", "<", "6b"),
    ("6c", "exits", "<=", 1.0),
    ("8d", "mean", "<", "8c"),
    ("8d", "length", ">", "8c"),
    ("8e", "exits", "<=", 3.0),
]
COMPARE = {"<": operator.lt, ">": operator.gt, "<=": operator.le}


def names() -> list[str]:
    """Return the names of all figures."""
    return sorted(path.stem for path in FIGURES.glob("*.json"))


def line(numbers: Numbers) -> str:
    """Write the figures of a design."""
    shown = {k: numbers[k] for k in ("length", "mean", "farthest", "within", "exits", "objective",
                                     "bound") if k in numbers}  # fmt: skip
    parts = [f"{key} {value:.2f}".rstrip("0").rstrip(".") for key, value in shown.items()]
    return f"{', '.join(parts)}, gap {100 * numbers['gap']:.1f} %, {numbers['seconds']:.1f} s"


def relations(found: dict[str, Numbers]) -> list[str]:
    """Print the relations between figures that were made; return those that do not hold."""
    wrong = []
    for name, key, sign, other in RELATIONS:
        if name not in found or (isinstance(other, str) and other not in found):
            continue
        own = found[name][key]
        limit = found[other][key] if isinstance(other, str) else other
        of = f" of {other}" if isinstance(other, str) else ""
        holds = COMPARE[sign](own, limit)
        text = f"{key} of {name}: {own:.2f} {sign} {limit:.2f}{of}"
        print(text if holds else f"{text}: DOES NOT HOLD")
        if not holds:
            wrong.append(text)
    row = found.get("5", {})
    steps = [(row[f"length {i}"], row[f"mean {i}"]) for i in range(5)] if row else []
    if steps:
        print("5:", "; ".join(f"{a:.0f} edges, {b:.2f}" for a, b in steps))
        if not (steps[0][0] < steps[-1][0] and steps[0][1] > steps[-1][1]):
            wrong.append("5: lengths and ways do not go opposite ways")
    return wrong


def main() -> None:
    """Make the figures that are named."""
    wanted = sys.argv[1:] or names()
    unknown = sorted(set(wanted) - set(names()))
    if unknown:
        sys.exit(f"No such figure: {', '.join(unknown)}. There are {', '.join(names())}.")
    found: dict[str, Numbers] = {}
    for name in wanted:
        try:
            made = design(read(name))
        except FigureError as error:
            sys.exit(str(error))
        path = draw(name, made, PICTURES)
        found[name] = dict(made[0].numbers)
        for i, own in enumerate(made):
            found[name].update({f"{key} {i}": value for key, value in own.numbers.items()})
            title = getattr(own, "title", "")
            print(f"{name} {title}".strip() + f": {line(own.numbers)}", flush=True)
        print(f"    {path.relative_to(ROOT)}, {path.stat().st_size / 1000:.0f} kB", flush=True)
    wrong = relations(found)
    if wrong:
        sys.exit("Not as in the paper: " + "; ".join(wrong))


if __name__ == "__main__":
    main()
