"""The sample project: all of it opens wherever it is copied, styled, and says whose data it is."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from qgis.core import QgsProject  # noqa: E402

GROUND = ("Rail yard", "Roads", "Buildings, parks, water")
FINISHED = ("Finished problems", "Finished junctions", "Finished streets", "Finished blocks")


@pytest.fixture
def copy(package, tmp_path, provider):
    """Copy the sample into a folder with a name of somebody's choice."""
    return package("plugin.sample").copied(tmp_path / "Été 2026 (1)")


@pytest.fixture
def project(copy):
    opened = QgsProject()
    assert opened.read(str(copy)), opened.error()
    return opened


def test_every_layer_opens_beside_the_project(project, copy):
    layers = {layer.name(): layer for layer in project.mapLayers().values()}
    assert set(layers) == {*GROUND, *FINISHED}
    for name, layer in layers.items():
        assert layer.isValid(), name
        assert Path(layer.source().split("|")[0]).parent == copy.parent
        assert layer.crs().authid() == "EPSG:3067"
        assert layer.featureCount() > 0 or name == "Finished problems"
    assert project.crs().authid() == "EPSG:3067"


def test_paths_are_relative(copy):
    with zipfile.ZipFile(copy) as archive:
        (name,) = [n for n in archive.namelist() if n.endswith(".qgs")]
        text = archive.read(name).decode("utf-8")
    sources = [s for s in re.findall(r"<datasource>([^<]+)</datasource>", text) if s.strip()]
    assert len(sources) == len({*GROUND, *FINISHED})
    assert all(source.startswith("./helsinki_") for source in sources)
    assert not re.search("/(?:tmp|" + "root|" + "home|" + "work)/", text)


def test_it_says_whose_data_it_is(project):
    metadata = project.metadata()
    assert "© OpenStreetMap contributors" in metadata.abstract()
    assert "ODbL" in metadata.abstract()
    assert [link.url for link in metadata.links()] == ["https://www.openstreetmap.org/copyright"]
    for layer in project.mapLayers().values():
        assert "OpenStreetMap" in layer.metadata().rights()[0], layer.name()
    assert project.readEntry("CopyrightLabel", "/Label")[0] == "© OpenStreetMap contributors"


def test_the_design_has_our_styles(project):
    styles = {
        name: project.mapLayersByName(name)[0].renderer().type() for name in (*GROUND, *FINISHED)
    }
    assert styles["Finished streets"] == styles["Finished junctions"] == "categorizedSymbol"
    assert styles["Finished blocks"] == "graduatedSymbol"
    assert styles["Buildings, parks, water"] == "categorizedSymbol"
    (streets,) = project.mapLayersByName("Finished streets")
    assert "Distance to the exit" in streets.styleManager().styles()


def test_the_design_breaks_no_rule(project, toolbox, package):
    layers = {name: project.mapLayersByName(name)[0] for name in (*GROUND, *FINISHED)}
    site = toolbox.run(
        "preparesite", INPUT=layers["Rail yard"], ROADS=layers["Roads"],
        OBSTACLES=layers["Buildings, parks, water"], SNAP_DISTANCE=60,
    )  # fmt: skip
    found = toolbox.run(
        "validatenetwork", INPUT=layers["Finished streets"], SITE=site.layers["SITE"],
        BOUNDARY_STREETS=site.layers["BOUNDARY_STREETS"],
        OBSTACLES=site.layers["SITE_OBSTACLES"],
    )  # fmt: skip
    assert found.results["VIOLATIONS"] == 0
    assert found.results["TOTAL_LENGTH"] > 1000
    assert package("plugin.record").read_record(layers["Finished streets"])["specification"]


def test_it_is_small(root):
    folder = root / "data" / "helsinki"
    assert sum(path.stat().st_size for path in folder.iterdir()) < 700_000


def test_a_copy_keeps_what_the_planner_has_changed(package, tmp_path):
    copied = package("plugin.sample").copied
    first = copied(tmp_path)
    (first.parent / "helsinki_design.gpkg").write_bytes(b"my own")
    first.unlink()
    again = copied(tmp_path)
    assert again == first
    assert again.is_file()
    assert (again.parent / "helsinki_design.gpkg").read_bytes() == b"my own"


class Window:
    """Stands for the window of QGIS."""

    def __init__(self):
        self.opened, self.told, self.menus = [], [], []

    def mainWindow(self):  # noqa: N802 - names of QGIS
        return None

    def messageBar(self):  # noqa: N802
        return self

    def pushMessage(self, title, text, level):  # noqa: N802, ARG002
        self.told.append(text)

    def addProject(self, path):  # noqa: N802
        self.opened.append(path)

    def addPluginToMenu(self, menu, action):  # noqa: N802
        self.menus.append((menu, action.text()))

    def removePluginMenu(self, menu, action):  # noqa: N802
        self.menus.remove((menu, action.text()))


@pytest.fixture
def entry(package, tmp_path, monkeypatch):
    sample = package("plugin.sample")
    places = type("Places", (), {"writableLocation": staticmethod(lambda _: str(tmp_path))})
    places.StandardLocation = sample.QStandardPaths.StandardLocation
    monkeypatch.setattr(sample, "QStandardPaths", places)
    window = Window()
    return sample.SampleAction(window), window


def test_the_menu_opens_a_copy(entry, tmp_path):
    action, window = entry
    assert window.menus == [("Platwright", "Open sample project")]
    QgsProject.instance().setDirty(False)
    action.open()
    assert window.opened == [str(tmp_path / "Platwright sample" / "helsinki_yard.qgz")]
    action.remove()
    assert window.menus == []


def test_unsaved_work_is_not_thrown_away(entry):
    action, window = entry
    QgsProject.instance().setDirty(True)
    try:
        action.open()
    finally:
        QgsProject.instance().setDirty(False)
    assert window.opened == []
    assert "Save your project first" in window.told[0]


def test_a_folder_that_cannot_be_written_is_said(entry, tmp_path):
    action, window = entry
    (tmp_path / "Platwright sample").write_text("a file in its place")
    QgsProject.instance().setDirty(False)
    action.open()
    assert window.opened == []
    assert "cannot be copied" in window.told[0]
