"""Everything that can go wrong on the way: a sentence with the way out, in time, cancellable."""

from __future__ import annotations

import json
import os
import re
import threading
import time

import pytest
import requests
from clock import allowed
from platwright.errors import CancelledError, InputError, ServiceError, without_credentials
from platwright.osm import OsmSettings, boundaries
from platwright.osm.cache import AnswerCache
from platwright.osm.transport import Transport, seconds_to_slot
from server import BROKEN

#: Kind of broken answer -> what the sentence must say.
SENTENCES = {
    "429": r"too many requests .*HTTP 429.* Wait some minutes",
    "504": r"too busy, or the area too large .*HTTP 504.* smaller area",
    "500": r"out of order \(HTTP 500\)",
    "403": r"does not let this computer in \(HTTP 403\)",
    "404": r"does not know the request \(HTTP 404\).* Check its address",
    "400": r"refused the request \(HTTP 400\)",
    "truncated": r"broke off in the middle",
    "half": r"broke off in the middle",
    "html": r"web page instead of data.* log in first",
    "garbage": r"something that is no data",
    "empty": r"something that is no data",
    "foreign": r"is not that of (Nominatim|an Overpass API)",
    "hang": r"gave no answer within 0.6 seconds.*allow more time",
    "drip": r"gave no answer within 0.6 seconds",
    "reset": r"broke the connection without an answer",
    "loop": r"round in a circle",
}
OVERPASS_ONLY = {"remark": r"stopped before it was done .*out of memory.* smaller area"}
#: Those that wait as long as they may: the shorter, the sooner the test is done.
SILENT = ("hang", "drip")


def test_every_broken_answer_has_a_test():
    words = {kind for kind in {**SENTENCES, **OVERPASS_ONLY} if not kind.isdigit()}
    assert words | {"once"} == set(BROKEN)


def check_sentence(error, url):
    text = str(error)
    assert url in text
    assert text.endswith(".")
    assert re.search(r"settings|file|again|smaller|log in|administrator", text), text
    assert "Traceback" not in text
    assert "HTTPConnectionPool" not in text


@pytest.mark.parametrize("kind", sorted(SENTENCES))
def test_nominatim_broken(settings, kind):
    given = settings(kind, timeout=0.6 if kind in SILENT else 1.5)
    start = time.monotonic()
    with pytest.raises(ServiceError, match=SENTENCES[kind]) as caught:
        boundaries("Larvotto", settings=given)
    assert time.monotonic() - start < allowed(2.5)
    check_sentence(caught.value, given.nominatim_url)


@pytest.mark.parametrize("kind", sorted({**SENTENCES, **OVERPASS_ONLY}))
def test_overpass_broken(settings, kind):
    given = settings(kind, timeout=0.6 if kind in SILENT else 1.5)
    start = time.monotonic()
    with pytest.raises(ServiceError, match={**SENTENCES, **OVERPASS_ONLY}[kind]) as caught:
        Transport(given).overpass("[out:json];node(1);out;")
    assert time.monotonic() - start < allowed(2.5)
    check_sentence(caught.value, given.overpass_url)


def test_a_server_that_is_busy_once_is_asked_again(settings, listener):
    found = boundaries("Larvotto", settings=settings("once"), progress=listener)
    assert found["osm_id"].iloc[0] == "R5986437"
    assert any("is busy (HTTP 429); asking again" in text for text in listener.said)


def test_a_busy_server_is_asked_three_times_and_no_more(settings, server):
    before = len(server.log)
    with pytest.raises(ServiceError, match="429"):
        boundaries("Larvotto", settings=settings("429"))
    assert len(server.log) - before == 3


@pytest.mark.parametrize(
    ("url", "sentence"),
    [
        ("http://127.0.0.1:9/", "refused the connection.*(settings|file)"),
        ("http://no-such-host.invalid/", r"its name is not known here \(DNS\).*Check the spelling"),
        ("http://127.0.0.1:99999/", "an address, or a proxy, that cannot be used"),
        ("https://127.0.0.1:{port}/", "certificate|cannot be reached"),
    ],
)
def test_no_service_there(url, sentence, server):
    url = url.format(port=server.server_port)
    given = OsmSettings(nominatim_url=url, overpass_url=url, timeout=5, rate_limit=False)
    start = time.monotonic()
    with pytest.raises(ServiceError, match=sentence) as caught:
        boundaries("Larvotto", settings=given)
    assert time.monotonic() - start < 6
    check_sentence(caught.value, url)


def test_a_proxy_that_is_not_there_is_named_without_its_password():
    given = OsmSettings(
        nominatim_url="http://nominatim.invalid/", proxy="http://me:secret@127.0.0.1:9", timeout=5
    )
    with pytest.raises(ServiceError, match=r"the proxy http://127\.0\.0\.1:9") as caught:
        boundaries("Larvotto", settings=given)
    assert "secret" not in str(caught.value)


