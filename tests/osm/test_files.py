"""Local OpenStreetMap files: what is read, and what is said of files that cannot be read."""

from __future__ import annotations

import bz2
import datetime
import gzip
import importlib
import sys
from pathlib import Path

import numpy as np
import osmium
import pytest
import shapely
from clock import allowed
from platwright.errors import CancelledError, InputError, MissingDependencyError
from platwright.osm import files
from platwright.osm.ground import area_ha

XML = """<?xml version="1.0"?><osm version="0.6">
{nodes}
<way id="10"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="4"/><nd ref="1"/>
  <tag k="landuse" v="residential"/><tag k="name" v="Hill"/><tag k="name:de" v="Hügel"/>
  <tag k="alt_name" v="Mount;The Hill"/></way>
<way id="11"><nd ref="1"/><nd ref="2"/><nd ref="3"/><tag k="highway" v="residential"/></way>
<way id="12"><nd ref="1"/><nd ref="2"/><nd ref="3"/></way>
<way id="13"><nd ref="3"/><nd ref="4"/><nd ref="1"/></way>
<relation id="20"><member type="way" ref="12" role="outer"/>
  <member type="way" ref="13" role="outer"/>
  <tag k="type" v="boundary"/><tag k="boundary" v="administrative"/><tag k="admin_level" v="8"/>
</relation>
<relation id="21"><member type="way" ref="12" role="outer"/>
  <member type="way" ref="99" role="outer"/>
  <tag k="type" v="boundary"/><tag k="boundary" v="administrative"/><tag k="name" v="Cut off"/>
</relation>
</osm>"""
#: The corners of a square of .01 degrees.
CORNERS = {1: (7.0, 50.0), 2: (7.01, 50.0), 3: (7.01, 50.01), 4: (7.0, 50.01)}


def xml(corners: dict[int, tuple[float, float]] = CORNERS) -> bytes:
    nodes = "\n".join(f'<node id="{k}" lon="{x}" lat="{y}"/>' for k, (x, y) in corners.items())
    return XML.format(nodes=nodes).encode()


@pytest.mark.parametrize("name", ["a.osm", "a.osm.gz", "a.osm.bz2", "A.OSM"])
def test_every_form_is_read_alike(tmp_path, name):
    pack = {".gz": gzip.compress, ".bz2": bz2.compress}.get(Path(name).suffix, bytes)
    (tmp_path / name).write_bytes(pack(xml()))
    found = files.read_boundaries(tmp_path / name).set_index("osm_id")
    assert list(found.columns) == ["name", "names", "kind", "admin_level", "place", "geometry"]
    assert set(found.index) == {"W10", "R20"}, "the boundary that is cut off is no polygon"
    assert found.crs.to_epsg() == 4326
    square = shapely.box(7.0, 50.0, 7.01, 50.01)
    assert all(shapely.equals(found.geometry.to_numpy(), square))
    hill = found.loc["W10"]
    assert (hill["name"], hill["kind"], hill["place"]) == ("Hill", "residential", None)
    assert hill["names"] == "Hügel;Mount;The Hill"
    unnamed = found.loc["R20"]
    assert (unnamed["name"], unnamed["names"]) == (None, None)
    assert (unnamed["kind"], unnamed["admin_level"]) == ("administrative", "8")


def test_crossed_rings_are_repaired(tmp_path):
    bow_tie = {**CORNERS, 3: CORNERS[4], 4: CORNERS[3]}
    (tmp_path / "a.osm").write_bytes(xml(bow_tie))
    found = files.read_boundaries(tmp_path / "a.osm")
    assert found.is_valid.all()


def test_the_shipped_extract(extract):
    found = files.read_boundaries(extract)
    assert found.is_valid.all()
    assert not found.geometry.is_empty.any()
    wards = found[found["admin_level"] == "10"]
    assert {"Larvotto", "Monte-Carlo", "La Rousse", "Fontvieille"} <= set(wards["name"])
    site = found[found["osm_id"] == "W686693023"].iloc[0]
    assert (site["name"], site["kind"]) == ("L'Anse du Portier", "construction")
    assert area_ha(site["geometry"]) == pytest.approx(6.6, abs=0.05)


def test_its_date(extract):
    assert files.file_info(extract).date == datetime.date(2023, 12, 26)


def test_a_file_without_a_header(tmp_path):
    (tmp_path / "a.osm").write_bytes(xml())
    assert files.file_info(tmp_path / "a.osm") == files.FileInfo(None, None)


