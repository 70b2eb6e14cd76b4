"""OpenStreetMap files on disk: .osm (also .gz, .bz2) and .osm.pbf, read with pyosmium.

pyosmium reads all of these forms at the speed of C++ (a country of 160 000 objects in .3 s),
puts areas together out of their relations, and holds only what is asked for in memory.
"""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas as gpd

from ..errors import CancelledError, InputError
from ..progress import Progress, Silent
from .names import other_names
from .packages import load_osmium
from .shapes import WGS84, area_id, area_wkb, troubles, valid_polygons
from .waiting import wait_for

SUFFIXES = (".osm.pbf", ".pbf", ".osm", ".osm.gz", ".osm.bz2")
"""Endings of the files that can be read."""

LARGEST = 1.5e9
"""Larger files are refused, bytes: the places of their points would fill the memory."""

CUT_SMALLER = (
    "Download a smaller region, or cut one out with 'osmium extract' or JOSM, and run again."
)
_BYTES_PER_OBJECT = {".pbf": 8.0, ".bz2": 12.0, ".gz": 16.0, ".osm": 150.0}
_MOST_OBJECTS_UNASKED = 512

BOUNDARY_COLUMNS = ("osm_id", "name", "names", "kind", "admin_level", "place")
#: Tags of areas that somebody may look for by name, in the order in which they name the kind.
_BOUNDARY_KEYS = ("boundary", "place", "landuse", "leisure", "natural", "amenity", "tourism")


@dataclass(frozen=True)
class FileInfo:
    """What a file says of itself.

    Attributes
    ----------
    date
        Day of its data, or None.
    bounds
        West, south, east, north in degrees, or None.
    """

    date: datetime.date | None
    bounds: tuple[float, float, float, float] | None


def check_file(path: Path | str) -> Path:
    """Make sure that a file can be an OpenStreetMap file.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    Path
        The same.

    Raises
    ------
    InputError
        It is not there, is empty, too large, or of another kind.
    """
    found = Path(path)
    if found.is_dir():
        raise InputError(f"{found} is a folder.", "Choose a file that ends in .osm or .osm.pbf.")
    if not found.is_file():
        raise InputError(
            f"There is no file {found}.", "Choose an OpenStreetMap file, .osm or .osm.pbf."
        )
    if not found.name.lower().endswith(SUFFIXES):
        raise InputError(
            f"{found.name} is no OpenStreetMap file that can be read.",
            f"Choose one that ends in {', '.join(SUFFIXES)}.",
        )
    try:
        size = found.stat().st_size
        with found.open("rb"):
            pass
    except OSError as error:
        raise InputError(
            f"{found} cannot be opened ({error.strerror or error}).",
            "See whether you may read it.",
        ) from error
    if size == 0:
        raise InputError(f"{found.name} is empty.", "Download it again.")
    if size > LARGEST:
        raise InputError(f"{found.name} is too large ({size / 1e9:.1f} GB).", CUT_SMALLER)
    return found


def file_info(path: Path | str) -> FileInfo:
    """Read the date and the extent of a file from its first bytes.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    FileInfo
        What its header says.

    Raises
    ------
    InputError
        The file cannot be read.
    MissingDependencyError
        The package osmium is not installed.
    """
    osmium = load_osmium()
    found = check_file(path)
    try:
        with osmium.io.Reader(opened(found), osmium.osm.NOTHING) as reader:
            header = reader.header()
            box = header.box()
            stamp = header.get("osmosis_replication_timestamp") or header.get("timestamp")
            corners = (box.bottom_left, box.top_right) if box.valid() else None
            bounds = None
            if corners is not None:
                bounds = (corners[0].lon, corners[0].lat, corners[1].lon, corners[1].lat)
    except troubles() as error:
        raise _corrupted(found, error) from error
    try:
        date = datetime.date.fromisoformat(str(stamp)[:10])
    except ValueError:
        # The date of the file itself would be that of a copy.
        date = None
    return FileInfo(date, bounds)


def opened(path: Path) -> Any:
    """Return a file as pyosmium opens it, its form told by its ending in any case.

    Parameters
    ----------
    path
        A file that `check_file` has accepted.
    """
    name = path.name.lower()
    form = next(ending for ending in SUFFIXES if name.endswith(ending)).lstrip(".")
    return load_osmium().io.File(str(path), "pbf" if form.endswith("pbf") else form)


