"""Runs a tool in a Python process of its own, where the packages cannot work in that of QGIS.

That is so where another plugin, or QGIS itself, loaded shapely or pyproj first and bound it to
the wrong libraries (`deps.ClashError`); such a binding lasts until QGIS ends. The input layers
go through GeoPackages as Processing sees them (selection, filters, edits), the parameters and
the progress as JSON, and the outputs come back through GeoPackages: nothing in this module needs
any of the packages. In the process the same tool runs with a QGIS without a window; see
`worker_process`.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import qgis
from qgis.core import (
    QgsApplication,
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsFeatureRequest,
    QgsProcessingParameterDefinition,
    QgsProcessingUtils,
    QgsProperty,
    QgsRasterLayer,
    QgsVectorFileWriter,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QProcess

from ..algorithms.errors import CancelledError, InputError
from . import bridge, compat, deps, files, settings
from .installer_process import InstallError, environment, find_python, stop, temporary_folder
from .outputs import Result, Writer
from .progress import FeedbackProgress
from .record import read_record

if TYPE_CHECKING:
    from .request import Request
    from .tool import Tool

#: Name of the column with the feature id, which must not be that of a field.
_FID = "platwright_fid"
#: How long a cancelled run may take to hand over what it has (s).
PATIENCE = 20.0
_POLL_MS = 100
_PROGRAM = Path(__file__).with_name("worker_process.py")
_ROOT = Path(__file__).absolute().parents[1]


class WorkerError(deps.DependencyError):
    """The process failed; the text is what it said, or why it could not begin."""


def compute(tool: Tool, request: Request, progress: FeedbackProgress) -> Result:
    """Run a tool in a process of its own.

    Parameters
    ----------
    tool, request
        The tool and its run.
    progress
        Told what the process tells; asked ten times a second whether to stop.

    Returns
    -------
    Result
        Its layers are those of memory, to be written by `CopyWriter`.

    Raises
    ------
    WorkerError
        The process could not be started, or the tool stopped with an error.
    CancelledError
        The planner cancelled before there was anything to keep.
    """
    with temporary_folder() as folder:
        progress.stage("Preparing a process of its own", 0.0)
        wanted = {key: "gpkg" for key in tool.layers if request.parameters.get(key) is not None}
        order = {
            "root": str(_ROOT),
            "package": __name__.rpartition(".plugin.")[0],
            "tool": tool.about.name,
            "needs": list(tool.needs),
            "folders": deps.folders(),
            "qgis": [str(Path(path).parent) for path in qgis.__path__],
            "prefix": QgsApplication.prefixPath(),
            "parameters": dict(_inputs(tool, request, folder, progress)),
            "outputs": {
                **{key: str(folder / f"{key}.{end}") for key, end in wanted.items()},
                **{key: str(path) for key, path in _pages(tool, request, folder).items()},
            },
        }
        (folder / "order.json").write_text(json.dumps(order), encoding="utf-8")
        answer = _Conversation(folder, progress).run()
        if not answer["results"]:
            raise CancelledError
        return _result(tool, request, answer["results"], folder)


def _inputs(
    tool: Tool, request: Request, folder: Path, progress: FeedbackProgress
) -> Iterator[tuple[str, Any]]:
    """Yield the input parameters in a form for JSON, the layers as paths of files."""
    for definition in tool.parameterDefinitions():
        key = definition.name()
        # A CRS may be that of the project, which the process does not have.
        if definition.isDestination() or not (request.has(key) or definition.type() == "crs"):
            continue
        if definition.type() in ("source", "vector"):
            yield key, _save_layer(request, key, folder / f"input_{key}.gpkg", progress)
        elif definition.type() == "raster":
            yield key, _raster(request.raster(key), folder / f"input_{key}.vrt")
        else:
            yield key, _plain(tool, request, definition)


def _plain(tool: Tool, request: Request, definition: QgsProcessingParameterDefinition) -> Any:
    """Return a parameter as JSON has it, evaluated, or as an expression for each feature."""
    key, values, context = definition.name(), request.parameters, request.context
    value = values.get(key)
    if isinstance(value, QgsProperty) and definition.isDynamic():
        return {"expression": value.asExpression()}
    kind = definition.type()
    if kind in ("number", "distance", "area", "duration", "scale"):
        return tool.parameterAsDouble(values, key, context)
    if kind == "boolean":
        return tool.parameterAsBoolean(values, key, context)
    if kind == "enum":
        words = tool.parameterAsEnumStrings(values, key, context)
        return words if definition.allowMultiple() else words[0]
    if kind == "file":
        return os.path.abspath(tool.parameterAsFile(values, key, context))
    if kind == "crs":
        return bridge.crs_text(tool.parameterAsCrs(values, key, context))
    if kind == "point":
        crs = tool.parameterAsPointCrs(values, key, context)
        point = tool.parameterAsPoint(values, key, context)
        return f"{point.x()!r},{point.y()!r} [{crs.authid()}]"
    if kind == "extent":
        crs = tool.parameterAsExtentCrs(values, key, context)
        box = tool.parameterAsExtent(values, key, context)
        corners = (box.xMinimum(), box.xMaximum(), box.yMinimum(), box.yMaximum())
        return f"{','.join(repr(c) for c in corners)} [{crs.authid()}]"
    return tool.parameterAsString(values, key, context)


def _raster(layer: QgsRasterLayer | None, path: Path) -> str | None:
    """Return a raster as Processing names it elsewhere: the process has no project.

    A coordinate reference system that was set for the layer alone goes over in a file at `path`.
    """
    if layer is None:
        return None
    source = layer.source()
    if layer.providerType() != "gdal":
        return QgsProcessingUtils.encodeProviderKeyAndUri(layer.providerType(), source)
    source = os.path.abspath(source) if os.path.exists(source) else source
    if QgsRasterLayer(source, "", "gdal").crs() == layer.crs():
        return source
    from osgeo import gdal

    made = gdal.Translate(str(path), source, format="VRT", outputSRS=layer.crs().toWkt())
    return source if made is None else str(path)


def _save_layer(request: Request, key: str, path: Path, progress: FeedbackProgress) -> str:
    """Save an input layer as Processing sees it and return it as Processing names it."""
    source = request.source(key)
    if source is None:
        msg = f"{key} is no layer."
        raise InputError(msg)
    # The name is in texts for the planner, and divided by bars in the name of a table.
    name = request.name(key).replace("|", " ").replace('"', " ") or key
    options = QgsVectorFileWriter.SaveVectorOptions()
    options.driverName = "GPKG"
    options.layerName = name
    options.layerOptions = [f"FID={_FID}"]
    writer = QgsVectorFileWriter.create(
        str(path),
        source.fields(),
        source.wkbType(),
        source.sourceCrs(),
        request.context.transformContext(),
        options,
    )
    features = source.getFeatures(QgsFeatureRequest(), compat.SKIP_VALIDITY_CHECK)
    for count, feature in enumerate(features):
        if count % bridge.CHUNK == 0 and progress.cancelled():
            raise CancelledError
        if not writer.addFeature(feature, compat.FAST_INSERT):
            break
    if writer.hasError():
        text = f"It cannot be handed to a process of its own ({writer.errorMessage()})."
        raise InputError(text, "Save it as a GeoPackage and try again.", layer=request.name(key))
    del writer
    return f"{path}|layername={name}"


class _Conversation:
    """Starts the process, passes on what it tells, and ends it.

    Parameters
    ----------
    folder
        Where `order.json` is.
    progress
        Who is told, and asked whether to stop.
    """

    def __init__(self, folder: Path, progress: FeedbackProgress) -> None:
        self.folder = folder
        self.progress = progress
        self.rest = b""
        self.answer: dict[str, Any] = {}
        self.other: list[str] = []

    def run(self) -> dict[str, Any]:
        """Return the answer: {"results": ...}."""
        try:
            python = find_python(self.progress)
        except InstallError as error:
            raise WorkerError(str(error)) from error
        process = QProcess()
        process.setProcessChannelMode(QProcess.ProcessChannelMode.MergedChannels)
        process.setProcessEnvironment(environment(_surroundings()))
        process.setWorkingDirectory(str(self.folder))
        process.start(python, [str(_PROGRAM), str(self.folder)])
        if not process.waitForStarted(10000):
            msg = f"{python} could not be started ({process.errorString()})."
            raise WorkerError(msg)
        cancelled_at = 0.0
        while process.state() != QProcess.ProcessState.NotRunning:
            if not process.waitForReadyRead(_POLL_MS):
                process.waitForFinished(1)
            self._hear(bytes(process.readAllStandardOutput()))
            if self.progress.cancelled() and not cancelled_at:
                cancelled_at = time.monotonic()
                # The end of its input is how it learns of it, also when QGIS itself ends.
                process.closeWriteChannel()
            if cancelled_at and time.monotonic() - cancelled_at > PATIENCE:
                stop(process)
                raise CancelledError
        self._hear(bytes(process.readAllStandardOutput()) + b"\n")
        if self.answer.get("error") is not None:
            raise WorkerError(self.answer["error"])
        if "results" not in self.answer:
            last = " ".join(self.other[-3:])
            msg = (
                f"The process of its own ended without a result (code {process.exitCode()}). {last}"
            )
            raise WorkerError(msg)
        return self.answer

    def _hear(self, more: bytes) -> None:
        *lines, self.rest = (self.rest + more).split(b"\n")
        for line in lines:
            text = line.decode("utf-8", "replace").strip()
            told = _message(text)
            if told is None:
                # Solvers write what they like.
                self.other += [text] if text else []
            elif "stage" in told:
                self.progress.stage(told["stage"], told["fraction"])
            elif "fraction" in told:
                self.progress.fraction(told["fraction"])
            elif "info" in told:
                self.progress.info(told["info"])
            elif "warning" in told:
                self.progress.warn(told["warning"])
            else:
                self.answer = told


def _message(line: str) -> dict[str, Any] | None:
    """Return a line of the process as what it tells, or None where it is something else."""
    if not line.startswith('{"platwright": '):
        return None
    try:
        return dict(json.loads(line)["platwright"])
    except (ValueError, TypeError):
        return None


def _surroundings() -> dict[str, str]:
    """Return the environment of the process: our settings, and packages from where we have them."""
    made = {option.variable: str(settings.value(key)) for key, option in settings.OPTIONS.items()}
    made["PLATWRIGHT_TIMEOUT"] = str(settings.timeout())
    made["PLATWRIGHT_CACHE"] = str(settings.cache_folder())
    made[deps.ENVIRONMENT_VARIABLE] = os.pathsep.join(deps.folders())
    made[deps.WORKER_VARIABLE] = "never"
    if sys.platform not in ("win32", "darwin"):
        # There may be no display; elsewhere there is one, and Qt may come without this.
        made["QT_QPA_PLATFORM"] = "offscreen"
    addresses = (str(settings.value("overpass_url")), str(settings.value("nominatim_url")))
    proxy = settings.proxy_for(*addresses)
    if proxy:
        made.update({"HTTP_PROXY": proxy, "HTTPS_PROXY": proxy})
    return made


def _pages(tool: Tool, request: Request, folder: Path) -> dict[str, Path]:
    """Return where the files of other kinds are made, by key.

    One that others stand beside has its own name there already, since it names them.
    """
    found = {}
    for key in tool.files:
        path = files.place(request, key)
        if path is not None:
            (folder / key).mkdir(exist_ok=True)
            found[key] = folder / key / path.name
    return found


def _result(tool: Tool, request: Request, results: Mapping[str, Any], folder: Path) -> Result:
    """Return what the process made, its layers read into memory."""
    layers: dict[str, QgsVectorLayer] = {}
    found: dict[str, str] = {}
    crs = QgsCoordinateReferenceSystem()
    for key in tool.layers:
        path = folder / f"{key}.gpkg"
        if not path.is_file():
            continue
        layer = QgsVectorLayer(str(path), key, "ogr")
        crs = layer.crs() if layer.crs().isValid() else crs
        found = found or read_record(layer)
        layers[key] = layer.materialize(QgsFeatureRequest())
    numbers = {key: _number(results.get(key)) for key in (*tool.numbers, *tool.texts)}
    pages = _pages(tool, request, folder)
    return Result(
        crs=crs,
        layers=layers,
        numbers=numbers,
        specification=found.get("specification", "{}"),
        keep=True,
        credits=json.loads(found.get("credits", "{}")),
        files={key: tool.files[key].read(p) for key, p in pages.items() if p.is_file()},
    )


def _number(value: Any) -> Any:
    return float("nan") if value is None else value


class CopyWriter(Writer):
    """Writes layers that a process made, which are QGIS layers already."""

    def _fill(self, key: str, sink: Any, result: Result) -> None:
        fields = self._fields(key)
        names = fields.names()
        made = []
        for found in result.layers[key].getFeatures():
            feature = QgsFeature(fields)
            feature.setGeometry(found.geometry())
            feature.setAttributes([found[name] for name in names])
            made.append(feature)
        if made and not sink.addFeatures(made, compat.FAST_INSERT):
            raise bridge.SinkError(sink.lastError() if hasattr(sink, "lastError") else "refused")
        if hasattr(sink, "finalize"):
            sink.finalize()
        # The caller holds no other reference: the file is closed here, and complete.
        del sink
