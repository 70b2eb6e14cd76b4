"""Real suburbs cut out of cadastres: the land to lay out anew, its parcels and its streets."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import geopandas as gpd
import numpy as np
import shapely
from platwright.measure.polygons import largest_parts, read_polygons
from shapely.geometry import MultiLineString, Polygon
from shapely.geometry.polygon import orient

ROOT = Path(__file__).resolve().parents[1]
#: Faces of the street network are blocks of housing if they have so many parcels of the size of
#: housing, these have such a share of their parcels' land, parcels such a share of the face, and
#: it is of such a size (square metres).
PARCELS, HOUSING, COVERED, FACE = 5, 0.35, 0.5, (2_000.0, 120_000.0)
#: Parcels outside these many times the median area are no housing: slivers along streets, and
#: schools, works and parks. That they do not count is in favour of the map.
SIZES = (0.15, 6.0)
#: Where there are no centre lines, gaps up to this width between parcels are streets (metres).
GAP = 30.0
#: Holes smaller than this are no key element (square metres).
HOLE = 2_000.0


@dataclass(frozen=True)
class Case:
    """Where a suburb is: file and layers; streets are None where they are gaps only.

    Attributes
    ----------
    shared
        Whether the data may be shown; what may not is measured alone.
    """

    name: str
    file: str
    parcels: str = "parcels"
    streets: str | None = "streets"
    shared: bool = True


#: Villages of the French cadastre are left out: their parcels are fields and farmyards.
CASES = (
    Case("Cambridgeport", "cambridge_ma_cambridgeport_grid.gpkg"),
    Case("West Cambridge", "cambridge_ma_west_cambridge_suburb.gpkg"),
    Case("Bubenec", "bubenec_prague.gpkg", "plots"),
    Case("Bellerose", "not_for_release/bellerose_ny.gpkg", streets=None, shared=False),
)


@dataclass(frozen=True)
class Region:
    """A suburb in metres.

    Attributes
    ----------
    name
        What it is called.
    polygon
        The land: blocks of housing and the streets between them, up to the centre lines around
        or, without centre lines, to the property lines.
    parcels
        The real parcels in it, with the field use: parcel or other.
    streets
        The real centre lines in it; None where there are none.
    on_centre
        Whether the edge of the polygon is the centre line of streets.
    """

    name: str
    polygon: Polygon
    parcels: gpd.GeoDataFrame
    streets: gpd.GeoDataFrame | None
    on_centre: bool

    @property
    def median_size(self) -> tuple[float, float]:
        """Median width and depth of the real parcels, metres."""
        from platwright.measure.parcels import Ideal, measure_parcels

        found = measure_parcels(self.parcels, ideal=Ideal(tolerance=1.0)).parcels
        return float(found["width_m"].median()), float(found["depth_m"].median())


def data_folder() -> Path:
    """Folder of the real parcels."""
    given = os.environ.get("PLATWRIGHT_TEST_DATA")
    return (Path(given) if given else ROOT.parent / "shared" / "data") / "parcels"


def regions(folder: Path, only: str = "") -> list[Region]:
    """Cut all cases out whose files are there.

    Parameters
    ----------
    folder
        Where the files are.
    only
        A part of the name; empty for all.
    """
    found = []
    for case in CASES:
        if only.lower() not in case.name.lower():
            continue
        file = folder / case.file
        if not file.is_file():
            print(
                f"SKIPPED: {case.name}, {case.file} is not there (PLATWRIGHT_TEST_DATA says where)"
            )
            continue
        streets = gpd.read_file(file, layer=case.streets) if case.streets else None
        found.append(cut_out(case.name, gpd.read_file(file, layer=case.parcels), streets))
    return found


def cut_out(name: str, parcels: gpd.GeoDataFrame, streets: gpd.GeoDataFrame | None) -> Region:
    """Find the largest piece of land in a cadastre that is blocks of housing.

    Parameters
    ----------
    name
        Of the region.
    parcels, streets
        The layers; streets may be None.
    """
    layer = read_polygons(parcels, name)
    shapes = largest_parts(layer.shapes)[layer.usable]
    area = shapely.area(shapes)
    low, high = (share * float(np.median(area)) for share in SIZES)
    uses = np.where((area >= low) & (area <= high), "parcel", "other")
    lines = None
    if streets is None:
        land = shapely.buffer(shapely.union_all(shapes), GAP / 2, join_style="mitre")
        land = shapely.buffer(land, -GAP / 2, join_style="mitre")
        parts = shapely.get_parts(land)
    else:
        lines = shapely.force_2d(streets.to_crs(layer.crs).geometry.to_numpy())
        lines = shapely.get_parts(lines[~shapely.is_missing(lines)])
        parts = shapely.get_parts(shapely.union_all(housing_faces(lines, shapes, uses == "parcel")))
    polygon = orient(max(parts, key=shapely.area))
    holes = [ring for ring in polygon.interiors if Polygon(ring).area > HOLE]
    polygon = Polygon(polygon.exterior, holes)
    inside = shapely.intersects(polygon, shapely.point_on_surface(shapes))
    columns = {"use": uses[inside]}
    if lines is not None:
        # only what is of the region, so that what lies around does not count on the map either
        lines = shapely.get_parts(shapely.intersection(lines, shapely.buffer(polygon, 0.5)))
        lines = lines[(shapely.get_type_id(lines) == 1) & (shapely.length(lines) > 1.0)]
    return Region(
        name,
        polygon,
        gpd.GeoDataFrame(columns, geometry=shapes[inside], crs=layer.crs),
        None if lines is None else gpd.GeoDataFrame(geometry=lines, crs=layer.crs),
        streets is not None,
    )


def housing_faces(lines: np.ndarray, parcels: np.ndarray, small: np.ndarray) -> np.ndarray:
    """Find the faces of a street network that are blocks of housing.

    Parameters
    ----------
    lines
        Centre lines, shape (l,), metres.
    parcels
        Parcels, shape (n,).
    small
        Which of them are of the size of housing, shape (n,).
    """
    noded = shapely.union_all(lines, grid_size=0.01)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    of, parcel = shapely.STRtree(shapely.point_on_surface(parcels)).query(faces, "contains")
    share = shapely.area(parcels)[parcel]
    count, housing, land = (
        np.bincount(of, weights=what, minlength=len(faces))
        for what in (small[parcel], share * small[parcel], share)
    )
    area = shapely.area(faces)
    good = (count >= PARCELS) & (housing >= HOUSING * land) & (land >= COVERED * area)
    good &= (area > FACE[0]) & (area < FACE[1])
    return np.asarray(faces[good])


def ring_lines(polygon: Polygon) -> MultiLineString:
    """Give the rings of a polygon as lines."""
    return MultiLineString([ring.coords for ring in (polygon.exterior, *polygon.interiors)])
