"""Colours of shapes for which nobody chose any."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from ..types import Template

#: Soft colours that differ from each other, also in print and for most who see few colours.
PALETTE = (
    "#8fb8de", "#f2c879", "#9ccb9a", "#e39a8b", "#bda6d6", "#7fc4bd", "#e8e08a", "#d9a7c7",
    "#a9b7c6", "#c9b08e",
)  # fmt: skip


def coloured(templates: Sequence[Template]) -> tuple[Template, ...]:
    """Give shapes colours of their own where none of them has one.

    Parameters
    ----------
    templates
        Shapes; where any has a colour other than the usual grey all stay as they are.

    Examples
    --------
    >>> two = [Template(name, frozenset({(0, 0)})) for name in ("cell", "closet")]
    >>> [own.colour for own in coloured(two)]
    ['#8fb8de', '#f2c879']
    """
    if any(own.colour != Template.colour for own in templates):
        return tuple(templates)
    return tuple(
        dataclasses.replace(own, colour=PALETTE[at % len(PALETTE)])
        for at, own in enumerate(templates)
    )
