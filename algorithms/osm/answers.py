"""What can go wrong between here and a service, as sentences, and what an answer must be."""

from __future__ import annotations

import errno
import json
import socket
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ..errors import ServiceError, without_credentials
from .settings import OsmSettings

LATER = "Try again in some minutes"
OTHER = "choose another server in the settings, or use a local .osm or .pbf file"
SMALLER = "Use a smaller area"
CHECK = "Check the connection in a web browser"

#: HTTP codes after which the same request may well succeed a little later.
BUSY = frozenset({429, 502, 503, 504})
_OK = 200

_NO_NETWORK = {errno.ENETUNREACH, errno.EHOSTUNREACH, errno.ENETDOWN, errno.EHOSTDOWN}


@dataclass(frozen=True)
class Reply:
    """What came back from a server.

    Attributes
    ----------
    status
        HTTP code.
    headers
        Headers, their names in lower case.
    body
        All that was received.
    complete
        Whether the server sent as much as it had announced.
    """

    status: int
    headers: dict[str, str]
    body: bytes
    complete: bool = True


def _chain(error: BaseException) -> Iterator[BaseException]:
    """Yield an error and all that lies behind it."""
    waiting: list[BaseException] = [error]
    seen: set[int] = set()
    while waiting:
        found = waiting.pop(0)
        if id(found) in seen:
            continue
        seen.add(id(found))
        yield found
        behind = [found.__cause__, found.__context__, getattr(found, "reason", None), *found.args]
        waiting += [other for other in behind if isinstance(other, BaseException)]


def _has(chain: list[BaseException], kind: type[BaseException]) -> bool:
    return any(isinstance(found, kind) for found in chain)


def explain(error: BaseException, url: str, settings: OsmSettings) -> ServiceError:
    """Put a failure of the connection into words.

    Parameters
    ----------
    error
        What `requests` raised.
    url
        Address of the service.
    settings
        With which it was called.

    Returns
    -------
    ServiceError
        To be raised.
    """
    chain = list(_chain(error))
    names = {type(found).__name__ for found in chain}
    codes = {getattr(found, "errno", None) for found in chain}
    problem, remedy = "cannot be reached", f"{CHECK}, {OTHER}."
    if "ProxyError" in names or "InvalidProxyURL" in names:
        proxy = without_credentials(settings.proxy) or "of this computer's settings"
        problem = f"cannot be reached, since the proxy {proxy} does not let requests through"
        remedy = "Check the proxy in the network settings."
    elif _has(chain, socket.gaierror) or "NameResolutionError" in names:
        problem = "cannot be found: its name is not known here (DNS)"
        remedy = f"Check the spelling of the address and whether this computer is online, {OTHER}."
    elif names & {"SSLError", "SSLCertVerificationError", "CertificateError"}:
        problem = "shows a certificate that this computer does not trust"
        remedy = "Ask your administrator whether a proxy inspects the traffic, or " + OTHER + "."
    elif names & {"InvalidURL", "InvalidSchema", "MissingSchema", "LocationParseError"}:
        problem = "has an address, or a proxy, that cannot be used"
        remedy = "Correct it in the settings."
    elif names & {"ConnectTimeout", "ReadTimeout", "ReadTimeoutError", "TimeoutError", "timeout"}:
        return silent(url, settings)
    elif "TooManyRedirects" in names:
        problem, remedy = "sends requests round in a circle", "Check its address in the settings."
    elif names & {"ChunkedEncodingError", "IncompleteRead", "ContentDecodingError"}:
        return broken_off(url)
    elif _has(chain, ConnectionRefusedError):
        problem = "refused the connection: no such service runs at this address now"
        remedy = f"{LATER}, {OTHER}."
    elif codes & _NO_NETWORK:
        problem = "cannot be reached: there is no network"
    elif names & {"RemoteDisconnected", "ConnectionResetError", "BrokenPipeError"}:
        problem, remedy = "broke the connection without an answer", f"{LATER}, {OTHER}."
    return ServiceError(url, problem, remedy)


def silent(url: str, settings: OsmSettings) -> ServiceError:
    """Put into words that no answer came in time."""
    return ServiceError(
        url,
        f"gave no answer within {settings.timeout:g} seconds",
        f"{LATER}, use a smaller area, allow more time in the settings, {OTHER}.",
    )


