"""Writing what a tool made: all layers or none, each with its style and its record."""

from __future__ import annotations

import contextlib
import re
import tempfile
import traceback
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsFields,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingOutputLayerDefinition,
    QgsWkbTypes,
)

from ..algorithms.errors import InputError
from . import bridge, compat, files, geopackage, styles
from .fields import LayerKind
from .record import Record, to_json

if TYPE_CHECKING:
    from .request import Request

#: Endings of the files that a database has beside it while it is written to.
_JOURNALS = ("-wal", "-shm", "-journal")
#: Endings of the files that belong to another of the same name.
_COMPANIONS = (".shx", ".dbf", ".prj", ".cpg", ".qmd", ".qml", ".qpj", ".qix")
#: Stands for all tables of a file.
_WHOLE = ""
_TABLE = re.compile(r'table="([^"]+)"')
#: What lies over what: higher numbers on top.
_OVER = {"Point": 3, "LineString": 2, "Polygon": 1}
_DATABASE = re.compile(r"dbname='([^']+)'")


@dataclass(frozen=True)
class Result:
    """What a tool hands over to be written.

    Attributes
    ----------
    crs
        CRS of the layers.
    layers
        GeoDataFrames by output key.
    numbers
        Numeric outputs by output key.
    specification
        What was asked, as JSON, for the metadata of the layers.
    keep
        Whether this is worth keeping even if the planner has cancelled meanwhile.
    credits
        Whose the data is: attribution, licence, source, date; empty for the planner's own.
    files
        Contents of the output files by key.
    """

    crs: QgsCoordinateReferenceSystem
    layers: Mapping[str, Any]
    numbers: Mapping[str, float] = field(default_factory=dict)
    specification: str = "{}"
    keep: bool = False
    credits: Mapping[str, str] = field(default_factory=dict)
    files: Mapping[str, files.Content] = field(default_factory=dict)


def destination_text(request: Request, key: str) -> str:
    """Return where an output is to go, as the planner wrote it; empty where nowhere."""
    value = request.parameters.get(key)
    if isinstance(value, QgsProcessingOutputLayerDefinition):
        text, _ = value.sink.valueAsString(request.context.expressionContext(), "")
        return str(text)
    if hasattr(value, "staticValue"):  # a QgsProperty
        text, _ = value.valueAsString(request.context.expressionContext(), "")
        return str(text)
    return str(value) if value else ""


def file_of(destination: str) -> Path | None:
    """Return the file that a destination or a data source means, or None where it is no file."""
    found = _DATABASE.search(destination)
    if destination.startswith("ogr:"):
        return Path(found.group(1)) if found else None
    path = destination.split("|", 1)[0]
    if not path or path in ("TEMPORARY_OUTPUT", "memory:") or re.match(r"^\w{2,}:", path):
        return None
    return Path(path)


def file_exists(destination: str | None) -> bool:
    """Tell whether a destination is a file that is there; temporary layers have none."""
    path = file_of(destination) if destination else None
    return path is not None and path.is_file()


def check_destinations(request: Request, keys: Iterable[str], inputs: Iterable[str]) -> None:
    """Raise `InputError` where an output cannot be written, or would destroy an input.

    Parameters
    ----------
    request
        The run.
    keys
        Keys of the output layers and files.
    inputs
        Keys of the input layers.
    """
    read = _tables_read(request, inputs)
    taken: dict[Path, dict[str, str]] = {}
    for key in keys:
        destination = destination_text(request, key)
        path = file_of(destination)
        if path is None:
            continue
        title = str(request.tool.parameterDefinition(key).description())
        _check_writable(path, title)
        place = path.resolve()
        # Of a database one table is written and the others stay; any other file goes whole.
        table = _table_of(destination, path) if destination.startswith("ogr:") else _WHOLE
        lost = _overlap(read.get(place, {}), table)
        if lost is not None:
            raise InputError(
                f"Output '{title}' would overwrite {path}, the file of the layer '{lost}' that is "
                "read.",
                "Choose another file, or another table of it.",
            )
        other = _overlap(taken.get(place, {}), table)
        if other is not None:
            raise InputError(
                f"Outputs '{other}' and '{title}' have the same file, {path}.",
                "Give each a file of its own, or save each as a table of one GeoPackage.",
            )
        taken.setdefault(place, {})[table] = title


