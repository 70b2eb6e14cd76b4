"""How to reach OpenStreetMap: addresses, patience, cache, and what its licence asks for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from ..errors import InputError

#: What has to stand beside every map made of the data.
ATTRIBUTION = "© OpenStreetMap contributors"
LICENCE = "Open Database License (ODbL) 1.0, https://www.openstreetmap.org/copyright"

USER_AGENT = "Platwright (https://github.com/platwright/platwright)"


@dataclass(frozen=True)
class OsmSettings:
    """How requests to OpenStreetMap services are made.

    Attributes
    ----------
    overpass_url
        Address of the Overpass API, which gives map data; without `/interpreter`.
    nominatim_url
        Address of Nominatim, which finds places.
    timeout
        Longest wait for one request with all its repetitions, in seconds, greater than 0.
    cache_folder
        Folder for answers, in the format of osmnx; None for no cache.
    use_cache
        Whether answers are kept in and taken from that folder.
    only_cache
        Work offline: take answers from the folder and never send a request.
    rate_limit
        Keep to the rates that public services ask for: one request a second, and the waiting
        time that Overpass names. Only for a server of one's own this may be False.
    proxy
        Address of a proxy, such as ``http://proxy:8080``; empty for that of the
        environment.
    user_agent
        Name under which requests are sent; the public services demand one.
    max_query_area
        Larger areas are asked for in pieces, in square metres, so that a server answers each in
        time.

    Raises
    ------
    InputError
        A value cannot be used; the text says which.
    """

    overpass_url: str = "https://overpass-api.de/api"
    nominatim_url: str = "https://nominatim.openstreetmap.org/"
    timeout: float = 60.0
    cache_folder: Path | None = None
    use_cache: bool = True
    only_cache: bool = False
    rate_limit: bool = True
    proxy: str = ""
    user_agent: str = USER_AGENT
    max_query_area: float = 1.25e8

    def __post_init__(self) -> None:
        for name, url in (("Overpass", self.overpass_url), ("Nominatim", self.nominatim_url)):
            parts = urlsplit(url)
            if parts.scheme not in ("http", "https") or not parts.netloc:
                raise InputError(
                    f"The address of the {name} service is no web address: '{url}'.",
                    "Give one that begins with https:// in the settings.",
                )
        for name, value in (("timeout", self.timeout), ("largest area", self.max_query_area)):
            if not (math.isfinite(value) and value > 0):
                raise InputError(
                    f"The {name} for OpenStreetMap requests is {value:g}.",
                    "Give a number greater than 0 in the settings.",
                )
        if self.only_cache and (self.cache_folder is None or not self.use_cache):
            raise InputError(
                "Working offline needs the folder with the answers of earlier requests.",
                "Name a cache folder in the settings and switch the cache on, or switch the "
                "offline mode off.",
            )
        if not self.user_agent.strip():
            raise InputError(
                "The OpenStreetMap services demand the name of the program that asks.",
                "Fill in the user agent in the settings.",
            )
