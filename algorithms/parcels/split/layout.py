"""A layout: streets, blocks and parcels of one site, made and judged (UP section 3)."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
from shapely.geometry import LineString, Point

from ...errors import CancelledError
from ...measure.parcel_shape import corner_deviation, rectangle_ratio, undesirable
from ...progress import Progress, Share, Silent
from ..fill.result import FillProblem
from ..roadmesh import Ground, StreetMesh, begin_mesh
from ..rules import ParcelRules
from ..types import Block, Plot
from .backtrack import Backtracker
from .cells import ANGLE, AREA, BAD, GREEN, STREET, Cell, fill_regions
from .choosing import Chooser
from .moving import optimised
from .rules import SplitRules
from .search import Splitter


@dataclass(frozen=True)
class Remark:
    """Something about a layout that a planner should know, and where."""

    place: Point
    problem: str
    action: str = ""
    severity: str = "info"


@dataclass(frozen=True)
class Score:
    """How good a layout is.

    Attributes
    ----------
    parcels
        Number of parcels.
    p_angle, p_area
        Means over the parcels, degrees and ratio (UP section 7).
    undesirable, green, street
        Shares: of the parcels, and of the land that is green (or court) or street.
    """

    parcels: int
    p_angle: float
    p_area: float
    undesirable: float
    green: float
    street: float

    @property
    def value(self) -> float:
        """What land for one parcel costs, smaller is better, by the weights of `cells.costs_of`."""
        parcel = ANGLE * self.p_angle + AREA * (self.p_area - 1) + BAD * self.undesirable
        land = max(0.0, 1 - self.green - self.street)
        return land * parcel + GREEN * self.green + STREET * self.street


@dataclass(frozen=True)
class Layout:
    """Streets, blocks and parcels of a site.

    Attributes
    ----------
    ground
        What it was made on.
    mesh
        Streets and regions.
    regions
        Number of the region of each block.
    blocks, plots
        The blocks, and what each was cut into.
    streets
        Streets of templates inside blocks, metres.
    remarks
        What a planner should know.
    score
        How good it is.
    seed
        With which it can be made again.
    seconds
        What took how long, by stage.
    """

    ground: Ground
    mesh: StreetMesh
    regions: Sequence[int]
    blocks: Sequence[Block]
    plots: Sequence[Sequence[Plot]]
    streets: Sequence[LineString]
    remarks: Sequence[Remark]
    score: Score
    seed: int = 0
    seconds: dict[str, float] = field(default_factory=dict)


def lay_out(
    ground: Ground,
    rules: ParcelRules,
    split: SplitRules,
    *,
    arriving: Sequence[tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]] = (),
    guides: Sequence[LineString] = (),
    seed: int = 0,
    progress: Progress | None = None,
) -> Layout:
    """Lay out a site: streets until parcels fit, then parcels.

    Parameters
    ----------
    ground
        The site.
    rules, split
        What is asked of parcels and of streets.
    arriving
        Places and directions of existing streets at the edge of the site.
    guides
        Drawn lines that a guided field follows, metres.
    seed
        0 takes the best street each time, others one at random by quality.
    progress
        Told of the work, asked for cancellation.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    told = progress or Silent()
    watch = _Watch()
    mesh, given = begin_mesh(ground)
    remarks = [Remark(place, text, "look at it", "warning") for place, text in given]
    splitter = Splitter(mesh, rules, split, arriving, guides, seed, Share(told, 0.0, 0.4))
    mesh = splitter.run().mesh
    remarks += _forced(mesh, rules, split)
    watch.stop("streets")
    turning = split.turning_radius
    cells = fill_regions(
        mesh, sorted(mesh.regions), rules, turning=turning, templates=split.templates,
        seed=seed, refine=False, progress=Share(told, 0.4, 0.5),
    )  # fmt: skip
    watch.stop("parcels")
    splitter.progress = Silent()
    second = Backtracker(splitter, mesh, cells, seed)
    second.run(split.tries, Share(told, 0.5, 0.7))
    watch.stop("backtracking")
    mesh, kept = second.mesh, second.cells
    if split.optimise:
        mesh, kept = optimised(mesh, kept, rules, split, seed, Share(told, 0.7, 0.8))
        watch.stop("optimisation")
    refined = _refined(mesh, kept, rules, split, seed, Share(told, 0.8, 1.0))
    watch.stop("refinement")
    return _layout(ground, mesh, refined, remarks, seed, watch.seconds)


