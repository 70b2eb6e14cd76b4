"""A page that holds the plot, the table and the plans, and needs nothing from elsewhere."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from html import escape
from typing import Any

from .design import FIGURES
from .drawing import picture, plot
from .parameters import PARAMETERS
from .tradeoffs import Exploration, Explored

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #2c2a26; margin: 2em auto; max-width: 70em;
  padding: 0 1em; }
table { border-collapse: collapse; font-size: 13px; }
th, td { padding: .25em .6em; text-align: right; border-bottom: 1px solid #e3ded2; }
th { vertical-align: bottom; } td.text, th.text { text-align: left; }
tr.front td { background: #e4efee; font-weight: 600; }
img { max-width: 100%; } figure { margin: 1.5em 0; overflow-x: auto; }
"""
_DIGITS = {"gap": 3, "objective": 2, "bound": 2, "seconds": 1}
_HEADS = {
    "length_m": "length, m", "mean_distance_m": "mean way out, m",
    "max_distance_m": "longest way out, m", "objective": "price", "bound": "bound", "gap": "gap",
    "seconds": "time, s", "dead_ends": "dead ends", "blocks": "blocks", "violations": "violations",
}  # fmt: skip


def page(exploration: Exploration, title: str = "Trade-offs") -> str:
    """Return an HTML page with the plot, the table and the plans of all designs.

    Parameters
    ----------
    exploration
        The designs.
    title
        Head of the page.

    Returns
    -------
    str
        The page; it asks nothing of the network.

    Raises
    ------
    InputError
        There is no design to show.
    MissingDependencyError
        matplotlib is not installed.
    """
    names = " and ".join(FIGURES[name] for name in exploration.columns)
    parts = [
        f"<h1>{escape(title)}</h1>",
        f"<p>{len(exploration.done)} of {len(exploration.designs)} designs were made. Those that "
        f"no other is better than in {escape(names)} stand out.</p>",
        _figure(plot(exploration, "svg"), "svg+xml", "Length against distance"),
        f"<figure>{_table(exploration)}</figure>",
        _figure(picture(exploration, "png"), "png", "All plans at one scale"),
    ]
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>'
    body = "\n".join(parts)
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def _figure(data: bytes, kind: str, alt: str) -> str:
    text = base64.b64encode(data).decode("ascii")
    return f'<figure><img alt="{alt}" src="data:image/{kind};base64,{text}"></figure>'


def _table(exploration: Exploration) -> str:
    varied = exploration.varied
    labels = [PARAMETERS[key].label if key in PARAMETERS else "exits" for key in varied]
    heads = ["design", *labels, *(_HEADS[key] for key in FIGURES), "remark"]
    top = "".join(f"<th>{escape(head)}</th>" for head in heads)
    rows = "\n".join(
        _row(one, [row[key] for key in varied])
        for one, (_, row) in zip(exploration.designs, exploration.table().iterrows())
    )
    return f"<table><thead><tr>{top}</tr></thead>\n<tbody>\n{rows}\n</tbody></table>"


def _row(one: Explored, values: Sequence[Any]) -> str:
    cells = [f"<td>{one.run.number}</td>"]
    cells += [f"<td>{escape(_shown(value))}</td>" for value in values]
    for key in FIGURES:
        number = one.figures.get(key, math.nan)
        text = f"{number:.{_DIGITS.get(key, 0)}f}" if math.isfinite(number) else ""
        cells.append(f"<td>{text}</td>")
    remark = one.reason or ("cancelled" if one.state == "cancelled" else "")
    cells.append(f'<td class="text">{escape(remark)}</td>')
    return f'<tr class="{"front" if one.pareto else one.state}">{"".join(cells)}</tr>'


def _shown(value: Any) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "as usual"
    if isinstance(value, float):
        return "forbidden" if math.isinf(value) else f"{value:g}"
    return str(value)
