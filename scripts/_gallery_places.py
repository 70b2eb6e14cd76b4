"""The sites of the gallery of layouts: where they are, and what stands there in reality."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import geopandas as gpd
import pyogrio
import shapely

from _parcel_regions import Region, regions

ROOT = Path(__file__).resolve().parents[1]
OSM = "© OpenStreetMap contributors"
CAMBRIDGE = "City of Cambridge GIS, public domain"
#: Roads are shown and read up to this far from a suburb that is laid out anew (metres).
AROUND = 150.0
#: Real streets nearer than this to the edge of a suburb run along it, and stay (metres).
EDGE = 3.0


@dataclass(frozen=True)
class Where:
    """A site of the gallery.

    Attributes
    ----------
    key
        Of its pictures and its table.
    name
        What it is called.
    file
        GeoPackage with the layers site and streets, below the folder of the test data or, for
        the sample, of the repository; empty for a suburb that is cut out of its cadastre.
    credit
        What pictures say of the data.
    obstacles
        Whether the layer of obstacles is given to the tool; else it is only shown.
    snap
        Snap distance, metres.
    templates
        Whether it is laid out with the shipped templates, too.
    """

    key: str
    name: str
    file: str
    credit: str
    obstacles: bool = False
    snap: float = 30.0
    templates: bool = False


PLACES = (
    Where("helsinki", "Rail yard, Helsinki", "data/helsinki/helsinki_yard.gpkg", OSM, snap=60.0,
          obstacles=True),
    Where("baltimore", "Brownfield, Baltimore", "sites/01_rect_brownfield_baltimore.gpkg", OSM),
    Where("triesen", "Triesen, Liechtenstein", "sites/02_organic_triesen_li.gpkg", OSM,
          templates=True),
    Where("baths", "Around the baths, Schaan", "sites/12_hole_baths_li.gpkg", OSM),
    Where("railside", "Along the railway, Cambridge",
          "sites/04_long_thin_railside_cambridge.gpkg", CAMBRIDGE),
    Where("notched", "Notched block, Cambridge", "sites/05_concave_notched_cambridge.gpkg",
          CAMBRIDGE),
    Where("alewife", "Rail lands at Alewife, Cambridge",
          "sites/09_rail_lands_alewife_1km.gpkg", CAMBRIDGE),
    Where("cambridgeport", "Cambridgeport", "", CAMBRIDGE),
    Where("west_cambridge", "West Cambridge", "", CAMBRIDGE),
)  # fmt: skip


@dataclass(frozen=True)
class Place:
    """A site that is there: its layers in a CRS in metres, and its real parcels and streets."""

    where: Where
    site: gpd.GeoDataFrame
    roads: gpd.GeoDataFrame
    obstacles: gpd.GeoDataFrame
    parcels: gpd.GeoDataFrame | None = None
    streets: gpd.GeoDataFrame | None = None


def data_folder() -> Path:
    """Folder of the test data."""
    given = os.environ.get("PLATWRIGHT_TEST_DATA")
    return Path(given) if given else ROOT.parent / "shared" / "data"


def read(where: Where) -> Place | None:
    """Read a site; say so and return None where its data is not there."""
    if not where.file:
        found = regions(data_folder() / "parcels", where.name)
        return suburb(where, found[0], _all_streets(where.name)) if found else None
    folder = ROOT if where.file.startswith("data/") else data_folder()
    path = folder / where.file
    if not path.is_file():
        print(f"SKIPPED: {where.name}, {where.file} is not there (PLATWRIGHT_TEST_DATA says where)")
        return None
    site, roads = (gpd.read_file(path, layer=name) for name in ("site", "streets"))
    names = {str(name) for name, _ in pyogrio.list_layers(path)}
    none = gpd.GeoDataFrame({"kind": []}, geometry=[], crs=site.crs)
    obstacles = gpd.read_file(path, layer="obstacles") if "obstacles" in names else none
    return Place(where, site, roads, obstacles)


def suburb(where: Where, region: Region, streets: gpd.GeoDataFrame) -> Place:
    """Clear a suburb: its own streets and parcels go, the streets on the edge and around stay.

    Parameters
    ----------
    where
        What it is called.
    region
        The suburb.
    streets
        All centre lines there are, in and around it.
    """
    crs = region.parcels.crs
    land = region.polygon
    lines = streets.to_crs(crs).geometry.to_numpy()
    own = shapely.buffer(land, -EDGE)
    around = shapely.get_parts(shapely.difference(lines, own))
    near = shapely.dwithin(around, land, AROUND) & (shapely.length(around) > 2 * EDGE)
    return Place(
        where,
        gpd.GeoDataFrame({"site": [where.key]}, geometry=[land], crs=crs),
        gpd.GeoDataFrame(geometry=around[near], crs=crs),
        gpd.GeoDataFrame({"kind": []}, geometry=[], crs=crs),
        region.parcels,
        region.streets,
    )


def _all_streets(name: str) -> gpd.GeoDataFrame:
    """Read the centre lines of the file of a suburb."""
    from _parcel_regions import CASES

    (case,) = [case for case in CASES if case.name == name]
    return gpd.read_file(data_folder() / "parcels" / case.file, layer=case.streets)
