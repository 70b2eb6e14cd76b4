"""Areas that may be meant, from a local .osm or .pbf file."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional

import shapely

from ..errors import CancelledError, InputError
from ..progress import Progress
from . import files
from .candidates import BY_ID, Candidate, level, matched, smallest_first
from .names import Match, OsmId, fold, match_name, other_names
from .packages import load_osmium
from .shapes import area_id, area_wkb, valid_polygons
from .waiting import wait_for

#: Tags of which one says what an area is.
_KIND_KEYS = (
    "boundary", "place", "landuse", "leisure", "natural", "amenity", "tourism", "building",
    "area:highway", "highway", "railway", "aeroway", "man_made", "military", "water", "power",
)  # fmt: skip
#: Tags of areas without a name that a point may lie in and that may be a site.
_SITE_KEYS = ("landuse", "leisure", "amenity")
_CHUNK = 512
#: Worst grade of a match of a whole name.
_WHOLE_NAME = 2


@dataclass(frozen=True)
class Place:
    """A point with a name.

    Attributes
    ----------
    osm_id
        Such as "N123".
    name
        Its name.
    point
        Longitude and latitude, degrees.
    """

    osm_id: str
    name: str
    point: tuple[float, float]


class _Part:
    """The progress of one reading of several, as a part of that of all."""

    def __init__(self, whole: Progress, start: float, end: float) -> None:
        self.start, self.span = start, end - start
        self.whole = whole
        self.search, self.info, self.warn = whole.search, whole.info, whole.warn
        self.cancelled = whole.cancelled

    def stage(self, text: str, fraction: float) -> None:
        """Pass the stage on."""
        self.whole.stage(text, self.start + fraction * self.span)


class Local:
    """Finds areas in a file.

    Parameters
    ----------
    path
        The file.
    progress
        Told how far it is; asked for cancellation.

    Raises
    ------
    InputError
        The file cannot be read.
    """

    def __init__(self, path: Path, progress: Progress) -> None:
        self.path = files.check_file(path)
        self.progress = progress

    @property
    def origin(self) -> dict[str, str]:
        """Where the data is from, and of which day."""
        day = files.file_info(self.path).date
        return {"source": self.path.name, "date": day.isoformat() if day else ""}

    def by_name(self, name: str) -> list[Candidate]:
        """Find areas by their name, the best match first, large before small.

        What stands after a comma names an area that they lie in.

        Raises
        ------
        InputError
            There is no such place.
        """
        everything = self._named(0.0, 0.6)
        found = _matching(everything, name)
        if not found and "," in name:
            found = _matching(everything, name.split(",")[0])
            for part in filter(None, map(str.strip, name.split(",")[1:])):
                found = self._within(found, everything, part)
        found = [self._with_address(area, everything) for area in found]
        if found and found[0].match.grade <= _WHOLE_NAME:
            return found
        places = self._places(name)
        if not places and "," in name:
            places = _points_within(self._places(name.split(",")[0]), everything, name)
        if found and not places:
            return found
        if not places:
            raise InputError(
                f"{self.path.name} has no area called '{name}'.",
                self._suggestions(everything, name),
            )
        return [*found, *self._around_points(places, everything, name, bool(found))]

    def _around_points(
        self, places: Sequence[Place], everything: Sequence[Candidate], name: str, others: bool
    ) -> list[Candidate]:
        """Say that a name is that of points, and offer what encloses the first in any area."""
        best, around = places[0], list[Candidate]()
        for place in places:
            found = _enclosing(everything, place.point, f"encloses {place.name}")
            if found:
                best, around = place, found
                break
        where = "after those whose name is similar" if others else "instead, boundaries first"
        self.progress.warn(
            f"'{name}' is a point in {self.path.name} ({best.name}, {best.osm_id}) without a "
            f"boundary of its own: areas that enclose it are listed {where}."
        )
        more = [place for place in places if place is not best]
        if more:
            few = "; ".join(f"{p.osm_id} at {p.point[0]:.5f},{p.point[1]:.5f}" for p in more[:5])
            self.progress.warn(
                f"{len(more)} more of that name: {few}{'; ...' if len(more) > 5 else ''}. Give "
                "one of them as the point, without a place, for what encloses it."
            )
        return smallest_first(around, administrative_first=True)

    def by_id(self, identity: OsmId) -> list[Candidate]:
        """Find one area by its id.

        Raises
        ------
        InputError
            It is not in the file, or no area.
        """
        if identity.kind == "node":
            raise InputError(
                f"{identity} is a node, so a point, which is no area.",
                "Give a way or a relation, or the point itself.",
            )
        found = self._areas(_KIND_KEYS, 0.0, 0.9, osm_id=str(identity))
        if not found:
            raise InputError(
                f"{self.path.name} has no complete area {identity}.",
                "Check the number, use a file that covers the whole area, or search without a "
                "file.",
            )
        return [dataclasses.replace(area, match=BY_ID) for area in found]

    def around(self, point: tuple[float, float], match: str) -> list[Candidate]:
        """Find the areas that a point lies in, the smallest first.

        Parameters
        ----------
        point
            Longitude and latitude, degrees.
        match
            What to say of how they were found.
        """
        unnamed = self._areas(_SITE_KEYS, 0.0, 0.45, spot=shapely.Point(point))
        return _enclosing([*unnamed, *self._named(0.45, 0.9)], point, match)

    def _named(self, start: float, end: float) -> list[Candidate]:
        """Return all areas that have a name, read while the progress goes from start to end."""
        frame = files.read_boundaries(self.path, _Part(self.progress, start, end))
        return [
            Candidate(
                osm_id=row.osm_id,
                name=row.name or "",
                geometry=row.geometry,
                kind=row.kind or "",
                admin_level=level(row.admin_level),
                names=tuple((row.names or "").split(";")) if row.names else (),
            )
            for row in frame.itertuples(index=False)
        ]

    def _areas(
        self, keys: Sequence[str], start: float, end: float, **which: Any
    ) -> list[Candidate]:
        """Return the areas that have one of some tags, and are those of `_read`."""
        return wait_for(
            lambda own: self._read(keys, own, **which), _Part(self.progress, start, end)
        )

    def _read(
        self,
        keys: Sequence[str],
        progress: Progress,
        *,
        osm_id: str = "",
        spot: Optional[shapely.Point] = None,
    ) -> list[Candidate]:
        """Read the areas of an id, or in which a point lies; all would fill the memory."""
        factory = load_osmium().geom.WKBFactory()
        found = []
        for thing in files.walk(self.path, keys, progress, text=f"Reading {self.path.name}"):
            if not thing.is_area() or osm_id not in ("", area_id(thing)):
                continue
            wkb = area_wkb(factory, thing)
            if wkb is None:
                continue
            geometry = valid_polygons([wkb])[0]
            if geometry.is_empty or not (spot is None or geometry.intersects(spot)):
                continue
            tags = {tag.k: tag.v for tag in thing.tags}
            found.append(
                Candidate(
                    osm_id=area_id(thing),
                    name=tags.get("name", ""),
                    geometry=geometry,
                    kind=next((tags[key] for key in _KIND_KEYS if key in tags), ""),
                    admin_level=level(tags.get("admin_level")),
                )
            )
        return found

    def _places(self, name: str) -> list[Place]:
        """Return the points of places that have that whole name, the best match first."""
        self.progress.stage(f"Looking for '{name}' among the points", 0.6)
        places = wait_for(lambda own: self._read_places(name, own), self.progress)
        whole = [found for found in places if found[0] <= _WHOLE_NAME]
        return [place for _, place in sorted(whole, key=lambda found: found[0])]

    def _read_places(self, name: str, progress: Progress) -> list[tuple[int, Place]]:
        osmium = load_osmium()
        nodes = osmium.FileProcessor(files.opened(self.path), osmium.osm.NODE)
        found = []
        for count, node in enumerate(nodes.with_filter(osmium.filter.KeyFilter("place"))):
            if count % _CHUNK == 0 and progress.cancelled():
                raise CancelledError
            tags = {tag.k: tag.v for tag in node.tags}
            own = tags.get("name", "")
            match = match_name(name, own, other_names(tags, own))
            if match is not None:
                point = (node.location.lon, node.location.lat)
                found.append((match.grade, Place(f"N{node.id}", own or name, point)))
        return found

    def _with_address(self, area: Candidate, everything: Sequence[Candidate]) -> Candidate:
        middle = area.geometry.representative_point()
        around = [
            other
            for other in everything
            if other.admin_level is not None
            and other.osm_id != area.osm_id
            and other.geometry.area > area.geometry.area
            and other.geometry.intersects(middle)
        ]
        around.sort(key=lambda other: other.geometry.area)
        return dataclasses.replace(area, display_name=_address(area, around))

    def _within(
        self, areas: list[Candidate], everything: Sequence[Candidate], name: str
    ) -> list[Candidate]:
        """Return those that lie in an area of that name, all where there are none."""
        around = [a for a in _matching(everything, name) if a.match.grade <= _WHOLE_NAME]
        inside = [
            area
            for area in areas
            for middle in [area.geometry.representative_point()]
            if any(other.geometry.intersects(middle) for other in around if other is not area)
        ]
        if areas and not inside:
            self.progress.warn(
                f"{self.path.name} does not say whether they lie in '{name.strip()}': that part "
                "of the name is left out."
            )
        return inside or areas

    def _suggestions(self, everything: Sequence[Candidate], name: str) -> str:
        """Return the way out, with names that begin alike or those of the largest areas."""
        start = fold(name)[:3]
        alike = [a for a in everything if a.name and start and fold(a.name).startswith(start)]
        large = sorted(everything, key=lambda a: -a.geometry.area)
        names = dict.fromkeys(a.name for a in (alike or large) if a.name)
        few = ", ".join(list(names)[:8])
        return (
            f"It has, among others: {few}. Check the spelling, or use another file."
            if few
            else "Use another file, or search without one."
        )


def _matching(areas: Sequence[Candidate], name: str) -> list[Candidate]:
    found = [area for given in areas if (area := matched(given, name)) is not None]
    return sorted(found, key=lambda area: (area.match.grade, -area.geometry.area))


def _points_within(places: list[Place], areas: Sequence[Candidate], name: str) -> list[Place]:
    """Return the points that lie in areas of what stands after a comma, all where none do."""
    found = places
    for part in filter(None, map(str.strip, name.split(",")[1:])):
        around = [a for a in _matching(areas, part) if a.match.grade <= _WHOLE_NAME]
        inside = [
            place
            for place in found
            if any(area.geometry.intersects(shapely.Point(place.point)) for area in around)
        ]
        found = inside or found
    return found


def _enclosing(
    areas: Sequence[Candidate], point: tuple[float, float], match: str
) -> list[Candidate]:
    """Return the areas that a point lies in, each once, the smallest first."""
    spot = shapely.Point(point)
    known = {area.osm_id: area for area in areas}
    around = smallest_first(a for a in known.values() if a.geometry.intersects(spot))
    return [
        dataclasses.replace(
            area, match=Match(7, match), display_name=_address(area, around[at + 1 :])
        )
        for at, area in enumerate(around)
    ]


def _address(area: Candidate, around: Sequence[Candidate]) -> str:
    """Return the name of an area with those of the administrative ones around it."""
    names = [area.title]
    names += [a.name for a in around if a.admin_level is not None and a.name]
    return ", ".join(dict.fromkeys(names))
