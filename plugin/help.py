"""The help of a tool, written from its own declarations.

`describe` gathers what a tool declares; the help panel of QGIS and the reference pages of the
documentation are both written from it, so that neither can say anything else.
"""

from __future__ import annotations

import html
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterNumber,
)
from qgis.PyQt.QtCore import QUrl

from . import compat, parameters
from .fields import Field, LayerKind

#: Where the pictures lie: `<tool>.png`, as wide as the help panel, drawn by scripts/docs.
PICTURES = Path(__file__).with_name("pictures")
#: Width of lines in a terminal.
TERMINAL = 88


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
    picture
        What is to be seen in its picture, if it has one.
    references
        Papers and sources, by their keys in `REFERENCES`.
    """

    name: str
    title: str
    group: str
    tags: tuple[str, ...]
    summary: str
    paragraphs: tuple[str, ...] = ()
    picture: str = ""
    references: tuple[str, ...] = ()


#: Groups of the toolbox in the order of the work.
GROUPS = {
    "site": "1 Site",
    "streets": "2 Streets",
    "parcels": "3 Parcels",
    "buildings": "4 Buildings",
    "rooms": "5 Rooms",
    "measure": "6 Measure",
    "setup": "9 Set-up",
    "models": "Models",
}

#: What tools refer to.
REFERENCES = {
    "CND": (
        "C.-H. Peng, Y.-L. Yang, F. Bao, D. Fink, D.-M. Yan, P. Wonka, N. J. Mitra, "
        "Computational network design from functional specifications, "
        "ACM Transactions on Graphics 35(4), 2016."
    ),
    "UP": (
        "Y.-L. Yang, J. Wang, E. Vouga, P. Wonka, Urban pattern: layout design by hierarchical "
        "domain splitting, ACM Transactions on Graphics 32(6), 2013."
    ),
    "VANEGAS": (
        "C. A. Vanegas, T. Kelly, B. Weber, J. Halatsch, D. G. Aliaga, P. Müller, Procedural "
        "generation of parcels in urban modeling, Computer Graphics Forum 31(2), 2012."
    ),
    "CS": (
        "C. Dobbie, A. Johansson, In pursuit of the optimal city: evaluation of procedurally "
        "generated city layouts, supplementary information (CitySprout)."
    ),
    "RZ": (
        "L. Wang, W. Hua, H. Bao, Procedural modeling of residential zone subject to urban "
        "planning constraints, Entertainment Computing, ICEC 2007, Lecture Notes in Computer "
        "Science 4740."
    ),
    "SNAKES": (
        "M. Kass, A. Witkin, D. Terzopoulos, Snakes: active contour models, International Journal "
        "of Computer Vision 1(4), 1988."
    ),
    "SUMO": (
        "P. Alvarez Lopez, M. Behrisch, L. Bieker-Walz, J. Erdmann, Y.-P. Flötteröd, "
        "R. Hilbrich, L. Lücken, J. Rummel, P. Wagner, E. Wießner, Microscopic traffic "
        "simulation using SUMO, IEEE Intelligent Transportation Systems Conference, 2018."
    ),
    "OSMNX": (
        "G. Boeing, Modeling and analyzing urban networks and amenities with OSMnx, "
        "Geographical Analysis 57(4), 2025."
    ),
    "ORDER": (
        "G. Boeing, Urban spatial order: street network orientation, configuration, and entropy, "
        "Applied Network Science 4, 2019."
    ),
    "NATURAL": (
        "B. Jiang, S. Zhao, J. Yin, Self-organized natural roads for predicting traffic flow, "
        "Journal of Statistical Mechanics, 2008."
    ),
    "LIVING": (
        "B. Jiang, C. de Rijke, Structural beauty: a structure-based computational approach to "
        "quantifying the beauty of an image, Journal of Imaging 7, 2021."
    ),
    "BRANDES": (
        "U. Brandes, A faster algorithm for betweenness centrality, Journal of Mathematical "
        "Sociology 25(2), 2001."
    ),
    "BPR": "Bureau of Public Roads, Traffic assignment manual, U.S. Department of Commerce, 1964.",
    "BFW": (
        "M. Mitradjieva, P. O. Lindberg, The stiff is moving: conjugate direction Frank-Wolfe "
        "methods with applications to traffic assignment, Transportation Science 47(2), 2013."
    ),
}

#: Ends of field names and the unit that they stand for.
_UNITS = {
    "m": "m",
    "m2": "m²",
    "ha": "ha",
    "mha": "m/ha",
    "pct": "%",
    "kmh": "km/h",
    "deg": "degrees",
    "angle": "degrees",
    "similarity": "m",
    "s": "s",
    "seconds": "s",
    "hours": "h",
    "h": "vehicles/h",
    "rotation": "degrees",
}


@dataclass(frozen=True)
class Input:
    """One input: its key, texts, what values it takes, and whether it is behind Advanced."""

    key: str
    title: str
    kind: str
    default: str
    text: str
    advanced: bool
    per_feature: bool


@dataclass(frozen=True)
class Description:
    """Everything that a tool declares, ready to be written in any form.

    Attributes
    ----------
    about
        What the tool says of itself.
    inputs
        Its inputs in the order of the dialog.
    layers
        Its output layers by key.
    numbers
        What its numeric outputs say, by key.
    """

    about: About
    inputs: tuple[Input, ...]
    layers: Mapping[str, LayerKind]
    numbers: Mapping[str, str]

    @property
    def picture(self) -> Path | None:
        """The picture of the tool, or None where it has none."""
        path = PICTURES / f"{self.about.name}.png"
        return path if path.is_file() else None

    @property
    def references(self) -> tuple[str, ...]:
        """The sources in full."""
        return tuple(REFERENCES[key] for key in self.about.references)


def unit_of(field: Field) -> str:
    """Return the unit of a field, which is the last part of its name; empty where it has none."""
    return _UNITS.get(field.name.rpartition("_")[2], "") if field.kind == "number" else ""


def describe(
    about: About,
    parameters: Iterable[QgsProcessingParameterDefinition],
    layers: Mapping[str, LayerKind],
    numbers: Mapping[str, str],
) -> Description:
    """Gather what a tool declares.

    Parameters
    ----------
    about
        What the tool says of itself.
    parameters
        Its parameters, with their help; outputs among them are left out.
    layers
        Its output layers by their keys.
    numbers
        What its numeric outputs say, by their keys.
    """
    inputs = tuple(_input(p) for p in parameters if not p.isDestination())
    return Description(about, inputs, layers, numbers)


def _input(definition: QgsProcessingParameterDefinition) -> Input:
    default = definition.defaultValue()
    return Input(
        key=definition.name(),
        title=parameters.title(definition),
        kind=_kind(definition),
        default="" if default is None else _plain(default),
        text=definition.help(),
        advanced=bool(definition.flags() & compat.ADVANCED),
        per_feature=bool(definition.isDynamic()),
    )


def _plain(value: Any) -> str:
    return f"{value:g}" if isinstance(value, (int, float)) else str(value)


def _kind(definition: QgsProcessingParameterDefinition) -> str:
    """Say which values a parameter takes."""
    if isinstance(definition, QgsProcessingParameterEnum):
        return " / ".join(definition.options())
    if isinstance(definition, QgsProcessingParameterNumber):
        whole = definition.dataType() == compat.NUMBER_INTEGER
        low, high = definition.minimum(), definition.maximum()
        limits = [f"at least {low:g}"] if low > -compat.NO_LIMIT else []
        limits += [f"at most {high:.10g}"] if high < compat.NO_LIMIT else []
        return ", ".join(["whole number" if whole else "number", *limits])
    if definition.type() == "source":
        names = [compat.SOURCE_NAMES.get(kind, "any") for kind in definition.dataTypes()]
        return f"layer ({' or '.join(names)})" if names else "layer"
    words = {"string": "text", "boolean": "yes / no", "crs": "CRS", "multilayer": "layers"}
    return words.get(definition.type(), str(definition.type()))


def help_html(described: Description) -> str:
    """Return the help of a tool for the panel beside its dialog."""
    about = described.about
    parts = [f"<p>{html.escape(about.summary)}</p>"]
    if described.picture is not None:
        source = QUrl.fromLocalFile(str(described.picture)).toString()
        parts.append(f'<p><img src="{html.escape(source)}"></p>')
        parts.append(f"<p><i>{html.escape(about.picture)}</i></p>" if about.picture else "")
    parts += [f"<p>{html.escape(text)}</p>" for text in about.paragraphs]
    for heading, advanced in (("Inputs", False), ("Advanced inputs", True)):
        entries = [(i.title, "", i.text) for i in described.inputs if i.advanced == advanced]
        parts += [f"<h3>{heading}</h3>", _rows(entries)] if entries else []
    if described.layers or described.numbers:
        parts.append("<h3>Outputs</h3>")
    for kind in described.layers.values():
        fields = [(field.name, field.kind, field.text) for field in kind.fields]
        parts.append(f"<p><b>{html.escape(kind.title)}</b></p>{_rows(fields)}")
    if described.numbers:
        numbers = [(key, "", text) for key, text in described.numbers.items()]
        parts += ["<p><b>Numbers</b></p>", _rows(numbers)]
    if described.references:
        parts.append("<h3>References</h3>")
        parts += [f"<p>{html.escape(text)}</p>" for text in described.references]
    return "".join(parts)


def help_text(described: Description) -> str:
    """Return the help of a tool as plain text, for a terminal.

    `qgis_process help` lists the inputs with their help and the outputs by itself, after the
    summary; what it lacks are the rest of the text, the fields and the sources.
    """
    lines = [""]
    for text in described.about.paragraphs:
        lines += [textwrap.fill(text, TERMINAL), ""]
    for key, kind in described.layers.items():
        lines.append(f"Fields of {key} ({kind.title}):")
        for field in kind.fields:
            entry = f"{field.name} ({field.kind}): {field.text}"
            lines.append(textwrap.indent(textwrap.fill(entry, TERMINAL - 2), "  "))
        lines.append("")
    if described.references:
        lines.append("References:")
        lines += [textwrap.fill(text, TERMINAL) for text in described.references]
    return "\n".join(lines)


def _rows(entries: Iterable[tuple[str, str, str]]) -> str:
    rows = "".join(
        f"<li><b>{html.escape(name)}</b>{f' ({kind})' if kind else ''}: {html.escape(text)}</li>"
        for name, kind, text in entries
    )
    return f"<ul>{rows}</ul>"
