"""Houses, driveways, gardens and pools on parcels (UP section 4, templates of level 3)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon

from ...errors import CancelledError
from ...progress import Progress, Silent
from ..rules import ParcelRules
from ..templates.types import TemplateLibrary
from ..types import Block, Plot
from .assign import all_ways, kits
from .batch import Task
from .match import evaluate
from .regions import NEAR, Outline, Sides, choose_corners, outline, sides

Floats = npt.NDArray[np.float64]
#: A house that has to be bent by more on average is not built (metres).
BENT = 1.0
#: How near the middle of an edge another plot lies that shares it (metres).
BESIDE = 0.05
#: A side of a parcel is a front where this part of it is open.
OPEN = 0.6
#: What an edge lies along: another parcel or closed land, the outside, a plot of street or lane.
SHUT, OUTSIDE, STREET_PLOT, LANE_PLOT = range(4)
#: Parcels whose candidates are warped together.
TOGETHER = 200


@dataclass(frozen=True)
class Furniture:
    """A thing on a parcel.

    Attributes
    ----------
    polygon
        Its outline, metres. The things of a parcel tile it.
    label
        What it is: house, driveway, garden, pool...
    parcel
        Index of its plot.
    template
        Name of the template that it was drawn from.
    """

    polygon: Polygon
    label: str
    parcel: int
    template: str


def furnish(
    plots: Sequence[Plot],
    library: TemplateLibrary,
    rules: ParcelRules,
    seed: int = 0,
    *,
    closed: shapely.Geometry | None = None,
    progress: Progress | None = None,
) -> list[Furniture]:
    """Warp templates of parcels into the parcels among plots.

    Parameters
    ----------
    plots
        Plots of any number of blocks. The front of a parcel is its shortest side along a plot that
        is a street; without, along the outside, where no other plot is; without, along a lane.
    library
        Templates; those of regions "parcel" are used.
    rules
        What parcels are asked for.
    seed
        Where several templates fit, one is drawn, the more likely the better it fits and the
        greater its probability.
    closed
        Lines along which there is no street.
    progress
        Told, and asked for cancellation.

    Returns
    -------
    list
        In the order of the plots. Parcels without a front, with other than four corners, or that
        no house fits on are left empty.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    progress = Silent() if progress is None else progress
    made = {t.name: kits(t, rules) for t in library.labelled("parcel")}
    found: list[Furniture] = []
    blocks = list(_parcels(plots, closed))
    for start in range(0, len(blocks), TOGETHER):
        if progress.cancelled():
            raise CancelledError("Cancelled while parcels were furnished.")
        progress.stage("furnishing parcels", start / len(blocks))
        tasks: list[Task] = []
        of: list[tuple[int, str]] = []
        areas: list[float] = []
        for index, block, region in blocks[start : start + TOGETHER]:
            for name, _, task in all_ways(made, region):
                tasks.append(task)
                of.append((index, name))
                areas.append(block.polygon.area)
        if tasks:
            found.extend(_choose(tasks, of, np.array(areas), library, rules, seed))
    return found


def _choose(
    tasks: list[Task],
    of: list[tuple[int, str]],
    areas: Floats,
    library: TemplateLibrary,
    rules: ParcelRules,
    seed: int,
) -> Iterator[Furniture]:
    """Warp what may stand on parcels and draw one template for each."""
    _, tiles, _, energy = evaluate(tasks, areas, rules, 0.0)
    owner = np.array([index for index, _ in of])
    for index in np.unique(owner):
        fits = np.flatnonzero((owner == index) & (energy < BENT))
        if not len(fits):
            continue
        likely = np.array([library[of[k][1]].probability for k in fits])
        likely = likely / (0.2 + energy[fits]) ** 2
        rng = np.random.default_rng([seed, int(index)])
        k = int(fits[rng.choice(len(fits), p=likely / likely.sum())])
        form = tasks[k].form
        pieces = tiles.polygons[tiles.start[k] : tiles.start[k + 1]]
        for polygon, face in zip(pieces, form.piece_face):
            yield Furniture(polygon, form.labels[face], int(index), of[k][1])


