"""Which cell size fits a site: its sides are seldom whole numbers of blocks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import shapely
from shapely.geometry import LineString

from ..errors import MeshError
from ..mesh import QuadMesh, quadrangulate
from ..network.problem import FloatArray
from ..network.specification import Specification
from ..progress import Progress
from ..site.types import AccessPoint, Site
from .blocks import Block
from .cells import cell_ratio, stretched_mesh

#: Edge lengths tried, as shares of the block width; cells vary around what is asked.
CELLS = (1.05, 1.0, 0.96, 1.1, 0.93)
#: How many of them are tried on a large site.
FEW = 3
#: No other cell size is tried after a plan this good (`plan_misfit` and `street_misfit`).
GOOD_ENOUGH = 0.17
#: What arriving streets that are not continued, each place without a street, and a median width
#: other than asked count against a plan.
NOT_CONTINUED, UNCOVERED, OFF_WIDTH = 0.4, 0.02, 0.75
#: What streets that are longer than blocks of the asked size need count, per share of that
#: length, and how much all turns along the streets count, per 100 degrees in a kilometre.
STREETS, TURNING = 0.3, 0.05
#: Width of a cell that fits best, as a share of the block width.
FIT = 0.95
#: What arriving streets that no mesh line meets count against the fit of cells.
MISSED = 0.15
#: Sites of fewer blocks than this are designed on all meshes (cells of block width squared).
SMALL_SITE = 60
#: Bounds of block widths, as shares of the asked one (45, 55 and 80 m at 72 m).
TOO_THIN, GOOD_FROM, TOO_WIDE = 0.62, 0.76, 1.11


def edge_length(spec: Specification) -> float:
    """Edge length of the (coarsest) candidate mesh in metres.

    With the planner's rules a cell is as wide as a block. As in the paper it is a third of a
    block for the finest level (a block is then three cells wide), twice that above it.
    """
    if spec.edge_length is not None:
        return spec.edge_length
    if spec.rules == "planner":
        return spec.block_width
    return spec.block_width / 3 * spec.levels


def mesh_choices(
    site: Site,
    spec: Specification,
    arrivals: Sequence[AccessPoint] = (),
    progress: Progress | None = None,
    required: Sequence[LineString] = (),
    exits: Sequence[tuple[float, float]] = (),
) -> list[Callable[[], QuadMesh]]:
    """List the candidate meshes worth trying, as functions that make them.

    With the planner's rules these are cells of several sizes on a small site, where designing
    takes well under a second; the one whose cells fit best on a large one. Where the asked block
    length is no whole number of widths, cells of the right length come first on a small site, see
    `cells`.

    Parameters
    ----------
    site
        The site.
    spec
        What the planner asks.
    arrivals
        Existing streets that arrive: boundary vertices are drawn to them.
    progress
        Asked for cancellation.
    required
        Required streets: boundary vertices are drawn to where they leave the site, with an
        index in `QuadMesh.attracted` beyond that of the arrivals.
    exits
        Given sinks: boundary vertices are drawn to those near the edge, too.
    """
    edge = site.polygon.boundary
    ends = [xy for line in required for xy in shapely.get_coordinates(line.intersection(edge))]
    at_edge = [xy for xy in exits if edge.distance(shapely.Point(xy)) < spec.block_width / 2]
    points = [*(p.xy for p in arrivals), *ends, *at_edge]
    drawn = np.array(points, dtype=float).reshape(-1, 2)
    h = edge_length(spec)

    def make(size: float) -> QuadMesh:
        return quadrangulate(site.polygon, size * h, attract_points=drawn, progress=progress)

    ratio = cell_ratio(h, spec.block_length)
    oblong: list[Callable[[], QuadMesh]] = [
        partial(stretched_mesh, site.polygon, h, ratio, across, drawn, progress)
        for across in (False, True)
        if ratio != 1.0
    ]

    def best() -> QuadMesh:
        made: list[QuadMesh] = []
        failure: MeshError | None = None
        for size in CELLS[:FEW]:
            try:
                made.append(make(size))
            except MeshError as error:
                failure = error
        if not made:
            raise failure or MeshError(f"No candidate mesh could be made of {site.name}.")
        return min(made, key=lambda m: _mesh_misfit(m, spec, len(arrivals)))

    if spec.rules != "planner" or spec.edge_length is not None:
        return [partial(make, 1.0)]
    if site.polygon.area > SMALL_SITE * spec.block_width**2:
        return [best]
    return [*oblong, *(partial(make, size) for size in CELLS)]


def site_mesh(
    site: Site,
    spec: Specification,
    arrivals: Sequence[AccessPoint] = (),
    progress: Progress | None = None,
) -> QuadMesh:
    """Return the candidate mesh of a site whose cells fit best; see `mesh_choices`.

    Raises
    ------
    MeshError
        If the site is too small or too narrow for the block width.
    """
    made: list[QuadMesh] = []
    failure: MeshError | None = None
    for make in mesh_choices(site, spec, arrivals, progress):
        try:
            made.append(make())
        except MeshError as error:
            failure = error
    if not made:
        raise failure or MeshError(f"No candidate mesh could be made of {site.name}.")
    return min(made, key=lambda m: _mesh_misfit(m, spec, len(arrivals)))


def cell_misfit(mesh: QuadMesh, block_width: float) -> float:
    """Mean deviation of the cells from the block width, by area; the smaller the better.

    The width of a cell is the smaller of its two spans. Wider than asked weighs double: the
    back gardens of a block that is too wide cannot be reached.
    """
    sides = mesh.lengths[mesh.face_edges]
    width = ((sides[:, :2] + sides[:, 2:]) / 2).min(axis=1) / (FIT * block_width)
    off = np.where(width > 1, 2 * (width - 1), 1 / width - 1)
    areas = shapely.area(shapely.polygons(mesh.vertices[mesh.faces]))
    return float(np.average(np.minimum(off, 1.0), weights=areas))


def block_misfit(blocks: Sequence[Block], width: float, length: float) -> float:
    """Share of blocks of the wrong size, 0 for a perfect plan.

    Half by number, half by area, so that a large piece without streets is no single bad block
    among many good ones. A block counts whole where it is too thin or far too wide, half where
    it is merely off, and up to half for being longer than asked.

    Parameters
    ----------
    blocks
        The blocks of a plan.
    width, length
        Wished size in metres.
    """
    if not blocks:
        return 1.0
    wrong = []
    for block in blocks:
        share = block.width / width
        off = 1.0 if share < TOO_THIN or share > TOO_WIDE + 0.3 else 0.0
        if not off and not GOOD_FROM <= share <= TOO_WIDE:
            off = 0.5
        wrong.append(off + 0.5 * min(1.0, max(0.0, block.length / length - 1.1)))
    areas = [block.polygon.area for block in blocks]
    return float(np.mean(wrong) + np.average(wrong, weights=areas)) / 2


def plan_misfit(
    blocks: Sequence[Block], spec: Specification, missed: float, uncovered: int
) -> float:
    """How far a plan is from what was asked; compares plans of one site on several meshes.

    Parameters
    ----------
    blocks
        The blocks of the plan.
    spec
        What was asked.
    missed
        Share of the arriving streets that are not continued.
    uncovered
        Number of places that no street reaches.
    """
    wrong = block_misfit(blocks, spec.block_width, spec.block_length)
    middle = float(np.median([b.width for b in blocks])) if blocks else 0.0
    off = abs(1 - middle / spec.block_width)
    return wrong + OFF_WIDTH * off + NOT_CONTINUED * missed + UNCOVERED * uncovered


def street_misfit(streets: Sequence[FloatArray], area: float, spec: Specification) -> float:
    """How much longer streets are than the asked blocks need, and how much they turn.

    Plans of one site whose blocks are equally good may differ much in this: a wobbling street
    looks worse than a straight one, and blocks of half the length cost twice the cross streets.

    Parameters
    ----------
    streets
        Courses from end to end through junctions, each of shape (k, 2), metres.
    area
        Ground, square metres.
    spec
        What was asked.

    Examples
    --------
    >>> asked = Specification(block_width=50, block_length=100)
    >>> street_misfit([np.array([[0.0, 0.0], [300.0, 0.0]])], 1e4, asked)
    0.0
    >>> round(street_misfit([np.array([[0, 0], [300, 0], [300, 300]])], 1e4, asked), 3)
    0.375
    """
    steps = [np.diff(line, axis=0) for line in streets]
    length = sum(float(np.hypot(*step.T).sum()) for step in steps)
    if not length or not area:
        return 0.0
    turned = 0.0
    for step in steps:
        cross = step[:-1, 0] * step[1:, 1] - step[:-1, 1] * step[1:, 0]
        dot = (step[:-1] * step[1:]).sum(axis=1)
        turned += float(np.degrees(np.abs(np.arctan2(cross, dot))).sum())
    needed = area * (1 / spec.block_width + 1 / spec.block_length)
    over = max(0.0, length / needed - 1)
    return STREETS * over + TURNING * turned / length * 10


def same_mesh(one: QuadMesh, other: QuadMesh) -> bool:
    """Whether two meshes of a site are the same but for a metre: both sizes were rounded alike."""
    if one.vertices.shape != other.vertices.shape or not np.array_equal(one.faces, other.faces):
        return False
    return bool(np.abs(one.vertices - other.vertices).max() < 1.0)


def _mesh_misfit(mesh: QuadMesh, spec: Specification, arrivals: int) -> float:
    """Misfit of the cells and share of arriving streets that no mesh line meets."""
    missed = 1 - len(mesh.attracted) / arrivals if arrivals else 0.0
    return cell_misfit(mesh, spec.block_width) + MISSED * missed
