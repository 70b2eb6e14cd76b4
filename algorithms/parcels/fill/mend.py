"""Make blocks sound before they are cut: valid, flat, in one piece."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import shapely
from shapely.geometry import Point, Polygon
from shapely.geometry.polygon import orient

from ..types import Block
from .result import FillProblem


def sound_parts(block: Block) -> tuple[list[Block], list[FillProblem]]:
    """Return the sound parts of a block, with its number; itself if it is sound.

    Parameters
    ----------
    block
        A block of any quality.

    Returns
    -------
    parts
        Valid blocks in one piece each, exteriors counter-clockwise; none if it has no area.
    problems
        What was repaired.
    """
    outline: Any = block.polygon
    if (
        outline is None
        or outline.is_empty
        or not np.isfinite(shapely.get_coordinates(outline)).all()
    ):
        place = Point(0.0, 0.0)
        if outline is not None and not outline.is_empty:
            xy = shapely.get_coordinates(outline)
            good = xy[np.isfinite(xy).all(axis=1)]
            place = Point(good[0]) if len(good) else place
        return [], [_problem(block, place, "The block has no outline.", "It was left out.")]
    problems = []
    if not outline.is_valid:
        why = shapely.is_valid_reason(outline).split("[")[0].lower()
        place = Point(shapely.get_coordinates(outline)[0])
        outline = shapely.make_valid(outline, method="structure", keep_collapsed=False)
        problems.append(
            _problem(block, place, f"The outline is invalid ({why}).", "It was repaired.")
        )
    pieces = [
        piece
        for piece in shapely.get_parts(shapely.force_2d(outline))
        if isinstance(piece, Polygon) and piece.area > 0
    ]
    if not pieces:
        place = Point(shapely.get_coordinates(block.polygon)[0])
        problems.append(_problem(block, place, "The block has no area.", "It was left out."))
    if len(pieces) == 1 and pieces[0] is block.polygon:
        return [block], problems
    return [replace(block, polygon=orient(piece)) for piece in pieces], problems


def _problem(block: Block, place: Point, reason: str, done: str) -> FillProblem:
    return FillProblem(block.block_id, place, reason, done)


def sound_blocks(
    blocks: Sequence[Block],
) -> tuple[list[Block], list[int], list[FillProblem]]:
    """Return the sound parts of blocks, the index of the block of each, and what was repaired.

    Parameters
    ----------
    blocks
        Blocks of any quality.
    """
    parts: list[Block] = []
    of: list[int] = []
    problems: list[FillProblem] = []
    for index, block in enumerate(blocks):
        mine, told = sound_parts(block)
        parts += mine
        of += [index] * len(mine)
        problems += told
    return parts, of, problems
