"""Small sites that can be worked out by hand."""

from __future__ import annotations

import pytest
import shapely
from platwright.site import AccessPoint, BoundaryStreet, Site
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, Polygon

UTM = CRS.from_epsg(25832)


def make_site(
    polygon: Polygon,
    *,
    frontage: list[LineString] | None = None,
    access: tuple[AccessPoint, ...] = (),
    streets: tuple[BoundaryStreet, ...] = (),
    obstacles: tuple[Polygon, ...] = (),
    inner: tuple[BoundaryStreet, ...] = (),
) -> Site:
    """A site with streets all round unless a frontage is given."""
    rings = [LineString(polygon.exterior)] if frontage is None else frontage
    return Site(
        name="Test site",
        feature=1,
        polygon=shapely.geometry.polygon.orient(polygon),
        crs=UTM,
        source_crs=UTM,
        street_frontage=MultiLineString(rings),
        boundary_streets=streets,
        access_points=access,
        obstacles=obstacles,
        inner_streets=inner,
    )


@pytest.fixture(scope="session")
def square() -> Site:
    """288 m x 288 m: four by four blocks of 72 m, streets all round."""
    return make_site(shapely.box(0, 0, 288, 288))


@pytest.fixture(scope="session")
def field() -> Site:
    """432 m x 288 m with a street along the south side only."""
    south = LineString([(0, 0), (432, 0)])
    return make_site(
        shapely.box(0, 0, 432, 288),
        frontage=[south],
        streets=(BoundaryStreet(LineString([(-50, -8), (480, -8)]), "South Street"),),
    )
