"""What a template must be like, wherever it comes from."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import combinations

from ..types import Cells, Template

#: Longest name and use, characters.
LONGEST = 60
#: Slack for shares that are written as decimal numbers.
ROUNDING = 1e-9
_COLOUR = re.compile(r"#[0-9a-fA-F]{6}")

#: What is wrong and what to do about it, a sentence each.
Fault = tuple[str, str]


def connected(cells: Cells) -> bool:
    """Tell whether squares hang together by their sides; no squares do not.

    Parameters
    ----------
    cells
        Squares (column, row).
    """
    left = set(cells)
    waiting = [left.pop()] if left else []
    while waiting:
        column, row = waiting.pop()
        beside = {(column + 1, row), (column - 1, row), (column, row + 1), (column, row - 1)} & left
        left -= beside
        waiting.extend(beside)
    return bool(cells) and not left


def cell_fault(cells: Cells) -> Fault | None:
    """Tell why squares cannot be the shape of a room, None where they can.

    Holes are allowed. Squares that meet in a corner need a square beside both, for else the
    outline of the room would touch itself there.

    Parameters
    ----------
    cells
        Squares (column, row).
    """
    if not cells:
        return "It has no filled square.", "Fill at least one square."
    for column, row in sorted(cells):
        for side in (-1, 1):
            beside = {(column + side, row), (column, row + 1)}
            if (column + side, row + 1) in cells and not beside & cells:
                return (
                    f"Its squares in columns {min(column, column + side) + 1} and "
                    f"{max(column, column + side) + 1} of rows {row + 1} and {row + 2}, counted "
                    "from the lower left, meet only in a corner.",
                    "Fill a square beside both, or make two templates of them.",
                )
    if not connected(cells):
        return (
            "Its squares do not hang together.",
            "Join them along sides, or make a template of each piece.",
        )
    return None


def template_fault(template: Template) -> Fault | None:
    """Tell the first thing that is wrong with a template, None where all is well.

    Parameters
    ----------
    template
        The template.
    """
    if not template.name.strip():
        return "It has no name.", "Give every template a name."
    for what, value in (("name", template.name), ("use", template.use)):
        if len(value) > LONGEST or not value.isprintable():
            return (
                f"Its {what} is too long or has line breaks.",
                f"Give a single line of at most {LONGEST} characters.",
            )
    fault = cell_fault(template.cells)
    if fault:
        return fault
    if not template.rotations or set(template.rotations) - {0, 1, 2, 3}:
        return "It has no rotation, or an unknown one.", "Give 0, 90, 180 or 270."
    if not _COLOUR.fullmatch(template.colour):
        return (
            f"Its colour is '{template.colour[:40]}'.",
            "Write colours as #rrggbb, such as #8fb8de.",
        )
    return _limit_fault(template)


def _limit_fault(template: Template) -> Fault | None:
    if template.least < 0 or (template.most is not None and template.most < 0):
        return "A number of rooms is below 0.", "Give 0 or more."
    if template.most is not None and template.least > template.most:
        return (
            f"It asks for at least {template.least} and at most {template.most} rooms.",
            "Lower min or raise max.",
        )
    most = 1.0 if template.most_share is None else template.most_share
    if not (0 <= template.least_share <= 1 and 0 <= most <= 1):
        return (
            "A share of the area is not between 0 and 1.",
            "Write a quarter of the area as 0.25.",
        )
    if template.least_share > most:
        return (
            f"It asks for at least {template.least_share:g} and at most {most:g} of the area.",
            "Lower min_share or raise max_share.",
        )
    return None


def set_fault(templates: Iterable[Template]) -> Fault | None:
    """Tell why sound templates cannot be used together, None where they can.

    Parameters
    ----------
    templates
        The templates.
    """
    templates = tuple(templates)
    if not templates:
        return "There are no templates.", "Give at least one."
    for a, b in combinations(templates, 2):
        if a.name.casefold() == b.name.casefold():
            return f"Two templates are called '{b.name}'.", "Give each a name of its own."
    shares = sum(template.least_share for template in templates)
    if shares > 1 + ROUNDING:
        return (
            f"The least shares of the area add up to {shares:g}.",
            "Lower min_share of some, so that they add up to 1 or less.",
        )
    shares = sum(1.0 if t.most_share is None else t.most_share for t in templates)
    if shares < 1 - ROUNDING:
        return (
            f"The largest shares of the area add up to {shares:g} only.",
            "Raise max_share of some, or leave it out, so that rooms can cover the floor.",
        )
    return None
