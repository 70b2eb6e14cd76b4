"""The mesh of a footprint: a grid along its walls, or what the mesher makes, tiling it exactly."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon

from ...errors import InputError, MeshError
from ...mesh.clean import LEAST_HOLE, clean_site
from ...mesh.polysquare import quadrangulate
from ...mesh.quadmesh import QuadMesh
from ...mesh.quality import score
from ...mesh.variants import check_cancelled
from ...progress import Held, Progress, Silent
from .fit import fitted
from .grid import wall_grid
from .types import Feature, Remark

MOST_FACES = 4000
"""Largest number of faces of a storey."""
LEAST_MODULES = 2.0
"""A footprint must be at least this many modules wide and long."""
STRAIGHT = 0.5
"""How much worse a grid may score than a smoothed mesh, for its straight lines."""
FACTORS = (1.0, 0.9, 1.15, 0.75)
"""Shares of the module that are tried until a mesh tiles the footprint."""
CLEANING = (1 / 8, 1 / 4, 0.4)
"""Slots and spikes thinner than twice this many modules are cut where no module will do."""
DOUBTFUL = 4.0
"""Score from which on a mesh is called poor."""


@dataclass(frozen=True, eq=False)
class Tiling:
    """A footprint and the mesh that tiles it.

    Attributes
    ----------
    polygon
        The footprint that is tiled, metres.
    mesh
        Its mesh.
    shafts
        Holes too small for a courtyard; they were filled and are obstacles.
    remarks
        What is not as it was asked.
    """

    polygon: Polygon
    mesh: QuadMesh
    shafts: tuple[Polygon, ...]
    remarks: tuple[Remark, ...]


def check_module(module: float) -> None:
    """Refuse a module that is no length.

    Raises
    ------
    InputError
        If it is not a number greater than 0.
    """
    if not (math.isfinite(module) and module > 0):
        raise InputError(
            f"The module is {module}.", "It must be a number of metres greater than 0."
        )


def check_size(polygon: Polygon, module: float, layer: str, feature: Feature) -> None:
    """Refuse a footprint in which squares of a module do not fit, or too many.

    Raises
    ------
    InputError
        With a module that would do.
    """
    box = shapely.minimum_rotated_rectangle(polygon)
    sides = np.hypot(*np.diff(np.asarray(box.exterior.coords), axis=0).T)[:2]
    width = 2 * float(shapely.maximum_inscribed_circle(polygon).length)
    short = min(float(sides.min()) / LEAST_MODULES, math.sqrt(polygon.area) / LEAST_MODULES)
    if short < module * (1 - 1e-9):
        raise InputError(
            f"The footprint ({polygon.area:.0f} m2, {width:.1f} m wide at its widest) is smaller "
            f"than 2 x 2 modules of {module:g} m.",
            f"Set a module of {math.floor(short * 10) / 10:g} m or less, or leave it out.",
            layer=layer,
            feature=feature,
        )
    count = polygon.area / module**2
    if count > MOST_FACES:
        enough = math.ceil(math.sqrt(polygon.area / MOST_FACES) * 10) / 10
        raise InputError(
            f"A module of {module:g} m gives about {count:.0f} squares per storey, more than "
            f"{MOST_FACES}.",
            f"Set a module of {enough:g} m or more.",
            layer=layer,
            feature=feature,
        )


def tile_footprint(
    polygon: Polygon,
    module: float,
    *,
    layer: str = "Footprints",
    feature: Feature = 0,
    progress: Progress | None = None,
) -> Tiling:
    """Make a mesh of near squares whose faces tile a footprint.

    Parameters
    ----------
    polygon
        Valid footprint with its courtyards, metres.
    module
        Side that squares should have, metres.
    layer, feature
        Where it is from, for messages.
    progress
        Asked for cancellation.

    Returns
    -------
    Tiling
        Corners of the footprint are vertices of the mesh where neighbouring corners are not
        closer than a fraction of the module; others lie on boundary arcs.

    Raises
    ------
    InputError
        If no mesh tiles the footprint, or it falls to pieces; the text names a module to try.
    CancelledError
        If the caller cancels.

    Examples
    --------
    >>> tiling = tile_footprint(shapely.box(0, 0, 60, 18), 4.0)
    >>> len(tiling.mesh.faces), float(tiling.mesh.lengths.min().round(3)), tiling.remarks
    (75, 3.6, ())
    """
    check_module(module)
    check_size(polygon, module, layer, feature)
    progress = progress or Silent()
    filled, shafts, remarks = _without_shafts(polygon, module, layer, feature)
    for factor in FACTORS:
        mesh = _best(filled, module * factor, progress)
        if mesh is not None:
            if factor != 1.0:
                remarks.append(_other_module(module, factor, layer, feature, filled))
            return Tiling(filled, mesh, shafts, (*remarks, *_poor(mesh, filled, layer, feature)))
    for ratio in CLEANING:
        for part in clean_site(filled, module, ratio, np.zeros((0, 2))).parts[:1]:
            mesh = _best(part, module, progress)
            if mesh is None or part.area < 0.8 * filled.area:
                continue
            remarks.append(_cut(filled, part, layer, feature))
            return Tiling(part, mesh, shafts, (*remarks, *_poor(mesh, part, layer, feature)))
    width = 2 * float(shapely.maximum_inscribed_circle(polygon).length)
    raise InputError(
        f"No mesh with a module of {module:g} m tiles the footprint: a part of it is too narrow "
        "or it would fall to pieces.",
        f"Set a module of {math.floor(min(module, width) * 5) / 10:g} m or less, or simplify the "
        "footprint.",
        layer=layer,
        feature=feature,
    )


def _best(polygon: Polygon, module: float, progress: Progress) -> QuadMesh | None:
    """Return the better of a grid and a smoothed mesh, of those that tile a polygon exactly."""
    check_cancelled(progress)
    grid = wall_grid(polygon, module)
    laid = None if grid is None else fitted(grid, polygon)
    held = Held(progress)
    if laid is not None and _score(laid, polygon) < 1.0:
        return laid
    try:
        made = quadrangulate(polygon, module, progress=held)
    except MeshError:
        return laid
    smooth = fitted(made, polygon)
    if laid is None or smooth is None:
        return smooth if laid is None else laid
    return laid if _score(laid, polygon) < _score(smooth, polygon) + STRAIGHT else smooth


def _score(mesh: QuadMesh, polygon: Polygon) -> float:
    """Return how good a mesh is, smaller is better."""
    return score(mesh, mesh.vertices, mesh.edge_length, polygon.area)


def _without_shafts(
    polygon: Polygon, module: float, layer: str, feature: Feature
) -> tuple[Polygon, tuple[Polygon, ...], list[Remark]]:
    """Fill holes that are too small for a courtyard."""
    holes = [Polygon(ring) for ring in polygon.interiors]
    small = tuple(hole for hole in holes if hole.area <= LEAST_HOLE * module**2)
    if not small:
        return polygon, (), []
    large = [hole.exterior for hole in holes if hole.area > LEAST_HOLE * module**2]
    text = f"Layer '{layer}', feature {feature}: {len(small)} holes are smaller than a square."
    action = "They were filled; give a smaller module to keep them as courtyards."
    return (
        Polygon(polygon.exterior, large),
        small,
        [Remark(text, action, "info", shapely.union_all(list(small)))],
    )


def _other_module(
    module: float, factor: float, layer: str, feature: Feature, polygon: Polygon
) -> Remark:
    """Tell that another module had to be taken."""
    return Remark(
        f"Layer '{layer}', feature {feature}: no mesh with a module of {module:g} m tiles the "
        "footprint.",
        f"A module of {module * factor:.2f} m was taken.",
        "warning",
        polygon.representative_point(),
    )


def _cut(polygon: Polygon, part: Polygon, layer: str, feature: Feature) -> Remark:
    """Tell what was cut from a footprint or added to it."""
    changed = shapely.symmetric_difference(polygon, part)
    return Remark(
        f"Layer '{layer}', feature {feature}: slots, necks or spikes are too narrow for the "
        "module.",
        f"The footprint was changed by {changed.area:.1f} m2 there. Set a smaller module to keep "
        "its shape.",
        "warning",
        changed,
    )


def _poor(mesh: QuadMesh, polygon: Polygon, layer: str, feature: Feature) -> list[Remark]:
    """Tell of a mesh whose faces are far from squares."""
    if _score(mesh, polygon) < DOUBTFUL:
        return []
    return [
        Remark(
            f"Layer '{layer}', feature {feature}: the footprint is narrow or ragged for its "
            "module, some faces are far from squares.",
            "Set a smaller module or simplify the footprint.",
            "warning",
            polygon.representative_point(),
        )
    ]