def test_requests_to_this_computer_never_go_through_the_proxy(settings):
    found = boundaries("Larvotto", settings=settings(proxy="http://127.0.0.1:9"))
    assert len(found)


def test_credentials_are_not_shown():
    assert without_credentials("https://a:b@host:1/path?q=1") == "https://host:1/path?q=1"
    assert without_credentials("host/path") == "host/path"


@pytest.mark.parametrize("kind", ["hang", "drip", "429"])
def test_cancelled_within_a_second_while_a_request_hangs(settings, kind, listener):
    listener.seconds = 0.3
    slow = settings(kind, timeout=30.0, rate_limit=kind == "429")
    start = time.monotonic()
    with pytest.raises(CancelledError):
        boundaries("Larvotto", settings=slow, progress=listener)
    assert time.monotonic() - start < allowed(1.3)
    assert time.monotonic() - listener.cancelled_at < allowed(1.0)


def test_a_request_that_is_left_alone_ends(settings, listener):
    before = set(threading.enumerate())
    listener.seconds = 0.2
    with pytest.raises(CancelledError):
        boundaries("Larvotto", settings=settings("hang", timeout=0.6), progress=listener)
    mine = [t for t in threading.enumerate() if t.name == "platwright-osm" and t not in before]
    assert len(mine) == 1
    mine[0].join(3.0)  # its socket waits no longer than the request may
    assert not mine[0].is_alive()


def test_at_most_one_request_a_second(settings, server):
    given = settings(rate_limit=True)
    start = time.monotonic()
    transport = Transport(given)
    for number in range(3):
        transport.nominatim("lookup", {"format": "json", "osm_ids": f"R{number + 1}"})
    assert transport.requests_sent == 3
    assert time.monotonic() - start >= 2.0


def test_the_name_of_the_program_is_sent(settings, server):
    boundaries("Larvotto", settings=settings(user_agent="Tester 1"))
    assert server.log[-1][1]["User-Agent"] == "Tester 1"


@pytest.mark.parametrize(
    ("status", "seconds"),
    [
        ("2 slots available now.", 0),
        ("Slot available after: 2026-01-01T12:00:00Z, in 14 seconds.\n"
         "Slot available after: 2026-01-01T12:00:09Z, in 23 seconds.", 14),
        ("Slot available after: 2026-01-01T12:00:00Z, in -1 seconds.", 0),
        ("<html>", 0),
        ("", 0),
    ],
)  # fmt: skip
def test_how_long_overpass_asks_to_wait(status, seconds):
    assert seconds_to_slot(status) == seconds


# The cache.


def test_answers_are_kept_and_work_offline(settings, server, tmp_path):
    online = settings(cache_folder=tmp_path)
    first = boundaries("Larvotto", settings=online)
    before = len(server.log)
    offline = settings(cache_folder=tmp_path, only_cache=True)
    again = boundaries("Larvotto", settings=offline)
    assert len(server.log) == before
    assert again.drop(columns="geometry").equals(first.drop(columns="geometry"))
    assert again.attrs["osm"]["date"] == "2023-12-26"


def test_that_nothing_is_there_is_asked_again(settings, server, tmp_path):
    """It may be on the map by now; offline the kept answer is all there is."""
    transport = Transport(settings(cache_folder=tmp_path))
    offline = Transport(settings(cache_folder=tmp_path, only_cache=True))
    query = "[out:json];node(1);out;"
    for _ in range(2):
        before = len(server.log)
        assert transport.nominatim("search", {"q": "Nowhere at all"}) == []
        assert transport.overpass(query)["elements"] == []
        assert len(server.log) == before + 2
    assert offline.nominatim("search", {"q": "Nowhere at all"}) == []
    assert offline.overpass(query)["elements"] == []
    assert len(server.log) == before + 2


def test_that_nothing_is_there_is_believed_where_the_server_is_silent(
    settings, server, tmp_path, monkeypatch
):
    """So that the layers of an area come from the cache when the network is down."""
    query = "[out:json];node(1);out;"
    given = settings(cache_folder=tmp_path)
    Transport(given).overpass(query)
    monkeypatch.setattr(server.overpass, "answer", lambda _: "no data")
    assert Transport(given).overpass(query)["elements"] == []
    with pytest.raises(ServiceError):
        Transport(given).overpass("[out:json];node(2);out;")


def test_that_answers_are_kept_ones_is_told_once(settings, tmp_path, listener):
    given = settings(cache_folder=tmp_path)
    boundaries("Larvotto", settings=given, progress=listener)
    assert not any("earlier" in text for text in listener.said)
    for answer in tmp_path.iterdir():
        os.utime(answer, (1_600_000_000, 1_600_000_000))
    boundaries("Larvotto", settings=given, progress=listener)
    (told,) = [text for text in listener.said if "earlier" in text]
    assert "2020-09-13" in told
    assert str(tmp_path) in told


