"""What OpenStreetMap's values mean to a planner: levels of streets, land uses, obstacles.

Values are those of https://wiki.openstreetmap.org/wiki/Map_features.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Literal

from . import tags as read

NetworkType = Literal["drive", "walk", "bike", "all"]

LEVELS: dict[int, frozenset[str]] = {
    1: frozenset({
        "motorway", "motorway_link", "trunk", "trunk_link", "primary", "primary_link",
    }),
    2: frozenset({"secondary", "secondary_link", "tertiary", "tertiary_link"}),
    3: frozenset({"unclassified", "residential", "living_street", "road", "busway"}),
}  # fmt: skip
"""Values of highway by level: 1 major, 2 collector, 3 local; everything else is 4."""

_NEVER = (
    "abandoned", "construction", "no", "planned", "platform", "proposed", "raceway", "razed",
    "rest_area", "services",
)  # fmt: skip
_CARS_NOT = (
    "bridleway", "bus_guideway", "corridor", "cycleway", "elevator", "escalator", "footway",
    "path", "pedestrian", "service", "steps", "track",
)  # fmt: skip
_BIKES_NOT = (
    "bus_guideway", "corridor", "elevator", "escalator", "footway", "motor", "motorway",
    "motorway_link", "steps",
)  # fmt: skip
_WALKERS_NOT = ("bus_guideway", "cycleway", "motor", "motorway", "motorway_link")

EXCLUDED: dict[str, tuple[tuple[str, tuple[str, ...]], ...]] = {
    "drive": (
        ("area", ("yes",)),
        ("access", ("private",)),
        ("highway", (*_NEVER, *_CARS_NOT)),
        ("motor_vehicle", ("no",)),
        ("motorcar", ("no",)),
        ("service", (
            "alley", "driveway", "emergency_access", "parking", "parking_aisle", "private",
        )),
    ),
    "walk": (
        ("area", ("yes",)),
        ("access", ("private",)),
        ("highway", (*_NEVER, *_WALKERS_NOT)),
        ("foot", ("no",)),
        ("service", ("private",)),
        ("sidewalk", ("separate",)),
        ("sidewalk:both", ("separate",)),
        ("sidewalk:left", ("separate",)),
        ("sidewalk:right", ("separate",)),
    ),
    "bike": (
        ("area", ("yes",)),
        ("access", ("private",)),
        ("highway", (*_NEVER, *_BIKES_NOT)),
        ("bicycle", ("no",)),
        ("service", ("private",)),
    ),
    "all": (("area", ("yes",)), ("highway", _NEVER)),
}  # fmt: skip
"""Network type -> (tag, values that leave a way out); after osmnx's own network types."""


def overpass_filter(network_type: NetworkType) -> str:
    """Return what Overpass is to be asked for a network, as osmnx takes it.

    Parameters
    ----------
    network_type
        "drive", "walk", "bike" or "all".
    """
    without = "".join(
        f'["{key}"!~"^({"|".join(values)})$"]' for key, values in EXCLUDED[network_type]
    )
    return f'["highway"]{without}'


def in_network(tags: Mapping[str, str], network_type: NetworkType) -> bool:
    """Tell whether a way belongs to a network; the same choice as `overpass_filter`.

    Parameters
    ----------
    tags
        Tags of the way.
    network_type
        "drive", "walk", "bike" or "all".
    """
    if "highway" not in tags:
        return False
    return all(tags.get(key) not in values for key, values in EXCLUDED[network_type])


def street_level(highway: str | None) -> int:
    """Return the level of a street: 1 major, 2 collector, 3 local, 4 service way or path.

    Parameters
    ----------
    highway
        Its highway class; of several, joined by ";", the highest counts.

    Examples
    --------
    >>> street_level("primary"), street_level("residential; tertiary"), street_level("footway")
    (1, 2, 4)
    """
    own = read.values(highway)
    return min((level for level, kinds in LEVELS.items() if kinds & set(own)), default=4)


FEATURES: dict[str, tuple[str, ...]] = {
    "building": (),
    "landuse": (),
    "leisure": (
        "park", "garden", "nature_reserve", "common", "golf_course", "pitch", "playground",
        "sports_centre", "stadium", "track", "marina", "dog_park", "beach_resort",
    ),
    "natural": (
        "water", "wood", "wetland", "scrub", "heath", "grassland", "beach", "bare_rock", "cliff",
        "coastline", "bay", "glacier", "sand",
    ),
    "waterway": ("river", "stream", "canal", "riverbank", "dock", "ditch", "drain"),
    "railway": ("rail", "light_rail", "subway", "narrow_gauge", "funicular"),
    "amenity": (
        "school", "kindergarten", "college", "university", "hospital", "parking", "grave_yard",
        "place_of_worship", "marketplace", "prison", "townhall", "fire_station", "bus_station",
    ),
    "highway": ("motorway", "motorway_link"),
    "aeroway": ("aerodrome", "runway", "taxiway", "apron"),
    "barrier": ("city_wall",),
    "military": (),
}  # fmt: skip
"""Tags of the areas and lines that become layers; no values means any."""

ATTRIBUTES = (
    "name", "access", "height", "building:levels", "layer", "tunnel", "bridge", "location",
    "width", "water", "area", "service", "indoor",
)  # fmt: skip
"""Further tags that are read of them."""

COLUMNS = (*FEATURES, *ATTRIBUTES)
"""All tags that a table of features has as columns."""


def is_feature(tags: Mapping[str, str]) -> bool:
    """Tell whether something in a file is one of `FEATURES`.

    Parameters
    ----------
    tags
        Its tags.
    """
    return any(
        key in tags and (not values or tags[key] in values) for key, values in FEATURES.items()
    )


