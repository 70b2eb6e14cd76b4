"""osmnx for one call: its settings are global, its requests impatient to nobody.

Left alone, osmnx asks a busy server again for ever, a minute apart, takes half an answer for a
whole one, and changes how the whole process finds servers. Here it only says what it wants to
have; `Transport` gets it. For the time of a call its settings are ours, behind a lock.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from ..errors import CancelledError, MissingDependencyError
from ..progress import Progress, Silent
from .settings import OsmSettings
from .transport import Transport
from .waiting import Relay, pause, wait_for

#: Part of every query, and so of the name of its file in the cache: osmnx's own default.
QUERY_SETTINGS = "[out:json][timeout:180]{maxsize}"

T = TypeVar("T")

# Held by the thread that works with osmnx, until it has put everything back.
_lock = threading.Lock()


def load_osmnx() -> ModuleType:
    """Import osmnx 2.

    Raises
    ------
    MissingDependencyError
        It is not installed, or another version than this library knows how to steer.
    """
    try:
        import osmnx
        from osmnx import _nominatim, _overpass
    except ImportError as error:
        msg = "This needs the Python package osmnx, version 2. Install it with pip."
        raise MissingDependencyError(msg) from error
    known = hasattr(_overpass, "_overpass_request") and hasattr(_nominatim, "_nominatim_request")
    version = str(getattr(osmnx, "__version__", "0"))
    if not known or version.split(".")[0] != "2":
        msg = f"The Python package osmnx {version} is not known here. Install osmnx 2.1 with pip."
        raise MissingDependencyError(msg)
    return osmnx


def with_osmnx(
    call: Callable[[ModuleType, Transport], T],
    settings: OsmSettings | None = None,
    progress: Progress | None = None,
    *,
    options: Mapping[str, Any] | None = None,
) -> T:
    """Do work with osmnx, its requests sent by a `Transport`.

    Parameters
    ----------
    call
        Given the module osmnx and the transport of its requests. It runs in a thread of its own
        and must not touch the caller's progress; `transport.progress` is passed on.
    settings
        How requests are made.
    progress
        Told what is waited for; asked for cancellation.
    options
        More settings of osmnx for this call, by name.

    Returns
    -------
    object
        What the call returns.

    Raises
    ------
    ServiceError
        A request failed; the text says why and what to do.
    CancelledError
        The caller has cancelled; the thread stops at its next request.
    MissingDependencyError
        osmnx is not installed.
    """
    settings = settings or OsmSettings()
    osmnx = load_osmnx()

    def work(relay: Relay) -> T:
        while not _lock.acquire(timeout=0.1):
            if relay.cancelled():
                raise CancelledError
        try:
            transport = Transport(settings, relay)
            with _steered(osmnx, transport, options or {}):
                pause(0.0, relay)
                return call(osmnx, transport)
        finally:
            _lock.release()

    return wait_for(work, progress or Silent())


@contextlib.contextmanager
def _steered(osmnx: ModuleType, transport: Transport, options: Mapping[str, Any]) -> Iterator[None]:
    """Set osmnx up for one call, and put everything back."""
    from osmnx import _nominatim, _overpass

    def overpass_request(data: Mapping[str, Any], *_: Any, **__: Any) -> dict[str, Any]:
        return transport.overpass(data)

    def nominatim_request(
        params: Mapping[str, Any], *_: Any, request_type: str = "search", **__: Any
    ) -> list[dict[str, Any]]:
        return transport.nominatim(request_type, params)

    settings = transport.settings
    wanted = {
        "overpass_url": settings.overpass_url,
        "nominatim_url": settings.nominatim_url,
        "overpass_settings": QUERY_SETTINGS,
        "max_query_area_size": settings.max_query_area,
        "cache_folder": settings.cache_folder or Path("cache"),
        "use_cache": False,  # the transport has the cache
        "cache_only_mode": False,
        "log_file": False,
        "log_console": False,
        **options,
    }
    before = {name: getattr(osmnx.settings, name) for name in wanted}
    requests = (_overpass._overpass_request, _nominatim._nominatim_request)
    try:
        for name, value in wanted.items():
            setattr(osmnx.settings, name, value)
        _overpass._overpass_request = overpass_request
        _nominatim._nominatim_request = nominatim_request
        yield
    finally:
        _overpass._overpass_request, _nominatim._nominatim_request = requests
        for name, value in before.items():
            setattr(osmnx.settings, name, value)
