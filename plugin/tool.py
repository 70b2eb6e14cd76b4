"""The shape of every tool: read, call the library once, write all layers or none.

A tool is one file in `tools` with one subclass. It declares what it is (`about`), its inputs,
its output layers and numbers, checks its request before the run and computes; everything else
is here.
"""

from __future__ import annotations

import contextlib
import os
import traceback
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar

from qgis.core import (
    Qgis,
    QgsApplication,
    QgsMessageLog,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsProcessingOutputNumber,
    QgsProcessingOutputString,
    QgsProcessingParameterDefinition,
)
from qgis.PyQt.QtGui import QIcon

from ..algorithms.errors import CancelledError, PlatwrightError
from . import bridge, deps, files, parameters, rescue, worker
from .fields import LayerKind
from .help import GROUPS, About, Description, describe, help_html, help_text
from .icons import icon_path
from .outputs import Result, Writer, check_destinations, file_exists
from .progress import FeedbackProgress
from .request import Request, with_words


class Tool(QgsProcessingAlgorithm):
    """Base of every tool.

    Attributes
    ----------
    about
        Name, title, group, tags and help.
    layers
        Output layers by key; the first is always made, the others may be switched off.
    files
        Output files of other kinds by key; made where the planner names one.
    numbers
        Numeric outputs by key, with what they say.
    texts
        Outputs that are words, likewise; they travel with the numbers of the result.
    needs
        Python packages that the tool cannot do without, see `deps`.
    """

    about: ClassVar[About]
    layers: ClassVar[Mapping[str, LayerKind]]
    files: ClassVar[Mapping[str, files.FileKind]] = {}
    numbers: ClassVar[Mapping[str, str]] = {}
    texts: ClassVar[Mapping[str, str]] = {}
    needs: ClassVar[Sequence[str]] = deps.LAYERS

    # What a subclass says.

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the input parameters in the order of the dialog."""
        raise NotImplementedError

    def check(self, request: Request) -> None:
        """Raise an error of the library where the request cannot be met; runs before the run."""

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read the layers, call the library and return what is to be written."""
        raise NotImplementedError

    # What Processing asks.

    def createInstance(self) -> Tool:
        """Return a fresh tool."""
        return type(self)()

    def name(self) -> str:
        """Return the id for ever."""
        return self.about.name

    def displayName(self) -> str:
        """Return the name in the toolbox."""
        return self.about.title

    def group(self) -> str:
        """Return the name of the group."""
        return GROUPS[self.about.group]

    def groupId(self) -> str:
        """Return the id of the group."""
        return self.about.group

    def tags(self) -> list[str]:
        """Return the words that find the tool."""
        return list(self.about.tags)

    def shortDescription(self) -> str:
        """Return the tool in one sentence."""
        return self.about.summary

    def shortHelpString(self) -> str:
        """Return the help, written from the declarations."""
        # In a terminal nobody reads HTML.
        terminal = QgsApplication.platform() == "qgis_process"
        return help_text(self.described()) if terminal else help_html(self.described())

    def described(self) -> Description:
        """Return everything that the tool declares."""
        pages = {key: kind.text for key, kind in self.files.items()}
        said = {**self.numbers, **self.texts, **pages}
        return describe(self.about, self.parameterDefinitions(), self.layers, said)

    def icon(self) -> QIcon:
        """Return the picture of the tool."""
        return QIcon(self.svgIconPath())

    def svgIconPath(self) -> str:
        """Return the path of that picture."""
        return icon_path(self.about.name, self.about.group)

    def initAlgorithm(self, configuration: Any = None) -> None:  # noqa: ARG002
        """Declare the parameters and the outputs."""
        for definition in self.inputs():
            self.addParameter(definition)
        for index, (key, kind) in enumerate(self.layers.items()):
            fields = ", ".join(field.name for field in kind.fields)
            text = (
                f"all fields of {kind.like}, and {fields}" if kind.like else f"the fields {fields}"
            )
            self.addParameter(parameters.sink(key, kind, f"Layer with {text}.", optional=index > 0))
        for key, other in self.files.items():
            self.addParameter(files.destination(key, other))
        for key, text in self.numbers.items():
            self.addOutput(QgsProcessingOutputNumber(key, text))
        for key, text in self.texts.items():
            self.addOutput(QgsProcessingOutputString(key, text))

    def canExecute(self) -> tuple[bool, str]:
        """Tell whether the packages are there, and what to do where they are not."""
        text = deps.missing_text(self.needs)
        return not text, text

    def checkParameterValues(
        self, parameters: dict[str, Any], context: QgsProcessingContext
    ) -> tuple[bool, str]:
        """Find what would make the run fail before it begins."""
        parameters = with_words(parameters, self.parameterDefinitions())
        good, text = super().checkParameterValues(parameters, context)
        if not good:
            return good, text
        try:
            request = Request(self, parameters, context)
            if self._packages_work():
                self._check(request)
            else:
                self._check_layers(request)
        except (PlatwrightError, deps.DependencyError) as error:
            return False, str(error)
        except OSError as error:
            return False, f"{self.about.title}: {error}."
        return True, ""

    def processAlgorithm(
        self,
        parameters: dict[str, Any],
        context: QgsProcessingContext,
        feedback: QgsProcessingFeedback,
    ) -> dict[str, Any]:
        """Run the tool; every error that comes out of here is a sentence for a planner."""
        progress = FeedbackProgress(feedback or QgsProcessingFeedback())
        parameters = with_words(parameters, self.parameterDefinitions())
        request = Request(self, parameters, context)
        try:
            with readable_errors(self.about.title):
                here = self._packages_work(progress)
                if here:
                    self._check(request)
                    result = self.compute(request, progress.part(0.0, 0.95))
                else:
                    self._check_layers(request)
                    result = worker.compute(self, request, progress.part(0.0, 0.95))
                if progress.cancelled() and not result.keep:
                    raise CancelledError
                if self.layers:
                    progress.stage("Writing layers", 0.95)
                writer = Writer if here else worker.CopyWriter
                outputs = writer(request, self.layers, self.files).write(result)
                if progress.cancelled() and rescue.needed():
                    self._tell_where(outputs, context, progress)
        except (CancelledError, bridge.CancelledWhileReadingError):
            progress.warn("Cancelled before there was anything to keep; no layer was written.")
            return {}
        for key, text in self.numbers.items() if here else ():
            if outputs.get(key) is not None:
                progress.info(f"{text}: {outputs[key]:g}")
        return outputs

    def _packages_work(self, progress: FeedbackProgress | None = None) -> bool:
        """Load the packages; tell whether they work here, or only in a process of its own."""
        try:
            deps.load(self.needs)
        except deps.ClashError as error:
            if os.environ.get(deps.WORKER_VARIABLE) == "never":
                raise
            if progress is not None:
                progress.warn(f"{error} Meanwhile the tool runs in a process of its own.")
            return False
        return True

    def _tell_where(
        self, outputs: dict[str, Any], context: QgsProcessingContext, progress: FeedbackProgress
    ) -> None:
        """Say where the layers of a cancelled run are, since QGIS does not load them."""
        kept = rescue.save(outputs, self.layers, context)
        files = [str(outputs[key]) for key in self.layers if file_exists(outputs.get(key))]
        places = ", ".join([*files, *([str(kept)] if kept else [])])
        progress.warn(f"QGIS loads no layers of a cancelled run. They are kept in: {places}")

    def _check(self, request: Request) -> None:
        self._check_layers(request)
        self.check(request)

    def _check_layers(self, request: Request) -> None:
        sources = [
            definition.name()
            for definition in self.parameterDefinitions()
            if definition.type() == "source"
        ]
        for key in sources:
            request.check_layer(key)
        check_destinations(request, (*self.layers, *self.files), sources)


