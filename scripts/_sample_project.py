"""Make the sample project: the site as it is, a finished design, styles, and whose data it is.

Run by scripts/make_project in the environment with QGIS.
"""

from __future__ import annotations

import importlib
import os
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT / "data" / "helsinki"
SAMPLE, DESIGN, PROJECT = "helsinki_yard.gpkg", "helsinki_design.gpkg", "helsinki_yard.qgz"
CREDIT = "© OpenStreetMap contributors, Open Database License (ODbL) 1.0"
LINK = "https://www.openstreetmap.org/copyright"
#: The yard ends this far from the roads along it (metres).
SNAP_DISTANCE = 60.0
#: Layers of the design from the top: key of the output, table, title. The titles differ from
#: those that a run of the tools gives.
MADE = (
    ("design:PROBLEMS", "problems", "Finished problems"),
    ("design:JUNCTIONS", "junctions", "Finished junctions"),
    ("design:STREETS", "streets", "Finished streets"),
    ("design:BLOCKS", "blocks", "Finished blocks"),
)
#: Colours of the ground that stays: its kind, what it is called, its colour.
KINDS = (
    ("park", "park", "#cfe0bd"),
    ("water", "water", "#bcd7e6"),
    ("building", "building that stays", "#cdbfb4"),
    ("station", "main station", "#b79f92"),
)
ABSTRACT = (
    "The rail yard in the centre of Helsinki as a site to design, with a finished design: the "
    "sample of the Platwright plugin."
)


def design(folder: Path) -> None:
    """Design the sample with the model of the plugin; all layers go into one database."""
    from qgis.core import QgsApplication, QgsProcessingContext, QgsProcessingFeedback

    class Loud(QgsProcessingFeedback):
        def reportError(self, error: str, fatalError: bool = False) -> None:  # noqa: N802, N803, ARG002
            print(error, file=sys.stderr)

    model = QgsApplication.processingRegistry().createAlgorithmById("platwright:parcelstodesign")
    sample, target = folder / SAMPLE, folder / DESIGN
    given = {
        "INPUT": f"{sample}|layername=site",
        "ROADS": f"{sample}|layername=streets",
        "OBSTACLES": f"{sample}|layername=obstacles",
        "SNAP_DISTANCE": SNAP_DISTANCE,
        **{key: f"ogr:dbname='{target}' table=\"{table}\" (geom)" for key, table, _ in MADE},
    }
    _, good = model.run(given, QgsProcessingContext(), Loud(False))
    if not good:
        sys.exit("make_project: the design failed.")


def site_style() -> Any:
    """Return how the site looks: an outline, so that the design shows on it."""
    from qgis.core import QgsFillSymbol, QgsSingleSymbolRenderer

    symbol = QgsFillSymbol.createSimple(
        {"style": "no", "outline_color": "#55702f", "outline_width": "0.9"}
    )
    return QgsSingleSymbolRenderer(symbol)


def ground_style() -> Any:
    """Return how parks, water and buildings look."""
    from qgis.core import QgsCategorizedSymbolRenderer, QgsFillSymbol, QgsRendererCategory

    return QgsCategorizedSymbolRenderer(
        "kind",
        [
            QgsRendererCategory(
                kind,
                QgsFillSymbol.createSimple({"color": colour, "outline_color": "#9a9a90"}),
                label,
            )
            for kind, label, colour in KINDS
        ],
    )


def road_style() -> Any:
    """Return how the streets of the surroundings look."""
    from qgis.core import QgsLineSymbol, QgsSingleSymbolRenderer

    line = {"color": "#a39d93", "width": "0.8", "capstyle": "round", "joinstyle": "round"}
    return QgsSingleSymbolRenderer(QgsLineSymbol.createSimple(line))


def layer(path: Path, table: str, title: str) -> Any:
    """Open a layer with the style that it has in its file."""
    from qgis.core import QgsVectorLayer

    opened = QgsVectorLayer(f"{path}|layername={table}", title, "ogr")
    if not opened.isValid():
        sys.exit(f"make_project: no layer {table} in {path.name}")
    return opened