def _parcels(
    plots: Sequence[Plot], closed: shapely.Geometry | None
) -> Iterator[tuple[int, Block, Outline]]:
    """Give the parcels that have a front as blocks that are closed elsewhere."""
    polygons = np.array([plot.polygon for plot in plots], dtype=object)
    use = np.array([plot.use for plot in plots])
    which = np.flatnonzero(use == "parcel") if len(plots) else np.zeros(0, np.int64)
    which = which[shapely.get_num_interior_rings(polygons[which]) == 0]
    if not len(which):
        return
    xy, owner = shapely.get_coordinates(polygons[which], return_index=True)
    edge = np.flatnonzero(owner[:-1] == owner[1:])
    lines = np.stack([xy[edge], xy[edge + 1]], axis=1)
    best = _kinds(lines, which[owner[edge]], polygons, use, closed)
    first = np.searchsorted(owner[edge], np.arange(len(which) + 1))
    for k, index in enumerate(which):
        own = slice(first[k], first[k + 1])
        block = Block(polygons[index])
        region = outline(block)
        corners = choose_corners(region, 4, 0)
        if corners is None:
            continue
        of = sides(region, corners)
        front = _front(of, lines[own], best[own])
        if front is None:
            continue
        # all sides but the front count as closed
        start, end = of.corners[front], of.corners[front + 1]
        step = np.diff(region.at)
        middle = (region.at[:-1] + step / 2.0 - region.at[corners[0]]) % region.at[-1]
        others = np.where((middle > start) & (middle < end), 0.0, step)
        only = np.concatenate([[0.0], np.cumsum(others)])
        yield int(index), block, Outline(region.points, region.at, only, region.turn)


def _front(of: Sides, lines: Floats, kinds: npt.NDArray[np.int64]) -> int | None:
    """Choose the shortest side along the best kind of street."""
    middle = lines.mean(axis=1)
    z = middle[:, 0] + 1j * middle[:, 1]
    own = (of.points[:-1] + of.points[1:]) / 2.0
    edge = np.abs(z[:, None] - own[None, :]).argmin(axis=1)
    side = np.searchsorted(of.corners, ((of.at[:-1] + of.at[1:]) / 2.0)[edge], side="right") - 1
    length = np.hypot(*np.diff(lines, axis=1)[:, 0].T)
    for kind in (STREET_PLOT, OUTSIDE, LANE_PLOT):
        along = np.bincount(side, length * (kinds == kind), minlength=len(of.lengths))
        fronts = np.flatnonzero(along > OPEN * of.lengths)
        if len(fronts):
            return int(fronts[np.argmin(of.lengths[fronts])])
    return None


def _kinds(
    lines: Floats,
    owner: npt.NDArray[np.int64],
    polygons: npt.NDArray[np.object_],
    use: npt.NDArray[np.str_],
    closed: shapely.Geometry | None,
) -> npt.NDArray[np.int64]:
    """Tell what each edge lies along."""
    middle = lines.mean(axis=1)
    around = shapely.box(
        middle[:, 0] - BESIDE, middle[:, 1] - BESIDE, middle[:, 0] + BESIDE, middle[:, 1] + BESIDE
    )
    pairs = shapely.STRtree(polygons).query(around, predicate="intersects")
    pairs = pairs[:, pairs[1] != owner[pairs[0]]]
    found = np.full(len(lines), OUTSIDE)
    if closed is not None and not closed.is_empty:
        shapely.prepare(closed)
        found[shapely.distance(closed, shapely.points(middle)) < 2 * NEAR] = SHUT
    beside = use[pairs[1]]
    for kind, which in (
        (SHUT, (beside != "street") & (beside != "lane")),
        (LANE_PLOT, beside == "lane"),
        (STREET_PLOT, beside == "street"),
    ):
        found[pairs[0][which]] = kind
    return found
