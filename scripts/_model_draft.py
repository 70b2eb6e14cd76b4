"""Put a model together from the tools of the plugin: what scripts/_models.py is written with."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

#: Distances on the canvas of the model designer.
STEP_X, STEP_Y = 230, 120
#: What models are for, which is always made; a model may have another.
MAIN = (
    ("design", "STREETS"), ("compared", "OUTPUT"), ("parcels", "PARCELS"), ("zone", "BUILDINGS"),
    ("plan", "ROOMS"),
)  # fmt: skip


class Draft:
    """A model that is being put together.

    Parameters
    ----------
    name
        Its id, which is the name of its file.
    title, summary, text
        What it says of itself.
    main
        The step and the key of what it is for; None where `MAIN` has it.
    """

    def __init__(
        self, name: str, title: str, summary: str, text: str,
        main: tuple[str, str] | None = None,
    ) -> None:  # fmt: skip
        from qgis.core import QgsProcessingModelAlgorithm

        self.name = name
        self.main = MAIN if main is None else (main,)
        self.model = QgsProcessingModelAlgorithm(title, "Models")
        self.help = {"SHORT_DESCRIPTION": summary, "ALG_DESC": text}
        self.inputs = 0
        self.children = 0
        self.order: list[str] = []

    def input(self, definition: Any, **changes: Any) -> None:
        """Ask for something; `changes` are values for the setters of the definition."""
        from qgis.core import QgsProcessingModelParameter
        from qgis.PyQt.QtCore import QPointF

        for name, value in changes.items():
            getattr(definition, f"set{name}")(value)
        definition.setIsDynamic(False)
        place = QgsProcessingModelParameter(definition.name())
        place.setPosition(QPointF(STEP_X * self.inputs, 0))
        self.inputs += 1
        self.model.addModelParameter(definition, place)
        self.order.append(definition.name())
        self.help[definition.name()] = definition.help()

    def step(
        self, child: str, tool: str, title: str, given: dict[str, Any], **outputs: str
    ) -> None:
        """Add a tool.

        Parameters
        ----------
        child
            Its id in the model, before the colon of its outputs on a command line.
        tool, title
            The id of the tool and what the step is called.
        given
            Sources of its inputs by their keys, see `asked`, `made`, `value` and `expression`.
        outputs
            Titles of the layers that the model hands out, by their keys.
        """
        from qgis.core import QgsProcessingModelChildAlgorithm, QgsProcessingModelOutput
        from qgis.PyQt.QtCore import QPointF

        made = QgsProcessingModelChildAlgorithm(tool)
        if made.algorithm() is None:
            sys.exit(f"{self.name}: there is no tool {tool}")
        known = {d.name(): d for d in made.algorithm().parameterDefinitions()}
        if {*given, *outputs} - set(known):
            sys.exit(f"{self.name}: {tool} has no {sorted({*given, *outputs} - set(known))}")
        # The model designer, too, writes the defaults of what is not optional into a model.
        given = {**_defaults(known), **given}
        made.setChildId(child)
        made.setDescription(title)
        at = QPointF(STEP_X * (self.children % 4), STEP_Y * (1.5 + 2 * (self.children // 4)))
        made.setPosition(at)
        self.children += 1
        for key, sources in given.items():
            made.addParameterSources(key, sources if isinstance(sources, list) else [sources])
        ends = {}
        for number, (key, text) in enumerate(outputs.items()):
            end = QgsProcessingModelOutput(key, text)
            end.setChildId(child)
            end.setChildOutputName(key)
            end.setMandatory((child, key) in self.main)
            end.setPosition(at + QPointF(30, 60 + 35 * number))
            ends[key] = end
        made.setModelOutputs(ends)
        self.model.addChildAlgorithm(made)

    def text(self) -> str:
        """Return the contents of the model's file."""
        self.model.setHelpContent(self.help)
        self.model.setParameterOrder(self.order)
        good, why = self.model.validate()
        if not good:
            sys.exit(f"{self.name}: {'; '.join(why)}")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "made.model3"
            self.model.toFile(str(path))
            return path.read_text(encoding="utf-8")


def _defaults(definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the defaults of all inputs that must be given."""
    return {
        key: value(definition.defaultValue())
        for key, definition in definitions.items()
        if not definition.isDestination()
        and not definition.flags() & flags(optional=True)
        and definition.defaultValue() is not None
    }


def asked(name: str) -> Any:
    """Take an input of the model."""
    from qgis.core import QgsProcessingModelChildParameterSource as Source

    return Source.fromModelParameter(name)


def made(child: str, key: str) -> Any:
    """Take an output of an earlier step."""
    from qgis.core import QgsProcessingModelChildParameterSource as Source

    return Source.fromChildOutput(child, key)


def value(given: Any) -> Any:
    """Take a fixed value."""
    from qgis.core import QgsProcessingModelChildParameterSource as Source

    return Source.fromStaticValue(given)


def expression(text: str) -> Any:
    """Take the value of an expression."""
    from qgis.core import QgsProcessingModelChildParameterSource as Source

    return Source.fromExpression(text)


def of_tool(tool: str, key: str) -> Any:
    """Return a copy of an input of one of our tools."""
    from qgis.core import QgsApplication

    found = QgsApplication.processingRegistry().algorithmById(f"platwright:{tool}")
    return found.parameterDefinition(key).clone()


def flags(advanced: bool = False, optional: bool = False) -> Any:
    from qgis.core import QgsProcessingParameterDefinition

    flag = QgsProcessingParameterDefinition.Flag
    flags = QgsProcessingParameterDefinition.Flags()
    flags |= flag.FlagAdvanced if advanced else flags
    return flags | flag.FlagOptional if optional else flags
