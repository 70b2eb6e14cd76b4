"""What layers tell of themselves: how they were made, what came out, what is wrong, whose they are.

Only QGIS is asked here; what a page makes of it is told in `algorithms/report`.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsApplication,
    QgsExpression,
    QgsFeatureRequest,
    QgsMapLayer,
    QgsSingleSymbolRenderer,
    QgsVectorLayer,
    QgsWkbTypes,
)

from ..algorithms.errors import CancelledError
from ..algorithms.report import (
    Credit,
    Figure,
    InputFacts,
    LayerFacts,
    LayerRow,
    Problem,
    Run,
    figures_of,
    wishes_of,
)
from . import compat, fields, report_words, styles
from .fields import Field, LayerKind
from .help import unit_of
from .outputs import file_of
from .progress import FeedbackProgress
from .record import read_record
from .symbols import GREY, fill, line, marker

#: The field that tells designs apart in one layer.
DESIGN = "design"
#: Fields of a layer of problems.
_PROBLEM = tuple(own.name for own in fields.PROBLEMS.fields)
#: Features between two looks at the Cancel button.
_CHUNK = 500
#: Providers of QGIS that read files.
_FILES = ("ogr", "gdal", "delimitedtext", "spatialite")
#: Fields that the layers of OpenStreetMap have.
_OSM = "osm_id"
_OSM_CREDIT = "© OpenStreetMap contributors, if it comes from there: its fields look so"


@dataclass
class Shown:
    """One layer of a report.

    Attributes
    ----------
    layer
        The layer.
    key
        Tells it from the others.
    record
        How it was made, see `record`; empty where nobody tells.
    designs
        Values of its field `design`; empty where it has none.
    source
        Where it came from, before any copy was made.
    own
        Whether the planner sees it in QGIS: then it keeps the style and the name it has there.
    name
        What it was called before any copy was made.
    """

    layer: QgsMapLayer
    key: str
    record: Mapping[str, str] = field(default_factory=dict)
    designs: tuple[str, ...] = ()
    source: str = ""
    own: bool = False
    name: str = ""

    @property
    def tool(self) -> str:
        """Name of the tool that made it, without its provider."""
        return self.record.get("tool", "").rpartition(":")[2]

    @property
    def file(self) -> Path | None:
        """Its file, or None where it is none: other sources may hold a password."""
        if self.layer.providerType() not in _FILES:
            return None
        return file_of(self.source.partition("?")[0])

    @property
    def table(self) -> bool:
        """Whether it has no shapes."""
        vector = isinstance(self.layer, QgsVectorLayer)
        return vector and self.layer.wkbType() == compat.WKB["NoGeometry"]

    @property
    def tells_problems(self) -> bool:
        """Whether it is a layer of problems."""
        return isinstance(self.layer, QgsVectorLayer) and set(_PROBLEM) <= set(
            self.layer.fields().names()
        )

    @property
    def measure(self) -> bool:
        """Whether a tool made it that measures what is there."""
        tool = _tool(self.tool)
        return tool is not None and tool.groupId() == "measure"

    def facts(self) -> LayerFacts:
        """Return what decides of which design it is."""
        path = self.file
        # a row about a design that a tool measured goes with that design
        own = () if self.table and self.record and len(self.designs) < 2 else self.designs
        return LayerFacts(
            self.key,
            self.name,
            self.tool,
            self.record.get("specification", ""),
            self.record.get("result", ""),
            str(path.resolve()) if path is not None else "",
            own,
        )

    def row(self) -> LayerRow:
        """Return the line about it in the list of layers."""
        layer, tool = self.layer, _tool(self.tool)
        vector = isinstance(layer, QgsVectorLayer)
        path = self.file
        crs = layer.crs()
        return LayerRow(
            layer.name(),
            tool.displayName() if tool is not None else self.tool,
            layer.featureCount() if vector else None,
            path.name if path is not None else f"{layer.providerType()} layer",
            "none, a table" if self.table else crs.authid() or crs.description() or "not known",
        )


def read(shown: Shown, progress: FeedbackProgress) -> None:
    """Read what a layer tells, and give it its style unless it has one in QGIS.

    That is the style that lies with its file, or that of its kind.
    """
    layer = shown.layer
    if not isinstance(layer, QgsVectorLayer):
        return
    shown.record = read_record(layer)
    shown.designs = _designs(layer, progress)
    if shown.own:
        return
    kind = kind_of(layer, shown.tool)
    if kind is not None:
        layer.setName(kind.title)
    if shown.table or layer.loadDefaultStyle()[1]:
        return
    if kind is not None:
        styles.apply(layer, kind)
    else:
        _plain_style(layer)


def _plain_style(layer: QgsVectorLayer) -> None:
    """Give a layer that nobody has styled a look that does not drown the others."""
    plain = {"Point": marker("circle", GREY, 1.4), "LineString": line("#c9c4ba", 0.5)}
    symbol = plain.get(shape_of(layer), fill("#f4f1ea", GREY, 0.4))
    layer.setRenderer(QgsSingleSymbolRenderer(symbol))


def shape_of(layer: QgsVectorLayer) -> str:
    """Return the type of a layer's shapes without parts, heights and measures."""
    text = QgsWkbTypes.displayString(QgsWkbTypes.flatType(layer.wkbType()))
    return str(text).removeprefix("Multi")


