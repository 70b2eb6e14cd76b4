"""Binary glTF 2.0 of laid out zones (https://registry.khronos.org/glTF/specs/2.0)."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon

from .buffers import Buffers
from .colours import COLOURS, linear
from .scene import Layers, Scene, Solid, scene_of
from .tree import tree_faces, tree_scale
from .triangles import triangulate

Floats = npt.NDArray[np.float64]
Nodes = list[dict[str, Any]]
#: The plan lies on a plate that reaches so far beyond it, so much below it, metres.
BEYOND, BELOW = 12.0, 0.3
MAGIC, VERSION, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 2, 0x4E4F534A, 0x004E4942


def gltf(layers: Layers) -> bytes:
    """Give the plan of zones as binary glTF, the contents of a .glb file.

    Metres, y up, north towards -z. The origin is the middle of the plan at ground level; where
    that lies is in `asset.extras` (crs, origin). Each building is a node with the fields of its
    layer as extras, coloured by use and storeys as in QGIS.

    Parameters
    ----------
    layers
        Those of `layers.zone_layers`.

    Returns
    -------
    bytes

    Raises
    ------
    InputError
        If there is no layer of buildings, it has no CRS, or there is nothing in any layer.
    """
    scene = scene_of(layers)
    bounds = scene.bounds
    origin = np.round((bounds[:2] + bounds[2:]) / 2)
    buffers = Buffers()
    meshes: Nodes = []
    nodes: Nodes = [{"name": "plan", "children": []}]
    _add_group(nodes, "ground", _ground(scene, origin, buffers, meshes))
    _add_group(nodes, "buildings", _buildings(scene, origin, buffers, meshes))
    _add_group(nodes, "trees", _trees(scene, origin, buffers, meshes))
    materials = _used(meshes)
    document = {
        "asset": {
            "version": "2.0",
            "generator": "Platwright",
            "extras": {
                "crs": f"EPSG:{scene.epsg}" if scene.epsg else scene.crs.to_wkt(),
                "origin": origin.tolist(),
            },
        },
        "scene": 0,
        "scenes": [{"name": "Residential zone", "nodes": [0]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [_material(name) for name in materials],
        "accessors": buffers.accessors,
        "bufferViews": buffers.views,
        "buffers": [{"byteLength": len(buffers.data)}],
    }
    return _packed(document, bytes(buffers.data))


def _packed(document: dict[str, Any], data: bytes) -> bytes:
    """Join the two chunks of a .glb file, each filled up to four bytes."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    total = 12 + 8 + len(text) + 8 + len(data)
    return b"".join(
        [
            struct.pack("<III", MAGIC, VERSION, total),
            struct.pack("<II", len(text), JSON_CHUNK),
            text,
            struct.pack("<II", len(data), BINARY_CHUNK),
            data,
        ]
    )


def _material(name: str) -> dict[str, Any]:
    """Give a dull material of one colour."""
    return {
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*linear(COLOURS[name]), 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.95,
        },
    }


def _add_group(nodes: Nodes, name: str, own: Nodes) -> None:
    """Add nodes below one of their own; an empty group is left out."""
    if not own:
        return
    first = len(nodes) + 1
    nodes[0]["children"].append(len(nodes))
    nodes.append({"name": name, "children": list(range(first, first + len(own)))})
    nodes += own


def _up(xy: Floats, height: float, origin: Floats) -> Floats:
    """Give points of the plan as glTF has them, shape (n, 3)."""
    return np.column_stack([xy[:, 0] - origin[0], np.full(len(xy), height), origin[1] - xy[:, 1]])


def _ground(scene: Scene, origin: Floats, buffers: Buffers, meshes: Nodes) -> Nodes:
    """Give the plate and the pieces of ground, one node of each kind."""
    x0, y0, x1, y1 = scene.bounds
    plate = shapely.box(x0 - BEYOND, y0 - BEYOND, x1 + BEYOND, y1 + BEYOND)
    pieces: dict[str, list[Polygon]] = {}
    for surface in scene.surfaces:
        pieces.setdefault(surface.kind, []).extend(surface.polygons)
    nodes = [_flat("plate", [plate], -BELOW, origin, buffers, meshes)]
    nodes += [_flat(kind, own, 0.0, origin, buffers, meshes) for kind, own in pieces.items()]
    return nodes


