"""A tool in a process of its own: the same results, errors and cancel, and the real clash."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sysconfig
import time
from pathlib import Path

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis
PROGRAM = shutil.which("qgis_process.bin") or shutil.which("qgis_process")

from support import FailedError, Listener, box, layer, roads, site  # noqa: E402


@pytest.fixture
def apart(monkeypatch):
    """Run every tool in a process of its own, with the packages of this one."""
    monkeypatch.setenv("PLATWRIGHT_WORKER", "always")
    monkeypatch.setenv("PLATWRIGHT_DEPS", sysconfig.get_paths()["purelib"])


def shapes(rows):
    """Return the features without their numbers of order, for comparison."""
    return sorted(
        (
            row["geometry"].asWkt(3),
            *(str(v) for k, v in row.items() if k not in ("geometry", "fid")),
        )
        for row in rows
    )


def test_layers_numbers_and_record_are_those_of_a_run_here(toolbox, package, monkeypatch, apart):
    monkeypatch.setenv("PLATWRIGHT_WORKER", "never")
    here = toolbox.run("preparesite", INPUT=site(), ROADS=roads())
    monkeypatch.setenv("PLATWRIGHT_WORKER", "always")
    there = toolbox.run("preparesite", INPUT=site(), ROADS=roads())
    assert any("a process of its own" in text for text in there.said.warnings)
    assert not any("a process of its own" in text for text in here.said.warnings)
    for key in toolbox.tool("preparesite").layers:
        assert shapes(there.rows(key)) == shapes(here.rows(key)), key
        assert there.layers[key].crs() == here.layers[key].crs()
        assert there.layers[key].wkbType() == here.layers[key].wkbType()
    assert len(there.rows("BOUNDARY_STREETS")) >= 4
    for key in ("SITES", "AREA", "REPAIRS"):
        assert there.results[key] == here.results[key]


def test_only_what_is_selected_goes_over(toolbox, apart):
    from qgis.core import QgsProcessingFeatureSourceDefinition, QgsProject

    ground = layer([box(0, 0, 100, 100), box(500, 0, 200, 100)], name="two sites")
    QgsProject.instance().addMapLayer(ground)
    try:
        ground.selectByIds([2])
        run = toolbox.run(
            "preparesite", INPUT=QgsProcessingFeatureSourceDefinition(ground.id(), True)
        )
    finally:
        QgsProject.instance().removeMapLayer(ground.id())
    assert run.results["SITES"] == 1
    assert run.results["AREA"] == pytest.approx(2.0)


def test_feature_ids_and_layer_names_in_texts_are_those_of_the_layer(toolbox, apart):
    bowtie = "POLYGON((500000 6700000,500100 6700100,500100 6700000,500000 6700100,500000 6700000))"
    run = toolbox.run("preparesite", INPUT=layer([box(500, 0, 90, 90), bowtie], name="my | site"))
    assert {(row["layer"], str(row["feature"])) for row in run.rows("PROBLEMS")} == {
        ("my   site", "2")
    }


def test_what_the_library_refuses_arrives_as_its_sentence(toolbox, apart):
    with pytest.raises(FailedError) as caught:
        toolbox.run("preparesite", INPUT=layer([None], name="nothing"))
    assert "nothing" in str(caught.value)
    assert "Traceback" not in str(caught.value)


def test_outputs_that_are_switched_off_are_not_made(toolbox, apart):
    run = toolbox.run("preparesite", INPUT=site(), ACCESS_POINTS=None, PROBLEMS=None)
    assert set(run.layers) == {"SITE", "BOUNDARY_STREETS", "SITE_OBSTACLES"}


@pytest.mark.slow
def test_cancel_keeps_the_best_design(toolbox, apart):
    listener = Listener(cancel_at="Best design")
    began = time.monotonic()
    run = toolbox.run(
        "designstreets", listener=listener, INPUT=layer([box(0, 0, 900, 900)]), TIME_LIMIT=60, GAP=0
    )
    assert time.monotonic() - began < 40
    assert [row for row in run.rows("STREETS") if row["status"] == "new"]


def test_a_process_that_dies_is_told(toolbox, package, apart, monkeypatch, tmp_path):
    program = tmp_path / "dies.py"
    program.write_text("import os; print('a last word', flush=True); os._exit(3)")
    monkeypatch.setattr(package("plugin.worker"), "_PROGRAM", program)
    with pytest.raises(FailedError, match=r"without a result \(code 3\)\. a last word"):
        toolbox.run("preparesite", INPUT=site())


#: Not pyproj, too: bound to the PROJ of QGIS 3.40 it brings down QGIS itself.
EVIL = """
import os, sys
def classFactory(iface):
    sys.path.insert(0, os.environ["EVIL"])
    import shapely, shapely.lib
    sys.path.remove(os.environ["EVIL"])
    class Plugin:
        def initProcessing(self):
            pass
        def unload(self):
            pass
    return Plugin()
