"""What the gallery of floor plans and game levels designs: footprints, outlines and settings."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Optional, Union

import geopandas as gpd
import numpy as np
from shapely.geometry import LineString, Point, Polygon, box
from shapely.geometry.base import BaseGeometry
from shapely.ops import unary_union

from _gallery_places import OSM, ROOT, data_folder

#: Drawn footprints and outlines lie somewhere in it (metres).
CRS = "EPSG:32632"
#: Buildings of a town, and two of them by their number in OpenStreetMap.
TOWN, NOVOTEL, HOSPITAL = "town/monaco.gpkg", "w94400040", "w49209406"

#: A geometry and its storey.
Placed = tuple[BaseGeometry, Union[int, None]]


@dataclass(frozen=True)
class Inputs:
    """What a tool is given: a footprint or outline, exits or ends, obstacles, corridors, shapes.

    Exits, obstacles and corridors are pairs of a geometry and its storey; None stands on all of
    them. Shares are least and most shares of shapes that the shipped set does not limit.
    """

    outline: gpd.GeoDataFrame
    exits: tuple[Placed, ...] = ()
    obstacles: tuple[Placed, ...] = ()
    corridors: tuple[Placed, ...] = ()
    shares: dict[str, dict[str, float]] = field(default_factory=dict)

    def write(self, path: Path, shapes: str = "office") -> dict[str, str]:
        """Write the layers into one file; return the inputs of the tool by their keys."""
        path.unlink(missing_ok=True)
        self.outline[["geometry"]].to_file(path, layer="outline", VERSION="1.2")
        found = {"INPUT": f"{path}|layername=outline"}
        if self.shares:
            found["TEMPLATE_FILE"] = str(self._shapes(path.with_suffix(".json"), shapes))
        for key, name, own in (
            ("SINKS", "exits", self.exits), ("OBSTACLES", "given", self.obstacles),
            ("CORRIDORS_GIVEN", "corridors", self.corridors),
        ):  # fmt: skip
            if own:
                places = [place for place, _ in own]
                storeys = {} if all(s is None for _, s in own) else {"floor": [s for _, s in own]}
                made = gpd.GeoDataFrame(storeys, geometry=places, crs=self.outline.crs)
                if storeys:
                    made["floor"] = made["floor"].astype("Int64")
                made.to_file(path, layer=name, VERSION="1.2")
                found[key] = f"{path}|layername={name}"
        return found

    def _shapes(self, path: Path, shapes: str) -> Path:
        """Write a shipped set of shapes with other shares."""
        shipped = ROOT / "algorithms" / "rooms" / "shapes" / f"{shapes}.json"
        told = json.loads(shipped.read_text(encoding="utf-8"))
        for own in told["templates"]:
            own.update(self.shares.get(own["name"], {}))
        path.write_text(json.dumps(told), encoding="utf-8")
        return path


@dataclass(frozen=True)
class Room:
    """A floor plan or a level of the gallery.

    Attributes
    ----------
    key
        Of its picture and its figures.
    name
        What it is called in the table.
    tool
        `designfloor` or `designgamelevel`.
    make
        Returns what the tool is given, or None where the data is not there.
    asked
        What else the tool is told.
    credit
        Whose the data is.
    shown
        Storeys that are drawn.
    wide
        Pixels of the picture from west to east.
    style
        The further style of its blocks, or empty for the first one.
    """

    key: str
    name: str
    tool: str
    make: Callable[[], Optional[Inputs]]
    asked: dict[str, Any] = field(default_factory=dict)
    credit: str = ""
    shown: tuple[int, ...] = (0,)
    wide: int = 1100
    style: str = ""


def _drawn(outline: Polygon) -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(geometry=[outline], crs=CRS)


def _building(reference: str) -> Optional[gpd.GeoDataFrame]:
    """Return a building of the town; say so and return None where the file is not there."""
    path = data_folder() / TOWN
    if not path.is_file():
        print(f"SKIPPED: {TOWN} is not there (PLATWRIGHT_TEST_DATA says where)")
        return None
    buildings = gpd.read_file(path, layer="buildings")
    found = buildings[buildings["osm_ref"] == reference]
    return found.explode(index_parts=False)


def office() -> Inputs:
    """Four storeys around two cores with lifts and stairs; the entrance is on the lowest."""
    side = 3.6
    cores = [box(a * side, 2 * side, (a + 1) * side, 4 * side) for a in (4, 9)]
    way_in = LineString([(7 * side, 0), (7 * side, 2 * side)])
    return Inputs(
        _drawn(box(0, 0, 14 * side, 6 * side)),
        (*((core.centroid, None) for core in cores), (Point(7 * side, 0), 0)),
        tuple((core, None) for core in cores),
        ((way_in, 0),),
        {
            "office": {"min_share": 0.3},
            "open office": {"max_share": 0.2},
            "large open office": {"max_share": 0.12},
        },
    )


def novotel() -> Optional[Inputs]:
    """Return the L of a hotel."""
    found = _building(NOVOTEL)
    return None if found is None else Inputs(found)


def garden() -> Inputs:
    """Two storeys of a school; a part of the roof of the lower one is the garden of the upper."""
    outline = Polygon([(0, 0), (56, 0), (56, 16), (40, 16), (40, 36), (16, 36), (16, 20), (0, 20)])
    return Inputs(
        _drawn(outline),
        ((Point(26, 10), None), (Point(28, 0), 0)),
        ((box(24, 8, 28, 12), None), (box(20, 24, 32, 36), 1)),
        ((LineString([(28, 0), (28, 8)]), 0),),
    )


def hospital() -> Optional[Inputs]:
    """Return a real hospital."""
    found = _building(HOSPITAL)
    return None if found is None else Inputs(found)


def castle() -> Inputs:
    """Walls with four towers and a gate around a court, on a grid of 5 m."""
    towers = [box(x, y, x + 25, y + 25) for x in (-10, 85) for y in (-10, 65)]
    walls = unary_union([box(0, 0, 100, 80), *towers, box(40, -10, 60, 5), box(35, 75, 65, 95)])
    court = box(35, 30, 65, 50)
    return Inputs(_drawn(walls.difference(court)), ((Point(50, -10), None),))


def island() -> Inputs:
    """Draw an island around a lagoon."""
    angle = np.linspace(0.0, 2.0 * np.pi, 120, endpoint=False)

    def shore(size: float, *waves: tuple[int, float, float]) -> Polygon:
        far = size * (1.0 + sum(a * np.cos(n * angle + shift) for n, a, shift in waves))
        return Polygon(np.column_stack([1.25 * far * np.cos(angle), far * np.sin(angle)]))

    land = shore(52.0, (2, 0.05, 0.4), (3, 0.09, 1.1), (5, 0.03, 2.0))
    return Inputs(_drawn(land.difference(shore(19.0, (2, 0.1, 0.0), (3, 0.08, 0.5)))))


def cave() -> Inputs:
    """Draw a cave that winds."""
    x = np.linspace(0.0, 190.0, 60)
    middle = LineString(np.column_stack([x, 34.0 * np.sin(x / 30.0)]))
    return Inputs(
        _drawn(middle.buffer(17.5).simplify(0.3)),
        ((Point(0, 0), None), (Point(190, 34.0 * np.sin(190 / 30.0)), None)),
    )


ROOMS = (
    Room("office", "office of four storeys", "designfloor", office,
         {"MODULE": 3.6, "TEMPLATE_SET": "office", "STOREYS": 4, "TIME_LIMIT": 20},
         shown=(0, 1, 2, 3)),
    Room("novotel", "hotel, Monaco", "designfloor", novotel,
         {"MODULE": 4.3, "TEMPLATE_SET": "hotel", "TIME_LIMIT": 30}, OSM),
    Room("garden", "school with a roof garden", "designfloor", garden,
         {"MODULE": 4.0, "TEMPLATE_SET": "school", "CORRIDOR_WIDTH": 2.2, "STOREYS": 2,
          "TIME_LIMIT": 30}, shown=(0, 1)),
    Room("hospital", "hospital, Monaco", "designfloor", hospital,
         {"MODULE": 3.5, "TEMPLATE_SET": "hospital", "CORRIDOR_WIDTH": 2.0, "TIME_LIMIT": 120}, OSM,
         wide=1500),
    Room("castle", "castle, branching", "designgamelevel", castle,
         {"MODULE": 5.0, "LEVEL_TYPE": "branching", "TIME_LIMIT": 60},
         style="By role"),
    Room("island", "island, circular", "designgamelevel", island,
         {"MODULE": 5.0, "LEVEL_TYPE": "circular", "TIME_LIMIT": 30}),
    Room("cave", "cave, linear", "designgamelevel", cave,
         {"MODULE": 5.0, "LEVEL_TYPE": "linear", "TIME_LIMIT": 30}),
)  # fmt: skip
