"""Requests to Nominatim and Overpass: patient, polite, cancellable, and honest about failure."""

from __future__ import annotations

import copy
import dataclasses
import datetime
import ipaddress
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from ..errors import ServiceError, without_credentials
from ..progress import Deadline, Progress, Silent
from . import answers
from .answers import Reply
from .cache import AnswerCache, CorruptedAnswerError
from .packages import load_requests
from .settings import OsmSettings
from .waiting import Relay, pause, wait_for

if TYPE_CHECKING:
    from types import ModuleType

#: How often a request is sent again after a failure that may pass.
RETRIES = 2
#: Seconds before the first and the second repetition, where the server names no time.
WAITS = (2.0, 5.0)
#: Least seconds between two requests to the same server: the usage policy of Nominatim.
POLITE = 1.0
#: Longest wait for the status of an Overpass server, in seconds.
STATUS_TIMEOUT = 5.0
_CHUNK = 65536

_lock = threading.Lock()
_last: dict[str, float] = {}


class Transport:
    """Sends the requests of one run.

    Parameters
    ----------
    settings
        How.
    progress
        Hears what is waited for; asked for cancellation.

    Attributes
    ----------
    date
        Day of the oldest data among all answers so far, or None.
    requests_sent
        How many requests went out; answers from the cache do not count.
    """

    def __init__(self, settings: OsmSettings, progress: Progress | None = None) -> None:
        self.settings = settings
        self.progress = progress or Silent()
        self.cache = AnswerCache(settings.cache_folder if settings.use_cache else None)
        self.date: datetime.date | None = None
        self.requests_sent = 0
        self._told_of_cache = self._told_of_kept = False

    def hurried(self, seconds: float) -> Transport:
        """Return another of the same kind that waits no longer than that for each request."""
        other = copy.copy(self)
        patience = min(seconds, self.settings.timeout)
        other.settings = dataclasses.replace(self.settings, timeout=patience)
        return other

    def nominatim(self, kind: str, parameters: Mapping[str, Any]) -> list[dict[str, Any]]:
        """Ask Nominatim.

        Parameters
        ----------
        kind
            "search", "lookup" or "reverse".
        parameters
            Parameters of the request, in the order that the cache knows.

        Returns
        -------
        list of dict
            Places, the most important one first; empty where there is none.

        Raises
        ------
        ServiceError
            There is no usable answer; the text says why and what to do.
        CancelledError
            The caller has cancelled.
        """
        base = self.settings.nominatim_url
        url = f"{base.rstrip('/')}/{kind}"
        places: list[dict[str, Any]] = self._answer(
            base, url, parameters, "GET", answers.check_places
        )
        return places

    def overpass(self, query: str | Mapping[str, Any]) -> dict[str, Any]:
        """Ask Overpass.

        Parameters
        ----------
        query
            In the language of Overpass, with ``[out:json]``; or the form that osmnx sends.

        Returns
        -------
        dict
            The answer, its elements under "elements".

        Raises
        ------
        ServiceError
            There is no usable answer; the text says why and what to do.
        CancelledError
            The caller has cancelled.
        """
        base = self.settings.overpass_url
        form = {"data": query} if isinstance(query, str) else query
        url = f"{base.rstrip('/')}/interpreter"
        data: dict[str, Any] = self._answer(base, url, form, "POST", answers.check_elements)
        self.take_date(str(data.get("osm3s", {}).get("timestamp_osm_base", ""))[:10])
        return data

    def _answer(
        self,
        base: str,
        url: str,
        parameters: Mapping[str, Any],
        method: str,
        check: Callable[[Any, str], Any],
    ) -> Any:
        requests = load_requests()
        try:
            form = requests.Request("GET", url, params=OrderedDict(parameters))
            request = str(form.prepare().url)
        except (requests.exceptions.RequestException, ValueError) as error:
            raise answers.explain(error, base, self.settings) from error
        kept = self._kept(request, base, check)
        # What was not on the map then may be there now.
        if kept is not None and (self.settings.only_cache or _has_content(kept[0])):
            self._use_kept(kept[1])
            return kept[0]
        if self.settings.only_cache:
            raise ServiceError(
                base,
                "was not asked, since the settings say offline, and the folder "
                f"{self.settings.cache_folder} has no answer to this request (answers to other "
                "places, areas or of other versions do not fit)",
                "Switch the offline mode off, or use a local .osm or .pbf file.",
            )
        try:
            data = check(self._send_patiently(base, url, parameters, method), base)
        except ServiceError:
            if kept is None:
                raise
            self._use_kept(kept[1])
            return kept[0]
        self.take_date(datetime.datetime.now(datetime.timezone.utc).date().isoformat())
        self._keep(request, data)
        return data

    def _kept(
        self, request: str, base: str, check: Callable[[Any, str], Any]
    ) -> tuple[Any, datetime.date] | None:
        """Return the answer that the cache has and its day, or None."""
        try:
            found = self.cache.read(request)
            return None if found is None else (check(found[0], base), found[1])
        except CorruptedAnswerError as error:
            problem = str(error)
        except ServiceError:
            problem = f"The kept answer {self.cache.path(request)} is not one of this service"
        if self.settings.only_cache:
            raise ServiceError(
                base,
                f"was not asked, since the settings say offline. {problem}",
                "Delete that file and switch the offline mode off, or use a local .osm or .pbf "
                "file.",
            )
        self.progress.warn(f"{problem}; it is asked for again.")
        return None

    def _use_kept(self, day: datetime.date) -> None:
        self.take_date(day.isoformat())
        if not self._told_of_kept:
            self._told_of_kept = True
            self.progress.info(
                f"Answers to earlier requests are used, such as one of {day}. To ask for newer "
                f"data, delete the files in {self.settings.cache_folder}."
            )

    def _keep(self, request: str, data: Any) -> None:
        try:
            self.cache.write(request, data)
        except OSError as error:
            if not self._told_of_cache:
                self._told_of_cache = True
                self.progress.warn(
                    f"Answers cannot be kept in {self.settings.cache_folder} "
                    f"({error.strerror or error}); choose another cache folder in the settings."
                )

    def take_date(self, text: str) -> None:
        """Take note of the day of some of the data, as year-month-day; other texts are nothing."""
        try:
            day = datetime.date.fromisoformat(text)
        except ValueError:
            return
        self.date = day if self.date is None else min(day, self.date)

    def _send_patiently(
        self, base: str, url: str, parameters: Mapping[str, Any], method: str
    ) -> Any:
        """Send, and again after what may pass, but no longer than the settings allow."""
        deadline = Deadline(self.settings.timeout)
        for attempt in range(RETRIES + 1):
            self._keep_rate(url)
            reply = self._send(base, url, parameters, method, deadline.left)
            if reply.status not in answers.BUSY or attempt == RETRIES:
                break
            wait = self._wait_after(reply, attempt, deadline, method)
            if wait > deadline.left:
                break
            self.progress.info(
                f"{without_credentials(base)} is busy (HTTP {reply.status}); asking again in "
                f"{wait:.0f} s."
            )
            pause(wait, self.progress)
        return answers.parse(reply, base)

    def _wait_after(self, reply: Reply, attempt: int, deadline: Deadline, method: str) -> float:
        """Return the seconds to wait before the next try."""
        named = reply.headers.get("retry-after", "")
        if named.isdigit():
            return float(named)
        usual = WAITS[min(attempt, len(WAITS) - 1)]
        if not self.settings.rate_limit:
            return min(usual, 0.2)
        if method == "GET":  # Nominatim has no slots
            return usual
        status = f"{self.settings.overpass_url.rstrip('/')}/status"
        try:
            told = self._send(status, status, {}, "GET", min(STATUS_TIMEOUT, deadline.left))
        except ServiceError:
            return usual
        return max(usual, seconds_to_slot(told.body.decode("utf-8", errors="replace")))

    def _keep_rate(self, url: str) -> None:
        """Wait until a second has passed since the last request to this server."""
        if not self.settings.rate_limit:
            return
        host = urlsplit(url).netloc
        with _lock:
            now = time.monotonic()
            start = max(now, _last.get(host, -POLITE) + POLITE)
            _last[host] = start
        pause(start - now, self.progress)

    def _send(
        self, base: str, url: str, parameters: Mapping[str, Any], method: str, seconds: float
    ) -> Reply:
        """Send once and return whatever comes back within the time."""
        requests = load_requests()
        settings = self.settings
        self.requests_sent += 1

        def work(relay: Relay) -> Reply:
            return _exchange(requests, settings, url, parameters, method, seconds, relay)

        try:
            return wait_for(work, self.progress, seconds)
        except TimeoutError as error:
            raise answers.silent(base, settings) from error
        except (requests.exceptions.RequestException, OSError, ValueError) as error:
            raise answers.explain(error, base, settings) from error


