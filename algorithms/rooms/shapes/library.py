"""The sets of templates that come along, as JSON beside this file."""

from __future__ import annotations

import difflib
from importlib import resources

from ...errors import InputError
from ..types import Template
from .text import description_of, parse_templates

#: Names of the sets, that of plain shapes first and that of game levels last.
SETS: tuple[str, ...] = ("basic", "hotel", "office", "school", "hospital", "caves")


def template_sets() -> dict[str, str]:
    """Return the sets that come along: name -> what it is for, in one line.

    Examples
    --------
    >>> list(template_sets())
    ['basic', 'hotel', 'office', 'school', 'hospital', 'caves']
    """
    return {name: description_of(_text_of(name), name) for name in SETS}


def shipped_templates(name: str) -> tuple[Template, ...]:
    """Read a set of templates that comes along.

    The shapes of buildings are meant for squares of 3 to 4 m. No numbers are asked, and shares only
    where a building without them would be of no use, so that they fit floors of any size.

    Parameters
    ----------
    name
        One of `template_sets`; capitals do not matter.

    Raises
    ------
    InputError
        If there is no set of that name.
    """
    key = name.strip().casefold()
    if key not in SETS:
        near = difflib.get_close_matches(key[:40], SETS, n=1)
        hint = f"Did you mean {near[0]}? " if near else ""
        raise InputError(
            f"There is no set of room templates {name[:40]!r}.",
            f"{hint}Give {', '.join(SETS)}, or templates of your own.",
        )
    return parse_templates(_text_of(key), f"{key}.json")


def _text_of(name: str) -> str:
    return (resources.files(__package__) / f"{name}.json").read_text(encoding="utf-8")
