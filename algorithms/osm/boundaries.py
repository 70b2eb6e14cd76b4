"""From a place name, an OpenStreetMap id or a point to the areas that may be meant."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Optional, Union

import geopandas as gpd

from ..errors import CancelledError, InputError
from ..progress import Progress, Silent
from .candidates import frame_of, nearest_first, tell, without_doubles
from .localplaces import Local
from .names import parse_osm_id
from .online import Online
from .settings import OsmSettings

#: Most candidates that are listed unless more are asked for.
LIMIT = 20
_LONGEST_NAME = 300


def boundaries(
    place: Optional[str] = None,
    *,
    point: Optional[tuple[float, float]] = None,
    source: Optional[Path] = None,
    settings: Optional[OsmSettings] = None,
    progress: Optional[Progress] = None,
    limit: int = LIMIT,
) -> gpd.GeoDataFrame:
    """Find all areas that a place name, an id or a point may mean, ranked.

    A name that stands for a point without a boundary, and a point itself, give the areas that
    enclose it. Candidates that cover the same ground are one.

    Parameters
    ----------
    place
        Name, with the town or the country after a comma where needed, or an id such as R123,
        way/123 or the address of a thing on openstreetmap.org.
    point
        Longitude and latitude, degrees. Together with a place, the candidates nearest to it
        come first.
    source
        An .osm or .osm.pbf file to search instead of the online services.
    settings
        How the services are asked.
    progress
        Hears every candidate, and warnings about what may be a mistake; asked for
        cancellation.
    limit
        Most candidates to return, at least 1.

    Returns
    -------
    geopandas.GeoDataFrame
        In EPSG:4326, best candidate first: rank (from 1), name, display_name, kind (such as
        administrative, square, railway), admin_level, osm_id, area_ha (on the ellipsoid, ha),
        match (how it was found), same_as (ids of other things on the same ground).
        ``attrs["osm"]`` has attribution, licence, source and date (of the oldest data).

    Raises
    ------
    InputError
        Nothing was found, or the question or the file cannot be used.
    ServiceError
        The services gave no usable answer.
    CancelledError
        The caller has cancelled.
    MissingDependencyError
        A package that this needs is not installed.
    """
    progress = progress or Silent()
    place, point = check_question(place, point, limit)
    finder: Union[Local, Online]
    if source is not None:
        finder = Local(Path(source), progress)
    else:
        finder = Online(settings or OsmSettings(), progress)
    identity = parse_osm_id(place) if place else None
    if identity is not None:
        found, asked = finder.by_id(identity), str(identity)
    elif place:
        found, asked = finder.by_name(place), f"'{place}'"
    elif point is not None:
        found, asked = finder.around(point, "encloses the point"), "the point"
    if place and point is not None:
        found = nearest_first(found, point)
    if not found:
        raise InputError(
            f"No area is known that encloses {asked}.",
            "Move the point, or give the name of a place; else draw the site by hand.",
        )
    if progress.cancelled():
        raise CancelledError
    progress.stage("Measuring the areas", 0.9)
    chosen = without_doubles(found)
    if len(chosen) > limit:
        progress.warn(f"{len(chosen)} areas were found; the first {limit} are listed.")
    frame = frame_of(chosen[:limit], **finder.origin)
    tell(frame, asked, progress)
    return frame


def check_question(
    place: Optional[str], point: Optional[tuple[float, float]], limit: int = LIMIT
) -> tuple[str, Optional[tuple[float, float]]]:
    """Return the question in plain form.

    Parameters
    ----------
    place, point, limit
        As for `boundaries`.

    Returns
    -------
    tuple
        The place without superfluous spaces, and the point with its longitude in -180 to 180.

    Raises
    ------
    InputError
        It cannot be answered.
    """
    name = " ".join((place or "").split())
    if not name and point is None:
        raise InputError(
            "There is neither a place nor a point.",
            "Give the name of a place, an OpenStreetMap id such as R34914, or a point.",
        )
    if len(name) > _LONGEST_NAME or any(ord(c) < ord(" ") for c in name):
        raise InputError(
            f"The place name is {len(name)} characters long or has characters that no name has.",
            "Give a shorter one.",
        )
    if limit < 1:
        raise InputError(f"The most candidates to list are {limit}.", "Give at least 1.")
    parse_osm_id(name)
    if point is None:
        return name, None
    lon, lat = float(point[0]), float(point[1])
    if not (math.isfinite(lon) and -90.0 <= lat <= 90.0 and abs(lon) <= 540.0):
        raise InputError(
            f"The point {lon:g}, {lat:g} is not on the globe.",
            "Give longitude and latitude in degrees, longitude first.",
        )
    # Beyond the 180th meridian the count of the degrees begins anew.
    return name, ((lon + 180.0) % 360.0 - 180.0, lat)
