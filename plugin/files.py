"""Outputs that are files of another kind than layers, such as a page to read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from qgis.core import QgsProcessingParameterDefinition, QgsProcessingParameterFileDestination

if TYPE_CHECKING:
    from .request import Request


@dataclass(frozen=True)
class FileKind:
    """One kind of output file, which is text.

    Attributes
    ----------
    title
        Name of the output in QGIS.
    ending
        Ending of the file, such as html; a page shows up among the results of Processing.
    text
        What it holds, as a sentence.
    """

    title: str
    ending: str
    text: str


def destination(key: str, kind: FileKind) -> QgsProcessingParameterDefinition:
    """Declare an output file; it is made only where the planner names one."""
    pattern = f"{kind.ending.upper()} (*.{kind.ending})"
    definition = QgsProcessingParameterFileDestination(key, kind.title, pattern, None, True, False)
    definition.setHelp(kind.text)
    return definition


def write(
    request: Request, kinds: Mapping[str, FileKind], contents: Mapping[str, str]
) -> dict[str, str]:
    """Write the files that were asked for, and return their paths by key.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    written = {}
    for key in kinds:
        path = request.tool.parameterAsFileOutput(request.parameters, key, request.context)
        if request.has(key) and path and key in contents:
            Path(path).write_text(contents[key], encoding="utf-8")
            written[key] = path
    return written
