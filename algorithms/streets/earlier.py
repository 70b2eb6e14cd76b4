"""An earlier design as the start of the next: which mesh it was made on and which of its edges.

A small change of what is asked then costs a small time: the search begins with the streets that
there are, and on the one mesh on which they lie.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import shapely
from shapely.geometry import LineString

from ..errors import InputError, MeshError
from ..mesh import QuadMesh
from ..network.problem import BoolArray, IntArray
from ..site.types import Site
from .fitting import same_mesh

#: A mesh edge lies on a street where it is nowhere farther from it than this (edge lengths).
NEAR = 0.2
#: Where along an edge that is looked at. The ends are left out: streets are drawn straight and
#: trimmed there.
PLACES = np.array([0.15, 0.3, 0.5, 0.7, 0.85])
#: Level of a street of which it is not known.
UNKNOWN = -1
#: Share of an earlier design that must lie in the site.
INSIDE = 0.5


def check_start(site: Site, lines: Sequence[LineString], layer: str) -> None:
    """Refuse an earlier design that belongs to another site.

    Raises
    ------
    InputError
        If less than half of its length lies in the site.
    """
    if not lines:
        return
    streets = shapely.union_all(np.array(lines, dtype=object))
    near = shapely.buffer(site.polygon, 2 * site.snap_distance)
    inside = shapely.length(shapely.intersection(streets, near))
    if inside < INSIDE * shapely.length(streets):
        raise InputError(
            f"Only {inside:.0f} of {shapely.length(streets):.0f} m of its streets lie in the site "
            f"'{site.name}': it is the design of another one.",
            "Choose the design of this site, or start without one.",
            layer=layer,
        )


def start_edges(mesh: QuadMesh, lines: Sequence[LineString]) -> BoolArray:
    """Find the edges of a mesh along which the streets of an earlier design run.

    Parameters
    ----------
    mesh
        The candidate mesh.
    lines
        Streets of the earlier design, metres.

    Returns
    -------
    numpy.ndarray
        Shape (e,). Edges of the boundary are never among them.
    """
    mark = np.zeros(len(mesh.edges), dtype=np.bool_)
    if not lines:
        return mark
    streets = shapely.union_all(np.array(lines, dtype=object))
    inner = np.flatnonzero(~mesh.boundary_edges)
    edges = shapely.linestrings(mesh.vertices[mesh.edges[inner]])
    places = shapely.line_interpolate_point(edges[:, None], PLACES[None, :], normalized=True)
    off = shapely.distance(places, streets).max(axis=1, initial=0.0)
    mark[inner] = off < NEAR * mesh.edge_length
    return mark


def start_levels(mesh: QuadMesh, start: Mapping[int, Sequence[LineString]]) -> IntArray:
    """Find the level of an earlier design's street along each edge of a mesh.

    Parameters
    ----------
    mesh
        The candidate mesh.
    start
        Streets of the earlier design by level, 0 where it is not known.

    Returns
    -------
    numpy.ndarray
        Shape (e,). The level, `UNKNOWN` where it is not known, 0 where there was no street.
    """
    found = np.zeros(len(mesh.edges), dtype=np.int64)
    for level in sorted(start, reverse=True):
        found[start_edges(mesh, start[level])] = level or UNKNOWN
    return found


def mesh_of_start(
    choices: Sequence[Callable[[], QuadMesh]], lines: Sequence[LineString]
) -> Callable[[], QuadMesh]:
    """Return the mesh on which an earlier design lies best, as a function that gives it.

    Parameters
    ----------
    choices
        Functions that make the candidate meshes.
    lines
        Streets of the earlier design, metres.

    Raises
    ------
    MeshError
        If none of the meshes can be made.
    """
    made: list[QuadMesh] = []
    failure: MeshError | None = None
    for make in choices:
        try:
            one = make()
        except MeshError as error:
            failure = error
            continue
        # meshes of different sizes may be the same: then the first, as in the earlier run
        if not any(same_mesh(one, other) for other in made):
            made.append(one)
    if not made:
        raise failure or MeshError("No candidate mesh could be made of the site.")
    best = min(made, key=lambda mesh: mesh_misfit(mesh, lines))
    return lambda: best


def mesh_misfit(mesh: QuadMesh, lines: Sequence[LineString]) -> float:
    """Return how far an earlier design lies from the lines of a mesh.

    Parameters
    ----------
    mesh
        A candidate mesh.
    lines
        Streets of the earlier design, metres.

    Returns
    -------
    float
        Mean distance of places along the streets from the nearest mesh line, metres.
    """
    grid = shapely.union_all(shapely.linestrings(mesh.vertices[mesh.edges]))
    places = [
        line.interpolate(at)
        for line in lines
        for at in np.arange(0, line.length, mesh.edge_length / 5).tolist()
    ]
    if not places:
        return 0.0
    return float(np.mean(shapely.distance(np.array(places), grid)))
