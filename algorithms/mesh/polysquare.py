"""The mesher: from a site polygon to a candidate mesh with long, straight lines of quads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import MultiPolygon, Polygon

from ..errors import InputError, MeshError
from ..progress import Progress, Silent
from .assemble import assemble
from .attract import attract
from .clean import LEAST_PART, CleanSite, clean_site, polygons_of
from .quadmesh import FloatArray, QuadMesh
from .variants import FAIR, PartMesh, check_cancelled, improve, mesh_part

LEVELS = ((1 / 6, True), (1 / 4, True), (0.4, True), (1 / 4, False), (0.4, False))
"""Ratio of cleaning and whether holes are kept, tried until a mesh is good enough."""
ENOUGH = 2.0
DOUBTFUL = 3.0
BAD = 4.0
COST_MOVED = 6.0
COST_FILLED = 0.5
SMALL = 130
"""Number of quads up to which two levels of cleaning are worth a long search."""


@dataclass(frozen=True, eq=False)
class _Attempt:
    """The meshes of all parts at one level of cleaning."""

    clean: CleanSite
    parts: list[PartMesh]
    holes: bool
    score: float


def quadrangulate(
    polygon: Polygon | MultiPolygon,
    edge_length: float,
    *,
    fixed_points: npt.ArrayLike | None = None,
    attract_points: npt.ArrayLike | None = None,
    guide_direction: float | None = None,
    engine: str = "polysquare",
    progress: Progress | None = None,
) -> QuadMesh:
    """Fill a site with near squares whose edges may become streets.

    Every piece of the boundary gets a direction and a whole number of steps, so that the rings
    close on a lattice whose cells are the quads; several such lattices are smoothed and the
    best is kept. Slots, necks and spikes finer than about a third of the edge length are
    ignored; edges that therefore cross ground outside the site are flagged `foreign`.

    Parameters
    ----------
    polygon
        The site, metres in a planar CRS; holes are respected where they leave room.
    edge_length
        Length that edges should have, metres, greater than 0.
    fixed_points
        Shape (k, 2), metres. Points of the boundary that must be vertices; of two closer
        than 0.45 edge lengths one is lost, with a warning.
    attract_points
        Shape (k, 2), metres. Points of the boundary, such as ends of streets, onto which a
        vertex is pulled where the mesh stays good; see `QuadMesh.attracted`.
    guide_direction
        Direction of the mesh lines, degrees counter-clockwise from x; None for the direction
        along which most of the boundary runs.
    engine
        "polysquare", or "gmsh" for the mesher of that package, where it is installed.
    progress
        Told of stages and warnings, asked for cancellation.

    Returns
    -------
    QuadMesh
        Possibly of several components, where necks are too narrow for a quad.

    Raises
    ------
    InputError
        If the polygon or a parameter cannot be used.
    MeshError
        If the site is too small or too narrow for the edge length; the text names one that
        would do.
    MissingDependencyError
        If the engine is not installed.
    CancelledError
        If `progress` says so.

    Examples
    --------
    >>> mesh = quadrangulate(shapely.box(0, 0, 400, 300), 100)
    >>> len(mesh.faces), int(mesh.valences.max())
    (12, 4)
    """
    progress = progress or Silent()
    site = checked_site(polygon, edge_length)
    fixed = _points(fixed_points, "fixed_points")
    wanted = _points(attract_points, "attract_points")
    guide = None if guide_direction is None else float(np.radians(guide_direction))
    if engine == "gmsh":
        from .gmsh_engine import gmsh_mesh

        return gmsh_mesh(site, edge_length, fixed, progress)
    if engine != "polysquare":
        raise InputError(f"There is no mesher '{engine}'.", "Choose polysquare or gmsh.")
    best = _best_attempt(site, edge_length, fixed, guide, progress)
    check_cancelled(progress)
    if best.score > DOUBTFUL:
        progress.warn(
            f"The candidate mesh is poor (score {best.score:.1f}): the site is narrow or ragged "
            f"for an edge length of {edge_length:g} m. A smaller edge length may help."
        )
    _warn_lost(best, fixed, progress)
    if len(wanted):
        attract(best.parts, wanted, edge_length, [p.area for p in best.clean.parts], guide)
    return assemble(best.parts, site, edge_length, holes_filled=not best.holes)


def checked_site(polygon: Polygon | MultiPolygon, edge_length: float) -> Polygon | MultiPolygon:
    """Return a valid polygon, or raise what is wrong with it or with the edge length."""
    if not (np.isfinite(edge_length) and edge_length > 0):
        raise InputError(
            f"The edge length is {edge_length}.", "It must be a number of metres greater than 0."
        )
    if not isinstance(polygon, (Polygon, MultiPolygon)) or polygon.is_empty:
        raise InputError("The site is not a polygon or is empty.", "Give one polygon in metres.")
    parts = polygons_of(shapely.make_valid(shapely.force_2d(polygon)))
    if not parts:
        raise InputError("The site has no area.", "Give one polygon in metres.")
    site = parts[0] if len(parts) == 1 else MultiPolygon(parts)
    if not np.isfinite(site.area):
        raise InputError("The site has coordinates that are not numbers.", "Repair the polygon.")
    if site.area < LEAST_PART * edge_length**2:
        raise MeshError(_too_small(site, edge_length))
    return site


def _too_small(site: Polygon | MultiPolygon, edge_length: float) -> str:
    """Return the text for a site in which no quad fits."""
    largest = max(polygons_of(site), key=lambda p: p.area)
    width = 2 * float(shapely.maximum_inscribed_circle(largest).length)
    fitting = min(np.sqrt(largest.area / 3), 0.9 * width)
    digits = 0 if fitting >= 3 else 2
    return (
        f"The site ({site.area / 1e4:.2f} ha, {width:.1f} m wide at its widest) is too small for "
        f"quads with an edge length of {edge_length:g} m. Set an edge length of "
        f"{np.floor(fitting * 10**digits) / 10**digits:g} m or less, or choose a larger site."
    )


def _points(points: npt.ArrayLike | None, name: str) -> FloatArray:
    """Return points as an array (k, 2)."""
    array = np.zeros((0, 2)) if points is None else np.asarray(points, dtype=float)
    if array.size == 0:
        return np.zeros((0, 2))
    if array.ndim != 2 or array.shape[1] != 2 or not np.isfinite(array).all():
        raise InputError(f"'{name}' must be an array of shape (k, 2) of finite numbers.")
    return array


def _best_attempt(
    site: Polygon | MultiPolygon,
    h: float,
    fixed: FloatArray,
    guide: float | None,
    progress: Progress,
) -> _Attempt:
    """Mesh the site at rising levels of cleaning until the result is good enough."""
    attempts: list[_Attempt] = []
    known: list[tuple[Polygon, PartMesh | None]] = []
    has_holes = any(len(p.interiors) for p in polygons_of(site))
    for level, (ratio, holes) in enumerate(LEVELS):
        if attempts and attempts[0].score < ENOUGH:
            break
        if not holes and not has_holes:
            continue
        progress.stage("Making the candidate mesh", level / len(LEVELS) / 2)
        check_cancelled(progress)
        clean = clean_site(site, h, ratio, fixed, holes=holes)
        parts = [_mesh_known(p, h, fixed, guide, progress, known) for p in clean.parts]
        meshes = [mesh for mesh in parts if mesh is not None]
        if meshes and len(meshes) == len(parts):
            attempts.append(_Attempt(clean, meshes, holes, _total_score(clean, meshes, holes)))
            attempts.sort(key=lambda a: a.score)
    if not attempts:
        raise MeshError(_too_small(site, h))
    if attempts[0].score < ENOUGH:
        return attempts[0]
    progress.stage("Improving the candidate mesh", 0.5)
    best = _improved(attempts[0], h, fixed, guide, progress)
    small = sum(len(mesh.draft.faces) for mesh in best.parts) <= SMALL
    others = [a for a in attempts[1:] if a.parts[0] is not attempts[0].parts[0]]
    if others and (small or best.score > BAD):
        second = _improved(others[0], h, fixed, guide, progress)
        best = second if second.score < best.score else best
    return best


def _total_score(clean: CleanSite, meshes: list[PartMesh], holes: bool) -> float:
    """Return the mean score of the parts plus the cost of ground that was moved."""
    weight = [len(mesh.draft.faces) for mesh in meshes]
    value = sum(w * mesh.score for w, mesh in zip(weight, meshes)) / sum(weight)
    return value + COST_MOVED * clean.moved + (0.0 if holes else COST_FILLED)


def _improved(
    attempt: _Attempt, h: float, fixed: FloatArray, guide: float | None, progress: Progress
) -> _Attempt:
    """Search on from the poor parts of an attempt."""
    meshes = [
        improve(mesh, h, part.area, fixed, guide, progress) if mesh.score > FAIR else mesh
        for mesh, part in zip(attempt.parts, attempt.clean.parts)
    ]
    value = _total_score(attempt.clean, meshes, attempt.holes)
    return _Attempt(attempt.clean, meshes, attempt.holes, value)


def _mesh_known(
    part: Polygon,
    h: float,
    fixed: FloatArray,
    guide: float | None,
    progress: Progress,
    known: list[tuple[Polygon, PartMesh | None]],
) -> PartMesh | None:
    """Mesh a part, or return the mesh of a part at an earlier level that was the same."""
    for other, mesh in known:
        if abs(other.area - part.area) < 1e-3 * part.area and (
            other.symmetric_difference(part).area < 1e-3 * part.area
        ):
            return mesh
    mesh = mesh_part(part, h, fixed, np.arange(len(fixed)), guide, progress)
    known.append((part, mesh))
    return mesh


def _warn_lost(best: _Attempt, fixed: FloatArray, progress: Progress) -> None:
    """Say which given points are no vertices."""
    kept = {
        int(i)
        for mesh in best.parts
        for stations in mesh.stations
        for i in stations.point
        if i >= 0
    }
    lost = sorted(set(range(len(fixed))) - kept)
    if lost:
        progress.warn(
            f"{len(lost)} of {len(fixed)} fixed points are no vertices of the candidate mesh "
            f"(the first is point {lost[0]}): they lie too close to another one or off the edge."
        )
