"""Parcels in strips of the straight skeleton, cut across at parcel widths.

After C. A. Vanegas, T. Kelly, B. Weber, J. Halatsch, D. G. Aliaga and P. Müller, "Procedural
generation of parcels in urban modeling", Computer Graphics Forum 31 (2012), section 4.1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...errors import CancelledError
from ...progress import Progress, Silent
from ..rules import ParcelRules
from ..types import Block, Plot
from .across import cut_across
from .faces import Side, skeleton_faces
from .halve import halve_block
from .mosaic import Mosaic
from .wavefront import SkeletonError

#: Blocks whose middle is at most this many depths from the street get deeper parcels, no court.
DEEPER = 1.45


def skeleton_blocks(
    blocks: Sequence[Block],
    rules: ParcelRules,
    seed: int = 0,
    progress: Progress | None = None,
) -> list[list[Plot]]:
    """Cut blocks into strips of the straight skeleton, and these across (Vanegas et al. 2012).

    The land nearest to each side of a block is its strip; at corners of two streets the longer
    takes the land up to a perpendicular of the shorter. Strips are cut into parcels of equal
    area at right angles to the street. Where a block is deeper than 1.45 depths on each side,
    strips end at the depth wished for, and a court is left.

    Parameters
    ----------
    blocks
        Blocks; every one is tiled exactly.
    rules
        What is asked; `width`, `depth`, areas and `min_frontage` count.
    seed
        Of the halving that stands in where a block has no usable skeleton.
    progress
        Asked for cancellation, told of blocks without a skeleton; None for none.

    Returns
    -------
    list of list of Plot
        Plots of each block. Parcels all have `min_frontage`.

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
        try:
            found.append(skeleton_block(block, rules))
        except SkeletonError as error:
            progress.info(f"Block {block.block_id} is halved instead: {error}")
            found.append(halve_block(block, rules, seed))
    return found


def skeleton_block(block: Block, rules: ParcelRules) -> list[Plot]:
    """Cut one block, see `skeleton_blocks`.

    Parameters
    ----------
    block, rules
        See `skeleton_blocks`.

    Raises
    ------
    SkeletonError
        If the block has no usable skeleton.
    """
    mosaic = Mosaic(block.polygon, block.closed)
    if mosaic.frontage(0) < rules.min_frontage:
        return [Plot(block.polygon, "green", "no street access")]
    if block.polygon.area < rules.least_area:
        return [Plot(block.polygon, "green", "too small for a parcel")]
    sides, cores = skeleton_faces(mosaic, rules.depth, DEEPER * rules.depth)
    strips = give_closed_sides(mosaic, sides)
    strips = give_corners(mosaic, strips)
    parcels = []
    for side in strips:
        parcels += cut_across(mosaic, side.face, side.chain, rules) if side.street else [side.face]
    return settle(mosaic, parcels, cores, rules)


def give_closed_sides(mosaic: Mosaic, sides: Sequence[Side]) -> list[Side]:
    """Join the land along sides without access to the street strip that it touches most.

    Parameters
    ----------
    mosaic, sides
        See `faces.skeleton_faces`.
    """
    found = list(sides)
    waiting = [side for side in sides if not side.street]
    while waiting:
        for side in waiting:
            streets = {other.face: i for i, other in enumerate(found) if other.street}
            shared = mosaic.neighbours(side.face, streets)
            face = max(shared, key=lambda f: shared[f], default=None)
            joined = mosaic.join([face, side.face]) if face is not None else None
            if face is not None and joined is not None:
                found[streets[face]] = found[streets[face]]._replace(face=joined)
                found.remove(side)
                waiting.remove(side)
                break
        else:
            break
    return found


def give_corners(mosaic: Mosaic, sides: Sequence[Side]) -> list[Side]:
    """Give the land at convex corners of two streets to the longer one.

    Parameters
    ----------
    mosaic, sides
        See `faces.skeleton_faces`.
    """
    found = list(sides)
    for one in range(len(found)):
        begins = [
            i for i, side in enumerate(found)
            if i != one and side.ring == found[one].ring and side.chain[0] == found[one].chain[-1]
        ]  # fmt: skip
        for two in begins:
            a, b = found[one], found[two]
            if not (a.street and b.street and _convex(mosaic, a.chain, b.chain)):
                continue
            lengths = [_along(mosaic, side) for side in (a, b)]
            win, lose = (one, two) if lengths[0] >= lengths[1] else (two, one)
            found[win], left = _give(mosaic, found[win], found[lose], b.chain[0])
            if left is None:
                found[lose] = found[lose]._replace(face=-1)
            else:
                found[lose] = found[lose]._replace(face=left)
    return [side for side in found if side.face >= 0]


def _along(mosaic: Mosaic, side: Side) -> float:
    return mosaic.length(zip(side.chain, side.chain[1:]))


def _convex(mosaic: Mosaic, before: Sequence[int], after: Sequence[int]) -> bool:
    (ax, ay), (bx, by), (cx, cy) = (mosaic.xy[v] for v in (before[-2], before[-1], after[1]))
    return (bx - ax) * (cy - by) - (by - ay) * (cx - bx) > 0


