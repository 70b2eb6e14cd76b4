"""Areas that may be meant, from Nominatim and Overpass."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Optional

import shapely
from shapely.errors import ShapelyError
from shapely.geometry import shape

from ..errors import InputError, ServiceError, without_credentials
from ..progress import Progress
from .candidates import BY_ID, Candidate, level, matched, smallest_first
from .names import Match, OsmId, other_names
from .polygons import area_of_element, areal_part
from .settings import OsmSettings
from .transport import Transport

#: Most places that are asked of Nominatim at once; part of the cache's names, as osmnx has it.
MOST = 50
#: Longest time for what only adds to what is known already, in seconds.
ASIDE = 15.0
#: Wider areas around a point are named but not fetched, in degrees.
WIDEST = 3.0
#: Things around a point that may be a site or part of an address.
_AREA_KEYS = "^(boundary|place|landuse|leisure|amenity|military|aeroway)$"
_KIND_KEYS = ("boundary", "place", "landuse", "leisure", "amenity", "military", "aeroway")
#: Zooms of a reverse search, from the quarter to the state.
_ZOOMS = (16, 14, 12, 10, 8, 5)
_QUERY = "[out:json][timeout:60];"
_BY_SERVICE = Match(6, "found by Nominatim")


class Online:
    """Finds areas through the services of one run.

    Parameters
    ----------
    settings
        How requests are made.
    progress
        Hears what is asked; asked for cancellation.
    """

    def __init__(self, settings: OsmSettings, progress: Progress) -> None:
        self.settings = settings
        self.progress = progress
        self.transport = Transport(settings, progress)

    @property
    def origin(self) -> dict[str, str]:
        """Where the data is from, and of which day."""
        day = self.transport.date
        return {
            "source": ", ".join(
                without_credentials(url)
                for url in (self.settings.nominatim_url, self.settings.overpass_url)
            ),
            "date": day.isoformat() if day else "",
        }

    def by_name(self, name: str) -> list[Candidate]:
        """Find areas by their name, the most important first.

        A name that is a point without an area gives what lies around it.

        Raises
        ------
        InputError
            There is no such place.
        ServiceError
            The services cannot tell.
        """
        self.progress.stage(f"Looking for '{name}'", 0.1)
        form = {"format": "json", "polygon_geojson": 1, "dedupe": 0, "limit": MOST, "q": name}
        places = self.transport.nominatim("search", form)
        if not places:
            service = without_credentials(self.settings.nominatim_url)
            raise InputError(
                f"{service} knows no place called '{name}'.",
                "Check the spelling, try the name in the language of the country, add the town "
                "or the country after a comma, or give a point or an OpenStreetMap id.",
            )
        places.sort(key=lambda place: -_number(place.get("importance")))
        found = [(place, _area(place)) for place in places]
        areas = self._described([area for _, area in found if area is not None])
        areas = [matched(area, name.split(",")[0]) or area for area in areas]
        if found[0][1] is None:
            areas += self._around_place(places[0], name, bool(areas))
        points = [place for place, area in found[1:] if area is None and _osm_id(place)]
        if points:
            few = "; ".join(f"{p.get('display_name', '')} ({_osm_id(p)})" for p in points[:5])
            self.progress.info(
                f"{len(points)} more of that name without a boundary, not listed: {few}"
                f"{'; ...' if len(points) > 5 else ''}. Give such an id as the place for what "
                "encloses it."
            )
        return areas

    def by_id(self, identity: OsmId) -> list[Candidate]:
        """Find one area by its id; a node or a line gives what lies around it.

        Raises
        ------
        InputError
            There is no such thing.
        ServiceError
            The services cannot tell.
        """
        self.progress.stage(f"Looking for {identity}", 0.1)
        form = {"format": "json", "polygon_geojson": 1, "osm_ids": str(identity)}
        places = self.transport.nominatim("lookup", form)
        if places:
            area = _area(places[0])
            if area is None:
                return self._around_place(places[0], str(identity), False)
            return [dataclasses.replace(found, match=BY_ID) for found in self._described([area])]
        # Nominatim leaves out what has neither a name nor an address, such as most sites.
        self.progress.stage(f"Looking for {identity} on the map", 0.4)
        found = self._elements(f"{_QUERY}{identity.kind}({identity.number});out geom;")
        if not found:
            raise InputError(
                f"OpenStreetMap has no {identity.kind} {identity.number} now.",
                "Check the number, since things are deleted and replaced at times. To look for a "
                f"place of that name, add the town: '{identity}, London'.",
            )
        element = found[0]
        shape_of = area_of_element(element)
        if shape_of is not None:
            return [dataclasses.replace(_candidate(element, shape_of), match=BY_ID)]
        return self._around_place(_place_of(element), str(identity), False)

    def around(self, point: tuple[float, float], match: str) -> list[Candidate]:
        """Find the areas that a point lies in, the smallest first.

        Parameters
        ----------
        point
            Longitude and latitude, degrees.
        match
            What to say of how they were found.

        Raises
        ------
        ServiceError
            The services cannot tell.
        """
        self.progress.stage(f"Looking for what encloses {point[0]:.5f}, {point[1]:.5f}", 0.5)
        try:
            found = self._around_by_overpass(point)
        except ServiceError as error:
            self.progress.warn(
                f"{error.url} {error.problem}. Nominatim is asked instead, which knows fewer areas."
            )
            found = self._around_by_nominatim(point)
        return [dataclasses.replace(a, match=Match(7, match)) for a in smallest_first(found)]

    def _around_place(self, place: Mapping[str, Any], asked: str, others: bool) -> list[Candidate]:
        """Say that a place has no area, and offer what encloses it."""
        identity = _osm_id(place)
        name = str(place.get("display_name") or place.get("name") or "")
        known = ", ".join(text for text in (name, identity) if text) or "unnamed"
        what = "a line" if identity.startswith(("W", "R")) else "a point"
        if others:
            text = (
                f"The best match for '{asked}' is {what} without a boundary of its own "
                f"({known}): areas that enclose it are listed after those of that name."
            )
        else:
            text = (
                f"'{asked}' is {what} in OpenStreetMap ({known}) without a boundary of "
                "its own: areas that enclose it are listed instead, boundaries first."
            )
        self.progress.warn(text)
        point = (_number(place.get("lon")), _number(place.get("lat")))
        try:
            found = self.around(point, f"encloses {place.get('name') or asked}")
        except ServiceError as error:
            if not others:
                raise
            self.progress.warn(f"What encloses it is not listed: {error}")
            return []
        return smallest_first(found, administrative_first=True)

    def _around_by_overpass(self, point: tuple[float, float]) -> list[Candidate]:
        where = f"{point[1]:.7f},{point[0]:.7f}"
        filters = f'[~"{_AREA_KEYS}"~"."]["building"!~"."]'
        found = self._elements(
            f"{_QUERY}is_in({where})->.a;"
            f"(relation(pivot.a){filters};way(pivot.a){filters};);out tags bb;"
        )
        found.sort(key=_width)
        near = [e for e in found if _width(e) <= WIDEST][:MOST]
        far = [e for e in found if _width(e) > WIDEST]
        if far:
            names = ", ".join(dict.fromkeys(_name(e) or _osm_id(e) for e in far))
            self.progress.info(f"Too large to be listed: {names}.")
        if not near:
            return []
        elements = self._elements(f"{_QUERY}({_by_ids(near)});out geom;")
        candidates = []
        for element in elements:
            geometry = area_of_element(element)
            if geometry is not None and geometry.intersects(shapely.Point(point)):
                candidates.append(_candidate(element, geometry))
        return [_with_address(candidate, found) for candidate in candidates]

    def _around_by_nominatim(self, point: tuple[float, float]) -> list[Candidate]:
        found: dict[str, Candidate] = {}
        for count, zoom in enumerate(_ZOOMS):
            self.progress.stage(f"Asking for the address, zoom {zoom}", 0.5 + 0.07 * count)
            form = {
                "format": "json", "polygon_geojson": 1, "zoom": zoom,
                "lat": f"{point[1]:.7f}", "lon": f"{point[0]:.7f}",
            }  # fmt: skip
            for place in self.transport.nominatim("reverse", form):
                area = _area(place)
                if area is not None and area.geometry.intersects(shapely.Point(point)):
                    found.setdefault(area.osm_id, area)
        return list(found.values())

    def _elements(self, query: str) -> list[dict[str, Any]]:
        return _sound(self.transport.overpass(query)["elements"])

    def _described(self, areas: Sequence[Candidate]) -> list[Candidate]:
        """Add what Nominatim does not say: the administrative level and all names."""
        if not areas:
            return []
        self.progress.stage("Asking for names and levels", 0.6)
        transport = self.transport.hurried(ASIDE)
        try:
            query = f"{_QUERY}({_by_ids({'type': _kind(a), 'id': a.osm_id[1:]} for a in areas)});"
            elements = _sound(transport.overpass(f"{query}out tags;")["elements"])
        except ServiceError as error:
            self.progress.info(
                "Administrative levels are estimated from the ranks of Nominatim, since "
                f"{error.url} {error.problem}."
            )
            return list(areas)
        if transport.date is not None:
            self.transport.take_date(transport.date.isoformat())
        tags = {_osm_id(element): element.get("tags", {}) for element in elements}
        return [
            dataclasses.replace(
                area,
                admin_level=level(own.get("admin_level")) if own else area.admin_level,
                names=other_names(own, area.name),
            )
            for area in areas
            for own in [tags.get(area.osm_id, {})]
        ]


def _sound(elements: Iterable[Any]) -> list[dict[str, Any]]:
    """Return the elements that are things of the map, with their tags and bounds."""
    parts = ("tags", "bounds")
    return [
        {**e, **{part: e[part] if isinstance(e.get(part), dict) else {} for part in parts}}
        for e in elements
        if isinstance(e, dict)
        and e.get("type") in ("node", "way", "relation")
        and isinstance(e.get("id"), int)
    ]


def _number(value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return 0.0
    return number if math.isfinite(number) else 0.0


def _osm_id(thing: Mapping[str, Any]) -> str:
    """Return the id of a place of Nominatim or of an element of Overpass."""
    place = "id" not in thing
    kind = str(thing.get("osm_type" if place else "type") or "")
    number = thing.get("osm_id" if place else "id")
    # A postcode of Nominatim is no thing of the map.
    return f"{kind[0].upper()}{number}" if kind and number is not None else ""


def _kind(area: Candidate) -> str:
    return {"N": "node", "W": "way", "R": "relation"}[area.osm_id[0]]


def _by_ids(elements: Iterable[Mapping[str, Any]]) -> str:
    """Return the part of a query that asks for ways and relations by their ids."""
    ids: dict[str, list[str]] = {}
    for element in elements:
        ids.setdefault(str(element["type"]), []).append(str(element["id"]))
    return "".join(f"{kind}(id:{','.join(ids[kind])});" for kind in sorted(ids))


def _area(place: Mapping[str, Any]) -> Optional[Candidate]:
    """Return a place of Nominatim as a candidate, None where it has no area."""
    try:
        geometry = areal_part(shape(place["geojson"]))
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, ShapelyError):
        return None
    if geometry is None or place.get("osm_type") not in ("way", "relation"):
        return None
    display = str(place.get("display_name") or "")
    is_boundary = place.get("class", place.get("category")) == "boundary"
    administrative = is_boundary and place.get("type") == "administrative"
    return Candidate(
        osm_id=_osm_id(place),
        name=str(place.get("name") or display.split(",")[0]),
        geometry=geometry,
        display_name=display,
        kind=str(place.get("type") or ""),
        # The rank of an administrative area is, with exceptions by country, twice its level.
        admin_level=int(_number(place.get("place_rank"))) // 2 if administrative else None,
        match=_BY_SERVICE,
    )


def _name(element: Mapping[str, Any]) -> str:
    return str(element.get("tags", {}).get("name", ""))


def _candidate(element: Mapping[str, Any], geometry: Any) -> Candidate:
    """Return an element of Overpass as a candidate."""
    tags = element.get("tags", {})
    name = _name(element)
    return Candidate(
        osm_id=_osm_id(element),
        name=name,
        geometry=geometry,
        kind=next((str(tags[key]) for key in _KIND_KEYS if key in tags), ""),
        admin_level=level(tags.get("admin_level")),
        names=other_names(tags, name),
    )


def _with_address(candidate: Candidate, around: Sequence[Mapping[str, Any]]) -> Candidate:
    """Name a candidate with the administrative areas around it, sorted by their width."""
    own = next((_width(e) for e in around if _osm_id(e) == candidate.osm_id), 0.0)
    names = [candidate.title]
    for element in around:
        administrative = element.get("tags", {}).get("boundary") == "administrative"
        if administrative and _width(element) > own and _name(element) not in names:
            names.append(_name(element))
    return dataclasses.replace(candidate, display_name=", ".join(name for name in names if name))


def _width(element: Mapping[str, Any]) -> float:
    box = element.get("bounds", {})
    try:
        east, west = float(box["maxlon"]), float(box["minlon"])
        return max(east - west, float(box["maxlat"]) - float(box["minlat"]))
    except (KeyError, TypeError, ValueError):
        return 0.0


def _place_of(element: Mapping[str, Any]) -> dict[str, Any]:
    """Return an element without an area as a place: its name and where it is."""
    box = element.get("bounds", {})
    return {
        "osm_type": element.get("type"),
        "osm_id": element.get("id"),
        "name": _name(element),
        "lat": element.get("lat", (_number(box.get("minlat")) + _number(box.get("maxlat"))) / 2),
        "lon": element.get("lon", (_number(box.get("minlon")) + _number(box.get("maxlon"))) / 2),
    }
