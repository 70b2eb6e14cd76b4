"""The zip as a user gets it: unpacked into a fresh profile, loaded there, and a tool run."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sysconfig
import zipfile
from pathlib import Path

import geopandas as gpd
import pytest

from house import ROOT

PROGRAM = shutil.which("qgis_process.bin") or shutil.which("qgis_process")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.qgis,
    pytest.mark.skipif(PROGRAM is None, reason="qgis_process is not installed"),
]


@pytest.fixture(scope="module")
def profile(tmp_path_factory):
    """Make a profile as 'Install from ZIP' leaves it, its plugin folder not to be written to."""
    home = tmp_path_factory.mktemp("fresh")
    dist, plugins = home / "dist", home / "profiles" / "default" / "python" / "plugins"
    done = subprocess.run(
        [str(ROOT / "scripts" / "package"), str(dist)],
        capture_output=True, text=True, timeout=60, check=True,
    )  # fmt: skip
    with zipfile.ZipFile(done.stdout.strip()) as archive:
        archive.extractall(plugins)
    for path in plugins.rglob("*"):
        path.chmod(0o555 if path.is_dir() else 0o444)
    return home


@pytest.fixture(scope="module")
def qgis_process(profile):
    """Run `qgis_process` with nothing of this tree in sight; return what it says."""
    (profile / "runtime").mkdir(mode=0o700)
    environment = {
        **{k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "QGIS"))},
        "QGIS_CUSTOM_CONFIG_PATH": str(profile),
        "QT_QPA_PLATFORM": "offscreen",
        "XDG_RUNTIME_DIR": str(profile / "runtime"),
        "PLATWRIGHT_DEPS": sysconfig.get_paths()["purelib"],
        "PYTHONDONTWRITEBYTECODE": "1",  # what Python keeps beside the code is its own affair
    }

    def run(*words: str) -> tuple[str, str]:
        done = subprocess.run(
            [str(PROGRAM), *words],
            env=environment, cwd=profile, capture_output=True, text=True, timeout=200, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
        assert "Traceback" not in done.stdout + done.stderr
        return done.stdout, done.stderr

    run("plugins", "enable", "platwright")
    return run


def installed(profile: Path) -> Path:
    """Return the plugin's folder."""
    return profile / "profiles" / "default" / "python" / "plugins" / "platwright"


def test_every_tool_is_there(qgis_process):
    said, _ = qgis_process("--json", "list")
    tools = set(json.loads(said)["providers"]["platwright"]["algorithms"])
    modules = {
        path.stem
        for path in (ROOT / "plugin" / "tools").glob("*.py")
        if f"platwright:{path.stem}" in tools
    }
    assert {"preparesite", "candidatemesh", "designstreets", "validatenetwork"} <= modules
    for tool in sorted(tools):
        described = json.loads(qgis_process("--json", "help", tool)[0])
        assert described["algorithm_details"]["name"]


def test_the_sample_in_the_zip_is_designed(profile, qgis_process):
    sample = installed(profile) / "data" / "helsinki" / "helsinki_yard.gpkg"
    # A GeoPackage needs a place to be written to even for reading.
    copy = Path(shutil.copy(sample, profile / "sample.gpkg"))
    copy.chmod(0o644)
    out = profile / "streets.gpkg"
    said, _ = qgis_process(
        "--json", "run", "platwright:designstreets",
        f"--INPUT={copy}|layername=site", f"--ROADS={copy}|layername=streets",
        f"--OBSTACLES={copy}|layername=obstacles", "--SNAP_DISTANCE=60", "--BLOCK_WIDTH=72",
        "--BLOCK_LENGTH=150", "--TIME_LIMIT=5", f"--STREETS={out}",
    )  # fmt: skip
    results = json.loads(said)["results"]
    streets = gpd.read_file(out, layer="streets")
    new = streets[streets["status"] == "new"]
    assert 500 < new.geometry.length.sum() < 5000  # m on 11 ha
    assert results["TOTAL_LENGTH"] == pytest.approx(new.geometry.length.sum(), rel=0.01)


def test_nothing_was_written_into_the_plugin(profile, qgis_process):
    """On many machines nobody may write there; root may, so the files are compared."""
    qgis_process("list")
    (archive,) = (profile / "dist").glob("*.zip")
    shipped = {
        name.removeprefix("platwright/"): zipfile.ZipFile(archive).read(name)
        for name in zipfile.ZipFile(archive).namelist()
    }
    folder = installed(profile)
    now = {
        p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()
    }
    assert now == shipped
