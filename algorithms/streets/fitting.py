"""Which cell size fits a site: its sides are seldom whole numbers of blocks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import LineString

from ..errors import MeshError
from ..mesh import QuadMesh, quadrangulate
from ..network.specification import Specification
from ..progress import Progress
from ..site.types import AccessPoint, Site
from .blocks import Block

#: Edge lengths tried, as shares of the block width; cells vary around what is asked.
CELLS = (1.0, 0.96, 0.93, 1.05, 0.9)
#: How many of them are tried on a large site.
FEW = 3
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


def site_meshes(
    site: Site,
    spec: Specification,
    arrivals: Sequence[AccessPoint] = (),
    progress: Progress | None = None,
    required: Sequence[LineString] = (),
) -> list[QuadMesh]:
    """Make candidate meshes of a site, boundary vertices drawn to where streets arrive.

    They are drawn to where required streets leave the site, too: vertices attracted to those
    have an index in `QuadMesh.attracted` beyond that of the arrivals.

    With the planner's rules cells of several sizes are tried: all of them on a small site,
    where designing takes well under a second, the one whose cells fit best on a large one.

    Raises
    ------
    MeshError
        If the site is too small or too narrow for the block width.
    """
    edge = site.polygon.boundary
    ends = [xy for line in required for xy in shapely.get_coordinates(line.intersection(edge))]
    points = np.array([*(p.xy for p in arrivals), *ends], dtype=float).reshape(-1, 2)
    h = edge_length(spec)
    fitting = spec.rules == "planner" and spec.edge_length is None
    meshes: list[QuadMesh] = []
    failure: MeshError | None = None
    small = site.polygon.area <= SMALL_SITE * spec.block_width**2
    for factor in (CELLS if small else CELLS[:FEW]) if fitting else (1.0,):
        try:
            mesh = quadrangulate(site.polygon, factor * h, attract_points=points, progress=progress)
        except MeshError as error:
            failure = error
            continue
        meshes.append(mesh)
    if not meshes:
        raise failure or MeshError(f"No candidate mesh could be made of {site.name}.")
    if not small:
        meshes = [min(meshes, key=lambda m: _mesh_misfit(m, spec, len(arrivals)))]
    return meshes


def site_mesh(
    site: Site,
    spec: Specification,
    arrivals: Sequence[AccessPoint] = (),
    progress: Progress | None = None,
) -> QuadMesh:
    """Return the candidate mesh of a site whose cells fit best; see `site_meshes`."""
    meshes = site_meshes(site, spec, arrivals, progress)
    return min(meshes, key=lambda m: _mesh_misfit(m, spec, len(arrivals)))


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

    A block counts whole where it is too thin or far too wide, half where it is merely off,
    and up to half for being longer than asked.

    Parameters
    ----------
    blocks
        The blocks of a plan.
    width, length
        Wished size in metres.
    """
    wrong = 0.0
    for block in blocks:
        share = block.width / width
        off = 1.0 if share < TOO_THIN or share > TOO_WIDE + 0.3 else 0.0
        if not off and not GOOD_FROM <= share <= TOO_WIDE:
            off = 0.5
        off += 0.5 * min(1.0, max(0.0, block.length / length - 1.1))
        wrong += off
    return wrong / len(blocks) if blocks else 1.0


def _mesh_misfit(mesh: QuadMesh, spec: Specification, arrivals: int) -> float:
    """Misfit of the cells and share of arriving streets that no mesh line meets."""
    missed = 1 - len(mesh.attracted) / arrivals if arrivals else 0.0
    return cell_misfit(mesh, spec.block_width) + MISSED * missed
