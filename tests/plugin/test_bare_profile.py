"""A profile without any of our packages: loads, says what is missing, installs offline, runs.

All through the real `qgis_process`, from a folder of wheels that is filled once by pip.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
PROGRAM = shutil.which("qgis_process.bin") or shutil.which("qgis_process")
SYSTEM_PYTHON = "/usr/bin/python3"
pytestmark = [
    pytest.mark.qgis,
    pytest.mark.slow,
    pytest.mark.skipif(PROGRAM is None, reason="qgis_process is not installed"),
    pytest.mark.skipif(not Path(SYSTEM_PYTHON).exists(), reason="no Python of the system"),
]

#: What the necessary packages need beside numpy and scipy, which are those of QGIS.
NAMES = ("geopandas", "shapely", "pyproj", "pyogrio", "pandas", "tzdata", "networkx", "pulp",
         "highspy", "pvlib", "h5py")  # fmt: skip
#: A plugin that says at the end which numpy was used, and whether QGIS's bindings agree with it.
PROBE = """
import atexit, json, os
def tell():
    import numpy
    from osgeo import gdal_array
    with open(os.environ["PROBE_OUT"], "w") as out:
        json.dump({"file": numpy.__file__, "version": numpy.__version__,
                   "gdal": len(gdal_array.codes) > 0}, out)
class Plugin:
    def initProcessing(self):
        from qgis.core import QgsApplication
        QgsApplication.instance().aboutToQuit.connect(tell)
        atexit.register(tell)
    def unload(self):
        pass
def classFactory(iface):
    return Plugin()
