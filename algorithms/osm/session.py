"""osmnx for one call: its settings are global, its requests impatient to nobody.

Left alone, osmnx asks a busy server again for ever, a minute apart, takes half an answer for a
whole one, and changes how the whole process finds servers. Here it only says what it wants to
have; `Transport` gets it. For the time of a call its settings are ours, behind a lock.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator, Mapping
from types import ModuleType
from typing import Any, TypeVar

from ..errors import CancelledError
from ..progress import Progress, Silent
from .packages import load_osmnx
from .settings import OsmSettings
from .transport import Transport
from .waiting import Relay, pause, wait_for

#: Part of every query, and so of the name of its file in the cache: osmnx's own default.
QUERY_SETTINGS = "[out:json][timeout:180]{maxsize}"

T = TypeVar("T")

# Held by the thread that works with osmnx, until it has put everything back.
_lock = threading.Lock()


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
        told = False
        while not _lock.acquire(timeout=0.1):
            if relay.cancelled():
                raise CancelledError
            if not told:
                told = True
                relay.info("Another run is busy with OpenStreetMap; this one waits for its end.")
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

    requests = (_overpass._overpass_request, _nominatim._nominatim_request)
    own_thread = threading.get_ident()

    def overpass_request(data: Any, *more: Any, **named: Any) -> Any:
        if threading.get_ident() != own_thread:  # a script of somebody else in this process
            return requests[0](data, *more, **named)
        return transport.overpass(data)

    def nominatim_request(params: Any, *more: Any, **named: Any) -> Any:
        if threading.get_ident() != own_thread:
            return requests[1](params, *more, **named)
        return transport.nominatim(str(named.get("request_type", "search")), params)

    # Addresses, patience and cache are the transport's.
    wanted = {
        "overpass_settings": QUERY_SETTINGS,
        "max_query_area_size": transport.settings.max_query_area,
        "cache_only_mode": False,
        **options,
    }
    before = {name: getattr(osmnx.settings, name) for name in wanted}
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
