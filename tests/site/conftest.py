"""A site of 200 x 100 m and the roads around it, with numbers that can be checked by hand."""

from __future__ import annotations

from typing import Any

import geopandas as gpd
import pytest
import shapely
from shapely.affinity import translate
from shapely.geometry import LineString, box

CRS = "EPSG:25832"
X, Y = 500_000.0, 5_400_000.0


class Scene:
    """The site and its roads.

    South Street runs 10 m south of the edge; Mill Lane meets it at x = 60 from the south;
    East Lane comes from the east and ends 15 m before the edge, at y = 50.
    """

    def __init__(self) -> None:
        self.roads: list[tuple[LineString, str, str]] = [
            (LineString([(-100, -10), (300, -10)]), "South Street", "tertiary"),
            (LineString([(60, -110), (60, -10)]), "Mill Lane", "residential"),
            (LineString([(300, 50), (215, 50)]), "East Lane", "residential"),
            (LineString([(120, -80), (120, 90)]), "", "footway"),
        ]

    @staticmethod
    def frame(geometries: list[Any], crs: str | None = CRS, **columns: Any) -> gpd.GeoDataFrame:
        moved = [g if g is None or g.is_empty else translate(g, X, Y) for g in geometries]
        return gpd.GeoDataFrame(columns, geometry=gpd.GeoSeries(moved, crs=crs), crs=crs)

    def site_frame(self) -> gpd.GeoDataFrame:
        return self.frame([box(0, 0, 200, 100)], name=["Mill Field"])

    def road_frame(self) -> gpd.GeoDataFrame:
        return self.frame(
            [r[0] for r in self.roads],
            Street_Name=[r[1] for r in self.roads],
            Highway=[r[2] for r in self.roads],
        )

    @staticmethod
    def local(geometry: shapely.Geometry) -> shapely.Geometry:
        return translate(geometry, -X, -Y)


@pytest.fixture
def scene() -> Scene:
    return Scene()