BAD = {
    "half.osm.pbf": lambda good: good[: len(good) // 2],
    "holed.osm.pbf": lambda good: good[:30000] + b"\0" * 500 + good[30500:],
    "page.osm.pbf": lambda _: b"<html>Please log in</html>" * 50,
    "noise.pbf": lambda _: bytes(np.random.default_rng(1).integers(0, 256, 5000, np.uint8)),
    "page.osm": lambda _: b"<html><body>Please log in</body></html>",
    "half.osm": lambda _: xml()[:300],
    "word.osm": lambda _: b'<osm version="0.6"><node id="1" lat="abc" lon="2"/></osm>',
    "old.osm": lambda _: b'<osm version="0.5"></osm>',
    "json.osm": lambda _: b'{"elements": []}',
    "plain.osm.gz": lambda _: b"not packed",
    "plain.osm.bz2": lambda _: b"not packed",
}


@pytest.mark.parametrize("name", BAD)
def test_damaged_files(tmp_path, extract, name):
    path = tmp_path / name
    path.write_bytes(BAD[name](extract.read_bytes()))
    with pytest.raises(InputError, match="damaged, not complete") as error:
        files.read_boundaries(path)
    assert name in str(error.value)
    assert "Download it again" in str(error.value)
    assert str(tmp_path) not in str(error.value)


def test_files_that_are_none(tmp_path):
    with pytest.raises(InputError, match="There is no file"):
        files.check_file(tmp_path / "nowhere.osm")
    with pytest.raises(InputError, match="is a folder"):
        files.check_file(tmp_path)
    (tmp_path / "a.shp").write_bytes(b"x")
    with pytest.raises(InputError, match=r"ends in \.osm\.pbf"):
        files.check_file(tmp_path / "a.shp")
    (tmp_path / "a.osm").write_bytes(b"")
    with pytest.raises(InputError, match="is empty"):
        files.check_file(tmp_path / "a.osm")


def test_a_file_that_is_too_large(tmp_path, monkeypatch):
    (tmp_path / "a.osm").write_bytes(xml())
    monkeypatch.setattr(files, "LARGEST", 100)
    with pytest.raises(InputError, match="too large") as error:
        files.read_boundaries(tmp_path / "a.osm")
    assert "osmium extract" in str(error.value)


def test_without_the_package(tmp_path, monkeypatch):
    (tmp_path / "a.osm").write_bytes(xml())
    monkeypatch.setitem(sys.modules, "osmium", None)
    with pytest.raises(MissingDependencyError, match="osmium"):
        files.read_boundaries(tmp_path / "a.osm")


def test_a_file_without_areas(tmp_path, listener):
    (tmp_path / "a.osm").write_bytes(b'<osm version="0.6"></osm>')
    assert len(files.read_boundaries(tmp_path / "a.osm", listener)) == 0
    assert "no complete boundary" in listener.said[-1]


@pytest.mark.slow
def test_cancel_is_heard_within_a_second(tmp_path, listener):
    """In a file of a million points, at any time."""
    import time

    # XML takes longer to read than PBF; some have tags, as in real files
    path = tmp_path / "large.osm"
    with osmium.SimpleWriter(str(path)) as writer:
        for k in range(1, 1_000_001):
            place = (7 + (k % 1000) * 1e-4, 50 + (k // 1000) * 1e-4)
            tags = {"amenity": "bench"} if k % 20 == 0 else {}
            writer.add_node(osmium.osm.mutable.Node(id=k, location=place, tags=tags))
    # by questions and not by the clock: a second reading may be many times as fast as the first
    for questions in (0, 1, 2):
        listener = type(listener)(questions=questions)
        with pytest.raises(CancelledError):
            files.read_boundaries(path, listener)
        assert time.monotonic() - listener.cancelled_at < allowed(1.0)


@pytest.mark.parametrize(
    ("package", "load"),
    [
        ("osmium", "shapes.load_osmium"),
        ("osmnx", "session.load_osmnx"),
        ("requests", "transport.load_requests"),
    ],
)
def test_a_missing_package_names_the_way_out_in_qgis_and_out_of_it(monkeypatch, package, load):
    module, name = load.split(".")
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingDependencyError) as caught:
        getattr(importlib.import_module(f"platwright.osm.{module}"), name)()
    assert f"package {package}" in str(caught.value)
    assert "Settings > Options > Platwright" in str(caught.value)
    assert "pip install" in str(caught.value)