@pytest.mark.parametrize("proxy", ["", "http://127.0.0.1:9"])
def test_certificates_and_proxy_of_the_environment(settings, monkeypatch, tmp_path, proxy):
    """A firm that looks into the traffic names its own certificates there."""
    sent = []

    def send(_, request, **more):
        sent.append((more["proxies"].get("https"), more["verify"]))
        raise requests.exceptions.ConnectionError

    monkeypatch.setattr(requests.adapters.HTTPAdapter, "send", send)
    monkeypatch.setenv("REQUESTS_CA_BUNDLE", str(tmp_path))
    monkeypatch.setenv("HTTPS_PROXY", "http://of.environment:1")
    given = settings(nominatim_url="https://nominatim.example/", proxy=proxy)
    with pytest.raises(ServiceError):
        Transport(given).nominatim("search", {"q": "x"})
    assert sent == [(proxy or "http://of.environment:1", str(tmp_path))]


def test_offline_and_never_asked(settings, tmp_path):
    with pytest.raises(ServiceError, match=r"the settings say offline.*no answer.*local .osm"):
        boundaries("Larvotto", settings=settings(cache_folder=tmp_path, only_cache=True))


BAD_FILES = {
    "half": b'[{"osm_id": 1, "osm_t',
    "binary": bytes(range(256)),
    "empty": b"",
    "another kind": b'{"version": 0.6, "elements": []}',
    "list of numbers": b"[1, 2, 3]",
}


@pytest.mark.parametrize("content", BAD_FILES.values(), ids=BAD_FILES)
def test_a_corrupted_cache(settings, tmp_path, listener, content):
    boundaries("Larvotto", settings=settings(cache_folder=tmp_path))
    (answer,) = [f for f in tmp_path.glob("*.json") if "licence" in f.read_text(encoding="utf-8")]
    whole = json.loads(answer.read_text(encoding="utf-8"))
    answer.write_bytes(content)
    with pytest.raises(ServiceError, match=rf"{answer.name}.*Delete that file"):
        boundaries("Larvotto", settings=settings(cache_folder=tmp_path, only_cache=True))
    found = boundaries("Larvotto", settings=settings(cache_folder=tmp_path), progress=listener)
    assert len(found)
    assert any(str(answer) in text and "asked for again" in text for text in listener.warnings)
    assert json.loads(answer.read_text(encoding="utf-8")) == whole


def test_a_cache_folder_that_cannot_be_made(settings, tmp_path, listener):
    (tmp_path / "file").write_text("no folder")
    given = settings(cache_folder=tmp_path / "file")
    assert len(boundaries("Larvotto", settings=given, progress=listener))
    assert any("cannot be kept in" in text for text in listener.warnings)


def test_a_failed_write_leaves_nothing(tmp_path):
    cache = AnswerCache(tmp_path)
    with pytest.raises(TypeError):
        cache.write("http://x", {"a": object()})
    assert list(tmp_path.iterdir()) == []


def test_names_of_files_are_those_of_osmnx(shared_data):
    request = (
        "https://nominatim.openstreetmap.org/search?"
        "format=json&polygon_geojson=1&dedupe=0&limit=50&q=Monaco"
    )
    path = AnswerCache(shared_data / "osmnx_cache").path(request)
    assert path.name == "c229000b41b163c7d643397a0ee62bf332c16826.json"
    assert path.is_file()


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"overpass_url": "overpass-api.de/api"}, "Overpass service is no web address"),
        ({"nominatim_url": "ftp://x"}, "Nominatim service is no web address"),
        ({"timeout": 0.0}, "timeout .* is 0"),
        ({"timeout": float("inf")}, "timeout .* is inf"),
        ({"max_query_area": -1.0}, "largest area"),
        ({"only_cache": True}, "Working offline needs the folder"),
        ({"user_agent": " "}, "demand the name of the program"),
    ],
)
def test_settings_that_cannot_work(given, text):
    with pytest.raises(InputError, match=text):
        OsmSettings(**given)


# Files.


@pytest.mark.parametrize("name", ["half.osm.pbf", "noise.osm.pbf", "half.osm", "empty.osm"])
def test_a_corrupted_file(tmp_path, extract, name):
    data = {
        "half.osm.pbf": extract.read_bytes()[:50_000],
        "noise.osm.pbf": bytes(range(256)) * 40,
        "half.osm": b"<osm version='0.6'><node id='1' lat='1' lon='2'/><way id='2'>",
        "empty.osm": b"",
    }[name]
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(InputError, match=name):
        boundaries("Larvotto", source=path)


def test_a_file_is_read_cancellably(extract, listener):
    listener.seconds = 0.0
    with pytest.raises(CancelledError):
        boundaries("Larvotto", source=extract, progress=listener)