def _exchange(
    requests: ModuleType,
    settings: OsmSettings,
    url: str,
    parameters: Mapping[str, Any],
    method: str,
    seconds: float,
    relay: Relay,
) -> Reply:
    """Send one request and read the answer piece by piece, as long as anybody waits for it."""
    headers = {
        "User-Agent": settings.user_agent,
        "Accept-Language": "en",
    }
    given: dict[str, Any] = {"params" if method == "GET" else "data": parameters}
    if settings.proxy:
        # Beside those of the environment, of which the certificates are wanted.
        given["proxies"] = {"http": settings.proxy, "https": settings.proxy}
    with requests.Session() as session:
        if _is_loopback(url):
            # No proxy stands between a computer and itself.
            session.trust_env = False
            given.pop("proxies", None)
        with session.request(
            method, url, headers=headers, timeout=max(seconds, 0.1), stream=True, **given
        ) as response:
            pieces = []
            for piece in response.iter_content(_CHUNK):
                if relay.cancelled():
                    break
                pieces.append(piece)
            announced = response.headers.get("Content-Length", "")
            received = response.raw.tell()
            return Reply(
                response.status_code,
                {name.lower(): text for name, text in response.headers.items()},
                b"".join(pieces),
                complete=not announced.isdigit() or received >= int(announced),
            )


def _has_content(data: Any) -> bool:
    """Tell whether an answer that has been checked names anything."""
    return bool(data["elements"] if isinstance(data, dict) else data)


def _is_loopback(url: str) -> bool:
    host = urlsplit(url).hostname or ""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def seconds_to_slot(status: str) -> float:
    """Return how long an Overpass server asks to wait, from the text of its status page.

    Parameters
    ----------
    status
        The page; a line of it may read "2 slots available now." or "Slot available after:
        2026-01-01T12:00:00Z, in 14 seconds."

    Returns
    -------
    float
        Seconds, 0 where a slot is free or the page says nothing.
    """
    waits = []
    for line in status.splitlines():
        words = line.split()
        if "slots available now" in line:
            return 0.0
        if line.startswith("Slot available after") and "in" in words:
            number = words[words.index("in") + 1]
            if number.lstrip("-").isdigit():
                waits.append(max(0.0, float(number)))
    return min(waits, default=0.0)