def _tables_read(request: Request, inputs: Iterable[str]) -> dict[Path, dict[str, str]]:
    """Return the names of the input layers by their files and their tables in them."""
    read: dict[Path, dict[str, str]] = {}
    for key in inputs:
        layer = request.tool.parameterAsVectorLayer(request.parameters, key, request.context)
        path = file_of(layer.source()) if layer is not None else None
        if path is not None:
            tables = read.setdefault(path.resolve(), {})
            tables[geopackage.table_of(layer.source())] = request.name(key)
    return read


def _table_of(destination: str, path: Path) -> str:
    found = _TABLE.search(destination)
    return found.group(1) if found else path.stem


def _overlap(tables: Mapping[str, str], table: str) -> str | None:
    """Return the title of what a table shares its ground with, or None."""
    both = (title for own, title in tables.items() if _WHOLE in (own, table) or own == table)
    return next(both, None)


def _check_writable(path: Path, title: str) -> None:
    remedy = "Choose a folder in which you may write."
    folder = path.parent
    try:
        if not folder.is_dir():
            raise InputError(f"Output '{title}': there is no folder {folder}.", remedy)
        if path.exists():
            with path.open("r+b"):
                pass
        else:
            with tempfile.TemporaryFile(dir=folder):
                pass
    except OSError as error:
        text = error.strerror or str(error)
        raise InputError(f"Output '{title}': {path} cannot be written ({text}).", remedy) from error


