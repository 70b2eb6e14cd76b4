"""Regions with what became of them: blocks, plots, and what they cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString

from ...measure.parcel_shape import corner_deviation, rectangle_ratio, undesirable
from ...progress import Progress
from ..fill import fill_blocks
from ..fill.result import FillProblem
from ..refine import refine_blocks
from ..roadmesh import StreetMesh
from ..roadmesh.land import region_blocks
from ..rules import ParcelRules
from ..types import Block, Plot
from ..warp import Match
from .choosing import TemplateRules, matched

#: What land costs: each parcel its p_angle in degrees, its p_area above 1, and what an
#: undesirable one costs besides; green and street for each parcel that would fit there.
ANGLE, AREA, BAD, GREEN, STREET = 1.0, 50.0, 30.0, 12.0, 10.0


@dataclass(frozen=True)
class Cell:
    """A region and what became of it.

    Attributes
    ----------
    blocks, plots
        Its land, and what each piece was cut into.
    problems
        What a planner should know of them.
    cost
        See `costs_of`.
    streets
        Centre lines of the streets of a template, metres.
    """

    blocks: Sequence[Block]
    plots: Sequence[Sequence[Plot]]
    problems: Sequence[FillProblem]
    cost: float
    streets: Sequence[LineString] = ()


def fill_regions(
    mesh: StreetMesh,
    regions: Sequence[int],
    rules: ParcelRules,
    *,
    turning: float = 0.0,
    templates: TemplateRules | None = None,
    seed: int = 0,
    refine: bool = True,
    progress: Progress | None = None,
) -> dict[int, Cell]:
    """Cut the land of regions into plots.

    Parameters
    ----------
    mesh, regions
        The mesh and the numbers of the regions.
    rules
        What is asked of parcels.
    turning
        Radius of turning circles at blind ends, metres.
    templates
        The templates that the regions of the mesh are labelled with.
    seed
        Of whatever is random.
    refine
        Whether parcels are improved by least squares, which takes most of the time.
    progress
        Told of the work.
    """
    by_region = region_blocks(mesh, turning, regions)
    names = {r: mesh.labels[r] for r in by_region if r in mesh.labels}
    drawn = matched(names, by_region, templates, rules) if templates and names else {}
    blocks = [block for r, many in by_region.items() for block in many if r not in drawn]
    filled = fill_blocks(blocks, rules, seed=seed, refine=refine, progress=progress)
    problems: dict[int, list[FillProblem]] = {}
    for problem in filled.problems:
        problems.setdefault(problem.block_id, []).append(problem)
    rows = iter(filled.plots)
    by_template = _of_templates(drawn, by_region, rules, refine=refine)
    plots = {
        region: [by_template[region]] if region in drawn else [next(rows) for _ in own]
        for region, own in by_region.items()
    }
    areas = [float(mesh.polygon(region).area) for region in plots]
    found = {}
    for region, cost in zip(plots, costs_of(areas, list(plots.values()), rules)):
        own = by_region[region]
        told = [problem for block in own for problem in problems.get(block.block_id, [])]
        inner = drawn[region].streets if region in drawn else ()
        found[region] = Cell(own, plots[region], told, cost, inner)
    return found


def _of_templates(
    drawn: Mapping[int, Match],
    by_region: Mapping[int, Sequence[Block]],
    rules: ParcelRules,
    *,
    refine: bool,
) -> dict[int, list[Plot]]:
    """Give the plots of the templates by region, improved like those of rows."""
    regions = sorted(drawn)
    plots: list[list[Plot]] = [list(drawn[region].plots) for region in regions]
    if refine and regions:
        plots = refine_blocks([by_region[r][0] for r in regions], plots, rules)
    return dict(zip(regions, plots))


def costs_of(
    areas: Sequence[float], plots: Sequence[Sequence[Sequence[Plot]]], rules: ParcelRules
) -> list[float]:
    """Costs of regions: what their plots lack, in degrees of p_angle summed over parcels.

    Costs of regions that are parts of another add up, so that one way to split it can be held
    against another.

    Parameters
    ----------
    areas
        Of the regions, square metres; what is no plot is street.
    plots
        By region and block.
    rules
        How large a parcel is.
    """
    every = [(k, plot) for k, blocks in enumerate(plots) for many in blocks for plot in many]
    count = len(areas)
    owner = np.array([k for k, _ in every], dtype=int)
    shapes = np.array([plot.polygon for _, plot in every], dtype=object)
    use = np.array([plot.use for _, plot in every], dtype=object)
    size = shapely.area(shapes)
    open_ = np.isin(use, ("green", "court"))
    parcel = use == "parcel"
    green = np.bincount(owner, weights=size * open_, minlength=count)
    land = np.bincount(owner, weights=size * (open_ | parcel), minlength=count)
    cost = (GREEN * green + STREET * (np.asarray(areas) - land)) / rules.area
    if parcel.any():
        angle, ratio = corner_deviation(shapes[parcel]), rectangle_ratio(shapes[parcel])
        lack = ANGLE * angle + AREA * (ratio - 1) + BAD * undesirable(angle, ratio)
        cost += np.bincount(owner[parcel], weights=lack, minlength=count)
    return [float(own) for own in cost]
