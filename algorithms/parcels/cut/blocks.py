"""Cut blocks into parcels: try several layouts of each, keep the best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import QhullError

from ...errors import CancelledError
from ...measure.parcel_shape import corner_deviation, rectangle_ratio, undesirable
from ...progress import Progress, Silent
from ..rules import ParcelRules
from ..types import Block, Plot
from .corners import ACUTE_FROM, TURN, Style
from .draft import Draft, Ground, draft
from .fronts import choices
from .kept import Kept
from .line import Floats
from .outline import Side, sides, usable
from .pieces import Pieces

#: Blocks scored together: one call of the measures for all their layouts.
BATCH = 24
#: How many sets of fronts are built with their corners both ways, if their score is that near.
SECOND, NEAR_BEST = 2, 6.0
#: Blocks whose largest circle has a smaller radius than that many depths may do without a court.
NO_COURT = 1.6
#: `Style.wide` and `Style.spare` that are tried where they may help.
WIDER = (2.0, 0.17)
#: The areas of plots and block agree to this, relative.
EXACT = 1e-6
#: What degenerate land may raise.
FAILURES = (shapely.errors.GEOSException, QhullError, ValueError, IndexError)
#: Blocks cut before: those of a trial are cut again when the trial is chosen.
KEPT = Kept()


def cut_blocks(
    blocks: Sequence[Block], rules: ParcelRules, progress: Progress | None = None
) -> list[list[Plot]]:
    """Cut blocks into rows of parcels along their streets.

    Several sets of sides are tried as fronts, then two ways to treat corners; the layout with
    the best `score` is kept. Rows meet where two fronts are equally far; parcels are cut square to
    their street at places that share out the area. What is deeper than two rows becomes a court,
    pointed corners and land without access become greens.

    Parameters
    ----------
    blocks
        The blocks; where they are closed, no parcel gets its frontage.
    rules
        What is asked of parcels.
    progress
        Told after every batch of blocks.

    Returns
    -------
    list of list of Plot
        For each block plots that tile it. A block that cannot be cut sensibly is one green, with
        a note that says why.

    Raises
    ------
    CancelledError
        If the caller cancelled.

    References
    ----------
    Urban Pattern (Yang et al. 2013), section 7 for what makes a parcel desirable.
    """
    progress = progress or Silent()
    found: list[list[Plot]] = []
    for first in range(0, len(blocks), BATCH):
        progress.stage("Cutting blocks into parcels", first / len(blocks))
        _ask(progress)
        batch = blocks[first : first + BATCH]
        known = [KEPT.find(b, rules) for b in batch]
        fresh = [b for b, plots in zip(batch, known) if plots is None]
        why = [_hopeless(b, rules) for b in fresh]
        done = iter(cut_all([Work(b, rules) for b, w in zip(fresh, why) if not w], progress))
        cut = iter([[Plot(b.polygon, "green", w)] if w else next(done) for b, w in zip(fresh, why)])
        for block, before in zip(batch, known):
            plots = next(cut) if before is None else list(before)
            KEPT.keep(block, rules, plots)
            found.append(plots)
    return found


def _ask(progress: Progress) -> None:
    """Stop if the caller cancelled."""
    if progress.cancelled():
        msg = "Cancelled while blocks were cut into parcels."
        raise CancelledError(msg)


def _hopeless(block: Block, rules: ParcelRules) -> str:
    """Return why a block cannot be cut at all, empty if it can."""
    if not usable(block.polygon):
        return "outline not valid"
    return "too small" if block.polygon.area < rules.least_area else ""


class Work:
    """One block and the layouts tried for it.

    Parameters
    ----------
    block
        The block.
    rules
        What is asked of parcels.
    """

    def __init__(self, block: Block, rules: ParcelRules) -> None:
        self.block, self.rules = block, rules
        self.outline: list[Side] = sides(block)
        turning = [s for s in self.outline if s.turn > TURN]
        self.corners = np.array(
            [x for s in turning for x in (s.xy[-1], self.outline[s.after].xy[0])]
        ).reshape(-1, 2)
        self.radius = float(shapely.maximum_inscribed_circle(block.polygon, tolerance=0.5).length)
        self.ground = Ground(block.polygon, self.outline, self.radius, rules)
        self.tried: list[tuple[float, tuple[int, ...], Style, list[Plot]]] = []
        self.drafts: list[tuple[bytes, Draft]] = []
        self.fresh: list[tuple[bytes, list[Plot]]] = []
        #: which draft fronts and style lead to: several may lead to the same
        self.asked: list[tuple[tuple[int, ...], Style, bytes]] = []
        self.marks: dict[bytes, tuple[float, list[Plot]]] = {}
        #: why layouts were dropped
        self.dropped: list[Exception] = []

    def build(self, fronts: tuple[int, ...], style: Style) -> None:
        """Draft one layout; one that fails is dropped."""
        try:
            key, made = draft(self.ground, fronts, style)
        except FAILURES as error:
            # degenerate land, of a thousand blocks one: the other layouts stand in for this one
            self.dropped.append(error)
        else:
            self.asked.append((fronts, style, key))
            if made is not None:
                self.drafts.append((key, made))

    def finish(self, angle: Floats, ratio: Floats) -> None:
        """Turn the drafts into plots; what fails or does not tile the block is dropped.

        Parameters
        ----------
        angle, ratio
            `corner_deviation` and `rectangle_ratio` of the pieces of all drafts, shape (n,).
        """
        first, area = 0, self.block.polygon.area
        for key, made in self.drafts:
            mine = slice(first, first + len(made.pieces))
            first = mine.stop
            try:
                pieces = Pieces(
                    made, self.block, self.rules, self.corners, angle[mine], ratio[mine]
                )
                pieces.merge_small()
                plots = pieces.plots()
            except FAILURES as error:
                self.dropped.append(error)
                continue
            if abs(float(pieces.areas().sum()) - area) < EXACT * area:
                self.fresh.append((key, plots))
            else:
                self.dropped.append(ValueError("The plots do not tile the block."))
        self.drafts = []

    def note(self, marks: Floats) -> None:
        """Take the scores of the layouts that were finished, shape (k,)."""
        for (key, plots), mark in zip(self.fresh, marks.tolist()):
            self.marks[key] = mark, plots
        for fronts, style, key in self.asked:
            if key in self.marks:
                mark, plots = self.marks[key]
                self.tried.append((mark, fronts, style, plots))
        self.fresh, self.asked = [], []

    def first(self) -> None:
        """Build a layout for each set of fronts."""
        for fronts in choices(self.outline, self.radius, self.rules):
            self.build(fronts, Style())

    def second(self) -> None:
        """Build the best sets of fronts with their corners the other way."""
        best = sorted(self.tried, key=lambda x: x[0])
        for mark, fronts, _, plots in best[:SECOND]:
            if mark < best[0][0] + NEAR_BEST:
                for style in self._styles(fronts, any(p.use == "court" for p in plots)):
                    self.build(fronts, style)

    def _styles(self, fronts: tuple[int, ...], has_court: bool) -> list[Style]:
        """Return the ways to treat corners that may make a difference."""
        turns = [self.outline[k].turn for k in fronts if self.outline[k].after in fronts]
        found = [Style(straight=True)] if any(x > TURN for x in turns) else []
        if any(x > ACUTE_FROM for x in turns):
            found += [Style(early=True), Style(straight=True, early=True)]
        if has_court and self.radius < NO_COURT * self.rules.depth:
            found += [replace(x, court=False) for x in (Style(), *found)]
        return found

    def third(self) -> None:
        """Build the best layout once more with wider parcels at slanted ends."""
        if self.tried:
            mark, fronts, style, plots = min(self.tried, key=lambda x: x[0])
            if mark > 30 / len(plots):
                self.build(fronts, replace(style, wide=WIDER[0], spare=WIDER[1]))

    def best(self) -> list[Plot]:
        """Return the best layout, or the block as one green."""
        if not self.tried:
            reached = any(s.open and s.length >= self.rules.min_frontage for s in self.outline)
            why = "no layout found" if reached else "no street access"
            return [Plot(self.block.polygon, "green", why)]
        return min(self.tried, key=lambda x: x[0])[3]


def cut_all(work: list[Work], progress: Progress) -> list[list[Plot]]:
    """Try layouts of some blocks in three rounds; return the best of each.

    Parameters
    ----------
    work
        The blocks.
    progress
        Asked for cancellation.
    """
    for build in (Work.first, Work.second, Work.third):
        for one in work:
            _ask(progress)
            build(one)
        _finish(work)
        marks = score([plots for one in work for _, plots in one.fresh])
        last = np.cumsum([len(one.fresh) for one in work])
        for one, mine in zip(work, np.split(marks, last[:-1])):
            one.note(mine)
    return [one.best() for one in work]


def _finish(work: list[Work]) -> None:
    """Turn all drafts into plots, their pieces measured together."""
    drafts = [made.pieces for one in work for _, made in one.drafts]
    if not drafts:
        return
    pieces = np.concatenate(drafts)
    angle, ratio = corner_deviation(pieces), rectangle_ratio(pieces)
    first = 0
    for one in work:
        last = first + sum(len(made.pieces) for _, made in one.drafts)
        one.finish(angle[first:last], ratio[first:last])
        first = last


def score(layouts: Sequence[Sequence[Plot]]) -> npt.NDArray[np.float64]:
    """Return how poor layouts of blocks are: 0 for equal rectangles on all of the land.

    Sum of 30 x share of undesirable parcels, mean deviation of corners (degrees), 50 x (mean
    rectangle / area - 1), 40 x share of land left green, 8 x coefficient of variation of area
    and 20 x what it is above .15: what weighs about the same to a planner in practice.

    Parameters
    ----------
    layouts
        Plots of each layout.

    Returns
    -------
    ndarray of float, shape (len(layouts),)
        1000 for layouts without parcels.
    """
    owner = np.array([k for k, plots in enumerate(layouts) for p in plots], dtype=np.int64)
    polygons = np.array([p.polygon for plots in layouts for p in plots], dtype=object)
    is_parcel = np.array([p.use == "parcel" for plots in layouts for p in plots], dtype=bool)
    if not is_parcel.any():
        return np.full(len(layouts), 1000.0)
    count = len(layouts)
    area = shapely.area(polygons)
    whole = np.bincount(owner, area, count)
    own, lots, size = owner[is_parcel], polygons[is_parcel], area[is_parcel]
    number = np.maximum(np.bincount(own, minlength=count), 1)
    angle, ratio = corner_deviation(lots), rectangle_ratio(lots)
    used = np.bincount(own, size, count)
    mean = used / number
    spread = np.sqrt(np.bincount(own, (size - mean[own]) ** 2, count) / number)
    varies = spread / np.maximum(mean, 1e-9)
    found = (
        30 * np.bincount(own, undesirable(angle, ratio), count) / number
        + np.bincount(own, angle, count) / number
        + 50 * (np.bincount(own, ratio, count) / number - 1)
        + 40 * (1 - used / np.maximum(whole, 1e-9))
        + 8 * varies
        + 20 * np.maximum(varies - 0.15, 0)
    )
    return np.asarray(np.where(used > 0, found, 1000.0))
