"""What a plan looks like in 3D: solids, surfaces of the ground and trees, in metres."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from ...errors import InputError
from ...site.crs import DISTORTION, distortion, is_metric, layer_crs, working_crs
from ..types import Floats

Shapes = npt.NDArray[np.object_]
Layers = Mapping[str, gpd.GeoDataFrame]
#: Height of a storey where a building has no height of its own, metres.
STOREY = 3.0
#: Smaller pieces of ground are not drawn, square metres.
LEAST = 0.05
WGS84 = CRS.from_epsg(4326)


@dataclass(frozen=True)
class Solid:
    """A building.

    Attributes
    ----------
    name
        Unique in the scene.
    polygon
        Outline, counter-clockwise, metres.
    height_m
        Metres.
    fields
        What the layer says of it.
    """

    name: str
    polygon: Polygon
    height_m: float
    fields: Mapping[str, Any]


@dataclass(frozen=True)
class Surface:
    """A piece of the ground; pieces do not overlap.

    Attributes
    ----------
    kind
        "corridor", "path", "parking", "green" or "paved".
    name
        Unique in the scene.
    polygons
        Its parts, counter-clockwise, metres.
    fields
        What the layer says of it.
    """

    kind: str
    name: str
    polygons: tuple[Polygon, ...]
    fields: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Scene:
    """A plan in 3D.

    Attributes
    ----------
    crs
        Projected, in metres.
    solids, surfaces
        Buildings and ground.
    trees
        Positions, shape (n, 2), metres.
    """

    crs: CRS
    solids: tuple[Solid, ...]
    surfaces: tuple[Surface, ...]
    trees: Floats

    @property
    def bounds(self) -> Floats:
        """Smallest x, smallest y, largest x, largest y, metres."""
        shapes = [solid.polygon for solid in self.solids]
        shapes += [part for surface in self.surfaces for part in surface.polygons]
        bounds: Floats = shapely.total_bounds(shapes)
        return bounds

    @property
    def epsg(self) -> int | None:
        """Code of the CRS, or None where it has none."""
        code = self.crs.to_epsg()
        return None if code is None else int(code)


def scene_of(layers: Layers) -> Scene:
    """Read the layers of laid out zones as a scene.

    Parameters
    ----------
    layers
        Those of `layers.zone_layers`, or others like them: "buildings" must be there; "corridors",
        "paths", "parking", "green", "trees" and "patches" may.

    Returns
    -------
    Scene
        In the CRS of the layers where that is in metres, true to 0.1 % and has a code; else in a
        UTM zone.

    Raises
    ------
    InputError
        If there is no layer of buildings, it has no CRS, or there is nothing in any layer.
    """
    if "buildings" not in layers:
        raise InputError("There is no layer of buildings.", "Give the layer 'buildings'.")
    bounds = [frame.total_bounds for frame in _drawn(layers)]
    if not bounds:
        raise InputError("There is nothing to draw.", "Lay out a zone first.", layer="buildings")
    low, high = np.array(bounds)[:, :2].min(axis=0), np.array(bounds)[:, 2:].max(axis=0)
    crs = scene_crs(layer_crs(layers["buildings"], "buildings"), np.concatenate([low, high]))
    moved = {
        name: frame if frame.crs == crs else frame.to_crs(crs)
        for name, frame in layers.items()
        if name in ("buildings", "corridors", "paths", "parking", "green", "trees", "patches")
    }
    solids = _solids(moved["buildings"])
    surfaces = _surfaces(moved, shapely.union_all([solid.polygon for solid in solids]))
    trees = moved.get("trees")
    points = np.zeros((0, 2))
    if trees is not None and len(trees):
        points = shapely.get_coordinates(trees.geometry.to_numpy())
    return Scene(crs, solids, surfaces, points)


def scene_crs(crs: CRS, bounds: Floats) -> CRS:
    """Choose the CRS of a scene: metres, and with a code that other programs know.

    Parameters
    ----------
    crs
        Of the layers.
    bounds
        Smallest x, smallest y, largest x, largest y in it.
    """
    if is_metric(crs) and crs.to_epsg() is not None and distortion(crs, bounds) < DISTORTION:
        return crs
    corners = gpd.GeoSeries([shapely.box(*bounds)], crs=crs).to_crs(WGS84)
    return working_crs(WGS84, corners.total_bounds, "buildings")


def _drawn(layers: Layers) -> list[gpd.GeoDataFrame]:
    """Give the layers that say where a plan lies."""
    names = ("buildings", "corridors", "patches", "green")
    return [layers[name] for name in names if name in layers and len(layers[name])]


def _solids(frame: gpd.GeoDataFrame) -> tuple[Solid, ...]:
    """Read the buildings; one of several parts becomes several."""
    found = []
    for at, (shape, fields) in enumerate(zip(frame.geometry, _records(frame))):
        height = fields.get("height_m") or STOREY * (fields.get("storeys") or 1)
        parts = _polygons(shape)
        for part, polygon in enumerate(parts):
            name = f"building-{fields.get('building_id', at + 1)}"
            name += f"-{part + 1}" if len(parts) > 1 else ""
            found.append(Solid(name, polygon, float(height), fields))
    return tuple(found)


def _surfaces(layers: Layers, built: BaseGeometry) -> tuple[Surface, ...]:
    """Cut the ground into pieces: what comes first lies above what comes later."""
    found: list[Surface] = []
    patches = layers.get("patches")
    inside = shapely.union_all([] if patches is None else patches.geometry.to_numpy())
    above: list[BaseGeometry] = [built]
    for kind in ("parking", "green", "path", "corridor"):
        frame = layers.get("paths" if kind == "path" else f"{kind}s", layers.get(kind))
        if frame is None or not len(frame):
            continue
        shapes = frame.geometry.to_numpy()
        if kind in ("path", "corridor"):
            half = frame["width_m"].astype(float).to_numpy() / 2
            cap = "round" if kind == "path" else "flat"
            shapes = shapely.buffer(shapes, half, cap_style=cap, quad_segs=4)
            # paths end at streets, and streets leave the patches to the buildings
            cut = shapely.difference if kind == "corridor" else shapely.intersection
            shapes = shapes if shapely.is_empty(inside) else cut(shapes, inside)
        own = _disjoint(shapes, shapely.union_all(above))
        above += own
        number = f"{kind}_id"
        for at, (shape, fields) in enumerate(zip(own, _records(frame))):
            parts = _polygons(shape)
            if parts:
                name = f"{kind}-{fields.get(number, at + 1)}"
                found.append(Surface(kind, name, parts, fields))
    paved = _polygons(shapely.difference(inside, shapely.union_all(above)))
    if paved:
        found.append(Surface("paved", "paved", paved, {}))
    return tuple(found)


def _disjoint(shapes: Shapes, above: BaseGeometry) -> list[BaseGeometry]:
    """Take from each shape what lies above it, and those before it."""
    own = shapely.difference(shapes, above)
    one, other = shapely.STRtree(own).query(own, predicate="intersects")
    left = []
    for k, shape in enumerate(own):
        before = other[(one == k) & (other < k)]
        left.append(shapely.difference(shape, shapely.union_all(own[before])))
    return left


def _polygons(shape: BaseGeometry | None) -> tuple[Polygon, ...]:
    """Give the parts of a shape that are polygons, their shells counter-clockwise."""
    if shape is None:
        return ()
    parts = shapely.get_parts(shapely.make_valid(shapely.force_2d(shape)))
    parts = shapely.get_parts(parts)
    keep = (shapely.get_type_id(parts) == 3) & (shapely.area(parts) > LEAST)
    return tuple(shapely.geometry.polygon.orient(part) for part in parts[keep])


def _records(frame: gpd.GeoDataFrame) -> Sequence[dict[str, Any]]:
    """Give the fields of each feature that are not empty, as plain values."""
    names = [name for name in frame.columns if name != frame.geometry.name]
    rows = zip(*(frame[name].tolist() for name in names))
    return [{name: v for name, v in zip(names, row) if not _missing(v)} for row in rows]


def _missing(value: Any) -> bool:
    """Tell whether a field is empty."""
    return value is None or (isinstance(value, float) and not math.isfinite(value))