def _refined(
    mesh: StreetMesh,
    cells: Mapping[int, Cell],
    rules: ParcelRules,
    split: SplitRules,
    seed: int,
    progress: Progress,
) -> Mapping[int, Cell]:
    """Improve all parcels; where the caller cancels they stay as they were cut."""
    try:
        return fill_regions(
            mesh, sorted(mesh.regions), rules, turning=split.turning_radius,
            templates=split.templates, seed=seed,
            progress=progress,
        )  # fmt: skip
    except CancelledError:
        progress.warn("Cancelled: the parcels are as they were cut, not improved.")
        return cells


def _forced(mesh: StreetMesh, rules: ParcelRules, split: SplitRules) -> list[Remark]:
    """Put templates that must be used where they fit best; tell which find no place."""
    if split.templates is None:
        return []
    lack = Chooser(split.templates, rules, split.turning_radius).force(mesh)
    place = mesh.polygon(max(mesh.regions, key=lambda r: mesh.polygon(r).area))
    return [
        Remark(
            place.representative_point(),
            f"the template '{name}' finds no place {count} more times, as often as it must be used",
            "ask for it less often, or for more variations",
            "warning",
        )
        for name, count in sorted(lack.items())
    ]


class _Watch:
    """Tells how long each stage took."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def stop(self, stage: str) -> None:
        """Take note of the time since the last stage."""
        now = time.perf_counter()
        self.seconds[stage] = now - self._last
        self._last = now


def _layout(
    ground: Ground,
    mesh: StreetMesh,
    cells: Mapping[int, Cell],
    remarks: Sequence[Remark],
    seed: int,
    seconds: dict[str, float],
) -> Layout:
    """Gather the cells of all regions; blocks are numbered from 1."""
    regions: list[int] = []
    blocks: list[Block] = []
    plots: list[Sequence[Plot]] = []
    found = list(remarks)
    for region in sorted(cells):
        cell = cells[region]
        for block, cut in zip(cell.blocks, cell.plots):
            regions.append(region)
            blocks.append(replace(block, block_id=len(blocks) + 1))
            plots.append(cut)
        found += [_remark(problem) for problem in cell.problems]
    streets = [line for region in sorted(cells) for line in cells[region].streets]
    return Layout(
        ground, mesh, regions, blocks, plots, streets, found, judge(ground, plots), seed, seconds
    )


def _remark(problem: FillProblem) -> Remark:
    """Turn a problem of a block into a remark."""
    return Remark(problem.place, problem.reason, problem.done)


def judge(ground: Ground, plots: Sequence[Sequence[Plot]]) -> Score:
    """Measure the plots of a site.

    Parameters
    ----------
    ground
        The site.
    plots
        By block.
    """
    every = [plot for many in plots for plot in many]
    parcels = np.array([p.polygon for p in every if p.use == "parcel"], dtype=object)
    area = ground.polygon.area
    green = sum(p.polygon.area for p in every if p.use in ("green", "court"))
    land = sum(p.polygon.area for p in every if p.use not in ("street", "lane"))
    if not len(parcels):
        return Score(0, 0.0, 1.0, 0.0, green / area, 1 - land / area)
    angle, ratio = corner_deviation(parcels), rectangle_ratio(parcels)
    return Score(
        parcels=len(parcels),
        p_angle=float(angle.mean()),
        p_area=float(ratio.mean()),
        undesirable=float(undesirable(angle, ratio).mean()),
        green=green / area,
        street=1 - land / area,
    )
