"""What lies around an area in an OpenStreetMap file: features as a table, streets for osmnx."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import shapely

from ..errors import InputError
from ..progress import Progress
from . import files, shapes
from .classes import COLUMNS, FEATURES, NetworkType, in_network, is_feature
from .packages import load_osmium

_CHUNK = 2000
#: No street is mapped as a single way longer than this, degrees.
_LONGEST_WAY = 0.5


@dataclass
class LocalMap:
    """What was found in a file.

    Attributes
    ----------
    features
        Areas and lines that meet the window: osm_id, the tags of `classes.COLUMNS`, geometry.
    ways
        Ways of the network that meet the window: id -> (tags, ids of the nodes).
    nodes
        Places of their nodes, longitude and latitude.
    """

    features: gpd.GeoDataFrame
    ways: dict[int, tuple[dict[str, str], list[int]]] = field(default_factory=dict)
    nodes: dict[int, tuple[float, float]] = field(default_factory=dict)


class _Collector:
    """Keeps of the things that go by those that meet a window, many at a time."""

    def __init__(self, window: shapely.Geometry) -> None:
        self.window = window
        shapely.prepare(window)
        self.rows: list[tuple[str, dict[str, str]]] = []
        self.shapes: list[Any] = []
        self.seen = 0
        self._rows: list[tuple[str, dict[str, str]]] = []
        self._wkb: list[bytes] = []

    def add(self, osm_id: str, tags: Mapping[str, str], wkb: bytes | None) -> None:
        """Take a thing; its geometry may be missing."""
        if wkb is None:
            return
        self._rows.append((osm_id, {key: tags[key] for key in COLUMNS if key in tags}))
        self._wkb.append(wkb)
        if len(self._wkb) >= _CHUNK:
            self.sift()

    def sift(self) -> None:
        """Drop what does not meet the window."""
        if not self._wkb:
            return
        self.seen += len(self._wkb)
        found = shapely.from_wkb(np.array(self._wkb, dtype=object), on_invalid="ignore")
        area = np.isin(shapely.get_type_id(found), (3, 6))
        close = shapely.intersects(shapely.box(*shapely.bounds(found).T), self.window)
        area &= close
        found[area] = shapes.polygons_only(found[area])
        hits = close & shapely.intersects(found, self.window)
        self.rows += [self._rows[k] for k in np.flatnonzero(hits)]
        self.shapes += list(found[hits])
        self._rows, self._wkb = [], []

    def frame(self) -> gpd.GeoDataFrame:
        """Return what was kept."""
        self.sift()
        columns: dict[str, list[Any]] = {"osm_id": [row[0] for row in self.rows]}
        for key in COLUMNS:
            columns[key] = [row[1].get(key) for row in self.rows]
        return gpd.GeoDataFrame(columns, geometry=self.shapes, crs=shapes.WGS84)


def read_local(
    path: Path, window: shapely.Geometry, network_type: NetworkType, progress: Progress
) -> LocalMap:
    """Read what meets a window out of a file.

    Parameters
    ----------
    path
        A file that `files.check_file` has accepted.
    window
        Polygon in EPSG:4326.
    network_type
        Which ways are streets.
    progress
        Told how far it is, up to 0.6; asked for cancellation.

    Returns
    -------
    LocalMap
        Features and streets.

    Raises
    ------
    InputError
        The file is damaged, or has nothing in the window.
    MissingDependencyError
        The package osmium is not installed.
    CancelledError
        The caller has cancelled.
    """
    osmium = load_osmium()
    factory = osmium.geom.WKBFactory()
    features = _Collector(window)
    streets = _Streets(window)
    keys = {*FEATURES, "highway"}
    for thing in files.walk(path, keys, progress, text=f"Reading {path.name}", end=0.6):
        tags = {tag.k: tag.v for tag in thing.tags}
        if thing.is_area():
            if is_feature(tags):
                features.add(shapes.area_id(thing), tags, shapes.area_wkb(factory, thing))
            continue
        if in_network(tags, network_type):
            streets.add(thing, tags)
        # A closed way comes once more, as an area.
        if is_feature(tags) and (not thing.is_closed() or _is_line(tags)):
            features.add(f"W{thing.id}", tags, shapes.line_wkb(factory, thing))
    found = LocalMap(features.frame(), streets.ways, streets.nodes)
    if len(found.features) == 0 and not found.ways:
        if streets.without_nodes:
            raise _without_nodes(path)
        raise _nothing_there(path, window, features.seen + streets.seen)
    return found


def _is_line(tags: Mapping[str, str]) -> bool:
    """Tell whether a closed way is a ring and no area, such as a coast or a city wall."""
    return tags.get("natural") == "coastline" or "barrier" in tags or "railway" in tags


class _Streets:
    """Keeps the ways of a network that meet a window, with their nodes."""

    def __init__(self, window: shapely.Geometry) -> None:
        self.window = window
        self.seen = 0
        self.without_nodes = 0
        self.ways: dict[int, tuple[dict[str, str], list[int]]] = {}
        self.nodes: dict[int, tuple[float, float]] = {}
        self._west, self._south, self._east, self._north = shapely.bounds(window)

    def add(self, way: Any, tags: dict[str, str]) -> None:
        """Take a way if it meets the window."""
        self.seen += 1
        if len(way.nodes) == 0 or not self._may_reach(way.nodes[0].location):
            return
        refs: list[int] = []
        best: list[int] = []
        places: dict[int, tuple[float, float]] = {}
        for node in way.nodes:
            if node.location.valid():
                refs.append(node.ref)
                places[node.ref] = (node.lon, node.lat)
                continue
            # A gap: the file was cut here. The longest stretch is kept.
            best, refs = max(best, refs, key=len), []
        best = max(best, refs, key=len)
        if len(best) < 2:  # a line has two ends
            self.without_nodes += 1
            return
        lon, lat = zip(*(places[ref] for ref in best))
        if max(lon) < self._west or min(lon) > self._east:
            return
        if max(lat) < self._south or min(lat) > self._north:
            return
        if shapely.intersects(self.window, shapely.linestrings(lon, lat)):
            self.ways[way.id] = (tags, best)
            self.nodes.update((ref, places[ref]) for ref in best)

    def _may_reach(self, start: Any) -> bool:
        """Tell whether a way from a place on could come to the window; quick."""
        if not start.valid():
            return True
        return bool(
            self._west - _LONGEST_WAY < start.lon < self._east + _LONGEST_WAY
            and self._south - _LONGEST_WAY < start.lat < self._north + _LONGEST_WAY
        )


def _without_nodes(path: Path) -> InputError:
    return InputError(
        f"{path.name} has ways without the points that they run through, or before them.",
        "Write it again with all nodes, in the usual order: 'osmium sort', or 'out body; >; out "
        "skel qt;' in Overpass.",
    )


def _nothing_there(path: Path, window: shapely.Geometry, seen: int) -> InputError:
    if seen == 0:
        return InputError(
            f"{path.name} has neither streets nor areas.", "Choose another OpenStreetMap file."
        )
    west, south, east, north = shapely.bounds(window)
    bounds = files.file_info(path).bounds
    corners = "" if bounds is None else ", ".join(f"{value:.3f}" for value in bounds)
    covered = (
        f" The file covers {corners} in degrees (west, south, east, north)." if corners else ""
    )
    return InputError(
        f"{path.name} has nothing inside the polygon, which covers {west:.3f}, {south:.3f}, "
        f"{east:.3f}, {north:.3f}.{covered}",
        "Choose the file of that region, or see whether the polygon has the right coordinate "
        "reference system.",
    )


def write_streets(found: LocalMap, path: Path, keys: tuple[str, ...]) -> None:
    """Write the streets as an .osm file that `osmnx.graph_from_xml` reads.

    Parameters
    ----------
    found
        With at least one way.
    path
        Where to.
    keys
        Tags to write.
    """
    osmium = load_osmium()
    with osmium.SimpleWriter(str(path)) as writer:
        for ref, place in found.nodes.items():
            writer.add_node(osmium.osm.mutable.Node(id=ref, location=place))
        for way_id, (tags, refs) in found.ways.items():
            own = {key: _writable(tags[key]) for key in keys if key in tags}
            writer.add_way(osmium.osm.mutable.Way(id=way_id, nodes=refs, tags=own))


def _writable(value: str) -> str:
    """Return a text without the characters that XML cannot hold."""
    return "".join(c for c in value if c >= " " or c == "\t")
