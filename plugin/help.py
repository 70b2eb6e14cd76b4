"""The help of a tool, written from its own declarations."""

from __future__ import annotations

import html
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from qgis.core import QgsProcessingParameterDefinition

from .fields import LayerKind


@dataclass(frozen=True)
class About:
    """What a tool says of itself, in one place.

    Attributes
    ----------
    name
        The id of the tool for ever: lower case, no separators.
    title
        The name in the toolbox.
    group
        Key of the group, see `GROUPS`.
    tags
        Words that find the tool in the toolbox.
    summary
        What it does, in one sentence.
    paragraphs
        What a planner should know before the first run.
    """

    name: str
    title: str
    group: str
    tags: tuple[str, ...]
    summary: str
    paragraphs: tuple[str, ...] = ()


#: Groups of the toolbox in the order of the work.
GROUPS = {"site": "1 Site", "streets": "2 Streets", "measure": "6 Measure"}


def _rows(entries: Iterable[tuple[str, str]]) -> str:
    rows = "".join(
        f"<li><b>{html.escape(name)}</b>: {html.escape(text)}</li>" for name, text in entries
    )
    return f"<ul>{rows}</ul>"


def help_html(
    about: About,
    parameters: Iterable[QgsProcessingParameterDefinition],
    layers: Mapping[str, LayerKind],
    numbers: Mapping[str, str],
) -> str:
    """Return the help text of a tool as HTML.

    Parameters
    ----------
    about
        What the tool says of itself.
    parameters
        Its parameters, with their help.
    layers
        Its output layers by their keys; their fields are listed.
    numbers
        What its numeric outputs say, by their keys.
    """
    described = [p for p in parameters if not p.isDestination()]
    parts = [f"<p>{html.escape(about.summary)}</p>"]
    parts += [f"<p>{html.escape(text)}</p>" for text in about.paragraphs]
    parts += ["<h3>Inputs</h3>", _rows((p.description(), p.help()) for p in described)]
    parts.append("<h3>Outputs</h3>")
    for kind in layers.values():
        entries = [(field.name, field.text) for field in kind.fields]
        parts.append(f"<p><b>{html.escape(kind.title)}</b></p>{_rows(entries)}")
    if numbers:
        parts += ["<p><b>Numbers</b></p>", _rows(numbers.items())]
    return "".join(parts)
