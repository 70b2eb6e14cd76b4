"""Real quarters to design anew: what stands there, and what is left when their streets are gone."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from platwright.measure.pattern import Grain, pattern_grain

ROOT = Path(__file__).resolve().parents[1]
#: Values of OpenStreetMap's `highway` that are streets between blocks: no service ways, no paths.
MAIN = ("trunk", "primary", "secondary", "tertiary")
KINDS = (*MAIN, "unclassified", "residential", "living_street", "pedestrian", "road")
#: What pictures name.
OSM = "© OpenStreetMap contributors"
CAMBRIDGE = "City of Cambridge GIS, public domain"
#: Streets are kept up to this far from a place (metres).
AROUND = 120.0
#: A street is one of a place's own if it lies this far inside, by more than half of it (metres).
OWN = 2.0
#: Blocks larger than this are no part of a quarter: parks, rails, the sea (square metres).
LARGEST = 6e4


@dataclass(frozen=True)
class Source:
    """A street layer: file in the data folder, layer, working CRS and what tells main streets."""

    file: str
    layer: str
    epsg: int
    field: str
    main: tuple[object, ...]
    kinds: tuple[str, ...] = ()


@dataclass(frozen=True)
class Where:
    """A quarter: the ground between main streets at a point, or the blocks within a radius.

    Attributes
    ----------
    name
        What it is called.
    source
        Key of `SOURCES`.
    at
        A point in it, in the CRS of the source.
    radius
        Metres; 0 for the ground that main streets enclose.
    """

    name: str
    source: str
    at: tuple[float, float]
    radius: float = 0.0


@dataclass(frozen=True)
class Place:
    """A quarter as it stands.

    Attributes
    ----------
    where
        How it was found.
    site
        Its ground, one polygon.
    own, around
        Its own streets, and those on its edge and around it.
    grain
        How large its blocks are.
    """

    where: Where
    site: gpd.GeoDataFrame
    own: gpd.GeoDataFrame
    around: gpd.GeoDataFrame
    grain: Grain

    @property
    def credit(self) -> str:
        """What a picture has to name."""
        source = SOURCES.get(self.where.source)
        return OSM if source is None or source.file.startswith("osm") else CAMBRIDGE


SOURCES = {
    "Helsinki": Source("osm/helsinki.osm.pbf", "lines", 3067, "highway", MAIN, KINDS),
    "Monaco": Source("osm/monaco.osm.pbf", "lines", 32632, "highway", MAIN, KINDS),
    "Baltimore": Source("osm/baltimore.osm.pbf", "lines", 26985, "highway", MAIN, KINDS),
    "Liechtenstein": Source("osm/liechtenstein.osm.pbf", "lines", 25832, "highway", MAIN, KINDS),
    "Cambridgeport": Source(
        "parcels/cambridge_ma_cambridgeport_grid.gpkg", "streets", 26986, "MajorRoad", (1.0, 2.0)
    ),
    "West Cambridge": Source(
        "parcels/cambridge_ma_west_cambridge_suburb.gpkg", "streets", 26986, "MajorRoad", (1.0, 2.0)
    ),
}
PLACES = (
    Where("Kluuvi", "Helsinki", (386147, 6672191)),
    Where("Kamppi", "Helsinki", (385680, 6671720), 200),
    Where("Kaartinkaupunki", "Helsinki", (386130, 6671650), 210),
    Where("La Condamine", "Monaco", (372740, 4843560), 210),
    Where("Monte Carlo", "Monaco", (373150, 4844130), 190),
    Where("Upper Fells Point", "Baltimore", (436802, 179492)),
    Where("Butchers Hill", "Baltimore", (437530, 180208)),
    Where("Mount Vernon", "Baltimore", (434288, 180992)),
    Where("Fells Point", "Baltimore", (436286, 179443)),
    Where("Vaduz", "Liechtenstein", (539250, 5221900), 260),
    Where("Schaan", "Liechtenstein", (538750, 5223500), 260),
    Where("Cambridgeport", "Cambridgeport", (232200, 901200), 300),
    Where("Riverside", "Cambridgeport", (232600, 901250), 300),
    Where("West Cambridge", "West Cambridge", (229750, 903200), 280),
    Where("Huron Village", "West Cambridge", (229900, 903750), 300),
)


def data_folder() -> Path:
    """Folder of the real test data: PLATWRIGHT_TEST_DATA or ../shared/data."""
    given = os.environ.get("PLATWRIGHT_TEST_DATA")
    return Path(given) if given else ROOT.parent / "shared" / "data"


def places(only: str = "") -> Iterator[Place]:
    """Yield the quarters whose data there are, and say which are left out.

    Parameters
    ----------
    only
        Beginnings of names, with commas; empty for all.
    """
    wanted = [word.strip().lower() for word in only.split(",") if word.strip()]
    for where in PLACES:
        if wanted and not any(where.name.lower().startswith(word) for word in wanted):
            continue
        if not (data_folder() / SOURCES[where.source].file).is_file():
            print(f"SKIPPED: {where.name}, whose streets are not in {data_folder()}")
            continue
        yield place_of(where, *_streets(SOURCES[where.source]))


def place_of(where: Where, streets: gpd.GeoDataFrame, main: gpd.GeoDataFrame) -> Place:
    """Cut a quarter out of a street layer.

    Parameters
    ----------
    where
        Where it is.
    streets, main
        All streets of a town, and the main ones among them, both in metres.
    """
    noded = shapely.get_parts(shapely.union_all(streets.geometry.to_numpy(), grid_size=0.01))
    faces = shapely.get_parts(shapely.polygonize(noded))
    middle = shapely.Point(where.at)
    if where.radius:
        middles = shapely.point_on_surface(faces)
        near = shapely.dwithin(middles, middle, where.radius) & (shapely.area(faces) < LARGEST)
        ground = shapely.union_all(faces[near])
    else:
        large = shapely.polygonize([shapely.union_all(main.geometry.to_numpy(), grid_size=0.01)])
        ground = max(shapely.get_parts(large), key=lambda face: face.contains(middle))
    ground = max(shapely.get_parts(ground), key=lambda part: part.area)
    ground = shapely.Polygon(ground.exterior)
    within = shapely.length(shapely.intersection(noded, ground.buffer(-OWN)))
    inside = within > 0.5 * shapely.length(noded)
    crs = streets.crs
    own = gpd.GeoDataFrame(geometry=noded[inside], crs=crs)
    near = shapely.intersection(noded[~inside], ground.buffer(AROUND))
    near = shapely.get_parts(near)
    near = near[shapely.get_type_id(near) == 1]
    around = gpd.GeoDataFrame(geometry=near, crs=crs)
    site = gpd.GeoDataFrame({"name": [where.name]}, geometry=[ground], crs=crs)
    return Place(where, site, own, around, pattern_grain(own, site, around))


def _streets(source: Source) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """Read the streets of a town, and the main ones among them; tunnels are no streets."""
    frame = gpd.read_file(data_folder() / source.file, layer=source.layer).to_crs(source.epsg)
    if source.kinds:
        kind = frame[source.field].str.removesuffix("_link")
        tags = frame.get("other_tags", pd.Series("", index=frame.index)).fillna("")
        frame = frame[kind.isin(source.kinds) & ~tags.str.contains('"tunnel"=>"yes"')]
        kind = kind[frame.index]
    else:
        kind = frame[source.field]
    frame = frame.explode(ignore_index=False)
    return frame, frame[np.isin(kind[frame.index].to_numpy(), source.main)]