class Writer:
    """Writes the layers of one run.

    Parameters
    ----------
    request
        The run.
    kinds
        The declared output layers by key.
    others
        The declared output files by key.
    """

    def __init__(
        self,
        request: Request,
        kinds: Mapping[str, LayerKind],
        others: Mapping[str, files.FileKind] | None = None,
    ) -> None:
        self.request = request
        self.kinds = kinds
        self.others = others or {}

    def write(self, result: Result) -> dict[str, Any]:
        """Write every layer that was asked for, and return what Processing wants to have.

        All sinks are opened before the first feature is written; where one fails, the files
        that this run has begun are taken away again.

        Raises
        ------
        QgsProcessingException
            An output cannot be written; the text says which.
        """
        begun: list[Path] = []
        try:
            begun += self._new_files()
            own = {key: self._own_style(key) for key in self.kinds}
            return self._write(result, own)
        except BaseException as error:
            # What failed still holds its files open, and would write them once more at its end.
            traceback.clear_frames(error.__traceback__)
            for path in begun:
                # What Windows still holds must not hide why it failed.
                with contextlib.suppress(OSError):
                    path.unlink(missing_ok=True)
            if not isinstance(error, (QgsProcessingException, bridge.SinkError, OSError)):
                raise
            msg = f"The outputs could not be written, none was kept: {error}"
            raise QgsProcessingException(msg) from error

    def _write(self, result: Result, own: Mapping[str, styles.OwnStyle | None]) -> dict[str, Any]:
        outputs: dict[str, Any] = {}
        sinks = {}
        sink = None
        for key, kind in self.kinds.items():
            sink, destination = self._open(key, kind, result.crs)
            if sink is not None:
                sinks[key] = sink
                outputs[key] = destination
        del sink
        for key in list(sinks):
            self._fill(key, sinks.pop(key), result)
        for key, destination in outputs.items():
            self._dress(key, destination, result, own[key])
        outputs.update(files.write(self.request, self.others, result.files))
        numbers = {key: None if value != value else value for key, value in result.numbers.items()}
        return {**outputs, **numbers}

    def _new_files(self) -> list[Path]:
        """Return the files that are not there yet and may be begun, with those beside them."""
        found = []
        for key in (*self.kinds, *self.others):
            path = file_of(destination_text(self.request, key))
            if path is not None and not path.exists():
                found.append(path)
                found += [path.with_name(path.name + ending) for ending in _JOURNALS]
                found += [path.with_suffix(ending) for ending in _COMPANIONS]
        return [path for path in found if not path.exists()]

    def _open(self, key: str, kind: LayerKind, crs: QgsCoordinateReferenceSystem) -> Any:
        request = self.request
        asked = (request.parameters, key, request.context, self._fields(key), self._wkb(key), crs)
        if kind.like:
            return request.tool.parameterAsSink(*asked, compat.COUNT_ANEW)
        return request.tool.parameterAsSink(*asked)

    def _fields(self, key: str) -> QgsFields:
        """Return the fields of an output, with those of the layer that it is like."""
        kind = self.kinds[key]
        source = self.request.source(kind.like) if kind.like else None
        return kind.qgs_fields(None if source is None else source.fields())

    def _wkb(self, key: str) -> Any:
        """Return the geometry type of an output: of several parts, if its input has them."""
        kind = self.kinds[key]
        source = self.request.source(kind.like) if kind.like else None
        if source is not None and (
            QgsWkbTypes.isMultiType(source.wkbType()) or source.wkbType() == compat.UNKNOWN
        ):
            return compat.WKB[f"Multi{kind.geometry}"]
        return kind.wkb

    def _fill(self, key: str, sink: Any, result: Result) -> None:
        kind, frame = self.kinds[key], result.layers[key]
        source = self.request.source(kind.like) if kind.like else None
        before = None
        if source is not None:
            before = bridge.attributes(source, kind.kept(source.fields()), frame, kind.renewed)
        bridge.write_frame(frame, self._fields(key), kind.kinds, sink, self._wkb(key), before)
        if hasattr(sink, "finalize"):
            sink.finalize()
        # The caller holds no other reference: the file is closed here, and complete.
        del sink

    def _own_style(self, key: str) -> styles.OwnStyle | None:
        """Return the style that the planner has stored with the file of an output."""
        destination = destination_text(self.request, key)
        path = file_of(destination)
        if path is None:
            return None
        return styles.own_style(path, _table_of(destination, path), self.kinds[key])

    def _dress(
        self, key: str, destination: str, result: Result, own: styles.OwnStyle | None
    ) -> None:
        kind = self.kinds[key]
        record = Record(
            self.request.tool.id(),
            kind.title,
            result.specification,
            to_json(result.numbers),
            result.credits,
        )
        path = file_of(destination)
        # A temporary layer has an id instead of a path.
        stored = path is not None and path.is_file()
        context: QgsProcessingContext = self.request.context
        if context.willLoadLayerOnCompletion(destination):
            details = context.layerToLoadOnCompletionDetails(destination)
            source = self._source_name()
            details.setPostProcessor(
                styles.post_processor(record.tool, key, kind, record, source=source, stored=stored)
            )
            self._group(details, kind, source)
        if stored:
            styles.save(destination, kind, own)
            record.save(destination)
            return
        # for the next tool of a model, which has the layer before it is loaded
        made = context.temporaryLayerStore().mapLayer(destination)
        if made is not None:
            record.attach(made)

    def _source_name(self) -> str:
        """Return the name of the main input layer; empty where the tool has none."""
        request = self.request
        definition = request.tool.parameterDefinition("INPUT")
        if definition is None or definition.type() != "source" or not request.has("INPUT"):
            return ""
        return request.name("INPUT")

    def _group(
        self, details: QgsProcessingContext.LayerDetails, kind: LayerKind, source: str
    ) -> None:
        """Put the layers of one run into a group, points over lines over polygons."""
        # From QGIS 3.32 on; before, Processing has one group for all results, or none.
        if len(self.kinds) > 1 and hasattr(details, "groupName"):
            title = self.request.tool.displayName()
            details.groupName = f"{title}: {source}" if source else title
        if hasattr(details, "layerSortKey"):
            details.layerSortKey = _OVER.get(kind.geometry, 0)