def _corrupted(path: Path, error: Exception) -> InputError:
    reason = " ".join(str(error).split()).removesuffix(".")[:200]
    return InputError(
        f"{path.name} cannot be read: it is damaged, not complete, or no OpenStreetMap file "
        f"({reason}).",
        "Download it again, or choose another file.",
    )


def walk(
    path: Path, keys: Iterable[str], progress: Progress, *, text: str, end: float = 1.0
) -> Iterator[Any]:
    """Yield the ways and areas of a file that have one of some tags.

    Parameters
    ----------
    path
        The file.
    keys
        Keys of the tags.
    progress
        Told how far the reading is, as stage `text`; asked for cancellation.
    text
        What is being done.
    end
        Fraction of the progress at the end.

    Yields
    ------
    osmium.osm.Way or osmium.osm.Area
        Only to be used until the next one comes; nodes of ways know their places.

    Raises
    ------
    InputError
        The file is damaged.
    CancelledError
        The caller has cancelled.
    """
    osmium = load_osmium()
    expected = max(1.0, path.stat().st_size / _BYTES_PER_OBJECT[path.suffix.lower()])
    wanted = osmium.filter.KeyFilter(*keys)
    source = (
        osmium.FileProcessor(opened(path)).with_locations().with_areas(wanted).with_filter(wanted)
    )
    progress.stage(text, 0.0)
    told = 0.0
    try:
        for count, thing in enumerate(source):
            if count % _MOST_OBJECTS_UNASKED == 0:
                if progress.cancelled():
                    raise CancelledError
                # Some tenth of all objects has tags; the end of a file is never known.
                share = 1.0 - math.exp(-20.0 * count / expected)
                if share > told + 0.02:
                    told = share
                    progress.stage(text, end * share)
            if thing.is_way() or thing.is_area():
                yield thing
    except troubles() as error:
        raise _corrupted(path, error) from error
    if progress.cancelled():
        raise CancelledError


def read_boundaries(path: Path | str, progress: Progress | None = None) -> gpd.GeoDataFrame:
    """Read all areas of a file that have a name or bound an administrative unit.

    Parameters
    ----------
    path
        An .osm or .osm.pbf file.
    progress
        Told how far it is; asked for cancellation. Boundaries that the file has in part only
        are left out, and counted in a remark.

    Returns
    -------
    geopandas.GeoDataFrame
        In EPSG:4326, columns osm_id ("R123" of a relation, "W123" of a way), name, names (all
        other names, of any language, joined by ";"), kind (type of the boundary, or value of
        place, landuse, leisure…), admin_level, place, geometry (valid polygons); None where a
        tag is absent. Perhaps without rows.

    Raises
    ------
    InputError
        The file is missing, of the wrong kind or damaged.
    MissingDependencyError
        The package osmium is not installed.
    CancelledError
        The caller has cancelled.
    """
    load_osmium()
    found = check_file(path)
    return wait_for(lambda own: _boundaries(found, own), progress or Silent())


def _boundaries(path: Path, progress: Progress) -> gpd.GeoDataFrame:
    osmium = load_osmium()
    factory = osmium.geom.WKBFactory()
    rows: list[tuple[str | None, ...]] = []
    wkb: list[bytes] = []
    for thing in walk(path, _BOUNDARY_KEYS, progress, text=f"Reading {path.name}"):
        if not thing.is_area():
            continue
        tags = {tag.k: tag.v for tag in thing.tags}
        if "name" not in tags and tags.get("boundary") != "administrative":
            continue
        shape = area_wkb(factory, thing)
        if shape is not None:
            rows.append((area_id(thing), *_described(tags)))
            wkb.append(shape)
    shapes = valid_polygons(wkb)
    frame = gpd.GeoDataFrame(rows, columns=list(BOUNDARY_COLUMNS), geometry=shapes, crs=WGS84)
    frame = frame[~frame.geometry.is_empty].reset_index(drop=True)
    if len(frame) == 0:
        progress.info(f"{path.name} has no complete boundary or named area.")
    return frame


def _described(tags: Mapping[str, str]) -> tuple[str | None, ...]:
    """Return name, names, kind, admin_level and place of an area."""
    name = tags.get("name")
    names = ";".join(other_names(tags, name or ""))
    kind = next((tags[key] for key in _BOUNDARY_KEYS if key in tags), None)
    return name, names or None, kind, tags.get("admin_level"), tags.get("place")