def _designs(layer: QgsVectorLayer, progress: FeedbackProgress) -> tuple[str, ...]:
    """Return the values of the field `design` in their order."""
    at = layer.fields().lookupField(DESIGN)
    if at < 0:
        return ()
    request = QgsFeatureRequest().setSubsetOfAttributes([at]).setFlags(compat.NO_GEOMETRY)
    found: dict[str, None] = {}
    for count, feature in enumerate(layer.getFeatures(request)):
        if count % _CHUNK == 0 and progress.cancelled():
            raise CancelledError
        if not compat.is_null(feature[at]):
            found.setdefault(str(feature[at]))
    return tuple(found)


def kind_of(layer: QgsVectorLayer, tool: str) -> LayerKind | None:
    """Return which kind of output a layer looks like by its fields, or None.

    In a model layers are handed on before they get their style and their record.
    """
    names = set(layer.fields().names())
    shape = shape_of(layer)
    made = _tool(tool)
    tools = [made] if made is not None else _tools()
    kinds = [kind for own in tools for kind in getattr(own, "layers", {}).values()]
    fitting = [
        kind
        for kind in kinds
        if kind.geometry.removeprefix("Multi") == shape
        and {own.name for own in kind.fields} <= names
    ]
    return max(fitting, key=lambda kind: len(kind.fields), default=None)


def _tools() -> list[Any]:
    provider = QgsApplication.processingRegistry().providerById("platwright")
    return list(provider.algorithms()) if provider is not None else []


def _tool(name: str) -> Any:
    """Return a tool, or None where there is none of that name."""
    if not name:
        return None
    return QgsApplication.processingRegistry().algorithmById(f"platwright:{name}")


def runs_of(layers: Iterable[Shown], design: str) -> tuple[Run, ...]:
    """Return the runs that made some layers of a design, and the tables that tell of it."""
    runs: dict[tuple[str, ...], Run] = {}
    for own in layers:
        if own.table and own.facts().designs:
            runs[("table", own.key)] = _run_of_table(own, design)
        elif own.record:
            key = tuple(own.record.get(part, "") for part in ("tool", "specification", "result"))
            runs.setdefault(key, _run(own))
    return tuple(run for run in runs.values() if run.figures or run.wishes)


