"""The parameters about drawn templates."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsProcessingParameterDefinition,
    QgsProcessingParameterFile,
    QgsProcessingParameterString,
)

from ...algorithms.errors import InputError
from .. import compat, parameters
from ..request import Request

SOURCES = {
    "rows": "rows of parcels along through streets, no templates",
    "shipped": "culs-de-sac, wedges, L-blocks, townhouses and courts where they fit",
    "file": "templates of your own, see 'Template file'",
}
#: Templates of the shipped library that rows of parcels do as well.
PLAIN = ("row", "rows")


def source() -> QgsProcessingParameterDefinition:
    """Declare where templates come from."""
    return parameters.choice(
        "TEMPLATES",
        "Templates",
        "Drawn patterns of parcels and small streets that are warped into places where they fit.",
        SOURCES,
        default="rows",
    )


def details() -> Iterator[QgsProcessingParameterDefinition]:
    """Yield the file, the names and how well templates must fit."""
    file = QgsProcessingParameterFile(
        "TEMPLATE_FILE",
        "Template file",
        extension="gpkg",
        defaultValue=None,
        optional=True,
    )
    file.setHelp(
        "A GeoPackage with templates that you have drawn; the page on templates tells how. "
        "Optional."
    )
    names = QgsProcessingParameterString(
        "TEMPLATE_NAMES", "Only these templates", defaultValue=None, optional=True
    )
    names.setHelp(
        "Names of templates, separated by commas. Empty: all of the file; of the shipped ones all "
        "but plain rows. Optional."
    )
    for definition in (file, names):
        definition.setFlags(definition.flags() | compat.ADVANCED)
        yield definition
    yield parameters.number(
        "TEMPLATE_ENERGY",
        "Largest misfit of templates",
        "Templates are used where they fit with less than this: the mean distance of their "
        "parcels from what was drawn, and what stretched sides and poor parcels add to it.",
        unit="m",
        default=2.0,
        minimum=0.01,
        maximum=100.0,
        advanced=True,
    )


def templates_of(request: Request) -> Any:
    """Return the `TemplateRules` that are asked for, or None for rows alone.

    Raises
    ------
    InputError
        The file is missing or no library, or a name is not in it.
    """
    from ...algorithms.parcels.split.choosing import TemplateRules
    from ...algorithms.parcels.templates import read_library, shipped_library

    word = request.word("TEMPLATES")
    if word == "rows":
        return None
    if word == "shipped":
        library = shipped_library()
    elif request.has("TEMPLATE_FILE"):
        name = request.tool.parameterAsFile(request.parameters, "TEMPLATE_FILE", request.context)
        library = read_library(Path(str(name)))
    else:
        raise InputError(
            "Templates of a file are to be used, but no file is given.",
            "Choose a GeoPackage for 'Template file', or the shipped templates.",
        )
    every = [own.name for own in library.labelled("block")]
    asked = request.tool.parameterAsString(request.parameters, "TEMPLATE_NAMES", request.context)
    names = [name.strip() for name in str(asked or "").split(",") if name.strip()]
    unknown = [name for name in names if name not in every]
    if unknown:
        raise InputError(
            f"There is no template '{unknown[0]}' for blocks.",
            f"Choose among {', '.join(every)}.",
        )
    if not names and word == "shipped":
        names = [name for name in every if not set(PLAIN) & set(name.lower().split())]
        names.append("Cul-de-sac with side rows")
    return TemplateRules(
        library, tuple(names) if names else None, request.number("TEMPLATE_ENERGY")
    )


def record(templates: Any) -> dict[str, Any] | None:
    """Return what the metadata of the layers say of templates."""
    if templates is None:
        return None
    return {
        "names": [own.name for own in templates.templates()],
        "threshold": templates.threshold,
    }