def broken_off(url: str) -> ServiceError:
    """Put into words that an answer was not whole."""
    return ServiceError(
        url,
        "broke off in the middle of its answer",
        f"Try again; if it happens once more, use a smaller area, {OTHER}.",
    )


def refusal(reply: Reply, url: str) -> ServiceError:
    """Put into words that a server answered with an HTTP code that is no success."""
    status = reply.status
    problem = f"refused the request (HTTP {status}{_said(reply)})"
    remedy = f"{LATER}, {OTHER}."
    if status == 429:
        problem = "has had too many requests from this address (HTTP 429)"
        named = reply.headers.get("retry-after", "")
        wait = f"Wait {named} seconds" if named.isdigit() and int(named) else "Wait some minutes"
        remedy = f"{wait} and run again, {OTHER}."
    elif status == 504:
        problem = "is too busy, or the area too large for it (HTTP 504)"
        remedy = f"{LATER}, use a smaller area, {OTHER}."
    elif status >= 500:
        problem = f"is out of order (HTTP {status})"
    elif status in (401, 403, 407, 451):
        problem = f"does not let this computer in (HTTP {status})"
        remedy = f"Check its address, the user agent and the proxy in the settings, {OTHER}."
    elif status == 404:
        problem = "does not know the request (HTTP 404): there may be another service there"
        remedy = "Check its address in the settings."
    return ServiceError(url, problem, remedy)


def parse(reply: Reply, url: str) -> Any:
    """Read an answer as JSON.

    Raises
    ------
    ServiceError
        It is no success, a web page, or not whole.
    """
    if reply.status != _OK:
        raise refusal(reply, url)
    if not reply.complete:
        raise broken_off(url)
    text = reply.body.decode("utf-8", errors="replace").lstrip("\ufeff \t\r\n")
    try:
        return json.loads(text)
    except ValueError as error:
        if text.startswith("<"):
            raise ServiceError(
                url,
                "answered with a web page instead of data",
                "The network may ask you to log in first: open any page in a web browser. Else "
                "check the address of the service in the settings.",
            ) from error
        if text.startswith(("{", "[")):
            raise broken_off(url) from error
        raise ServiceError(
            url,
            "answered with something that is no data",
            "Check its address in the settings.",
        ) from error


def check_elements(data: Any, url: str) -> dict[str, Any]:
    """Make sure that an answer of Overpass is whole.

    Overpass that runs out of time or memory sends what it has by then, with a remark and as a
    success: half a town would pass for a whole one.

    Raises
    ------
    ServiceError
        It is no list of elements, or not all of it.
    """
    if not isinstance(data, dict) or not isinstance(data.get("elements"), list):
        raise ServiceError(
            url,
            "answered with data that is not that of an Overpass API",
            "Check its address in the settings.",
        )
    remark = str(data.get("remark", ""))
    if "error" in remark or "timed out" in remark or "out of memory" in remark:
        raise ServiceError(
            url,
            f"stopped before it was done ({_short(remark)})",
            f"{SMALLER}, try again later, {OTHER}.",
        )
    return data


def check_places(data: Any, url: str) -> list[dict[str, Any]]:
    """Make sure that an answer is one of Nominatim.

    Raises
    ------
    ServiceError
        It is no list of places.
    """
    if isinstance(data, dict) and "osm_id" in data:  # the answer to a reverse request
        return [data]
    if isinstance(data, dict) and "error" in data:  # "Unable to geocode": nothing there
        return []
    if not isinstance(data, list) or not all(isinstance(item, dict) for item in data):
        raise ServiceError(
            url,
            "answered with data that is not that of Nominatim",
            "Check its address in the settings.",
        )
    return data


def _said(reply: Reply) -> str:
    """Return what a refusal says in plain text, with a colon before it."""
    text = reply.body[:2000].decode("utf-8", errors="replace").strip()
    if not text or text.startswith(("<", "{", "[")):
        return ""
    return f": {_short(text)}"


def _short(text: str, most: int = 160) -> str:
    text = " ".join(text.split())
    return text if len(text) <= most else text[: most - 1] + "…"