"""


@pytest.mark.slow
@pytest.mark.skipif(PROGRAM is None, reason="qgis_process is not installed")
def test_tools_run_though_another_plugin_loaded_shapely_badly(plugin_folder, root, tmp_path):
    ours = next(plugin_folder.iterdir())
    plugins = tmp_path / "plugins"
    (plugins / "evil").mkdir(parents=True)
    (plugins / "evil" / "__init__.py").write_text(EVIL)
    text = "name=evil\nqgisMinimumVersion=3.0\nversion=1\nauthor=a\nemail=a@b.c\ndescription=x\n"
    (plugins / "evil" / "metadata.txt").write_text(
        f"[general]\n{text}about=x\ntracker=https://x.x\nrepository=https://x.x\n"
        "hasProcessingProvider=yes\n"
    )
    (plugins / ours.name).symlink_to(ours.resolve(), target_is_directory=True)
    (tmp_path / "runtime").mkdir(mode=0o700)
    packages = sysconfig.get_paths()["purelib"]
    environment = {
        **{k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")},
        "QGIS_PLUGINPATH": str(plugins), "QGIS_CUSTOM_CONFIG_PATH": str(tmp_path),
        "QT_QPA_PLATFORM": "offscreen", "XDG_RUNTIME_DIR": str(tmp_path / "runtime"),
        "PLATWRIGHT_DEPS": packages, "EVIL": packages, "OMP_NUM_THREADS": "1",
    }  # fmt: skip

    def run(*words, **more):
        done = subprocess.run([PROGRAM, *words], env={**environment, **more}, text=True,
                              capture_output=True, timeout=100, check=False)  # fmt: skip
        assert "Traceback" not in done.stdout + done.stderr
        return done.stdout + done.stderr

    sample = root / "data" / "helsinki" / "helsinki_yard.gpkg"
    run("plugins", "enable", "evil")
    alone = subprocess.run(
        [PROGRAM, "run", "native:buffer", f"--INPUT={sample}|layername=site", "--DISTANCE=5",
         f"--OUTPUT={tmp_path / 'buffer.gpkg'}"],
        env=environment, capture_output=True, timeout=100, check=False,
    )  # fmt: skip
    if alone.returncode < 0:
        pytest.skip("packages so loaded bring this QGIS down even without a tool of ours")
    run("plugins", "enable", ours.name)
    words = ("run", "platwright:preparesite", f"--INPUT={sample}|layername=site",
             f"--ROADS={sample}|layername=streets", f"--SITE={tmp_path / 'site.gpkg'}")  # fmt: skip
    refused = run(*words, PLATWRIGHT_WORKER="never")
    if "does not work in this QGIS" not in refused:
        pytest.skip("the libraries of this QGIS happen to agree with those of the packages")
    assert not (tmp_path / "site.gpkg").exists()
    said = run(*words)
    assert "runs in a process of its own" in said
    assert re.search(r"SITES:\s+1", said), said
    from qgis.core import QgsVectorLayer

    made = QgsVectorLayer(str(tmp_path / "site.gpkg"), "", "ogr")
    assert made.featureCount() == 1
    assert Path(made.source()).is_file()