_THEMES: tuple[tuple[str, str, str], ...] = (
    ("landuse", "residential", "housing"),
    ("landuse", "retail|commercial|industrial|warehouse|depot|port|quarry|landfill", "work"),
    ("landuse", "construction|brownfield|greenfield", "development"),
    ("landuse", "railway|garages|highway", "transport"),
    ("landuse", "basin|reservoir|salt_pond", "water"),
    ("landuse", "farmland|farmyard|orchard|vineyard|plant_nursery|greenhouse_horticulture",
     "farming"),
    ("landuse", "education|religious|institutional|military|civic_admin", "public"),
    ("landuse", "forest|grass|meadow|recreation_ground|village_green|cemetery|allotments|flowerbed",
     "green"),
    ("leisure", "marina", "water"),
    ("leisure", ".*", "green"),
    ("natural", "water|bay|glacier", "water"),
    ("natural", "wood|wetland|scrub|heath|grassland|beach|bare_rock|sand", "green"),
    ("waterway", "riverbank|dock", "water"),
    ("amenity", "grave_yard", "green"),
    ("amenity", "parking|bus_station", "transport"),
    ("amenity", ".*", "public"),
    ("aeroway", ".*", "transport"),
    ("military", ".*", "public"),
    ("landuse", ".*", "other"),
)  # fmt: skip
THEMES = (
    "housing", "work", "development", "public", "transport", "green", "farming", "water", "other",
)  # fmt: skip
"""The themes of land use, in the order of a legend."""


def land_use(tags: Mapping[str, Any]) -> tuple[str, str] | None:
    """Return (theme, kind) of an area, or None where it says nothing about the use of land.

    Parameters
    ----------
    tags
        Its tags; kind is the value of the tag that decides, theme one of `THEMES`.

    Examples
    --------
    >>> land_use({"landuse": "retail"}), land_use({"building": "yes"})
    (('work', 'retail'), None)
    """
    for key, pattern, theme in _THEMES:
        for value in read.values(tags.get(key)):
            if re.fullmatch(pattern, value):
                return theme, value
    return None


GREEN: dict[str, frozenset[str]] = {
    "leisure": frozenset({
        "park", "garden", "nature_reserve", "common", "golf_course", "pitch", "playground",
        "dog_park", "track",
    }),
    "landuse": frozenset({
        "forest", "cemetery", "recreation_ground", "village_green", "allotments",
    }),
    "natural": frozenset({"wood", "wetland", "beach", "bare_rock", "glacier"}),
    "amenity": frozenset({"grave_yard"}),
}  # fmt: skip
"""Open land that streets keep out of; plain grass, meadows and fields may be built on."""

WATER: dict[str, frozenset[str]] = {
    "natural": frozenset({"water", "bay"}),
    "landuse": frozenset({"basin", "reservoir", "salt_pond"}),
    "waterway": frozenset({"riverbank", "dock"}),
}

HALF_WIDTHS: dict[str, dict[str, float]] = {
    "railway": {
        "rail": 4.0, "light_rail": 4.0, "subway": 4.0, "narrow_gauge": 3.0, "funicular": 3.0,
    },
    "waterway": {"river": 8.0, "canal": 6.0, "stream": 2.0, "ditch": 1.0, "drain": 1.0},
    "highway": {"motorway": 10.0, "motorway_link": 5.0},
    "aeroway": {"runway": 25.0, "taxiway": 12.0},
    "barrier": {"city_wall": 2.0},
    "natural": {"cliff": 2.0},
}  # fmt: skip
"""Half the width that a line takes as an obstacle, metres, where the tag width says nothing.

A single track with its ballast and clearance takes some 8 m, a carriageway of a motorway with
its shoulders 20 m; rivers of more than some metres are drawn as areas in OpenStreetMap anyway.
"""

_LINE_KINDS = {
    "railway": "rail", "waterway": "water", "highway": "motorway", "aeroway": "airfield",
    "barrier": "wall", "natural": "cliff",
}  # fmt: skip


def area_obstacle(tags: Mapping[str, Any]) -> str | None:
    """Return what kind of obstacle an area is, or None.

    Parameters
    ----------
    tags
        Its tags.

    Returns
    -------
    str or None
        "water", "green", "airfield" or "military". Railway land is none: it is often the
        very site; the tracks on it are obstacles of their own.
    """
    own = dict(tags)
    if read.below_ground(own) or not read.is_missing(own.get("building")):
        return None
    if _among(own, WATER):
        return "water"
    if _among(own, GREEN) and "private" not in read.values(own.get("access")):
        return "green"
    if read.values(own.get("aeroway")):
        return "airfield"
    if "military" in read.values(own.get("landuse")):
        return "military"
    return None


def line_obstacle(tags: Mapping[str, Any]) -> tuple[str, float] | None:
    """Return (kind, half width in metres) of a line that streets must not cross, or None.

    Parameters
    ----------
    tags
        Its tags. Tunnels, bridges and tracks in the street (trams) bar nothing.
    """
    own = dict(tags)
    if read.below_ground(own) or read.is_yes(own.get("bridge")):
        return None
    for key, widths in HALF_WIDTHS.items():
        for value in read.values(own.get(key)):
            if value in widths:
                width = read.height_m(own.get("width"))
                return _LINE_KINDS[key], width / 2 if width else widths[value]
    return None


def _among(tags: dict[str, Any], table: Mapping[str, frozenset[str]]) -> bool:
    return any(set(read.values(tags.get(key))) & values for key, values in table.items())
