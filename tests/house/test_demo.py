"""The demo as a newcomer runs it, through QGIS's own command line."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import geopandas as gpd
import pytest

from house import ROOT

pytestmark = [
    pytest.mark.slow,
    pytest.mark.qgis,
    pytest.mark.skipif(
        not (Path(sys.prefix) / "platwright.stamp").is_file(),
        reason="not running in the environment that scripts/setup makes",
    ),
    pytest.mark.skipif(
        not (shutil.which("qgis_process.bin") or shutil.which("qgis_process")),
        reason="qgis_process is not installed",
    ),
]

LAYERS = {
    "site", "boundary_streets", "access_points", "site_obstacles", "site_problems",
    "mesh_edges", "mesh_vertices", "mesh_faces",
    "streets", "junctions", "blocks", "design_problems", "network_problems",
}  # fmt: skip


def test_the_demo_leaves_layers_a_map_and_figures(tmp_path, artefacts):
    done = subprocess.run(
        [str(ROOT / "scripts" / "demo"), str(tmp_path / "out")],
        env={**os.environ, "PLATWRIGHT_VENV": sys.prefix, "PLATWRIGHT_DEMO_SECONDS": "5"},
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    out = tmp_path / "out"
    assert {path.stem for path in out.glob("*.gpkg")} == LAYERS
    streets = gpd.read_file(out / "streets.gpkg", layer="streets")
    new = streets[streets["status"] == "new"]
    assert 50 < new.geometry.length.sum() / 11.4 < 400  # m per hectare
    check = json.loads((out / "validatenetwork.json").read_text(encoding="utf-8"))
    name, _, count = done.stdout.splitlines()[-1].rpartition(" ")
    assert name.strip() == "Problems found by the check"
    assert int(count) == check["results"]["VIOLATIONS"]
    picture = out / "map.png"
    assert picture.read_bytes().startswith(b"\x89PNG")
    shutil.copy(picture, artefacts / "demo_map.png")
