"""How paths grow in each path pattern (RZ Table 3)."""

from __future__ import annotations

from dataclasses import dataclass

from ..types import CIRCLE, DIRECT, ENDING
from .ground import Prices


@dataclass(frozen=True)
class Style:
    """How a path pattern grows (RZ Table 3).

    Attributes
    ----------
    exit
        Price of an exit, metres.
    way
        How much of the way that remains from a path counts when joining it.
    far_first
        Whether the furthest row comes first, so that its way becomes a spine.
    loops
        Whether ends are joined to loops.
    """

    exit: float
    way: float
    far_first: bool = False
    loops: bool = False


def style_of(pattern: int, prices: Prices) -> Style:
    """Give the style of a path pattern.

    Parameters
    ----------
    pattern
        1 to 3, `PATH_PATTERNS`.
    prices
        Of exits.
    """
    styles = {
        CIRCLE: Style(6 * prices.exit, 0.3, loops=True),
        DIRECT: Style(prices.exit, 0.5),
        ENDING: Style(15 * prices.exit, 0.15, far_first=True),
    }
    return styles[pattern]
