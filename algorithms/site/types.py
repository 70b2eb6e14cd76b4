"""The planar site that every later room works on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, Polygon

#: Column of the site layer that says with which snap distance a site was prepared, metres.
SNAP_COLUMN = "snap_m"


@dataclass(frozen=True)
class AccessPoint:
    """A place where an existing street arrives at the edge of a site (a sink of CND).

    Attributes
    ----------
    xy
        Position on the site's boundary, metres in the working CRS.
    junction
        Position of the junction on the centre line of the existing street, metres; equal to
        `xy` where the boundary is the centre line itself.
    direction
        Unit vector in which the incoming street would go on into the site.
    name
        Name of the incoming street, empty where unknown.
    kind
        The road class of the incoming street as given, empty where unknown.
    """

    xy: tuple[float, float]
    junction: tuple[float, float]
    direction: tuple[float, float]
    name: str = ""
    kind: str = ""


@dataclass(frozen=True)
class BoundaryStreet:
    """An existing street along the edge of a site, between two junctions.

    Attributes
    ----------
    line
        Centre line in the working CRS, metres.
    name
        Street name, empty where unknown.
    kind
        The road class as given (OSM highway value or similar), empty where unknown.
    """

    line: LineString
    name: str = ""
    kind: str = ""


@dataclass(frozen=True)
class Site:
    """A piece of ground to design, in metres.

    Attributes
    ----------
    name
        How messages and layers call the site.
    feature
        Id of the feature it came from (the first of the dissolved ones).
    polygon
        Valid polygon, possibly with holes, exterior counter-clockwise, working CRS.
    crs
        Working CRS, projected, in metres.
    source_crs
        CRS of the input, to which the outputs return.
    street_frontage
        The parts of the polygon's rings that run along an existing street; these rings
        parts act as streets (they give coverage and may be sinks), the others do not.
    boundary_streets
        Centre lines of those streets, cut at junctions.
    access_points
        Where other streets arrive at the edge.
    inner_streets
        Existing streets inside the site that are to be kept.
    obstacles
        Polygons inside the site that must stay free of streets.
    site_id
        Number of the site in its layer, from 1; the layers of a site carry it.
    snap_distance
        How far from the boundary a street counted as running along it, metres.
    """

    name: str
    feature: int | str
    polygon: Polygon
    crs: CRS
    source_crs: CRS
    street_frontage: MultiLineString = field(default_factory=MultiLineString)
    boundary_streets: Sequence[BoundaryStreet] = ()
    access_points: Sequence[AccessPoint] = ()
    inner_streets: Sequence[BoundaryStreet] = ()
    obstacles: Sequence[Polygon] = ()
    site_id: int = 1
    snap_distance: float = 30.0

    @property
    def area_ha(self) -> float:
        """Area in hectares."""
        return float(self.polygon.area) / 1e4

    @property
    def access_xy(self) -> npt.NDArray[np.float64]:
        """Positions of the access points, shape (n, 2), metres."""
        return np.array([p.xy for p in self.access_points], dtype=float).reshape(-1, 2)

    @property
    def obstacle_union(self) -> shapely.Geometry:
        """All obstacles as one geometry, empty where there is none."""
        return shapely.union_all(list(self.obstacles))


@dataclass(frozen=True)
class PreparedSites:
    """What `prepare_sites` made of the planner's layers.

    Attributes
    ----------
    sites
        The sites, in the order of the first feature of each.
    problems
        One row per repair or finding; columns layer, feature, problem, action, severity
        ("info" repaired, "warning" to be looked at, "error" feature not used) and the
        geometry concerned, in the CRS of the polygon layer.
    """

    sites: tuple[Site, ...]
    problems: gpd.GeoDataFrame