def _run(shown: Shown) -> Run:
    tool = _tool(shown.tool)
    labels: dict[str, str] = {}
    inputs: dict[str, InputFacts] = {}
    if tool is not None:
        labels = dict(getattr(tool, "numbers", {}))
        inputs = report_words.inputs_of(tool)
    return Run(
        shown.tool,
        tool.displayName() if tool is not None else shown.tool,
        wishes_of(shown.record.get("specification", ""), inputs),
        figures_of(_json(shown.record.get("result", "")), labels),
    )


def _json(text: str) -> dict[str, Any]:
    try:
        values = json.loads(text or "{}")
    except (ValueError, RecursionError):
        return {}
    return values if isinstance(values, dict) else {}


def _run_of_table(shown: Shown, design: str) -> Run:
    """Return the first row about a design in a table as figures."""
    layer = shown.layer
    found: list[Figure] = []
    for feature in layer.getFeatures():
        if str(feature[DESIGN]) != design:
            continue
        for own in layer.fields():
            value = feature[own.name()]
            if own.isNumeric() and own.name() != "fid" and not compat.is_null(value):
                unit = unit_of(Field(own.name(), "number", ""))
                (one,) = figures_of({own.name(): float(value)}, {})
                found.append(Figure(one.key, one.label, one.value, unit))
        break
    return Run(shown.tool or shown.layer.name(), shown.layer.name(), (), tuple(found))


def problems_of(layers: Iterable[Shown], progress: FeedbackProgress) -> tuple[Problem, ...]:
    """Return the entries of the layers of problems among some layers, each once."""
    found: dict[Problem, None] = {}
    for own in layers:
        if not own.tells_problems:
            continue
        for count, feature in enumerate(own.layer.getFeatures()):
            if count % _CHUNK == 0 and progress.cancelled():
                raise CancelledError
            values = (feature[name] for name in _PROBLEM)
            words = ["" if compat.is_null(value) else str(value) for value in values]
            found.setdefault(Problem(*words))
    return tuple(found)


def credits_of(layers: Sequence[Shown]) -> tuple[Credit, ...]:
    """Return whose the data of some layers is, as far as they tell."""
    found = []
    for own in layers:
        told = _json(own.record.get("credits", ""))
        metadata = own.layer.metadata()
        links = [link.url for link in metadata.links() if link.url]
        rights = told.get("attribution") or ", ".join(filter(None, metadata.rights()))
        licences = told.get("licence") or ", ".join(filter(None, metadata.licenses()))
        names = own.layer.fields().names() if isinstance(own.layer, QgsVectorLayer) else []
        if not rights and not licences and _OSM in names:
            rights, licences = _OSM_CREDIT, "ODbL 1.0"
            links.append("https://www.openstreetmap.org/copyright")
        if rights or licences or links or told.get("source"):
            source, date = str(told.get("source", "")), str(told.get("date", ""))
            # a file is told by its name: folders are nobody's business
            source = source if "://" in source else Path(source).name
            name = own.layer.name()
            found.append(Credit(name, str(rights), str(licences), source, date, tuple(links)))
    return tuple(found)


def only_design(shown: Shown, design: str, progress: FeedbackProgress) -> Shown:
    """Return a layer with those features only whose field `design` has a value."""
    layer = shown.layer
    if shown.table or not isinstance(layer, QgsVectorLayer):
        return shown
    at = layer.fields().lookupField(DESIGN)
    values = {own for own in layer.uniqueValues(at) if str(own) == design}
    text = " OR ".join(
        QgsExpression.createFieldEqualityExpression(layer.fields().at(at).name(), value)
        for value in sorted(values, key=str)
    )
    request = QgsFeatureRequest().setFilterExpression(text or "false")
    made = layer.materialize(request, progress.feedback)
    if progress.cancelled():
        raise CancelledError
    made.setName(layer.name())
    if layer.renderer() is not None:
        made.setRenderer(layer.renderer().clone())
    if layer.labeling() is not None:
        made.setLabeling(layer.labeling().clone())
        made.setLabelsEnabled(layer.labelsEnabled())
    made.setOpacity(layer.opacity())
    return dataclasses.replace(shown, layer=made)
