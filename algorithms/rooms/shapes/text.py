"""Templates as JSON: squares drawn with '#', and what is asked of their numbers.

::

    {"text": "Two kinds of rooms",
     "templates": [{"name": "corner", "cells": ["#.", "##"], "rotations": [0, 90, 180, 270],
                    "mirror": true, "min": 0, "max": null, "min_share": 0, "max_share": 0.5,
                    "colour": "#8fb8de", "use": "office"}]}

Rows run from top to bottom; '#' is filled, '.' and a space are empty. Only name and cells must be
given.
"""

from __future__ import annotations

import difflib
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ...errors import InputError
from ..types import Cells, Template
from .checks import Fault, set_fault, template_fault
from .orient import settled

#: Largest file, bytes.
MOST_BYTES = 1_000_000
#: Largest number that a limit may be.
LARGEST = 1_000_000_000
#: Keys of the file, and of a template in it.
KEYS = ("templates", "text")
TEMPLATE_KEYS = (
    "name", "cells", "rotations", "mirror", "min", "max", "min_share", "max_share", "colour", "use",
)  # fmt: skip
FILLED, EMPTY = "#", ". "


def read_templates(given: str | Path) -> tuple[Template, ...]:
    """Read templates from a JSON file, or from JSON itself.

    Parameters
    ----------
    given
        Path of a file, or the text of one: a text that begins with a bracket.

    Returns
    -------
    tuple of Template
        In the order of the file.

    Raises
    ------
    InputError
        If the file cannot be read, or as `parse_templates` says.
    """
    if isinstance(given, str) and given.lstrip()[:1] in ("{", "["):
        return parse_templates(given, "given as text")
    path = Path(given)
    try:
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"Room templates '{path.name[:80]}' cannot be read: {why}.",
            "Check the path, or give the JSON itself.",
        ) from error
    try:
        return parse_templates(data.decode("utf-8-sig"), path.name)
    except UnicodeDecodeError as error:
        raise InputError(
            f"Room templates '{path.name}' are not text in UTF-8.", "Save the file as UTF-8."
        ) from error


def parse_templates(text: str, source: str) -> tuple[Template, ...]:
    """Read templates from JSON. Nothing in it is evaluated.

    Parameters
    ----------
    text
        The JSON.
    source
        What errors call it, such as the name of its file.

    Returns
    -------
    tuple of Template
        In the order of the text.

    Raises
    ------
    InputError
        If it is not JSON; if keys are unknown, missing or doubled; if a shape is empty, does not
        hang together or touches itself in a corner; if names are doubled; if limits, shares or
        colours make no sense.

    Examples
    --------
    >>> (corner,) = parse_templates('{"templates": [{"name": "L", "cells": ["#.", "##"]}]}', "L")
    >>> sorted(corner.cells)
    [(0, 0), (0, 1), (1, 0)]
    """
    return _templates(_load(text, source), source)


def description_of(text: str, source: str) -> str:
    """Return what JSON of templates says about itself, empty where it says nothing.

    Parameters
    ----------
    text, source
        As for `parse_templates`.
    """
    about = _load(text, source).get("text", "")
    if not isinstance(about, str):
        raise _error(source, ("Its 'text' is not a text.", "Write it in double quotes."))
    return about


def templates_text(templates: Iterable[Template], text: str = "") -> str:
    """Write templates as JSON that `read_templates` reads.

    Parameters
    ----------
    templates
        The templates.
    text
        One line that says what they are for.
    """
    entries = []
    for template in templates:
        values = {
            "name": template.name,
            "cells": rows_of(template.cells),
            "rotations": [90 * quarters for quarters in template.rotations],
            "mirror": template.mirror,
            "min": template.least,
            "max": template.most,
            "min_share": template.least_share,
            "max_share": template.most_share,
            "colour": template.colour,
            "use": template.use,
        }
        entries.append("    " + json.dumps(values, ensure_ascii=False))
    about = f'  "text": {json.dumps(text, ensure_ascii=False)},\n' if text else ""
    return "{\n" + about + '  "templates": [\n' + ",\n".join(entries) + "\n  ]\n}\n"


def rows_of(cells: Cells) -> list[str]:
    """Draw squares as rows of '#' and '.', from top to bottom.

    Parameters
    ----------
    cells
        Squares (column, row), counted from the lower left.

    Examples
    --------
    >>> rows_of(frozenset({(0, 0), (1, 0), (0, 1)}))
    ['#.', '##']
    """
    wide, high = max(c for c, _ in cells) + 1, max(r for _, r in cells) + 1
    return [
        "".join(FILLED if (column, row) in cells else EMPTY[0] for column in range(wide))
        for row in reversed(range(high))
    ]


# ---------------------------------------------------------------------- reading
class _Pairs(dict[str, Any]):
    """An object of JSON that remembers a key that it was given twice."""

    twice = ""

    def __init__(self, pairs: list[tuple[str, Any]]) -> None:
        super().__init__(pairs)
        if len(self) < len(pairs):
            keys = [key for key, _ in pairs]
            self.twice = next(key for key in keys if keys.count(key) > 1)


def _error(source: str, fault: Fault, where: str = "") -> InputError:
    return InputError(f"Room templates '{source}'{where}: {fault[0]}", fault[1])


