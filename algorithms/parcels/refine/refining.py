"""Refining the plots of blocks: from polygons to unknowns, and back where that is better."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from ...errors import InputError
from ...progress import Progress, Silent
from ..rules import ParcelRules
from ..types import Block, Plot
from .best import Best
from .descent import Descent, Limits, open_length
from .forces import Forces, Weights
from .layout import Layout
from .mesh import Flags, Floats, Ints, build_mesh
from .rails import find_rails

#: Uses whose outline holds still, while the ends of cuts may slide along it.
HELD = ("court", "lane", "street")
#: Plots that are worked on together; more make no difference to the result.
CHUNK = 1000
#: Blocks that have undesirable parcels after the first attempt get another, from their start again.
ATTEMPTS = (Weights(), Weights(area=1.5, room=1.02))
#: Blocks with a better score than this stay as they are: nobody sees 0.1 degrees.
GOOD = 0.1
#: Plots may not become smaller or larger than this, times the area that they came with or that
#: is common in their block.
SHRINK, GROW = 0.7, 1.4


def refine_blocks(
    blocks: Sequence[Block],
    plots: Sequence[Sequence[Plot]],
    rules: ParcelRules,
    progress: Progress = Silent(),  # noqa: B008
    *,
    iterations: int = 10,
) -> list[list[Plot]]:
    """Make the parcels of blocks squarer and of more even size.

    Ends of cuts slide along the outline of their block, vertices inside move freely; the outline
    itself, courts, lanes and inner streets stay. Least squares on the corners of parcels, their
    straight T-junctions, areas and rectangles around, by Levenberg-Marquardt; of each block the
    better of before and after is kept (`block_scores`).

    Parameters
    ----------
    blocks
        The blocks.
    plots
        The plots of each block, which tile it.
    rules
        What is asked of parcels: no piece of frontage falls under `min_frontage`, no area out of
        its bounds, where it was not before.
    progress
        Hears of the work; when cancelled, the best so far is returned.
    iterations
        Most steps.

    Returns
    -------
    list of list of Plot
        The plots of each block in their order, tiling it with shared vertices. They do not depend
        on the other blocks. Plots that leave gaps or overlap (by more than 1 mm) are returned
        as they came, with a warning.

    Raises
    ------
    InputError
        If there are not as many lists of plots as blocks.

    Notes
    -----
    The measures are those of Yang et al. 2013 (UP), section 7. As in UP section 6, ends slide along
    the boundary without crossing its corners and a weak pull holds vertices where they were, but
    there streets are moved, here the cuts between parcels.
    """
    if len(blocks) != len(plots):
        raise InputError(
            f"There are plots of {len(plots)} blocks, but {len(blocks)} blocks.",
            "Give the plots of every block, in the order of the blocks.",
        )
    found: list[list[Plot]] = [list(group) for group in plots]
    first = 0
    while first < len(blocks) and not progress.cancelled():
        progress.stage("Refining parcels", first / len(blocks))
        end, size = first, 0
        while end < len(blocks) and (end == first or size + len(plots[end]) <= CHUNK):
            size += len(plots[end])
            end += 1
        found[first:end] = _refine(blocks[first:end], plots[first:end], rules, progress, iterations)
        first = end
    return found


def _refine(
    blocks: Sequence[Block],
    plots: Sequence[Sequence[Plot]],
    rules: ParcelRules,
    progress: Progress,
    iterations: int,
) -> list[list[Plot]]:
    """Refine some blocks at once."""
    mesh = build_mesh(blocks, plots)
    for block, group, sound in zip(blocks, plots, mesh.sound.tolist()):
        if group and not sound:
            progress.warn(
                f"The plots of block {block.block_id} overlap or leave gaps; they stay as they are."
            )
    if not mesh.sound.any():
        return [list(group) for group in plots]
    use = [plot.use for group in plots for plot in group]
    outside = np.ones(len(blocks), bool)
    held = np.r_[np.isin(use, HELD), outside]
    parcel = np.r_[np.isin(use, ["parcel"]), ~outside]
    layout = Layout.of(mesh, find_rails(mesh, held))
    flat = np.array([plot.polygon for group in plots for plot in group], dtype=object)
    before = np.r_[shapely.area(flat), np.zeros(len(blocks))]
    common = _common(before, parcel, mesh.block_of_face, len(blocks))
    target = np.where(held, 0.0, _targets(before, common))
    limits = _limits(layout, blocks, rules, *_bounds(rules, before, common, parcel))
    green = np.isin(use, ["green"])
    best = Best(layout, plots, parcel[: len(flat)], green)
    limits = replace(limits, parts=np.r_[best.parts, np.zeros(len(blocks), int)])
    todo, order = mesh.sound & (best.score > GOOD), None
    for weights in ATTEMPTS:
        here = todo[mesh.block_of_face]
        forces = Forces(layout, parcel & here, ~held & here, target, weights)
        descent = Descent(layout, forces, limits, ~held & here, order)
        order = order or descent.bands
        state = descent.run(iterations, todo, progress)
        best.offer(state, todo)
        best.offer(layout.midway(state), todo)
        todo = best.awkward()
    return best.plots()


def _common(area: Floats, parcel: Flags, block: Ints, blocks: int) -> Floats:
    """Area that is common among the parcels of the block, for others their own, shape (f,)."""
    found = area.copy()
    for b in range(blocks):
        mine = parcel & (block == b)
        if mine.any():
            found[mine] = np.median(area[mine])
    return found


def _targets(own: Floats, common: Floats) -> Floats:
    """Areas to aim at: between what plots have and what is common in their block, shape (f,)."""
    target = 0.6 * np.clip(own, 0.85 * common, 1.7 * common)
    return np.asarray(target + 0.4 * np.clip(own, 0.95 * common, 1.3 * common))


def _bounds(
    rules: ParcelRules, own: Floats, common: Floats, parcel: Flags
) -> tuple[Floats, Floats]:
    """Least and largest area of each plot, shapes (f,)."""
    least, most = SHRINK * np.minimum(own, common), GROW * np.maximum(own, common)
    least = np.where(parcel, np.maximum(least, np.minimum(rules.least_area, own)), least)
    most = np.where(parcel, np.minimum(most, np.maximum(rules.largest_area, own)), most)
    return least, most


def _limits(
    layout: Layout, blocks: Sequence[Block], rules: ParcelRules, smallest: Floats, largest: Floats
) -> Limits:
    """Find which lengths must not be given up."""
    rails = layout.rails
    # stops in the order that they have on their rails; the ends of the same rail last
    count, number = len(rails.slider), len(rails.first) - 1
    kind = np.r_[np.ones(count), np.zeros(number), np.full(number, 2)]
    order = np.lexsort((rails.start, kind, rails.rail))
    same = rails.rail[order][1:] == rails.rail[order][:-1]
    before, behind = order[:-1][same], order[1:][same]
    long = rails.start[behind] - rails.start[before]
    least = np.minimum(rules.min_frontage, long)
    closed = _closed(layout, blocks)
    limits = Limits(
        before, behind, least, closed, least, smallest, largest, np.zeros(len(largest), int)
    )
    if len(closed):
        opened = open_length(limits, rails.rail, rails.start)
        limits = replace(limits, open_least=np.minimum(rules.min_frontage, opened))
    return limits


def _closed(layout: Layout, blocks: Sequence[Block]) -> Floats:
    """Parts of rails that give no access: rail, begin, end; shape (c, 3)."""
    rails, mesh = layout.rails, layout.mesh
    found = []
    shut = {i: block.closed for i, block in enumerate(blocks) if not block.closed.is_empty}
    for rail in range(len(rails.first) - 1 if shut else 0):
        mine = slice(rails.first[rail], rails.first[rail + 1])
        lines = shut.get(int(mesh.block[rails.bend[mine.start]]))
        if lines is None:
            continue
        line = shapely.LineString(mesh.xy[rails.bend[mine]])
        near = shapely.intersection(line, shapely.buffer(lines, 0.01, cap_style="flat"))
        for part in shapely.get_parts(near):
            if part.length > 0:
                ends = shapely.line_locate_point(line, shapely.points(part.coords))
                found.append((rail, ends.min(), ends.max()))
    return np.array(found, dtype=float).reshape(-1, 3)
