"""Patches drawn as polygons become groups of mesh faces (CND section 4.2 L1, figure 6e)."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import Polygon

from ..errors import InputError
from ..mesh import QuadMesh
from ..network.partition import broken_patches
from ..network.problem import IntArray
from ..site.types import Site
from .preferences import Preferences

#: Polygons that overlap each other or the site no wider than this only touch (edge lengths).
SLIVER = 0.1
#: Gaps between polygons that are no wider than this are closed (mesh edge lengths).
GAP = 0.5
#: So many faces that the mesh cuts off a patch go to its neighbours.
CRUMBS = 2

Patch = tuple[Polygon, "int | str"]


def patches_from_polygons(mesh: QuadMesh, site: Site, preferences: Preferences) -> IntArray:
    """Return to which of the given patches each face of a mesh belongs.

    Each face goes to the polygon with which it shares most ground. Polygons that lie outside
    the site, or reach into it with less than a face while most of them lies outside, do not
    count, so that one layer may serve several sites.

    Parameters
    ----------
    mesh
        The candidate mesh with m faces.
    site
        The site.
    preferences
        The polygons and the name of their layer.

    Returns
    -------
    numpy.ndarray
        Shape (m,). Patch of each face, numbered from 0 in the order of the polygons; -1 on
        obstacles that no polygon covers.

    Raises
    ------
    InputError
        If polygons overlap or leave ground of the site out, or a patch has no face or hangs
        together by nothing. The text names the layer and the feature.
    """
    layer = preferences.partition_layer
    sliver = SLIVER * mesh.edge_length
    within = [
        (shape, feature)
        for shape, feature in preferences.partition
        if not _thinned(shape.intersection(site.polygon), sliver).is_empty
    ]
    if not within:
        raise InputError(
            f"No patch lies in site {site.feature}.",
            "Draw patches that cover the site, or leave the layer out: patches are made then.",
            layer=layer,
        )
    _refuse_overlaps(within, sliver, layer)
    _refuse_gaps(within, site, GAP * mesh.edge_length, layer)
    patch = _faces(mesh, site, [shape for shape, _ in within])
    kept = []
    for number, (shape, feature) in enumerate(within):
        if (patch == number).any():
            kept.append(number)
        elif shape.intersection(site.polygon).area > 0.5 * shape.area:
            raise InputError(
                f"The patch is too small: it holds no cell of the mesh, whose edges are "
                f"{mesh.edge_length:.0f} m long.",
                "Join it with its neighbour, or make the mesh finer.",
                layer=layer,
                feature=feature,
            )
    _join_crumbs(mesh, patch)
    for number in broken_patches(mesh, patch):
        raise InputError(
            "The patch is not in one piece: the outline of the site or other patches cut it.",
            "Draw a polygon of its own for each piece.",
            layer=layer,
            feature=within[number][1],
        )
    renumbered = np.full(len(within) + 1, -1, dtype=np.int64)
    renumbered[kept] = np.arange(len(kept))
    return renumbered[patch]


def _thinned(shape: shapely.Geometry, width: float) -> shapely.Geometry:
    """Return what is left of a shape where it is wider than `width`."""
    return shapely.buffer(shape, -width / 2)


def _refuse_overlaps(patches: Sequence[Patch], width: float, layer: str) -> None:
    """Raise an error if two patches overlap by more than a sliver."""
    shapes = np.array([shape for shape, _ in patches], dtype=object)
    for i, j in sorted(shapely.STRtree(shapes).query(shapes, "intersects").T.tolist()):
        shared = shapely.intersection(shapes[i], shapes[j]) if i < j else Polygon()
        if not _thinned(shared, width).is_empty:
            raise InputError(
                f"The patch overlaps that of feature {patches[j][1]} by {shared.area:.0f} m².",
                "Cut one of them back, so that every place belongs to one patch.",
                layer=layer,
                feature=patches[i][1],
            )


def _refuse_gaps(patches: Sequence[Patch], site: Site, width: float, layer: str) -> None:
    """Raise an error if the patches leave ground of the site out, obstacles apart."""
    covered = shapely.union_all([shape for shape, _ in patches])
    left = site.polygon.difference(covered).difference(site.obstacle_union)
    bare = _thinned(left, width)
    if bare.is_empty:
        return
    worst = max(shapely.get_parts(bare), key=lambda part: part.area)
    where = worst.representative_point()
    gaps = [shape.distance(where) for shape, _ in patches]
    whole = max(shapely.get_parts(left), key=lambda part: part.intersection(worst).area)
    raise InputError(
        f"Beside this patch {whole.area:.0f} m² of site {site.feature} belong to no patch, at "
        f"x {where.x:.0f}, y {where.y:.0f} ({site.crs.name}).",
        "Enlarge the patch, or draw another one there.",
        layer=layer,
        feature=patches[int(np.argmin(gaps))][1],
    )


def _faces(mesh: QuadMesh, site: Site, shapes: Sequence[Polygon]) -> IntArray:
    """Give every face to the polygon that shares most ground with it, or the nearest one."""
    faces = shapely.polygons(mesh.vertices[mesh.faces])
    tree = shapely.STRtree(np.array(shapes, dtype=object))
    face, polygon = tree.query(faces, "intersects")
    shared = shapely.area(shapely.intersection(faces[face], tree.geometries[polygon]))
    patch = np.full(len(faces), -1, dtype=np.int64)
    # the last of several writes stays: the largest share, of equal ones the first polygon
    order = np.lexsort((-polygon, shared))
    order = order[shared[order] > 0]
    patch[face[order]] = polygon[order]
    centres = shapely.centroid(faces)
    bare = np.flatnonzero(patch < 0)
    bare = bare[~shapely.intersects(site.obstacle_union, centres[bare])]
    patch[bare] = tree.nearest(centres[bare])
    return patch


def _join_crumbs(mesh: QuadMesh, patch: IntArray) -> None:
    """Give the few faces that the mesh cuts off a patch to their neighbours, in place."""
    pairs = mesh.edge_faces[~mesh.boundary_edges].tolist()
    around: list[list[int]] = [[] for _ in range(len(patch))]
    for f, g in pairs:
        around[f].append(g)
        around[g].append(f)
    for number in broken_patches(mesh, patch):
        parts = _pieces(np.flatnonzero(patch == number).tolist(), around)
        for part in parts[1:]:
            beside = [int(patch[g]) for f in part for g in around[f] if g not in part]
            beside = [other for other in beside if other >= 0]
            if len(part) <= CRUMBS and beside:
                patch[sorted(part)] = max(sorted(set(beside)), key=beside.count)


def _pieces(faces: list[int], around: Sequence[Sequence[int]]) -> list[set[int]]:
    """Return the connected pieces of some faces, the largest first."""
    left = set(faces)
    found = []
    for first in faces:
        if first not in left:
            continue
        piece, queue = {first}, deque([first])
        left.discard(first)
        while queue:
            for g in around[queue.popleft()]:
                if g in left:
                    left.discard(g)
                    piece.add(g)
                    queue.append(g)
        found.append(piece)
    return sorted(found, key=lambda piece: (-len(piece), min(piece)))
