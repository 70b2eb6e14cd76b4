"""CityJSON 2.0 of laid out zones (https://www.cityjson.org/specs/2.0.1)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from shapely.geometry import Polygon

from .scene import Layers, Scene, Solid, Surface, scene_of
from .tree import tree_faces

#: Vertices are whole numbers of millimetres.
SCALE = 0.001
#: CityJSON types of the pieces of ground, with the semantics of their surfaces.
TYPES: Mapping[str, tuple[str, str | None]] = {
    "corridor": ("Road", "TrafficArea"),
    "path": ("Road", "TrafficArea"),
    "parking": ("Road", "AuxiliaryTrafficArea"),
    "green": ("PlantCover", None),
    "paved": ("LandUse", None),
}
#: What they are for.
FUNCTIONS: Mapping[str, str] = {
    "corridor": "street", "path": "footpath", "parking": "parking", "green": "green",
    "paved": "paved ground",
}  # fmt: skip
GROUND, WALL, ROOF = range(3)


def city_json(layers: Layers, *, title: str = "Residential zone") -> dict[str, Any]:
    """Give the plan of zones as a CityJSON object.

    Buildings are solids of level of detail 1 with ground, walls and roof told apart; the ground
    at height 0 is cut into roads (streets, paths, parking), plant cover and land use; trees are
    solitary vegetation objects. Fields of the layers become attributes.

    Parameters
    ----------
    layers
        Those of `layers.zone_layers`.
    title
        Title of the file.

    Returns
    -------
    dict
        Ready for `json.dumps`.

    Raises
    ------
    InputError
        If there is no layer of buildings, it has no CRS, or there is nothing in any layer.
    """
    scene = scene_of(layers)
    origin = np.floor(np.append(scene.bounds[:2], 0.0))
    vertices = _Vertices(origin)
    objects: dict[str, Any] = {}
    for solid in scene.solids:
        objects[solid.name] = _building(solid, vertices)
    for surface in scene.surfaces:
        objects[surface.name] = _piece(surface, vertices)
    for at, xy in enumerate(scene.trees):
        objects[f"tree-{at + 1}"] = _tree(at, xy, vertices)
    return {
        "type": "CityJSON",
        "version": "2.0",
        "transform": {"scale": [SCALE] * 3, "translate": origin.tolist()},
        "metadata": _metadata(scene, vertices, title),
        "CityObjects": objects,
        "vertices": vertices.points,
    }


class _Vertices:
    """Vertices in whole millimetres, each once."""

    def __init__(self, origin: npt.NDArray[np.float64]) -> None:
        self.origin = origin
        self.points: list[list[int]] = []
        self._index: dict[tuple[int, ...], int] = {}

    def ring(self, xyz: npt.NDArray[np.float64]) -> list[int]:
        """Give the indices of the points of an open ring, none twice in a row."""
        found: list[int] = []
        for point in np.rint((xyz - self.origin) / SCALE).astype(int).tolist():
            at = self._index.setdefault(tuple(point), len(self.points))
            if at == len(self.points):
                self.points.append(point)
            if not found or found[-1] != at:
                found.append(at)
        return found[:-1] if len(found) > 1 and found[0] == found[-1] else found


def _metadata(scene: Scene, vertices: _Vertices, title: str) -> dict[str, Any]:
    """Say where the plan lies."""
    points = np.array(vertices.points) * SCALE + vertices.origin
    extent = np.round(np.concatenate([points.min(axis=0), points.max(axis=0)]), 3)
    found: dict[str, Any] = {"title": title, "geographicalExtent": extent.tolist()}
    if scene.epsg is not None:
        found["referenceSystem"] = f"https://www.opengis.net/def/crs/EPSG/0/{scene.epsg}"
    return found


def _rings(polygon: Polygon, z: float) -> list[npt.NDArray[np.float64]]:
    """Give the open rings of a polygon at a height, shell first, each of shape (n, 3)."""
    rings = [np.array(ring.coords)[:-1, :2] for ring in (polygon.exterior, *polygon.interiors)]
    return [np.column_stack([ring, np.full(len(ring), z)]) for ring in rings]


def _face(rings: Sequence[npt.NDArray[np.float64]], vertices: _Vertices) -> list[list[int]]:
    """Give a surface by the indices of its rings; rings of no extent are left out."""
    indexed = [vertices.ring(ring) for ring in rings]
    return [ring for ring in indexed if len(ring) > 2]


def _building(solid: Solid, vertices: _Vertices) -> dict[str, Any]:
    """Give a building as a solid; all faces look outwards."""
    low, high = _rings(solid.polygon, 0.0), _rings(solid.polygon, solid.height_m)
    faces = [(_face([ring[::-1] for ring in low], vertices), GROUND)]
    for below, above in zip(low, high):
        for a in range(len(below)):
            b = (a + 1) % len(below)
            wall = np.array([below[a], below[b], above[b], above[a]])
            faces.append((_face([wall], vertices), WALL))
    faces.append((_face(high, vertices), ROOF))
    faces = [(face, kind) for face, kind in faces if face]
    return {
        "type": "Building",
        "attributes": dict(solid.fields),
        "geometry": [
            {
                "type": "Solid",
                "lod": "1",
                "boundaries": [[face for face, _ in faces]],
                "semantics": {
                    "surfaces": [
                        {"type": "GroundSurface"},
                        {"type": "WallSurface"},
                        {"type": "RoofSurface"},
                    ],
                    "values": [[kind for _, kind in faces]],
                },
            }
        ],
    }


def _piece(surface: Surface, vertices: _Vertices) -> dict[str, Any]:
    """Give a piece of ground as surfaces that look up."""
    kind, semantics = TYPES[surface.kind]
    faces = [_face(_rings(polygon, 0.0), vertices) for polygon in surface.polygons]
    faces = [face for face in faces if face]
    geometry: dict[str, Any] = {"type": "MultiSurface", "lod": "1", "boundaries": faces}
    if semantics is not None:
        geometry["semantics"] = {"surfaces": [{"type": semantics}], "values": [0] * len(faces)}
    return {
        "type": kind,
        "attributes": {"function": FUNCTIONS[surface.kind], **surface.fields},
        "geometry": [geometry],
    }


def _tree(at: int, xy: npt.NDArray[np.float64], vertices: _Vertices) -> dict[str, Any]:
    """Give a tree: a crown on a stem."""
    stem, crown, height = tree_faces(at)
    faces = [_face([np.append(xy, 0.0) + corners], vertices) for corners in (*stem, *crown)]
    return {
        "type": "SolitaryVegetationObject",
        "attributes": {"height_m": math.floor(height * 10) / 10},
        "geometry": [
            {"type": "MultiSurface", "lod": "1", "boundaries": [face for face in faces if face]}
        ],
    }
