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
    """One kind of output file.

    Attributes
    ----------
    title
        Name of the output in QGIS.
    ending
        Ending of the file, such as html; a page shows up among the results of Processing.
    text
        What it holds, as a sentence.
    binary
        Whether it is bytes rather than text.
    """

    title: str
    ending: str
    text: str
    binary: bool = False

    def read(self, path: Path) -> str | bytes:
        """Return what a file of this kind holds."""
        return path.read_bytes() if self.binary else path.read_text(encoding="utf-8")


def destination(key: str, kind: FileKind) -> QgsProcessingParameterDefinition:
    """Declare an output file; it is made only where the planner names one."""
    pattern = f"{kind.ending.upper()} (*.{kind.ending})"
    definition = QgsProcessingParameterFileDestination(key, kind.title, pattern, None, True, False)
    definition.setHelp(kind.text)
    return definition


def write(
    request: Request, kinds: Mapping[str, FileKind], contents: Mapping[str, str | bytes]
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
            content = contents[key]
            Path(path).write_bytes(content if isinstance(content, bytes) else content.encode())
            written[key] = path
    return written
