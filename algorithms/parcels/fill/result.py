"""What comes out of the chain from blocks to plots."""

from __future__ import annotations

from dataclasses import dataclass

from shapely.geometry import Point

from ..types import Plot


@dataclass(frozen=True)
class FillProblem:
    """Something that a planner should know about a block.

    Attributes
    ----------
    block_id
        Its number.
    place
        Where to look.
    reason
        What is the matter, a sentence.
    done
        What was done about it, a sentence.
    """

    block_id: int
    place: Point
    reason: str
    done: str


@dataclass(frozen=True)
class Filled:
    """Plots of blocks, and what went otherwise than asked.

    Attributes
    ----------
    plots
        Of each block, in the order of the blocks; they tile it.
    problems
        Exceptions, fallbacks and shortfalls with their reasons.
    requested
        Parcels that the land of the blocks holds at the width and depth asked for.
    achieved
        Parcels that there are.
    """

    plots: list[list[Plot]]
    problems: list[FillProblem]
    requested: int
    achieved: int
