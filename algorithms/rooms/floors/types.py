"""What a storey is made of before rooms are placed on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Union

from pyproj import CRS
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from ...mesh.quadmesh import BoolArray, QuadMesh

#: Id of a feature.
Feature = Union[int, str]


@dataclass(frozen=True)
class Remark:
    """Something that the planner should know about a floor, with its place.

    Attributes
    ----------
    text
        What is the matter, as a sentence.
    action
        What was done, or what to do.
    severity
        "info", "warning" or "error".
    geometry
        Where, in the working CRS of the floor.
    """

    text: str
    action: str
    severity: str
    geometry: BaseGeometry


@dataclass(frozen=True)
class LayerNames:
    """What the layers are called in messages, and the field that says the storey.

    Attributes
    ----------
    footprints, sinks, obstacles, corridors
        Names of the layers.
    floor
        Field with the storey of a feature, in any layer; empty values and layers without the
        field stand for all storeys.
    """

    footprints: str = "Footprints"
    sinks: str = "Exits"
    obstacles: str = "Obstacles"
    corridors: str = "Corridors"
    floor: str = "floor"


@dataclass(frozen=True, eq=False)
class Floor:
    """A storey of a building as a mesh of n vertices, m faces and e edges.

    All storeys of one footprint hold the same mesh, so that a shaft that goes through several
    lies on the same faces in each.

    Attributes
    ----------
    storey
        Number of the storey, as in the layers.
    feature
        Id of the footprint's feature.
    polygon
        The footprint with courtyards as holes, metres in `crs`. The faces, with their true
        sides, tile it.
    mesh
        The mesh, metres in `crs`.
    floor
        Shape (m,). Faces to be tiled; an obstacle covers more than half of the others.
    sinks
        Shape (n,). Vertices at which a way out begins: entrances, stairs, corners of lifts.
    required
        Shape (e,). Edges along which a corridor must run.
    outer
        Shape (e,). Edges along outer walls, those of courtyards too.
    crs, source_crs
        Working CRS, in metres, and the CRS of the footprints.
    remarks
        What was repaired or assumed.
    """

    storey: int
    feature: Feature
    polygon: Polygon
    mesh: QuadMesh
    floor: BoolArray
    sinks: BoolArray
    required: BoolArray
    outer: BoolArray
    crs: CRS
    source_crs: CRS
    remarks: tuple[Remark, ...] = ()
