"""A second mesher: frontal quads of the package gmsh, where that is installed.

gmsh is licensed under the GPL, version 2 or later; it is asked for only when it is used. Its
meshes have many irregular vertices and serve for comparison.
"""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from ..errors import CancelledError, MeshError, MissingDependencyError
from ..progress import Progress
from .assemble import finish
from .clean import clean_site
from .quadmesh import FloatArray, IntArray, QuadMesh
from .rings import place_stations, polygon_rings

_LOCK = threading.Lock()
"""gmsh has one global state."""
FRONTAL_QUADS = 8
BLOSSOM_FULL_QUADS = 3
CLEANING = 1 / 6


def gmsh_mesh(
    site: Polygon | MultiPolygon, h: float, fixed: FloatArray, progress: Progress
) -> QuadMesh:
    """Mesh a site with gmsh: algorithm 8 and recombination 3.

    Every curve gets an even number of segments, without which no all-quad mesh exists.

    Parameters
    ----------
    site
        Valid polygon, metres.
    h
        Edge length, metres.
    fixed
        Shape (k, 2). Points of the boundary that must be vertices.
    progress
        Asked for cancellation before the mesher starts.

    Raises
    ------
    MissingDependencyError
        If gmsh is not installed.
    MeshError
        If the mesher fails or leaves triangles.
    """
    try:
        import gmsh  # type: ignore[import-not-found, import-untyped, unused-ignore]
    except (ImportError, OSError) as error:
        msg = (
            "The mesher gmsh is not installed or lacks a system library. Install it with "
            "'pip install gmsh', or choose the mesher polysquare."
        )
        raise MissingDependencyError(msg) from error
    if progress.cancelled():
        msg = "Cancelled before the candidate mesh was made."
        raise CancelledError(msg)
    parts = clean_site(site, h, CLEANING, fixed).parts
    if not parts:
        msg = f"Nothing is left of the site at an edge length of {h:g} m. Set a smaller one."
        raise MeshError(msg)
    vertices, faces = [], []
    count = 0
    with _LOCK:
        for part in parts:
            points, quads = _mesh_part(gmsh, part, h, fixed)
            vertices.append(points)
            faces.append(quads + count)
            count += len(points)
    points = np.vstack(vertices)
    near = np.zeros(len(points), dtype=bool)
    if len(fixed):
        tree = shapely.STRtree(shapely.points(points))
        index, distance = tree.query_nearest(
            shapely.points(fixed), return_distance=True, all_matches=False
        )
        near[index[1][distance < 0.1 * h]] = True
    return finish(points, np.vstack(faces), h, site, lines={}, fixed=near, attracted={})


def _mesh_part(
    gmsh: Any, part: Polygon, h: float, fixed: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Mesh one polygon; return its vertices and its faces, counter-clockwise."""
    # interruptible would install a signal handler, which only the main thread may do
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("site")
        _add_surface(gmsh.model.geo, part, h, fixed)
        for name, value in (
            ("Mesh.MeshSizeMin", 0.7 * h),
            ("Mesh.MeshSizeMax", h),
            ("Mesh.RecombineAll", 1),
            ("Mesh.Algorithm", FRONTAL_QUADS),
            ("Mesh.RecombinationAlgorithm", BLOSSOM_FULL_QUADS),
        ):
            gmsh.option.setNumber(name, value)
        gmsh.model.mesh.generate(2)
        return _read(gmsh)
    except MeshError:
        raise
    except Exception as error:
        msg = f"The mesher gmsh failed: {error}. Choose the mesher polysquare."
        raise MeshError(msg) from error
    finally:
        gmsh.finalize()


def _add_surface(geo: Any, part: Polygon, h: float, fixed: FloatArray) -> None:
    """Describe a polygon to gmsh, an even number of segments on every curve."""
    loops = []
    rings = polygon_rings(part)
    close = fixed[shapely.distance(part, shapely.points(fixed)) < 0.5 * h]
    stations, _ = place_stations(rings, h, close, np.arange(len(close)))
    for ring, marks in zip(rings, stations):
        arcs = marks.arc if len(marks.arc) > 1 else np.array([0.0, ring.length / 2])
        ends = np.append(arcs[1:], arcs[0] + ring.length)
        tags = [geo.addPoint(float(x), float(y), 0.0, h) for x, y in ring.at(arcs)]
        curves = []
        for i, (a, b) in enumerate(zip(arcs.tolist(), ends.tolist())):
            inside = [geo.addPoint(float(x), float(y), 0.0) for x, y in ring.part(a, b)[1:-1]]
            path = [tags[i], *inside, tags[(i + 1) % len(tags)]]
            curve = geo.addPolyline(path) if len(path) > 2 else geo.addLine(*path)
            geo.mesh.setTransfiniteCurve(curve, max(2, 2 * round((b - a) / (2 * h))) + 1)
            curves.append(curve)
        loops.append(geo.addCurveLoop(curves))
    geo.addPlaneSurface(loops)
    geo.synchronize()


def _read(gmsh: Any) -> tuple[FloatArray, IntArray]:
    """Take the mesh out of gmsh."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    points = np.asarray(coordinates, dtype=float).reshape(-1, 3)[:, :2]
    index = {int(tag): i for i, tag in enumerate(tags)}
    quads = np.zeros((0, 4), dtype=np.int64)
    for kind, _, nodes in zip(*gmsh.model.mesh.getElements(2)):
        if kind == 2:
            msg = "The mesher gmsh left triangles. Choose the mesher polysquare."
            raise MeshError(msg)
        if kind == 3:
            quads = np.array([index[int(t)] for t in nodes], dtype=np.int64).reshape(-1, 4)
    if not len(quads):
        msg = "The mesher gmsh made no quads. Choose the mesher polysquare."
        raise MeshError(msg)
    used, inverse = np.unique(quads, return_inverse=True)
    faces = inverse.reshape(-1, 4).astype(np.int64)
    vertices = points[used]
    p = vertices[faces]
    shoelace = p[:, :, 0] * np.roll(p[:, :, 1], -1, 1) - np.roll(p[:, :, 0], -1, 1) * p[:, :, 1]
    turned = shoelace.sum(axis=1) < 0
    faces[turned] = faces[turned, ::-1]
    return vertices, faces
