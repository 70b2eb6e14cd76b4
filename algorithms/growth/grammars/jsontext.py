"""JSON from anywhere, read with care: size, depth and keys that are given twice."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path
from typing import Any

from ...errors import InputError

#: Largest file, bytes (and longest text, characters). The shipped grammars have about 2,000.
MOST_BYTES = 1_000_000
#: Deepest nesting of brackets; a grammar needs 6.
MOST_DEPTH = 20

#: Strings, so that the brackets in them do not count, or single brackets. The closing quote is
#: optional: where it is missing the rest is one string, and the time stays linear.
_BRACKETS = re.compile(r'"[^"\\]*(?:\\.[^"\\]*)*"?|[\[\]{}]', re.DOTALL)


class Fields(dict[str, Any]):
    """An object of a JSON file that remembers which keys it was given more than once."""

    def __init__(self, pairs: list[tuple[str, Any]]) -> None:
        super().__init__(pairs)
        self.twice: tuple[str, ...] = ()
        if len(self) < len(pairs):
            counts = Counter(key for key, _ in pairs)
            self.twice = tuple(key for key, count in counts.items() if count > 1)


def read_text(path: Path) -> str:
    """Read a small text file.

    Parameters
    ----------
    path
        The file.

    Raises
    ------
    InputError
        If it cannot be read, is larger than `MOST_BYTES`, or is not UTF-8.
    """
    try:
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"Grammar '{path.name}' cannot be read: {why}.", f"Check the path {path}."
        ) from error
    if len(data) > MOST_BYTES:
        raise _too_large(path.name)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(
            f"Grammar '{path.name}' is not text in UTF-8.", "Save it as JSON with coding UTF-8."
        ) from error


def _too_large(source: str) -> InputError:
    return InputError(
        f"Grammar '{source}' has more than {MOST_BYTES:,} characters.",
        "Choose the file of a grammar; those that come along have about 2,000.",
    )


def load(text: str, source: str) -> Any:
    """Read JSON. Numbers become float, objects become `Fields`.

    Parameters
    ----------
    text
        The JSON.
    source
        What errors call it.

    Returns
    -------
    Any
        What it holds; numbers that JSON does not have (NaN, Infinity) are there as such, for
        whoever reads the field to refuse.

    Raises
    ------
    InputError
        If it is too large, nested too deep or not JSON, with line and column.
    """
    if len(text) > MOST_BYTES:
        raise _too_large(source)
    if not text.strip():
        raise InputError(f"Grammar '{source}' is empty.", "Choose the file of a grammar.")
    depth = 0
    for found in _BRACKETS.finditer(text):
        depth += 1 if found[0] in "[{" else -1 if found[0] in "]}" else 0
        if depth > MOST_DEPTH:
            line = text.count("\n", 0, found.start()) + 1
            raise InputError(
                f"Grammar '{source}' has more than {MOST_DEPTH} brackets in each other in line "
                f"{line}.",
                "A grammar needs six; look for brackets that are not closed.",
            )
    try:
        return json.loads(
            text,
            parse_int=float,
            parse_float=float,
            parse_constant=float,
            object_pairs_hook=Fields,
        )
    except json.JSONDecodeError as error:
        raise InputError(
            f"Grammar '{source}' is not JSON: line {error.lineno}, column {error.colno}: "
            f"{error.msg}.",
            "JSON has no comments, no comma before a closing bracket, only double quotes, true "
            "and false in lower case, and nothing to calculate, such as pi/2.",
        ) from error
