"""The whole way from blocks to plots: sound blocks, cut, deep ones resolved, all checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import shapely
from shapely.geometry import Point

from ...errors import CancelledError
from ...progress import Progress, Share, Silent
from ..rules import ParcelRules
from ..types import Block, Plot
from .deep import NO_WAY, flag_courts, open_courts, stitch
from .guard import Fault, faults
from .houses import without_oddities
from .lanes import Parted, lane_choices, worth
from .mend import sound_blocks
from .methods import CANCELLED, NAMES, ORDER, Cut, cut_safely, refined
from .result import Filled, FillProblem
from .words import shortfalls


def fill_blocks(
    blocks: Sequence[Block],
    rules: ParcelRules,
    *,
    seed: int = 0,
    progress: Progress | None = None,
    refine: bool = True,
) -> Filled:
    """Cut blocks into plots, whatever the blocks are like.

    Blocks are repaired if need be, cut by the method of the rules (rows along streets, strips of
    the skeleton, halving; each stands in for the one before where that fails), refined, and what
    lies too deep for two rows is treated as the rules ask: a court with a way to it, rear lanes,
    or parcels behind others with access strips. Every block is checked by independent code for
    tiling and access; what breaks is undone and told.

    Parameters
    ----------
    blocks
        Blocks of any quality.
    rules
        What is asked of parcels.
    seed
        Same seed, same plots.
    progress
        Told of the work and asked for cancellation; None for none.
    refine
        Whether plots are improved by least squares.

    Returns
    -------
    Filled
        Plots of each block, problems, and parcels requested and achieved.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    progress = progress or Silent()
    parts, of, problems = sound_blocks(blocks)
    cuts = cut_safely(parts, rules, seed, Share(progress, 0.0, 0.7), refine=refine)
    progress.stage("Looking after deep blocks", 0.7)
    rows = [cut.plots for cut in cuts]
    deep = [i for i, row in enumerate(rows) if any(plot.use == "court" for plot in row)]
    if rules.deep == "lane":
        share = Share(progress, 0.7, 0.95)
        _with_lanes(parts, rows, deep, rules, seed, share, refine)
    for index in deep:
        if progress.cancelled():
            raise CancelledError(CANCELLED)
        rows[index] = _resolved(parts[index], rows[index], rules)
    progress.stage("Checking the parcels", 0.95)
    # what was cut has been checked; what became of it since has not
    new = [i for i, cut in enumerate(cuts) if rows[i] is not cut.plots or not cut.method]
    checked = faults([parts[i] for i in new], [rows[i] for i in new], rules)
    for index, fault in zip(new, checked):
        if fault is not None:
            problems.append(_undone(parts[index], fault))
            rows[index] = cuts[index].plots
    rows = without_oddities(rows, rules)
    for part, cut in zip(parts, cuts):
        problems += _fallbacks(part, cut)
    plots: list[list[Plot]] = [[] for _ in blocks]
    for index, row in zip(of, rows):
        plots[index] += row
    wanted = [round(part.polygon.area / rules.area) for part in parts]
    for part, row, wish in zip(parts, rows, wanted):
        problems += shortfalls(part, row, wish, rules)
    got = sum(plot.use == "parcel" for row in plots for plot in row)
    problems.sort(key=lambda problem: problem.block_id)
    return Filled(plots, problems, sum(wanted), got)


def _with_lanes(
    parts: Sequence[Block],
    rows: list[list[Plot]],
    deep: Sequence[int],
    rules: ParcelRules,
    seed: int,
    progress: Progress,
    refine: bool,
) -> None:
    """Lay lanes in deep blocks and cut anew what they leave; keep what serves more parcels."""
    jobs = []
    for count, index in enumerate(deep):
        progress.stage("Laying rear lanes", 0.5 * count / len(deep))
        if progress.cancelled():
            raise CancelledError(CANCELLED)
        jobs += [(index, way) for way in lane_choices(parts[index], rules, progress.cancelled)]
    pieces = [piece for _, parted in jobs for piece in parted.pieces]
    # where streets are so near, now rows and now strips of the skeleton serve more
    cut = iter(_better_cut(pieces, rules, seed, Share(progress, 0.5, 1.0)))
    best = {index: worth(rows[index], rules)[0] for index in deep}
    kept: dict[int, tuple[Parted, list[list[Plot]]]] = {}
    for index, parted in jobs:
        mine = [next(cut) for _ in parted.pieces]
        gained = sum(worth(row, rules)[0] for row in mine)
        if gained > best[index]:
            best[index], kept[index] = gained, (parted, mine)
    pieces = [piece for parted, _ in kept.values() for piece in parted.pieces]
    mine = [row for _, found in kept.values() for row in found]
    done = iter(refined(pieces, mine, rules, Silent()) if refine and pieces else mine)
    for index, (parted, _) in kept.items():
        row = [plot for _ in parted.pieces for plot in next(done)]
        row = stitch([*row, *(Plot(lane, "lane") for lane in parted.lanes)])
        if not any(faults([parts[index]], [row], rules)):
            rows[index] = row


def _better_cut(
    pieces: Sequence[Block], rules: ParcelRules, seed: int, progress: Progress
) -> list[list[Plot]]:
    """Cut blocks by the method of the rules and by the skeleton; return the better of each."""
    found = [cut.plots for cut in cut_safely(pieces, rules, seed, progress, refine=False)]
    if rules.method != "strips":
        return found
    other = replace(rules, method="skeleton")
    for i, cut in enumerate(cut_safely(pieces, other, seed, progress, refine=False)):
        if worth(cut.plots, rules)[0] > worth(found[i], rules)[0]:
            found[i] = cut.plots
    return found


def _resolved(block: Block, row: list[Plot], rules: ParcelRules) -> list[Plot]:
    """Give courts ways, or make parcels with access strips of them; no change if that fails."""
    if not any(plot.use == "court" for plot in row):
        return row
    work = flag_courts if rules.deep == "flag" else open_courts
    try:
        found = work(block, row, rules)
    except Exception:  # the court stays as it is, which the planner is told
        found = []
    if not found or any(faults([block], [found], rules)):
        return [replace(p, note=NO_WAY) if p.use == "court" else p for p in row]
    return found


def _undone(block: Block, fault: Fault) -> FillProblem:
    return FillProblem(
        block.block_id, fault.place, fault.reason, "What was done for its depth was undone."
    )


def _fallbacks(block: Block, cut: Cut) -> list[FillProblem]:
    """Tell of the methods that failed on a block."""
    found = []
    for method, fault in cut.failed:
        later = ORDER[ORDER.index(method) + 1 :]
        name = NAMES[cut.method] if cut.method else "one green"
        if later and cut.method != later[0] and cut.method:
            name = NAMES[later[0]]
        reason = f"It could not be cut into {NAMES[method]}: {fault.reason}"
        found.append(FillProblem(block.block_id, _place(fault.place), reason, f"Instead: {name}."))
    return found


def _place(place: Point) -> Point:
    x, y = shapely.get_x(place), shapely.get_y(place)
    return Point(float(x), float(y))
