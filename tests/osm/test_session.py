"""osmnx under control: our requests, our patience, and nothing of it left behind."""

from __future__ import annotations

import socket
import threading
import time

import pytest
import shapely
from clock import allowed
from platwright.errors import CancelledError, MissingDependencyError, ServiceError
from platwright.osm import session
from platwright.osm.session import with_osmnx

pytest.importorskip("osmnx")
import osmnx
from osmnx import _nominatim, _overpass

LARVOTTO = shapely.box(7.428, 43.741, 7.436, 43.746)


def state():
    names = [name for name in vars(osmnx.settings) if not name.startswith("_")]
    return (
        {name: getattr(osmnx.settings, name) for name in names},
        _overpass._overpass_request,
        _nominatim._nominatim_request,
        socket.getaddrinfo,
    )


@pytest.fixture(autouse=True)
def nothing_left_behind():
    before = state()
    yield
    assert state() == before


def drive(ox, _):
    return ox.graph_from_polygon(LARVOTTO, network_type="drive", retain_all=True)


def test_a_street_network(settings, server, listener):
    before = len(server.log)
    graph = with_osmnx(drive, settings(), listener)
    assert graph.number_of_nodes() > 30
    assert all("highway" in data for _, _, data in graph.edges(data=True))
    assert len(server.log) == before + 1


def test_features(settings):
    found = with_osmnx(
        lambda ox, _: ox.features_from_polygon(LARVOTTO, {"building": True}), settings()
    )
    assert len(found) > 50
    assert set(found.geom_type) <= {"Polygon", "MultiPolygon", "Point"}


def test_a_place_through_osmnx_itself(settings):
    found = with_osmnx(lambda ox, _: ox.geocode_to_gdf("Larvotto"), settings())
    assert found["osm_id"].tolist() == [5986437]


def test_the_date_of_the_data_is_known(settings):
    def work(ox, transport):
        drive(ox, transport)
        return transport.date

    assert with_osmnx(work, settings()).isoformat() == "2023-12-26"


def test_options_hold_for_the_call_only(settings):
    options = {"useful_tags_way": ["highway", "layer"]}
    seen = with_osmnx(lambda ox, _: list(ox.settings.useful_tags_way), settings(), options=options)
    assert seen == ["highway", "layer"]
    assert osmnx.settings.useful_tags_way != ["highway", "layer"]


def test_large_areas_are_asked_for_in_pieces(settings, server):
    before = len(server.log)
    with_osmnx(drive, settings(max_query_area=5e5))
    assert len(server.log) - before > 1


def test_answers_are_kept_and_work_offline(settings, server, tmp_path, monkeypatch):
    first = with_osmnx(drive, settings(cache_folder=tmp_path))
    before = len(server.log)
    again = with_osmnx(drive, settings(cache_folder=tmp_path, only_cache=True))
    assert len(server.log) == before
    assert set(first.nodes) == set(again.nodes)
    # What was kept, osmnx reads by itself as well: its own key and its own form. Left alone, some
    # of its versions change how the whole process finds servers.
    monkeypatch.setattr(socket, "getaddrinfo", socket.getaddrinfo)
    osmnx_settings = {name: getattr(osmnx.settings, name) for name in ("cache_folder",)}
    try:
        osmnx.settings.cache_folder = tmp_path
        osmnx.settings.overpass_url = settings().overpass_url
        own = osmnx.graph_from_polygon(LARVOTTO, network_type="drive", retain_all=True)
    finally:
        osmnx.settings.cache_folder = osmnx_settings["cache_folder"]
        osmnx.settings.overpass_url = "https://overpass-api.de/api"
    assert set(own.nodes) == set(first.nodes)
    assert len(server.log) == before


@pytest.mark.parametrize("kind", ["429", "504", "html", "half", "truncated", "remark", "hang"])
def test_failures_come_through_as_sentences(settings, kind):
    start = time.monotonic()
    with pytest.raises(ServiceError, match=r"http://127\.0\.0\.1"):
        with_osmnx(drive, settings(kind, timeout=1.0))
    assert time.monotonic() - start < allowed(2.5)


def test_no_server_and_no_name():
    from platwright.osm import OsmSettings

    for url in ("http://127.0.0.1:9/api", "http://no-such-host.invalid/api"):
        with pytest.raises(ServiceError, match=r"refused the connection|not known here"):
            with_osmnx(drive, OsmSettings(overpass_url=url, timeout=5, rate_limit=False))


def test_cancelled_within_a_second_and_the_next_call_works(settings, listener):
    listener.seconds = 0.3
    start = time.monotonic()
    with pytest.raises(CancelledError):
        with_osmnx(drive, settings("hang", timeout=30), listener)
    assert time.monotonic() - start < allowed(1.3)
    assert with_osmnx(drive, settings()).number_of_nodes() > 30


def test_cancelled_while_osmnx_computes(settings, listener):
    listener.seconds = 0.2
    done = threading.Event()

    def work(*_):
        time.sleep(1.5)
        done.set()

    start = time.monotonic()
    with pytest.raises(CancelledError):
        with_osmnx(work, settings(), listener)
    assert time.monotonic() - start < allowed(1.0)
    # The next call waits until osmnx is free again.
    assert with_osmnx(lambda *_: done.is_set(), settings())


def test_calls_of_several_threads_take_turns(settings):
    inside, most = [], []

    def work(*_):
        inside.append(1)
        most.append(len(inside))
        time.sleep(0.1)
        inside.pop()

    threads = [threading.Thread(target=with_osmnx, args=(work, settings())) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert most == [1, 1, 1]


def test_another_thread_keeps_its_own_osmnx(settings, monkeypatch):
    asked = []
    monkeypatch.setattr(_overpass, "_overpass_request", lambda data: asked.append(data))
    monkeypatch.setattr(
        _nominatim, "_nominatim_request", lambda params, **more: asked.append((params, more))
    )

    def work(*_):
        def of_somebody_else():
            _overpass._overpass_request({"data": "theirs"})
            _nominatim._nominatim_request({"q": "theirs"}, request_type="lookup")

        thread = threading.Thread(target=of_somebody_else)
        thread.start()
        thread.join()
        return _nominatim._nominatim_request({"q": "Nowhere at all"})

    assert with_osmnx(work, settings()) == []
    assert asked == [{"data": "theirs"}, ({"q": "theirs"}, {"request_type": "lookup"})]


def test_a_run_that_waits_for_another_says_so(settings, listener):
    go_on, begun = threading.Event(), threading.Event()

    def work(*_):
        begun.set()
        return go_on.wait(5)

    other = threading.Thread(target=with_osmnx, args=(work, settings()))
    other.start()
    begun.wait(5)
    timer = threading.Timer(0.5, go_on.set)
    timer.start()
    assert with_osmnx(lambda *_: True, settings(), listener)
    other.join()
    (told,) = listener.said
    assert "Another run" in told


def test_an_error_of_the_work_comes_through(settings):
    def work(*_):
        raise LookupError("mine")

    with pytest.raises(LookupError, match="mine"):
        with_osmnx(work, settings())


def test_another_version_of_osmnx_is_refused(monkeypatch):
    monkeypatch.setattr(osmnx, "__version__", "3.0.0")
    with pytest.raises(MissingDependencyError, match=r"osmnx 3\.0\.0 is not known"):
        session.load_osmnx()