def _give(mosaic: Mosaic, winner: Side, loser: Side, corner: int) -> tuple[Side, int | None]:
    """Move the land at a corner; return the winner, and the loser's face or None if it is gone."""
    if winner.face < 0 or loser.face < 0:
        return winner, loser.face
    junction = _diagonal_end(mosaic, winner.face, loser.face, corner)
    if junction is None:
        return winner, loser.face
    place, way, inner = _foot(mosaic, loser.chain, junction)
    parts = mosaic.cut(loser.face, place, way, only_at=True) if inner else [loser.face]
    moved = [part for part in parts if corner in mosaic.refine(part)[0]]
    rest = [part for part in parts if part not in moved]
    if len(moved) != 1 or len(rest) > 1 or (not rest and _has_far_end(mosaic, loser, corner)):
        return winner, _back(mosaic, parts, loser.face)
    joined = mosaic.join([winner.face, moved[0]])
    if joined is None:
        return winner, _back(mosaic, parts, loser.face)
    return winner._replace(face=joined), rest[0] if rest else None


def _back(mosaic: Mosaic, parts: Sequence[int], face: int) -> int:
    """Take a cut back that was not followed by anything, and return the face."""
    if list(parts) != [face]:
        mosaic.undo(parts)
    return face


def _has_far_end(mosaic: Mosaic, side: Side, corner: int) -> bool:
    """Tell whether a face still reaches the other end of its side."""
    far = side.chain[0] if side.chain[-1] == corner else side.chain[-1]
    return far in mosaic.refine(side.face)[0]


def _diagonal_end(mosaic: Mosaic, one: int, two: int, corner: int) -> int | None:
    """Return where the line between two strips that begins at a corner ends."""
    mine = {(b, a) for a, b in mosaic.edges(one)}
    shared = mine.intersection(mosaic.edges(two))
    onwards: dict[int, list[int]] = {}
    for a, b in shared:
        onwards.setdefault(a, []).append(b)
        onwards.setdefault(b, []).append(a)
    here, last = corner, -1
    while True:
        ends = [v for v in onwards.get(here, []) if v != last]
        if len(ends) != 1:
            return None if here == corner else here
        last, here = here, ends[0]


def _foot(
    mosaic: Mosaic, chain: Sequence[int], vertex: int
) -> tuple[tuple[float, float], tuple[float, float], bool]:
    """Return the nearest place on a chain, the way from there, and whether it is inside it."""
    xy = np.array([mosaic.xy[v] for v in chain])
    here = np.array(mosaic.xy[vertex])
    way = np.diff(xy, axis=0)
    size = np.maximum((way**2).sum(axis=1), 1e-18)
    t = np.clip(((here - xy[:-1]) * way).sum(axis=1) / size, 0, 1)
    feet = xy[:-1] + t[:, None] * way
    best = int(np.argmin(((feet - here) ** 2).sum(axis=1)))
    x, y = feet[best].tolist()
    off = math.dist((x, y), mosaic.xy[vertex])
    ends = min(math.dist((x, y), mosaic.xy[chain[0]]), math.dist((x, y), mosaic.xy[chain[-1]]))
    hx, hy = here.tolist()
    inner = off > 1e-6 and ends > 0.05
    return (x, y), ((hx - x) / max(off, 1e-9), (hy - y) / max(off, 1e-9)), inner


def settle(mosaic: Mosaic, parcels: list[int], cores: list[int], rules: ParcelRules) -> list[Plot]:
    """Join parcels that are too small or have too little frontage to others; name the rest.

    Parameters
    ----------
    mosaic
        The block.
    parcels, cores
        Faces that tile it.
    rules
        See `skeleton_blocks`.
    """
    courts = [core for core in cores if mosaic.area(core) >= rules.least_area]
    parcels = [*parcels, *(core for core in cores if core not in courts)]
    green: list[int] = []
    while True:
        wrong = [
            face for face in parcels
            if mosaic.area(face) < rules.least_area or mosaic.frontage(face) < rules.min_frontage
        ]  # fmt: skip
        if not wrong:
            break
        face = min(wrong, key=mosaic.area)
        shared = mosaic.neighbours(face, parcels)
        fits = [f for f in shared if mosaic.area(f) + mosaic.area(face) <= rules.largest_area]
        joined = None
        for other in sorted(fits, key=lambda f: -shared[f]):
            joined = mosaic.join([other, face])
            if joined is not None:
                parcels.remove(other)
                parcels.append(joined)
                break
        parcels.remove(face)
        if joined is None:
            green.append(face)
    plots = [Plot(polygon) for polygon in mosaic.polygons(parcels)]
    notes = [
        "no street access" if mosaic.frontage(f) < rules.min_frontage else "too small for a parcel"
        for f in green
    ]
    plots += [Plot(p, "green", note) for p, note in zip(mosaic.polygons(green), notes)]
    deep = "too far from the streets for a parcel"
    return plots + [Plot(polygon, "court", deep) for polygon in mosaic.polygons(courts)]
