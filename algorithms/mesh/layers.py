"""Meshes to and from layers: result layers, and meshes made of drawn edges or faces."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import geopandas as gpd
import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from ..errors import InputError
from .foreign import foreign_edges
from .quadmesh import FloatArray, QuadMesh
from .quality import face_areas, scaled_jacobians

SNAP = 0.05
"""Distance in metres up to which drawn ends count as the same vertex."""
STRAIGHT_ANGLE = np.radians(20.0)
"""A point of a drawn face where the outline turns by less may be no corner."""


def mesh_layers(mesh: QuadMesh, crs: Any, source_crs: Any) -> dict[str, gpd.GeoDataFrame]:
    """Write a mesh as layers.

    Parameters
    ----------
    mesh
        The mesh, metres in `crs`.
    crs, source_crs
        Working CRS and the CRS of the layers.

    Returns
    -------
    dict
        "edges": edge_id, length_m, boundary, foreign (true boundary geometry);
        "vertices": vertex_id, role (corner, boundary, inner, irregular), valence;
        "faces": face_id, area_m2, scaled_jacobian.
    """
    lines = shapely.linestrings(mesh.vertices[mesh.edges])
    for i, arc in mesh.boundary_arcs.items():
        lines[i] = shapely.linestrings(arc)
    role = np.where(mesh.boundary_vertices, "boundary", "inner").astype(object)
    role[~mesh.boundary_vertices & (mesh.valences != 4)] = "irregular"
    role[mesh.boundary_vertices & (mesh.fixed | (mesh.valences != 3))] = "corner"
    rings = [
        np.vstack(
            [_side(mesh, int(e), int(u))[:-1] for e, u in zip(mesh.face_edges[f], mesh.faces[f])]
        )
        for f in range(len(mesh.faces))
    ]
    tables = {
        "edges": gpd.GeoDataFrame(
            {
                "edge_id": np.arange(len(mesh.edges)),
                "length_m": mesh.lengths,
                "boundary": mesh.boundary_edges,
                "foreign": mesh.foreign,
            },
            geometry=lines,
            crs=crs,
        ),
        "vertices": gpd.GeoDataFrame(
            {
                "vertex_id": np.arange(len(mesh.vertices)),
                "role": role,
                "valence": mesh.valences,
            },
            geometry=shapely.points(mesh.vertices),
            crs=crs,
        ),
        "faces": gpd.GeoDataFrame(
            {
                "face_id": np.arange(len(mesh.faces)),
                "area_m2": face_areas(mesh.vertices, mesh.faces),
                "scaled_jacobian": scaled_jacobians(mesh.vertices, mesh.faces),
            },
            geometry=[Polygon(r) for r in rings],
            crs=crs,
        ),
    }
    return {name: table.to_crs(source_crs) for name, table in tables.items()}


def _side(mesh: QuadMesh, edge: int, start: int) -> FloatArray:
    """Return the points of an edge beginning at one of its vertices."""
    line = mesh.edge_line(edge)
    return line if mesh.edges[edge, 0] == start else line[::-1]


def mesh_from_edges(
    lines: gpd.GeoDataFrame,
    *,
    edge_length: float | None = None,
    site_polygon: Polygon | None = None,
    layer: str = "Mesh edges",
) -> QuadMesh:
    """Make a mesh of drawn edges.

    The lines are noded, and the faces between them are found. A boundary edge may be bent;
    its points between corners are then its true course.

    Parameters
    ----------
    lines
        Line layer in a CRS in metres.
    edge_length
        Nominal edge length, metres; None for the mean of the drawn edges.
    site_polygon
        The site, for the foreign flags.
    layer
        Name of the layer, for messages.

    Raises
    ------
    InputError
        If there is no face, or a face has not four corners; the text names places.
    """
    parts = shapely.get_parts(shapely.force_2d(_geometries(lines, layer)))
    if not (shapely.get_type_id(parts) == 1).all():
        raise InputError("It holds something other than lines.", "Give lines only.", layer=layer)
    noded = shapely.union_all(parts, grid_size=SNAP / 10)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(np.atleast_1d(noded))))
    if not len(faces):
        raise InputError(
            "The lines enclose no face.", "Draw the edges so that they meet.", layer=layer
        )
    return _mesh_of_polygons(list(faces), edge_length, site_polygon, layer, None)


def mesh_from_faces(
    faces: gpd.GeoDataFrame,
    *,
    edge_length: float | None = None,
    site_polygon: Polygon | None = None,
    layer: str = "Mesh faces",
) -> QuadMesh:
    """Make a mesh of drawn quadrilaterals.

    Parameters
    ----------
    faces
        Polygon layer in a CRS in metres; neighbours share whole sides.
    edge_length, site_polygon, layer
        As for `mesh_from_edges`.

    Raises
    ------
    InputError
        If a face has not four corners; the text names the features.
    """
    found: list[Polygon] = []
    names: list[int | str] = []
    for name, geometry in zip(faces.index, _geometries(faces, layer)):
        for part in shapely.get_parts(shapely.force_2d(geometry)):
            if not isinstance(part, Polygon) or part.is_empty:
                raise InputError(
                    "It is not a polygon.", "Give polygons only.", layer=layer, feature=name
                )
            found.append(part)
            names.append(name)
    return _mesh_of_polygons(found, edge_length, site_polygon, layer, names)


def _geometries(table: gpd.GeoDataFrame, layer: str) -> Any:
    """Return the geometries of a layer that is usable."""
    if table.crs is not None and not table.crs.is_projected:
        raise InputError(
            "Its coordinates are degrees.", "Reproject it to a CRS in metres.", layer=layer
        )
    missing = table.geometry.isna() | table.geometry.is_empty
    if len(table) == 0 or bool(missing.all()):
        raise InputError("It is empty.", "Choose a layer with features.", layer=layer)
    if bool(missing.any()):
        raise InputError(
            "It has no geometry.",
            "Delete the feature or draw it.",
            layer=layer,
            feature=table.index[missing][0],
        )
    return table.geometry.to_numpy()


def _mesh_of_polygons(
    polygons: Sequence[Polygon],
    edge_length: float | None,
    site: Polygon | None,
    layer: str,
    names: Sequence[int | str] | None,
) -> QuadMesh:
    """Find vertices, corners, faces and boundary arcs of touching polygons."""
    rings = [np.asarray(orient(p, 1.0).exterior.coords)[:-1, :2] for p in polygons]
    points, number = _merged(np.vstack(rings))
    cuts = np.cumsum([len(r) for r in rings])[:-1]
    outlines = [_without_repeats(part.tolist()) for part in np.split(number, cuts)]
    holed = [i for i, p in enumerate(polygons) if len(p.interiors)]
    degree = _degrees(outlines)
    corners = [_corners(outline, points, degree) for outline in outlines]
    bad = sorted({i for i, c in enumerate(corners) if len(c) != 4} | set(holed))
    if bad:
        raise InputError(_bad_faces(bad, corners, points, outlines, names), layer=layer)
    used = np.unique(np.array(corners))
    index = {int(v): i for i, v in enumerate(used)}
    faces = np.array([[index[v] for v in c] for c in corners], dtype=np.int64)
    vertices = points[used]
    bare = QuadMesh(vertices, faces, edge_length or 1.0)
    arcs = {}
    for outline, corner in zip(outlines, corners):
        for u, v in zip(corner, [*corner[1:], corner[0]]):
            path = _path(outline, u, v)
            edge = bare.edge_between(index[u], index[v])
            if len(path) > 2 and bare.boundary_edges[edge]:
                arcs[edge] = points[path if index[u] < index[v] else path[::-1]]
    nominal = edge_length or float(bare.lengths.mean())
    mesh = QuadMesh(vertices, faces, nominal, boundary_arcs=arcs)
    if site is None:
        return mesh
    return QuadMesh(vertices, faces, nominal, boundary_arcs=arcs, foreign=foreign_edges(mesh, site))


def _merged(points: FloatArray) -> tuple[FloatArray, np.ndarray[Any, Any]]:
    """Join points closer than the snapping distance; return points and the index of each."""
    tree = shapely.STRtree(shapely.points(points))
    first, second = tree.query(shapely.points(points), predicate="dwithin", distance=SNAP)
    number = np.arange(len(points))
    np.minimum.at(number, first, second)
    # chains of near points follow their lowest member
    while (number[number] != number).any():
        number = number[number]
    kept, number = np.unique(number, return_inverse=True)
    return points[kept], number.reshape(-1)


def _without_repeats(outline: list[int]) -> list[int]:
    """Drop vertices that follow themselves in a closed outline."""
    return [v for i, v in enumerate(outline) if v != outline[i - 1]]


def _degrees(outlines: Iterable[Sequence[int]]) -> dict[int, set[int]]:
    """Return the neighbours of every point along all outlines."""
    near: dict[int, set[int]] = {}
    for outline in outlines:
        for a, b in zip(outline, [*outline[1:], outline[0]]):
            near.setdefault(a, set()).add(b)
            near.setdefault(b, set()).add(a)
    return near


def _corners(outline: Sequence[int], points: FloatArray, degree: dict[int, set[int]]) -> list[int]:
    """Return the corners of a face: branchings, and of the rest the sharpest turns to four."""
    ring = points[list(outline)]
    v = np.roll(ring, -1, axis=0) - ring
    heading = np.arctan2(v[:, 1], v[:, 0])
    turn = np.abs((heading - np.roll(heading, 1) + np.pi) % (2 * np.pi) - np.pi)
    sure = [i for i, p in enumerate(outline) if len(degree[p]) > 2]
    loose = [i for i in range(len(outline)) if i not in sure and turn[i] > STRAIGHT_ANGLE]
    loose.sort(key=lambda i: -turn[i])
    chosen = sorted(sure + loose[: max(0, 4 - len(sure))])
    return [outline[i] for i in chosen]


def _path(outline: Sequence[int], start: int, end: int) -> list[int]:
    """Return the points of a closed outline from one to another."""
    i, j = outline.index(start), outline.index(end)
    return list(outline[i : j + 1]) if i < j else [*outline[i:], *outline[: j + 1]]


def _bad_faces(
    bad: Sequence[int],
    corners: Sequence[Sequence[int]],
    points: FloatArray,
    outlines: Sequence[Sequence[int]],
    names: Sequence[int | str] | None,
) -> str:
    """Return the text that names faces that are not quadrilaterals, five at most."""
    texts = []
    for i in bad[:5]:
        x, y = points[list(outlines[i])].mean(axis=0)
        what = "a hole" if len(corners[i]) == 4 else f"{len(corners[i])} corners"
        who = f"the face at ({x:.1f}, {y:.1f})" if names is None else f"feature {names[i]}"
        texts.append(f"{who} has {what}")
    more = f" and {len(bad) - 5} more" if len(bad) > 5 else ""
    return (
        f"{len(bad)} of its faces are no quadrilaterals: {'; '.join(texts)}{more}. "
        "Redraw them with four corners that their neighbours share."
    )
