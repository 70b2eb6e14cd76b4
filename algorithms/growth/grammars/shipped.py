"""The grammars that come along, as files in grammars/."""

from __future__ import annotations

import difflib
from importlib import resources

from ...errors import InputError
from ..grammar import Grammar
from .file import parse_grammar

#: Names of the grammars that come along, the four of CitySprout first.
GRAMMARS: tuple[str, ...] = ("organic", "grid", "hex", "line", "radial", "suburb")


def shipped_grammar(name: str) -> Grammar:
    """Read a grammar that comes along.

    Parameters
    ----------
    name
        One of `GRAMMARS`; capitals do not matter.

    Returns
    -------
    Grammar
        With angles in radians; its unit of length is 100 m.

    Raises
    ------
    InputError
        If there is no grammar of that name.
    """
    key = name.strip().casefold()
    if key not in GRAMMARS:
        near = difflib.get_close_matches(key[:40], GRAMMARS, n=1)
        hint = f"Did you mean {near[0]}? " if near else ""
        raise InputError(
            f"There is no grammar {name[:40]!r}.",
            f"{hint}Give {', '.join(GRAMMARS)}, or the file of a grammar of your own.",
        )
    file = resources.files(__package__) / f"{key}.json"
    return parse_grammar(file.read_text(encoding="utf-8"), f"{key}.json")