"""
PROBE_METADATA = """[general]
name=probe
qgisMinimumVersion=3.0
version=1
author=test
email=a@b.c
description=test
about=test
tracker=https://localhost
repository=https://localhost
hasProcessingProvider=yes
"""


@pytest.fixture(scope="module")
def wheels(root: Path, request: pytest.FixtureRequest) -> Path:
    """Return a folder of wheels in the versions of the constraints, kept between sessions."""
    folder = Path(request.config.cache.mkdir("wheels"))
    pins = dict(
        line.lower().split("==")
        for line in (root / "constraints.txt").read_text("utf-8").splitlines()
        if "==" in line
    )
    there = {tuple(p.name.lower().split("-")[:2]) for p in folder.glob("*.whl")}
    asked = [f"{name}=={pins[name]}" for name in NAMES if (name, pins[name]) not in there]
    if asked:
        for old in folder.glob("*.whl"):
            old.unlink()
        done = subprocess.run(
            [sys.executable, "-m", "pip", "download", "-q", "--no-deps", "--only-binary=:all:",
             "-d", str(folder), *(f"{name}=={pins[name]}" for name in NAMES)],
            capture_output=True, text=True, timeout=200, check=False,
        )  # fmt: skip
        if done.returncode:
            pytest.skip(f"the wheels cannot be downloaded: {done.stderr[-300:]}")
    return folder


@pytest.fixture(scope="module")
def profile(plugin_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> SimpleNamespace:
    """Return a fresh profile that sees the plugin and the probe, and a way to run in it."""
    home = tmp_path_factory.mktemp("bare")
    (home / "runtime").mkdir(mode=0o700)
    plugins = home / "plugins"
    plugins.mkdir()
    ours = next(plugin_folder.iterdir())
    (plugins / ours.name).symlink_to(ours.resolve(), target_is_directory=True)
    (plugins / "probe").mkdir()
    (plugins / "probe" / "__init__.py").write_text(PROBE)
    (plugins / "probe" / "metadata.txt").write_text(PROBE_METADATA)
    kept = {
        k: v
        for k, v in os.environ.items()
        if k not in ("PYTHONPATH", "VIRTUAL_ENV") and not k.startswith(("PIP_", "PLATWRIGHT"))
    }
    environment = {
        **kept,
        "QGIS_PLUGINPATH": str(plugins),
        "QGIS_CUSTOM_CONFIG_PATH": str(home),
        "QT_QPA_PLATFORM": "offscreen",
        "XDG_RUNTIME_DIR": str(home / "runtime"),
        "OMP_NUM_THREADS": "1",
        "PYTHONNOUSERSITE": "1",
        # As in an office without a network: no index, no folder that pip knows by itself.
        "PIP_CONFIG_FILE": os.devnull,
        "PROBE_OUT": str(home / "probe.json"),
    }  # fmt: skip

    def run(*words: str, **more: str) -> str:
        done = subprocess.run(
            [str(PROGRAM), *words], env={**environment, **more},
            capture_output=True, text=True, timeout=180, check=False,
        )  # fmt: skip
        said = done.stdout + done.stderr
        assert "Traceback" not in said, said
        assert done.returncode >= 0, said
        return said

    for name in (ours.name, "probe"):
        run("plugins", "enable", name)
    return SimpleNamespace(home=home, run=run, packages=home / "profiles" / "default" /
                           "platwright" / "packages")  # fmt: skip


def install(profile: SimpleNamespace, *words: str) -> str:
    return profile.run("run", "platwright:installdependencies", *(f"--{word}" for word in words))


@pytest.fixture(scope="module")
def story(profile: SimpleNamespace, wheels: Path, root: Path) -> SimpleNamespace:
    """Do what a planner without a network does, step by step, and note what was said."""
    absent = subprocess.run(
        [SYSTEM_PYTHON, "-s", "-c", "import geopandas"], capture_output=True, check=False
    ).returncode
    if not absent:
        pytest.skip("QGIS's own Python has the packages")
    sample = root / "data" / "helsinki" / "helsinki_yard.gpkg"
    prepare = (
        "run", "platwright:preparesite", f"--INPUT={sample}|layername=site",
        f"--ROADS={sample}|layername=streets", f"--SITE={profile.home / 'site.gpkg'}",
    )  # fmt: skip
    design = (
        "run", "platwright:designstreets", f"--INPUT={sample}|layername=site",
        f"--ROADS={sample}|layername=streets", "--TIME_LIMIT=6",
        f"--STREETS={profile.home / 'streets.gpkg'}",
    )  # fmt: skip
    told = SimpleNamespace(listed=profile.run("list"), missing=profile.run(*prepare))
    (profile.home / "some").mkdir()
    for name in wheels.glob("[!h]*.whl"):
        (profile.home / "some" / name.name).symlink_to(name)
    bare = ("CONSENT=true", "OPENSTREETMAP=false", "ORTOOLS=false", "PBF=false")
    told.lacking = install(profile, *bare, f"WHEELS={profile.home / 'some'}")
    told.after_lacking = list(profile.packages.glob("*/"))
    told.installed = install(profile, *bare, f"WHEELS={wheels}")
    told.folder = [p for p in profile.packages.iterdir() if p.is_dir()]
    told.designed = profile.run(*design)
    told.probe = json.loads((profile.home / "probe.json").read_text())
    told.tested = install(profile, "ACTION=test")
    told.removed = install(profile, "ACTION=remove")
    told.missing_again = profile.run(*prepare)
    return told


def test_it_loads_and_says_what_is_missing(story):
    assert "platwright:designstreets" in story.listed
    assert "platwright:installdependencies" in story.listed
    assert "geopandas (version 0.14 or newer)" in story.missing
    assert "Settings > Options > Platwright" in story.missing


def test_a_folder_that_lacks_a_wheel_changes_nothing(story):
    assert re.search(r"has no wheel of highspy\S* for Python 3", story.lacking)
    assert [p for p in story.after_lacking if p.is_dir()] == []


def test_it_installs_from_a_folder_of_wheels(story):
    assert "Installed in" in story.installed
    assert "geopandas" in story.installed
    assert "ortools" not in story.installed
    assert re.search(r"PACKAGES:\s+(9|10)", story.installed)
    assert len(story.folder) == 1


def test_it_designs_streets_then(story, profile):
    assert re.search(r"TOTAL_LENGTH:\s+1\d{3}", story.designed)
    from qgis.core import QgsVectorLayer

    assert QgsVectorLayer(str(profile.home / "streets.gpkg"), "", "ogr").featureCount() > 20


def test_the_numpy_of_qgis_is_untouched(story):
    own = subprocess.run(
        [SYSTEM_PYTHON, "-s", "-c", "import numpy; print(numpy.__file__, numpy.__version__)"],
        capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    assert [story.probe["file"], story.probe["version"]] == own
    assert story.probe["gdal"]
    assert "numpy" not in story.installed.split("Installed in")[1]


def test_it_is_tried_out_and_removed(story):
    assert "geopandas" in story.tested
    assert re.search(r"PACKAGES:\s+(9|10)", story.tested)
    assert "The packages are removed." in story.removed
    assert "were not found: " in story.missing_again