@contextlib.contextmanager
def readable_errors(title: str) -> Iterator[None]:
    """Turn errors into `QgsProcessingException` with a text for a planner.

    Cancellation passes through. What nobody foresaw goes to the message log with its place in
    the code, from where a report can be copied, and to the planner as a sentence.
    """
    try:
        yield
    except (CancelledError, bridge.CancelledWhileReadingError, QgsProcessingException):
        raise
    except (PlatwrightError, deps.DependencyError) as error:
        raise QgsProcessingException(str(error)) from error
    except MemoryError as error:
        msg = f"{title}: not enough memory. Use a smaller site, or longer and wider blocks."
        raise QgsProcessingException(msg) from error
    except Exception as error:
        places = traceback.extract_tb(error.__traceback__)
        chain = ", from ".join(f"{p.name} ({p.filename}:{p.lineno})" for p in reversed(places))
        QgsMessageLog.logMessage(
            f"{title}: {type(error).__name__}: {error} in {chain}",
            "Platwright",
            Qgis.MessageLevel.Critical,
        )
        msg = (
            f"{title}: something went wrong that should not ({type(error).__name__}: {error}). "
            "No layer was written. The Platwright tab of the log messages has the details; "
            "please report them."
        )
        raise QgsProcessingException(msg) from error