def _flat(
    kind: str,
    polygons: Sequence[Polygon],
    height: float,
    origin: Floats,
    buffers: Buffers,
    meshes: Nodes,
) -> dict[str, Any]:
    """Add a mesh of surfaces that look up."""
    points, triangles, begun = [], [], 0
    for polygon in polygons:
        xy, faces = triangulate(polygon)
        points.append(_up(xy, height, origin))
        triangles.append(faces + begun)
        begun += len(xy)
    every = np.concatenate(points)
    normals = np.tile([0.0, 1.0, 0.0], (len(every), 1))
    primitive = buffers.primitive(every, normals, np.concatenate(triangles), _number(kind))
    meshes.append({"name": kind, "primitives": [primitive]})
    return {"name": kind, "mesh": len(meshes) - 1}


def _buildings(scene: Scene, origin: Floats, buffers: Buffers, meshes: Nodes) -> Nodes:
    """Add a node for each building."""
    nodes = []
    for solid in scene.solids:
        kind = _kind(solid)
        roof = _roof(solid, origin)
        parts = [
            buffers.primitive(*_walls(solid, origin), _number(f"{kind} walls")),
            buffers.primitive(*roof, _number(f"{kind} roof")),
        ]
        meshes.append({"name": solid.name, "primitives": parts})
        nodes.append({"name": solid.name, "mesh": len(meshes) - 1, "extras": dict(solid.fields)})
    return nodes


def _kind(solid: Solid) -> str:
    """Tell by what a building is coloured."""
    if solid.fields.get("use") == "facility":
        return "facility"
    storeys = solid.fields.get("storeys") or solid.height_m / 3
    return "low" if storeys < 4 else "middle" if storeys < 9 else "high"


def _roof(solid: Solid, origin: Floats) -> tuple[Floats, Floats, npt.NDArray[np.int64]]:
    """Give the roof, and the ground below, which looks down."""
    xy, faces = triangulate(solid.polygon)
    points = np.concatenate([_up(xy, solid.height_m, origin), _up(xy, 0.0, origin)])
    normals = np.repeat([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]], len(xy), axis=0)
    return points, normals, np.concatenate([faces, faces[:, ::-1] + len(xy)])


def _walls(solid: Solid, origin: Floats) -> tuple[Floats, Floats, npt.NDArray[np.int64]]:
    """Give the walls, each with corners of its own, so that edges are sharp."""
    rings = [np.array(ring.coords) for ring in (solid.polygon.exterior, *solid.polygon.interiors)]
    a = np.concatenate([ring[:-1] for ring in rings])
    b = np.concatenate([ring[1:] for ring in rings])
    low, high = ((_up(a, z, origin), _up(b, z, origin)) for z in (0.0, solid.height_m))
    points = np.stack([low[0], low[1], high[1], high[0]], axis=1).reshape(-1, 3)
    # outwards is to the right of a shell that runs counter-clockwise
    way = b - a
    out = np.column_stack([way[:, 1], np.zeros(len(way)), way[:, 0]])
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    first = 4 * np.arange(len(a))[:, None]
    faces = (first + np.array([0, 1, 2, 0, 2, 3])).reshape(-1, 3)
    return points, np.repeat(out, 4, axis=0), faces


def _trees(scene: Scene, origin: Floats, buffers: Buffers, meshes: Nodes) -> Nodes:
    """Add the trees: one mesh that stands in many places."""
    if not len(scene.trees):
        return []
    stem, crown, _ = tree_faces(0)
    size = tree_scale(0)
    quads = (stem / size).reshape(-1, 4, 3)
    stems = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    parts = []
    for name, faces in (("stem", stems), ("crown", crown / size)):
        points = faces.reshape(-1, 3)[:, [0, 2, 1]] * [1.0, 1.0, -1.0]
        corners = points.reshape(-1, 3, 3)
        out = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        index = np.arange(len(points)).reshape(-1, 3)
        parts.append(buffers.primitive(points, np.repeat(out, 3, axis=0), index, _number(name)))
    meshes.append({"name": "tree", "primitives": parts})
    places = _up(scene.trees, 0.0, origin)
    return [
        {
            "name": f"tree-{at + 1}",
            "mesh": len(meshes) - 1,
            "translation": np.round(place, 3).tolist(),
            "scale": [round(tree_scale(at), 3)] * 3,
        }
        for at, place in enumerate(places)
    ]


def _used(meshes: Nodes) -> list[str]:
    """Keep the materials that meshes have, by new numbers, and give their names."""
    primitives = [primitive for mesh in meshes for primitive in mesh["primitives"]]
    used = sorted({primitive["material"] for primitive in primitives})
    for primitive in primitives:
        primitive["material"] = used.index(primitive["material"])
    return [list(COLOURS)[number] for number in used]


def _number(material: str) -> int:
    """Give the index of a material."""
    return list(COLOURS).index(material)
