"""A QGIS window under Xvfb: the tool is found, its dialog opened, run, its layers styled."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sysconfig
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = [
    pytest.mark.qgis,
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("qgis") is None, reason="the QGIS window is not installed"),
    pytest.mark.skipif(shutil.which("xvfb-run") is None, reason="Xvfb is not installed"),
]


@pytest.fixture(scope="module")
def notes(
    plugin_folder: Path, tmp_path_factory: pytest.TempPathFactory, root: Path, artefacts: Path
) -> Any:
    """Run `desktop_session.py` in a window and return what it noted."""
    home = tmp_path_factory.mktemp("desktop")
    folder = next(plugin_folder.iterdir()).name
    settings = home / "profiles" / "default" / "QGIS" / "QGIS3.ini"
    settings.parent.mkdir(parents=True)
    settings.write_text(
        f"[PythonPlugins]\n{folder}=true\nprocessing=true\n"
        "[qgis]\ncheckVersion=false\nshowTips=false\n[locale]\noverrideFlag=true\nuserLocale=en_US\n"
    )
    (home / "runtime").mkdir(mode=0o700)
    (home / "me" / "Documents").mkdir(parents=True)
    environment = {
        **{k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "QT_QPA_PLATFORM")},
        "QGIS_PLUGINPATH": str(plugin_folder),
        "XDG_RUNTIME_DIR": str(home / "runtime"),
        "HOME": str(home / "me"),
        "PLATWRIGHT_DEPS": sysconfig.get_paths()["purelib"],
        "OMP_NUM_THREADS": "1",
        "LANG": "C.UTF-8",
        "DESKTOP_OUT": str(artefacts),
        "DESKTOP_SAMPLE": str(root / "data" / "helsinki" / "helsinki_yard.gpkg"),
        "DESKTOP_PLUGIN": folder,
    }
    (artefacts / "desktop.json").unlink(missing_ok=True)
    done = subprocess.run(
        [
            *("xvfb-run", "-a", "-s", "-screen 0 1500x950x24"),
            *("qgis", "--nologo", "--noversioncheck", "--profiles-path", str(home)),
            *("--code", str(Path(__file__).with_name("desktop_session.py"))),
        ],
        env=environment,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    written = artefacts / "desktop.json"
    assert written.is_file(), done.stdout + done.stderr
    found = json.loads(written.read_text())
    assert "error" not in found, found["error"]
    return found


def test_the_session_went_to_its_end(notes):
    assert notes["steps"] == [
        "open_sample", "find_tool", "open_dialog", "run_tool", "finished", "look", "photograph",
        "start_and_cancel", "cancelled", "after_cancel", "open_every_dialog", "try_models",
        "run_model", "model_finished", "after_model", "switch_off",
    ]  # fmt: skip


def test_the_tool_is_in_the_toolbox(notes):
    assert {"Platwright", "2 Streets", "Design streets"} <= set(notes["found"])
    assert "Design Streets" in notes["title"].title()


def test_it_ran_and_gave_its_numbers(notes):
    assert notes["good"]
    assert notes["results"]["TOTAL_LENGTH"] > 500
    assert notes["results"]["BOUND"] <= notes["results"]["OBJECTIVE"] + 1e-6
    assert notes["seconds"] < 60


@pytest.mark.parametrize(
    ("name", "renderer", "label"),
    [
        ("Streets", "categorizedSymbol", "collector"),
        ("Junctions", "categorizedSymbol", "way out of the site"),
        ("Blocks", "graduatedSymbol", "width 60 to 80 m"),
        ("Problems", "categorizedSymbol", "warning"),
    ],
)
def test_styled_layers_are_on_the_canvas(notes, name, renderer, label):
    layer = notes["layers"][name]
    assert layer["renderer"] == renderer
    assert label in layer["classes"]
    assert layer["crs"] == "EPSG:3067"
    assert layer["features"] > 0 or name == "Problems"


def test_layers_remember_how_they_were_made(notes):
    layer = notes["layers"]["Streets"]
    assert json.loads(layer["specification"])["block_width"] == 72
    assert json.loads(layer["result"])["TOTAL_LENGTH"] == pytest.approx(
        notes["results"]["TOTAL_LENGTH"]
    )


def test_pictures_are_kept(notes, artefacts):
    for name in ("1_toolbox", "2_dialog", "3_log", "4_map", "5_canvas", "6_cancelled"):
        assert (artefacts / f"desktop_{name}.png").stat().st_size > 10_000


def test_cancel_is_quick_and_keeps_the_design(notes):
    assert notes["cancel seconds"] < 10
    assert "the best design so far is kept" in notes["cancel log"]
    (path,) = re.findall(r"They are kept in: (\S+\.gpkg)", notes["cancel log"])
    from qgis.core import QgsVectorLayer

    streets = QgsVectorLayer(f"{path}|layername=streets", "streets", "ogr")
    assert streets.featureCount() > 0
    assert streets.renderer().type() == "categorizedSymbol"


def test_the_dialog_of_every_tool_opens(notes, provider, artefacts):
    names = {tool.name() for tool in provider.algorithms()}
    assert set(notes["dialogs"]) == names
    for name, seen in notes["dialogs"].items():
        assert seen["shown"] == seen["declared"], name
        assert seen["runnable"], name
        assert provider.algorithm(name).displayName().lower() in seen["title"].lower()
        assert (artefacts / f"dialog_{name}.png").stat().st_size > 10_000


def test_the_sample_opens_as_a_copy(notes, root):
    path = Path(notes["sample"]["file"])
    assert path.name == "helsinki_yard.qgz"
    assert path.parent.name == "Platwright sample"
    assert root not in path.parents
    assert all(notes["sample"]["layers"].values())
    assert {"Rail yard", "Roads", "Finished streets"} <= set(notes["sample"]["layers"])


def test_a_model_gives_styled_layers_with_readable_names(notes):
    assert notes["model good"]
    styles = notes["model layers"]
    assert styles["Streets"] == "categorizedSymbol"
    assert styles["Blocks"] == "graduatedSymbol"
    assert styles["Site"] == "singleSymbol"
    assert {"Junctions", "Broken rules", "Problems of the design"} <= set(styles)


def test_switching_the_plugin_off_takes_the_provider_away(notes):
    assert notes["provider before"]
    assert not notes["provider after"]
