"""What a divided city is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import geopandas as gpd
import shapely
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, Polygon

from ..site.types import AccessPoint, BoundaryStreet, Site
from .rules import CityRules

#: What is done with a piece of ground: streets are designed, or it stays as it is.
DESIGN, LEFT = "design", "left"


@dataclass(frozen=True)
class DividingRoad:
    """A piece of a road between sub-regions, or of a new collector that cuts ground too large.

    Attributes
    ----------
    line
        Its course, metres.
    name, kind
        Name and class, empty where unknown.
    level
        1 major, 2 collector.
    new
        Whether it is not there yet.
    closed
        Whether nobody enters the ground beside it from there.
    """

    line: LineString
    name: str = ""
    kind: str = ""
    level: int = 1
    new: bool = False
    closed: bool = False


@dataclass(frozen=True)
class SubRegion:
    """A piece of a city between its major roads.

    Attributes
    ----------
    number
        From 1, north to south and west to east.
    polygon
        The ground, metres.
    state
        "design", or "left" where it stays as it is.
    reason
        Why it stays as it is, empty otherwise.
    frontage
        The parts of its rings along roads that give access.
    beside
        These roads, cut at junctions.
    inside
        Major roads that end blind in it.
    obstacles
        Small obstacles in it.
    """

    number: int
    polygon: Polygon
    state: str = DESIGN
    reason: str = ""
    frontage: MultiLineString = field(default_factory=MultiLineString)
    beside: tuple[BoundaryStreet, ...] = ()
    inside: tuple[BoundaryStreet, ...] = ()
    obstacles: tuple[Polygon, ...] = ()


@dataclass(frozen=True)
class PlannedJunction:
    """A place on a road between sub-regions at which streets of both sides may meet it.

    Attributes
    ----------
    number
        From 1.
    kind
        "existing" where a street meets the road already, else "planned".
    road
        Name of the road, empty where unknown.
    sides
        Number of a sub-region -> where its streets end, metres. The places differ where the road
        has two carriageways.
    """

    number: int
    kind: str
    road: str
    sides: Mapping[int, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class City:
    """A municipality divided by its major roads.

    Attributes
    ----------
    name
        How messages call it.
    crs, source_crs
        Working CRS in metres; CRS of the layer of municipalities.
    rules
        What was asked.
    regions
        Sub-regions, numbered from 1.
    roads
        The roads between them.
    junctions
        Planned junctions.
    street_space
        Ground between carriageways.
    problems
        Repairs and findings, columns as in `PreparedSites.problems`.
    """

    name: str
    crs: CRS
    source_crs: CRS
    rules: CityRules
    regions: tuple[SubRegion, ...]
    roads: tuple[DividingRoad, ...]
    junctions: tuple[PlannedJunction, ...]
    street_space: shapely.Geometry
    problems: gpd.GeoDataFrame

    @property
    def to_design(self) -> tuple[SubRegion, ...]:
        """The sub-regions whose streets are designed."""
        return tuple(r for r in self.regions if r.state == DESIGN)

    def site(self, region: SubRegion) -> Site:
        """Return a sub-region as a site; its planned junctions are its access points.

        Parameters
        ----------
        region
            One of `regions`.
        """
        from .junctions import inward

        points = []
        for junction in self.junctions:
            xy = junction.sides.get(region.number)
            if xy is not None:
                way = inward(region.polygon, xy)
                points.append(AccessPoint(xy, xy, way, junction.road, junction.kind))
        return Site(
            name=f"Sub-region {region.number}",
            feature=region.number,
            polygon=region.polygon,
            crs=self.crs,
            source_crs=self.source_crs,
            street_frontage=region.frontage,
            boundary_streets=region.beside,
            access_points=tuple(points),
            inner_streets=region.inside,
            obstacles=region.obstacles,
            site_id=region.number,
        )
