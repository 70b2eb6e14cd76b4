"""The models that come with the plugin: several tools in a row, from the files beside this one.

Each `.model3` file is an ordinary model, written by scripts/make_models, which opens in the model
designer as well. Here it becomes a tool of the provider with an id of its own: its file's name.
"""

from __future__ import annotations

import html
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

from qgis.core import (
    QgsApplication,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingModelAlgorithm,
)
from qgis.PyQt.QtGui import QIcon

from .. import compat, deps
from ..help import GROUPS, About, Description, describe, help_html, help_text
from ..icons import icon_path
from ..request import with_words

FOLDER = Path(__file__).parent
#: Key of the group, see `GROUPS`.
GROUP = "models"
#: What the help of a model is kept under in its file.
SUMMARY, ABOUT = "SHORT_DESCRIPTION", "ALG_DESC"


class Model(QgsProcessingModelAlgorithm):
    """A model of the provider.

    Parameters
    ----------
    path
        The `.model3` file.

    Attributes
    ----------
    layers, numbers, texts
        Empty: what comes out is declared by the tools that the model is made of.
    """

    layers: ClassVar[dict[str, Any]] = {}
    numbers: ClassVar[dict[str, str]] = {}
    texts: ClassVar[dict[str, str]] = {}

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path
        self.fromFile(str(path))
        for own, output, _ in self._ends():
            if not output.isMandatory():
                own.setFlags(own.flags() | compat.OPTIONAL)

    @property
    def about(self) -> About:
        """What the model says of itself."""
        told = self.helpContent()
        return About(
            name=self.name(),
            title=self.displayName(),
            group=GROUP,
            tags=("model", "street network", "design", "platwright"),
            summary=str(told.get(SUMMARY, "")),
            paragraphs=tuple(str(told.get(ABOUT, "")).split("\n\n")),
        )

    @property
    def needs(self) -> tuple[str, ...]:
        """Packages that the tools of the model cannot do without."""
        tools = (child.algorithm() for child in self.childAlgorithms().values())
        return tuple(dict.fromkeys(n for tool in tools for n in getattr(tool, "needs", ())))

    def createInstance(self) -> Model:
        """Return a fresh model."""
        return Model(self.path)

    def name(self) -> str:
        """Return the id for ever."""
        return self.path.stem

    def group(self) -> str:
        """Return the name of the group."""
        return GROUPS[GROUP]

    def groupId(self) -> str:
        """Return the id of the group."""
        return GROUP

    def tags(self) -> list[str]:
        """Return the words that find the model."""
        return list(self.about.tags)

    def shortDescription(self) -> str:
        """Return the model in one sentence."""
        return self.about.summary

    def described(self) -> Description:
        """Return everything that the model declares."""
        return describe(self.about, self.parameterDefinitions(), {}, {})

    def shortHelpString(self) -> str:
        """Return the help, with the layers that come out and what makes them."""
        if QgsApplication.platform() == "qgis_process":
            return help_text(self.described())
        outputs = "".join(
            f"<li><b>{html.escape(own.description())}</b></li>"
            for own in self.parameterDefinitions()
            if own.isDestination()
        )
        return f"{help_html(self.described())}<h3>Outputs</h3><ul>{outputs}</ul>"

    def icon(self) -> QIcon:
        """Return the picture of the model."""
        return QIcon(self.svgIconPath())

    def svgIconPath(self) -> str:
        """Return the path of that picture."""
        return icon_path(self.name(), GROUP)

    def canExecute(self) -> tuple[bool, str]:
        """Tell whether the tools and their packages are there, and what to do where not."""
        good, text = super().canExecute()
        text = text if not good else deps.missing_text(self.needs)
        return not text, text

    def checkParameterValues(
        self, parameters: dict[str, Any], context: QgsProcessingContext
    ) -> tuple[bool, str]:
        """Find what would make the run fail before it begins."""
        return super().checkParameterValues(
            with_words(parameters, self.parameterDefinitions()), context
        )

    def processAlgorithm(
        self,
        parameters: dict[str, Any],
        context: QgsProcessingContext,
        feedback: QgsProcessingFeedback,
    ) -> dict[str, Any]:
        """Run the model."""
        read = self._read()
        kept = {
            own.name(): "TEMPORARY_OUTPUT"
            for own, output, child in self._ends()
            if (output.childId(), output.childOutputName()) in read
            or not _optional(child.algorithm().parameterDefinition(output.childOutputName()))
        }
        given = {key: own for key, own in parameters.items() if own is not None and own != ""}
        results = dict(super().processAlgorithm({**kept, **given}, context, feedback))
        for own, _, _ in self._ends():
            made = results.get(own.name())
            if made and context.willLoadLayerOnCompletion(made):
                # QGIS would call it as the output is called on a command line.
                context.layerToLoadOnCompletionDetails(made).name = own.description()
        return results

    def _ends(self) -> Iterator[tuple[Any, Any, Any]]:
        """Yield the outputs: the parameter of the model, what it is of, and that step."""
        for child in self.childAlgorithms().values():
            for name, output in child.modelOutputs().items():
                own = self.parameterDefinition(f"{child.childId()}:{name}")
                if own is not None:
                    yield own, output, child

    def _read(self) -> set[tuple[str, str]]:
        """Return the outputs that a later step reads, by its id and the key.

        QGIS leaves away a layer that the planner does not want, even where a later step needs it.
        """
        return {
            (source.outputChildId(), source.outputName())
            for child in self.childAlgorithms().values()
            for given in child.parameterSources().values()
            for source in given
        }


def _optional(definition: Any) -> bool:
    return bool(definition.flags() & compat.OPTIONAL)


def models() -> list[Model]:
    """Return all models, in the order of their names."""
    return [Model(path) for path in sorted(FOLDER.glob("*.model3"))]