def build(folder: Path, package: Any) -> None:
    """Put the project together and write it."""
    from qgis.core import QgsLayerTreeGroup, QgsProject, QgsRectangle

    project = QgsProject.instance()
    tree = project.layerTreeRoot()
    finished = QgsLayerTreeGroup("Finished design")
    for _, table, title in MADE:
        made = layer(folder / DESIGN, table, title)
        fields = importlib.import_module(f"{package}.plugin.fields")
        styles = importlib.import_module(f"{package}.plugin.styles")
        styles.offer_others(made, getattr(fields, table.upper()))
        _credit(made)
        project.addMapLayer(made, False)
        finished.addLayer(made)
    grounds = {
        "site": ("Rail yard", site_style()),
        "streets": ("Roads", road_style()),
        "obstacles": ("Buildings, parks, water", ground_style()),
    }
    for table, (title, style) in grounds.items():
        opened = layer(folder / SAMPLE, table, title)
        opened.setRenderer(style)
        _credit(opened)
        project.addMapLayer(opened, False)
        # The group is not at the top, or QGIS would put what the tools make into it.
        if table == "obstacles":
            tree.addChildNode(finished)
        tree.addLayer(opened)
        if table == "site":
            project.setCrs(opened.crs())
            box = QgsRectangle(opened.extent())
            box.scale(1.15)
    _describe(project, box)
    if not project.write(str(folder / PROJECT)):
        sys.exit(f"make_project: {project.error()}")


def _credit(opened: Any) -> None:
    """Say in the metadata of a layer whose the data is."""
    metadata = opened.metadata()
    metadata.setRights([CREDIT])
    opened.setMetadata(metadata)


def _describe(project: Any, box: Any) -> None:
    """Say what the project is, whose data it shows, and where it opens."""
    from qgis.core import QgsAbstractMetadataBase, QgsReferencedRectangle

    project.setTitle("Helsinki rail yard")
    project.writeEntryBool("Paths", "/Absolute", False)
    metadata = project.metadata()
    metadata.setTitle("Helsinki rail yard")
    metadata.setAuthor("The Platwright authors")
    metadata.setAbstract(f"{ABSTRACT} Streets and land: {CREDIT}, {LINK}.")
    link = QgsAbstractMetadataBase.Link("OpenStreetMap", "WWW:LINK", LINK)
    link.description = CREDIT
    metadata.addLink(link)
    project.setMetadata(metadata)
    # The copyright line in the corner of the map.
    project.writeEntry("CopyrightLabel", "/Enabled", True)
    project.writeEntry("CopyrightLabel", "/Label", "© OpenStreetMap contributors")
    project.writeEntry("CopyrightLabel", "/Placement", 3)
    settings = project.viewSettings()
    settings.setDefaultViewExtent(QgsReferencedRectangle(box, project.crs()))


def main() -> None:
    """Make the design and the project in a folder of their own, then put them in their place."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    from qgis.analysis import QgsNativeAlgorithms
    from qgis.core import QgsApplication

    application = QgsApplication([], False)
    application.initQgis()
    registry = application.processingRegistry()
    registry.addProvider(QgsNativeAlgorithms(registry))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "platwright_project").symlink_to(ROOT, target_is_directory=True)
        sys.path.insert(0, name)
        plugin = importlib.import_module("platwright_project").classFactory(None)
        plugin.initProcessing()
        # A copy: QGIS writes into every database that it opens.
        shutil.copy(DATA / SAMPLE, folder)
        design(folder)
        build(folder, "platwright_project")
        shutil.copy(folder / DESIGN, DATA)
        shutil.copy(folder / PROJECT, DATA)
    for name in (DESIGN, PROJECT):
        print(f"{(DATA / name).relative_to(ROOT)}: {(DATA / name).stat().st_size / 1000:.0f} kB")
    sys.stdout.flush()
    # What lives on at the end of the program would end it badly.
    os._exit(0)


if __name__ == "__main__":
    main()
