"""Runs of the real `qgis_process`, where the traps are that a plain Python never shows."""

from __future__ import annotations

import os
import pty
import re
import select
import shutil
import signal
import subprocess
import sysconfig
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
# Debian 12's `qgis_process` is a broken wrapper of this.
PROGRAM = shutil.which("qgis_process.bin") or shutil.which("qgis_process")
pytestmark = [
    pytest.mark.qgis,
    pytest.mark.skipif(PROGRAM is None, reason="qgis_process is not installed"),
]

from support import X, Y  # noqa: E402


@pytest.fixture(scope="module")
def environment(plugin_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment of a profile of its own, with the plugin switched on."""
    home = tmp_path_factory.mktemp("profile")
    (home / "runtime").mkdir(mode=0o700)
    made = {
        **{k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")},
        "QGIS_PLUGINPATH": str(plugin_folder),
        "QGIS_CUSTOM_CONFIG_PATH": str(home),
        "QT_QPA_PLATFORM": "offscreen",
        "XDG_RUNTIME_DIR": str(home / "runtime"),
        "PLATWRIGHT_DEPS": sysconfig.get_paths()["purelib"],
        "OMP_NUM_THREADS": "1",
    }
    enable = [str(PROGRAM), "plugins", "enable", next(plugin_folder.iterdir()).name]
    subprocess.run(enable, env=made, check=True, capture_output=True, timeout=60)
    return made


@pytest.fixture(scope="module")
def qgis_process(environment: dict[str, str]) -> Callable[..., str]:
    """Run `qgis_process` and return all that it said; never a traceback."""

    def run(*words: str, timeout: float = 100, **extra: str) -> str:
        done = subprocess.run(
            [str(PROGRAM), *words],
            env={**environment, **extra},
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
        )
        said = done.stdout + done.stderr
        assert "Traceback" not in said, said
        assert done.returncode >= 0, f"killed by signal {-done.returncode}:\n{said}"
        return said

    return run


def tool(name: str, **parameters: Any) -> list[str]:
    return ["run", f"platwright:{name}", *(f"--{k}={v}" for k, v in parameters.items())]


def rows(path: Path | str) -> list[dict[str, Any]]:
    """Read a file back: small outputs may be unreadable though the run looked well."""
    from qgis.core import QgsVectorLayer

    made = QgsVectorLayer(str(path), "made", "ogr")
    assert made.isValid(), path
    names = [f.name() for f in made.fields()]
    return [
        {**dict(zip(names, f.attributes())), "geometry": f.geometry()} for f in made.getFeatures()
    ]


@pytest.fixture(scope="module")
def sample(root: Path) -> Path:
    return root / "data" / "helsinki" / "helsinki_yard.gpkg"


@pytest.fixture
def big_site(tmp_path: Path) -> Path:
    """Make a site of a square kilometre."""
    ring = [[X, Y], [X + 1000, Y], [X + 1000, Y + 1000], [X, Y + 1000], [X, Y]]
    crs = '{"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3067"}}'
    path = tmp_path / "big.geojson"
    path.write_text(
        '{"type": "FeatureCollection", "crs": ' + crs + ', "features": [{"type": "Feature",'
        '"properties": {}, "geometry": {"type": "Polygon", "coordinates": [' + str(ring) + "]}}]}"
    )
    return path


def test_parcels_and_land_use_are_measured(qgis_process, big_site, tmp_path):
    files = {key: tmp_path / f"{key.lower()}.gpkg" for key in ("OUTPUT", "HISTOGRAM", "PROBLEMS")}
    page = tmp_path / "page.html"
    said = qgis_process(*tool("measureparcels", INPUT=big_site, HISTOGRAM_HTML=page, **files))
    assert "Number of parcels: 1" in said
    (row,) = rows(files["OUTPUT"])
    assert row["p_area"] == pytest.approx(1)
    assert row["frontage_m"] == pytest.approx(4000)
    assert sum(r["count"] for r in rows(files["HISTOGRAM"]) if r["measure"] == "p_angle") == 1
    assert "<svg" in page.read_text(encoding="utf-8")
    table = tmp_path / "shares.gpkg"
    said = qgis_process(*tool("measurelanduse", INPUT=big_site, OUTPUT=table))
    assert "Share of parcels (%): 100" in said
    assert [r["land_use"] for r in rows(table)] == ["streets", "parcels", "parks", "other", "all"]


def test_streets_are_measured(qgis_process, sample, tmp_path):
    """With the packages bound to their own libraries beside those of QGIS."""
    files = {key: tmp_path / f"{key.lower()}.gpkg" for key in ("OUTPUT", "JUNCTIONS", "PROBLEMS")}
    natural = tmp_path / "natural.gpkg"
    given = f"{sample}|layername=streets"
    said = qgis_process(*tool("measurestreets", INPUT=given, NATURAL_STREETS=natural, **files))
    assert "Number of segments" in said
    streets = rows(files["OUTPUT"])
    assert len(streets) == len(rows(given))
    assert all(row["length_m"] > 0 for row in streets)
    ids = {row["natural_id"] for row in rows(natural)}
    assert {row["natural_id"] for row in streets} <= ids
    kinds = {row["kind"] for row in rows(files["JUNCTIONS"])}
    assert {"T", "dead end"} <= kinds


def test_the_tools_are_listed_and_explained(qgis_process):
    said = qgis_process("list")
    for name in ("preparesite", "candidatemesh", "designstreets", "validatenetwork"):
        assert f"platwright:{name}" in said
    said = qgis_process("help", "platwright:designstreets")
    assert "Block width (m)" in said
    assert "TOTAL_LENGTH" in said


def test_without_any_package_the_tools_are_listed_and_say_what_is_missing(qgis_process, sample):
    bare = {"PLATWRIGHT_DEPS": "", "PYTHONNOUSERSITE": "1"}
    said = qgis_process("list", **bare)
    assert "platwright:designstreets" in said
    system = subprocess.run(
        ["/usr/bin/python3", "-c", "import geopandas, pulp"], capture_output=True, check=False
    )
    if system.returncode == 0:
        pytest.skip("QGIS's own Python has the packages")
    said = qgis_process(
        *tool("designstreets", INPUT=f"{sample}|layername=site", STREETS="TEMPORARY_OUTPUT"), **bare
    )
    assert "Python packages that were not found" in said
    assert "geopandas" in said


def test_the_sample_is_designed_and_validated(qgis_process, sample, tmp_path: Path):
    plan = {
        key: f"ogr:dbname='{tmp_path / 'plan.gpkg'}' table=\"{key.lower()}\" (geom)"
        for key in ("STREETS", "JUNCTIONS", "BLOCKS", "PROBLEMS")
    }
    said = qgis_process(
        *tool(
            "designstreets",
            INPUT=f"{sample}|layername=site",
            ROADS=f"{sample}|layername=streets",
            OBSTACLES=f"{sample}|layername=obstacles",
            TIME_LIMIT=8,
            **plan,
        )
    )
    assert re.search(r"Best design [\d.]+, bound [\d.]+, gap [\d.]+ %", said)
    numbers = dict(re.findall(r"^([A-Z_]+):\t(-?[\d.e+-]+)$", said, re.MULTILINE))
    assert float(numbers["TOTAL_LENGTH"]) > 500
    assert float(numbers["BOUND"]) <= float(numbers["OBJECTIVE"]) + 1e-6
    streets = rows(f"{tmp_path / 'plan.gpkg'}|layername=streets")
    made = sum(s["length_m"] for s in streets if s["status"] == "new")
    assert made == pytest.approx(float(numbers["TOTAL_LENGTH"]), rel=0.01)
    assert rows(f"{tmp_path / 'plan.gpkg'}|layername=blocks")
    assert rows(f"{tmp_path / 'plan.gpkg'}|layername=junctions")
    said = qgis_process(
        *tool(
            "validatenetwork",
            INPUT=f"{tmp_path / 'plan.gpkg'}|layername=streets",
            SITE=f"{sample}|layername=site",
            PROBLEMS=tmp_path / "found.gpkg",
        )
    )
    assert re.search(r"^VIOLATIONS:\t0$", said, re.MULTILINE), rows(tmp_path / "found.gpkg")
    rows(tmp_path / "found.gpkg")


def test_the_streets_of_the_sample_are_smoothed(qgis_process, sample, tmp_path: Path):
    said = qgis_process(
        *tool(
            "smoothstreets",
            INPUT=f"{sample}|layername=streets",
            OBSTACLES=f"{sample}|layername=obstacles",
            SHAPE="straight",
            MAX_MOVE=5,
            STREETS=tmp_path / "smooth.gpkg",
            PROBLEMS=tmp_path / "found.gpkg",
        )
    )
    numbers = dict(re.findall(r"^([A-Z_0-9]+):\t(-?[\d.e+-]+)$", said, re.MULTILINE))
    assert float(numbers["ANGLE_AFTER"]) < float(numbers["ANGLE_BEFORE"])
    assert float(numbers["BENDS_AFTER"]) < float(numbers["BENDS_BEFORE"])
    assert 1 < float(numbers["LARGEST_MOVE"]) <= 5.01
    before, after = rows(f"{sample}|layername=streets"), rows(tmp_path / "smooth.gpkg")
    own = [key for key in before[0] if key not in ("geometry", "fid")]
    assert [[s[key] for key in own] for s in after] == [[s[key] for key in own] for s in before]
    assert max(s["moved_m"] for s in after) == pytest.approx(float(numbers["LARGEST_MOVE"]))
    rows(tmp_path / "found.gpkg")


def test_step_by_step(qgis_process, sample, tmp_path: Path):
    """Prepare, mesh and design, each from the files of the step before."""
    qgis_process(
        *tool(
            "preparesite",
            INPUT=f"{sample}|layername=site",
            ROADS=f"{sample}|layername=streets",
            SITE=tmp_path / "site.gpkg",
            BOUNDARY_STREETS=tmp_path / "boundary.gpkg",
            ACCESS_POINTS=tmp_path / "access.gpkg",
        )
    )
    (ground,) = rows(tmp_path / "site.gpkg")
    assert ground["area_ha"] == pytest.approx(11.4, abs=0.3)
    assert rows(tmp_path / "boundary.gpkg")
    assert rows(tmp_path / "access.gpkg")
    qgis_process(
        *tool(
            "candidatemesh",
            INPUT=tmp_path / "site.gpkg",
            ACCESS_POINTS=tmp_path / "access.gpkg",
            EDGES=tmp_path / "edges.gpkg",
            FACES=tmp_path / "faces.geojson",
        )
    )
    assert rows(tmp_path / "faces.geojson")
    edges = rows(tmp_path / "edges.gpkg")
    said = qgis_process(
        *tool(
            "designstreets",
            INPUT=tmp_path / "site.gpkg",
            ROADS=tmp_path / "boundary.gpkg",
            MESH_EDGES=tmp_path / "edges.gpkg",
            TIME_LIMIT=5,
            STREETS=tmp_path / "streets.gpkg",
        )
    )
    assert "ERROR" not in said
    streets = [s for s in rows(tmp_path / "streets.gpkg") if s["status"] == "new"]
    assert 0 < len(streets) <= len(edges)


def test_an_unwritable_output_is_told_before_the_run(qgis_process, sample):
    said = qgis_process(
        *tool("preparesite", INPUT=f"{sample}|layername=site", SITE="/nowhere/at/all/site.gpkg")
    )
    assert "Output 'Site': there is no folder /nowhere/at/all" in said
    assert "Preparing" not in said


def test_contradictions_are_told_before_the_run(qgis_process, sample):
    said = qgis_process(
        *tool(
            "designstreets",
            INPUT=f"{sample}|layername=site",
            BLOCK_WIDTH=300,
            STREETS="TEMPORARY_OUTPUT",
        )
    )
    assert "Block length (150 m) is less than block width (300 m)" in said


def interrupted(environment, words, cue, patience=60.0):
    """Start a run, send SIGINT once `cue` is in what it says; return all it said and seconds."""
    # A terminal, since the program keeps its lines back from anything else.
    ear, mouth = pty.openpty()
    process = subprocess.Popen([str(PROGRAM), *words], env=environment, stdout=mouth, stderr=mouth)
    os.close(mouth)
    said, began, sent = "", time.monotonic(), None
    try:
        while process.poll() is None or select.select([ear], [], [], 0)[0]:
            assert time.monotonic() - began < patience, said
            if not select.select([ear], [], [], 0.2)[0]:
                continue
            try:
                said += os.read(ear, 4096).decode(errors="replace")
            except OSError:  # the other end is closed
                break
            if sent is None and cue in said:
                process.send_signal(signal.SIGINT)
                sent = time.monotonic()
        process.wait(timeout=10)
    finally:
        os.close(ear)
        if process.poll() is None:
            process.kill()
            process.wait()
    assert sent is not None, said
    assert process.returncode == 0, said
    assert "Traceback" not in said
    return said, time.monotonic() - sent


@pytest.mark.parametrize("cue", ["Best design", "Local streets"])
def test_an_interrupt_keeps_the_best_design(environment, big_site, tmp_path: Path, cue):
    words = tool(
        "designstreets", INPUT=big_site, TIME_LIMIT=90, GAP=0, STREETS=tmp_path / "streets.gpkg"
    )
    said, seconds = interrupted(environment, words, cue)
    assert re.search(r"Cancelled.* gap is [\d.]+ %", said), said
    assert [s for s in rows(tmp_path / "streets.gpkg") if s["status"] == "new"]
    assert seconds < 10


def test_an_interrupt_before_there_is_a_design_leaves_no_file(environment, big_site, tmp_path):
    words = tool("designstreets", INPUT=big_site, STREETS=tmp_path / "streets.gpkg")
    said, seconds = interrupted(environment, words, "Reading big")
    assert "no layer was written" in said
    assert not (tmp_path / "streets.gpkg").exists()
    assert seconds < 10
