"""The local server as a program, as tutorials and models start it."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest
import server as program_file
from platwright.osm import OsmSettings, boundaries

#: Latitudes and longitudes of a rectangle around L'Anse du Portier.
WINDOW = "43.74 7.42 43.74 7.44 43.75 7.44 43.75 7.42"


@pytest.mark.parametrize("before", ["", "trap '' INT; "], ids=["plainly", "in the background"])
def test_the_program_serves_until_it_is_interrupted(before):
    # What a shell starts in the background inherits that interrupts are ignored.
    shell = ["sh", "-c", f'{before}exec "$@"', "sh"]
    words = [*shell, sys.executable, str(Path(program_file.__file__)), "--port", "0"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as program:
        try:
            said = program.stdout.readline() + program.stdout.readline()
            found = dict(re.findall(r"^(Nominatim|Overpass): +(\S+)$", said, re.MULTILINE))
            given = OsmSettings(
                nominatim_url=found["Nominatim"], overpass_url=found["Overpass"], rate_limit=False
            )
            assert boundaries("Larvotto", settings=given)["osm_id"].iloc[0] == "R5986437"
            with urllib.request.urlopen(f"{found['Overpass']}/status", timeout=5) as page:  # noqa: S310
                assert b"slots available now" in page.read()
        finally:
            program.send_signal(signal.SIGINT)
            try:
                rest, _ = program.communicate(timeout=20)
            finally:
                program.kill()
        assert rest == "Closed.\n"
        assert program.returncode == 0


@pytest.mark.parametrize(
    ("query", "ids"),
    [
        (f'way["landuse"="construction"]["name"](poly:"{WINDOW}");out ids;', {686693023}),
        ("way['highway'](id:686693023);out;", set()),
        ("way['landuse'](id:686693023);out;", {686693023}),
        ("way['landuse'!~'^c'](id:686693023);out;", set()),
        ("way['nothing'!~'x'](id:686693023);out;", {686693023}),
        ("""way[~"^land"~"struct"](686693023);out;""", {686693023}),
        ("relation(1);out;", set()),
    ],
)  # fmt: skip
def test_filters_mean_what_they_mean_in_overpass(server, query, ids):
    found = {e["id"] for e in server.overpass.answer(f"[out:json];{query}")["elements"]}
    assert ids <= found
    assert bool(found) == bool(ids)


def test_down_from_a_relation_to_its_points(server):
    elements = server.overpass.answer("[out:json];(relation(5986437);>;);out;")["elements"]
    kinds = [e["type"] for e in elements]
    assert kinds.count("relation") == 1
    ways = [e for e in elements if e["type"] == "way"]
    points = {e["id"] for e in elements if e["type"] == "node"}
    assert ways
    assert all(set(way["nodes"]) <= points for way in ways)
