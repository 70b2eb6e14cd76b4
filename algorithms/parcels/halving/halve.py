"""Parcels by halving: smallest rectangles cut in the middle, street access kept.

After C. A. Vanegas, T. Kelly, B. Weber, J. Halatsch, D. G. Aliaga and P. Müller, "Procedural
generation of parcels in urban modeling", Computer Graphics Forum 31 (2012), section 4.2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...errors import CancelledError
from ...progress import Progress, Silent
from ..rules import ParcelRules
from ..types import Block, Plot
from .mosaic import Mosaic
from .rectangle import smallest_rectangle

#: Where else than in the middle a cut is tried, as a share of the rectangle's side.
PLACES = (0.5, 0.4, 0.6, 1 / 3, 2 / 3)
#: Parcels larger than this many times the wish are halved: halves are then as far below it.
LARGE = math.sqrt(2.0)


def halve_blocks(
    blocks: Sequence[Block],
    rules: ParcelRules,
    seed: int = 0,
    progress: Progress | None = None,
    *,
    irregularity: float = 0.0,
) -> list[list[Plot]]:
    """Cut blocks into parcels by halving (Vanegas et al. 2012, section 4.2).

    A piece above sqrt(2) times the area wished for, or above the largest area, is cut in the
    middle of the longer side of the smallest rectangle around it. If a part would lose its
    frontage or be too small, the other axis is tried, then cuts beside the middle, then cuts
    at right angles to the piece's own street edge; if none will do, the piece stays whole.

    Parameters
    ----------
    blocks
        Blocks; every one is tiled exactly.
    rules
        What is asked; `width` x `depth`, least and largest area and `min_frontage` count.
    seed
        Of the irregularity; a block's parcels depend on the seed and its number only.
    progress
        Asked for cancellation; None for none.
    irregularity
        Largest distance of a cut from the middle, as a share of the side, 0 to 0.3.

    Returns
    -------
    list of list of Plot
        Plots of each block. Parcels all have `min_frontage`; a block that gives no access, or
        is too small for a parcel, is one green.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    progress = progress or Silent()
    found = []
    for block in blocks:
        if progress.cancelled():
            msg = "Cutting parcels was cancelled."
            raise CancelledError(msg)
        found.append(halve_block(block, rules, seed, irregularity))
    return found


def halve_block(
    block: Block, rules: ParcelRules, seed: int = 0, irregularity: float = 0.0
) -> list[Plot]:
    """Cut one block, see `halve_blocks`.

    Parameters
    ----------
    block, rules, seed, irregularity
        See `halve_blocks`.
    """
    mosaic = Mosaic(block.polygon, block.closed)
    if mosaic.frontage(0) < rules.min_frontage:
        return [Plot(block.polygon, "green", "no street access")]
    if block.polygon.area < rules.least_area:
        return [Plot(block.polygon, "green", "too small for a parcel")]
    rng = np.random.default_rng([seed, block.block_id])
    limit = most(rules)
    whole: list[int] = []
    todo = [0]
    while todo:
        face = todo.pop()
        parts = []
        if mosaic.area(face) > limit:
            shift = float(rng.uniform(-irregularity, irregularity)) if irregularity else 0.0
            parts = halve(mosaic, face, rules, shift)
        if parts:
            todo += parts
        else:
            whole.append(face)
    whole.sort()
    notes = [
        "no cut keeps street access" if mosaic.area(face) > rules.largest_area else ""
        for face in whole
    ]
    return [Plot(polygon, "parcel", note) for polygon, note in zip(mosaic.polygons(whole), notes)]


def halve(mosaic: Mosaic, face: int, rules: ParcelRules, shift: float = 0.0) -> list[int]:
    """Cut a face once, if a cut leaves all parts large enough and with frontage.

    Parameters
    ----------
    mosaic, face
        Which face of which mosaic.
    rules
        See `halve_blocks`.
    shift
        Distance of the first cut from the middle, as a share of the side.

    Returns
    -------
    list of int
        The parts; none if no cut will do.
    """
    for place, way in cuts(mosaic, face, shift):
        parts = mosaic.cut(face, place, way)
        if len(parts) < 2:
            continue
        if all(
            mosaic.area(part) >= rules.least_area and mosaic.frontage(part) >= rules.min_frontage
            for part in parts
        ):
            return parts
        mosaic.undo(parts)
    return []


def most(rules: ParcelRules) -> float:
    """Return the area above which a piece is cut, square metres."""
    return min(rules.largest_area, LARGE * rules.area)


def cuts(
    mosaic: Mosaic, face: int, shift: float
) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
    """Yield the cuts to try, best first, as a place and a direction.

    Parameters
    ----------
    mosaic, face, shift
        See `halve`.
    """
    (x, y), (wx, wy), long, short = smallest_rectangle(mosaic.places(face))
    for share in PLACES:
        along = (share - 0.5 + shift) * long
        yield (x + along * wx, y + along * wy), (-wy, wx)
        along = (share - 0.5 + shift) * short
        yield (x - along * wy, y + along * wx), (wx, wy)
    fronts = [edge for edge in mosaic.edges(face) if mosaic.is_front(edge)]
    a, b = max(fronts, key=lambda edge: mosaic.length([edge]))
    (ax, ay), (bx, by) = mosaic.xy[a], mosaic.xy[b]
    size = math.dist((ax, ay), (bx, by))
    for share in PLACES:
        place = (ax + share * (bx - ax), ay + share * (by - ay))
        yield place, ((ay - by) / size, (bx - ax) / size)