def _load(text: str, source: str) -> _Pairs:
    if len(text) > MOST_BYTES:
        raise _error(source, (f"There are more than {MOST_BYTES:,} characters.", "Give less."))
    try:
        data = json.loads(text, object_pairs_hook=_Pairs)
    except json.JSONDecodeError as error:
        problem = f"Not JSON: line {error.lineno}, column {error.colno}: {error.msg}."
        remedy = "JSON has double quotes only, and no comma before a closing bracket."
        raise _error(source, (problem, remedy)) from error
    except (RecursionError, ValueError) as error:
        raise _error(source, ("Not JSON that can be read.", "Look at its brackets.")) from error
    if not isinstance(data, _Pairs):
        raise _error(source, ("It is no object.", 'Write {"templates": [...]}.'))
    _check_keys(data, KEYS, source, "")
    return data


def _check_keys(data: _Pairs, known: tuple[str, ...], source: str, where: str) -> None:
    if data.twice:
        fault = (f"The key '{data.twice[:40]}' is given twice.", "Keep one of them.")
        raise _error(source, fault, where)
    for key in data:
        if key not in known:
            near = difflib.get_close_matches(key[:40].casefold(), known, n=1)
            hint = f"Did you mean {near[0]}? " if near else ""
            remedy = f"{hint}Known are {', '.join(known)}."
            raise _error(source, (f"The key '{key[:40]}' is unknown.", remedy), where)


def _templates(data: _Pairs, source: str) -> tuple[Template, ...]:
    entries = data.get("templates")
    if not isinstance(entries, list):
        raise _error(source, ("There is no list of templates.", 'Write {"templates": [...]}.'))
    found = []
    for number, entry in enumerate(entries, 1):
        where = f", template {number}"
        if not isinstance(entry, _Pairs):
            remedy = 'Write {"name": "room", "cells": ["##", "##"]}.'
            raise _error(source, ("It is no object.", remedy), where)
        name = entry.get("name")
        if isinstance(name, str) and name.strip():
            where += f" '{name.strip()[:60]}'"
        _check_keys(entry, TEMPLATE_KEYS, source, where)
        try:
            template = _template(entry)
        except _UnusableError as fault:
            raise _error(source, fault.fault, where) from None
        wrong = template_fault(template)
        if wrong:
            raise _error(source, wrong, where)
        found.append(template)
    wrong = set_fault(found)
    if wrong:
        raise _error(source, wrong)
    return tuple(found)


class _UnusableError(Exception):
    """A value cannot be used; it carries the fault."""

    def __init__(self, problem: str, remedy: str) -> None:
        super().__init__(problem)
        self.fault: Fault = (problem, remedy)


def _template(entry: _Pairs) -> Template:
    return Template(
        _text(entry, "name", "").strip(),
        _cells(entry.get("cells")),
        _rotations(entry.get("rotations", [0, 90, 180, 270])),
        _flag(entry.get("mirror", True)),
        _whole(entry, "min") or 0,
        _whole(entry, "max"),
        _number(entry, "min_share") or 0.0,
        _number(entry, "max_share"),
        _text(entry, "colour", Template.colour).strip(),
        _text(entry, "use", "").strip(),
    )


def _text(entry: _Pairs, key: str, default: str) -> str:
    value = entry.get(key, default)
    if not isinstance(value, str):
        raise _UnusableError(f"Its {key} is not a text.", "Write it in double quotes.")
    return value


def _cells(rows: object) -> Cells:
    if not isinstance(rows, list) or not all(isinstance(row, str) for row in rows):
        raise _UnusableError(
            "Its cells are not given as rows.",
            'Draw them from top to bottom, such as ["#.", "##"], in double quotes.',
        )
    for row in rows:
        strange = set(row) - set(FILLED + EMPTY)
        if strange:
            raise _UnusableError(
                f"Its cells hold the character {min(strange)!r}.",
                "Write '#' for filled squares and '.' for empty ones.",
            )
    cells = [
        (column, row)
        for row, line in enumerate(reversed(rows))
        for column, mark in enumerate(line)
        if mark == FILLED
    ]
    return settled(cells) if cells else frozenset()


def _rotations(value: object) -> tuple[int, ...]:
    known = (0, 90, 180, 270)
    fine = isinstance(value, list) and all(type(v) is int and v in known for v in value)
    if not fine or not isinstance(value, list) or not value:
        raise _UnusableError("Its rotations are unknown.", "Give a list of 0, 90, 180 and 270.")
    return tuple(sorted({angle // 90 for angle in value}))


def _flag(value: object) -> bool:
    if not isinstance(value, bool):
        raise _UnusableError("Its mirror is neither true nor false.", "Write true or false.")
    return value


def _number(entry: _Pairs, key: str) -> float | None:
    value = entry.get(key)
    if value is None:
        return None
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    # The largest first: a whole number may be too large to be asked whether it is finite.
    if not number or abs(value) > LARGEST or not math.isfinite(value):
        raise _UnusableError(f"Its {key} is no number.", "Write a number, or null for no limit.")
    return float(value)


def _whole(entry: _Pairs, key: str) -> int | None:
    value = _number(entry, key)
    if value is not None and value != round(value):
        raise _UnusableError(f"Its {key} is no whole number.", "Write 3, or null for no limit.")
    return None if value is None else round(value)
