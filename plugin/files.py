"""Outputs that are files of another kind than layers, such as a page to read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Union

from qgis.core import QgsProcessingParameterDefinition, QgsProcessingParameterFileDestination

if TYPE_CHECKING:
    from .request import Request

#: What a file holds; of one with files beside it what each holds, by the end of its name.
Content = Union[str, bytes, Mapping[str, Union[str, bytes]]]


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
    others
        Other endings that the file may have.
    beside
        Ends of names of files that belong to it: they stand beside it and begin with its name.
    """

    title: str
    ending: str
    text: str
    binary: bool = False
    others: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()

    def read(self, path: Path) -> Content:
        """Return what a file of this kind holds."""
        if self.beside:
            ends = ("", *self.beside)
            return {end: companion(path, end).read_bytes() for end in ends}
        return path.read_bytes() if self.binary else path.read_text(encoding="utf-8")


def destination(key: str, kind: FileKind) -> QgsProcessingParameterDefinition:
    """Declare an output file; it is made only where the planner names one."""
    endings = " ".join(f"*.{ending}" for ending in (kind.ending, *kind.others))
    pattern = f"{kind.ending.upper()} ({endings})"
    definition = QgsProcessingParameterFileDestination(key, kind.title, pattern, None, True, False)
    definition.setHelp(kind.text)
    return definition


def write(
    request: Request, kinds: Mapping[str, FileKind], contents: Mapping[str, Content]
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
            parts = content if isinstance(content, Mapping) else {"": content}
            for end, part in parts.items():
                data = part.encode() if isinstance(part, str) else part
                companion(Path(path), end).write_bytes(data)
            written[key] = path
    return written


def place(request: Request, key: str) -> Path | None:
    """Return where a file is to be written, or None where none is asked for."""
    path = request.tool.parameterAsFileOutput(request.parameters, key, request.context)
    return Path(path) if request.has(key) and path else None


def companion(path: Path, end: str) -> Path:
    """Return the path of a file that belongs to another; with no end it is that file itself."""
    return path.with_name(f"{path.stem}{end}") if end else path
