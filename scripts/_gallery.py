"""Lay out the sites of the gallery in QGIS, draw them, and write their figures; see `gallery`."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas as gpd
from platwright.measure.parcels import Ideal, measure_parcels

from _gallery_places import PLACES, ROOT, Place, Where, read
from _pages import write

PICTURES, PAGE = ROOT / "docs" / "images" / "parcels", ROOT / "docs" / "parcels.md"
#: So many layouts are made of each site, and so many are shown.
MADE, SHOWN = 6, 3
#: Layers of the tool that are kept, by their key.
TABLES = {
    "STREETS": "streets", "PARCELS": "parcels", "BLOCKS": "blocks", "PROBLEMS": "problems",
    "VARIATION_TABLE": "variations",
}  # fmt: skip
PACKAGE = "platwright_gallery"
HEAD = (
    "| variation | parcels | p_angle | p_area | undesirable | green | streets | street, m |",
    "|---|---|---|---|---|---|---|---|",
)


@dataclass(frozen=True)
class Run:
    """A run of the tool: how its pictures begin, its name in the table, and its layers."""

    stem: str
    title: str
    file: Path
    rows: gpd.GeoDataFrame
    seconds: float


def lay_out(place: Place, folder: Path, made: int, *, templates: bool) -> Run:
    """Run the tool on a site; all layers go into one GeoPackage.

    Parameters
    ----------
    place
        The site.
    folder
        For its layers.
    made
        So many variations.
    templates
        Whether the shipped templates are used.

    Raises
    ------
    RuntimeError
        If the tool fails.
    """
    from qgis.core import QgsApplication, QgsProcessingContext, QgsProcessingFeedback

    class Loud(QgsProcessingFeedback):
        def reportError(self, error: str, fatalError: bool = False) -> None:  # noqa: N802, N803, ARG002
            print(error, file=sys.stderr)

    where = place.where
    stem = where.key + ("_templates" if templates else "")
    given, target = folder / f"{where.key}_given.gpkg", folder / f"{stem}.gpkg"
    for path in (given, target):
        path.unlink(missing_ok=True)
    for name, frame in (
        ("site", place.site),
        ("streets", place.roads),
        ("obstacles", place.obstacles),
        ("parcels", place.parcels),
        ("own", place.streets),
    ):
        if frame is not None and len(frame):
            # a version that older GDAL reads without a warning
            frame.to_file(given, layer=name, VERSION="1.2")
    options = {
        "INPUT": f"{given}|layername=site",
        "ROADS": f"{given}|layername=streets",
        "SNAP_DISTANCE": where.snap,
        "VARIATIONS": made,
        "KEEP": min(made, SHOWN),
        "TEMPLATES": "shipped" if templates else "rows",
        **{key: f"ogr:dbname='{target}' table=\"{name}\" (geom)" for key, name in TABLES.items()},
    }
    if where.obstacles and len(place.obstacles):
        options["OBSTACLES"] = f"{given}|layername=obstacles"
    tool = QgsApplication.processingRegistry().createAlgorithmById("platwright:splitsite")
    began = time.monotonic()
    _, good = tool.run(options, QgsProcessingContext(), Loud(False))
    if not good or not target.is_file():
        msg = f"{where.name}: the tool failed"
        raise RuntimeError(msg)
    seconds = time.monotonic() - began
    rows = gpd.read_file(target, layer="variations").sort_values("variation").head(SHOWN)
    return Run(stem, "with templates" if templates else "", target, rows, seconds)


def draw(place: Place, run: Run, pictures: Path) -> int:
    """Draw the variations of a run; return the bytes of all pictures."""
    import _gallery_pictures as maps

    where = place.where
    given = run.file.with_name(f"{where.key}_given.gpkg")
    site = maps.single(_layer(given, "site"), maps.SITE)
    below = [site, maps.single(_layer(given, "streets"), maps.ROADS)]
    if len(place.obstacles):
        below.append(maps.single(_layer(given, "obstacles"), maps.GROUND))
    kinds = importlib.import_module(f"{PACKAGE}.plugin.parcel_fields")
    total = 0
    for number in run.rows["variation"].astype(int):
        made = [
            _styled(run.file, table, kind, f"variation = {number}")
            for table, kind in (
                ("streets", kinds.LAYOUT_STREETS),
                ("parcels", kinds.LAYOUT_PARCELS),
            )
        ]
        total += maps.draw(
            [*made, *below], site, where.credit, pictures / f"{run.stem}_{number}.png"
        )
    if place.parcels is not None and run.stem == where.key:
        real = _styled(given, "parcels", kinds.LAYOUT_PARCELS)
        _real_uses(real)
        streets = maps.single(_layer(given, "own"), maps.ROADS)
        target = pictures / f"{where.key}_map.png"
        total += maps.draw([streets, real, *below], site, where.credit, target)
    return total


def _layer(path: Path, table: str) -> Any:
    """Open a layer."""
    from qgis.core import QgsVectorLayer

    opened = QgsVectorLayer(f"{path}|layername={table}", table, "ogr")
    if not opened.isValid():
        msg = f"there is no layer {table} in {path.name}"
        raise RuntimeError(msg)
    return opened


def _styled(path: Path, table: str, kind: Any, which: str = "") -> Any:
    """Open a layer in the style of its kind, some of its features only."""
    opened = _layer(path, table)
    if which:
        opened.setSubsetString(which)
    importlib.import_module(f"{PACKAGE}.plugin.styles").apply(opened, kind)
    return opened


def _real_uses(layer: Any) -> None:
    """Show real parcels as ours: what is no housing has the colour of other land."""
    renderer = layer.renderer().clone()
    renderer.setClassAttribute("use")
    layer.setRenderer(renderer)


def figures(place: Place, runs: list[Run], made: int) -> list[str]:
    """Write the table of a site."""
    lines = list(HEAD)
    for run in runs:
        for row in run.rows.itertuples():
            cells = (
                f"{int(row.variation)}{run.title and ', ' + run.title}",
                f"{int(row.parcels)}",
                f"{row.p_angle:.2f}",
                f"{row.p_area:.3f}",
                f"{row.undesirable_pct:.1f} %",
                f"{row.green_pct:.1f} %",
                f"{row.street_pct:.1f} %",
                f"{row.street_m:.0f}",
            )
            lines.append(f"| {' | '.join(cells)} |")
    if place.parcels is not None:
        housing = place.parcels[place.parcels["use"] == "parcel"]
        real = measure_parcels(housing, ideal=Ideal(tolerance=1.0)).figures.as_dict()
        lines.append(
            f"| real, simplified by 1 m | {int(real['count'])} | {real['p_angle']:.2f} "
            f"| {real['p_area']:.3f} | {real['undesirable_pct']:.1f} % | | | |"
        )
    hectares = place.site.area.sum() / 1e4
    seconds = " and ".join(f"{run.seconds:.0f} s" for run in runs)
    with_these = f"{made} variations made in {seconds}, the best {min(made, SHOWN)} shown"
    return [*lines, "", f"{hectares:.1f} ha. {with_these}."]


def start(folder: Path) -> Any:
    """Start QGIS with this plugin; what is returned must live on."""
    from qgis.analysis import QgsNativeAlgorithms
    from qgis.core import QgsApplication

    application = QgsApplication([], False)
    application.initQgis()
    registry = application.processingRegistry()
    registry.addProvider(QgsNativeAlgorithms(registry))
    (folder / PACKAGE).symlink_to(ROOT, target_is_directory=True)
    sys.path.insert(0, str(folder))
    plugin = importlib.import_module(PACKAGE).classFactory(None)
    plugin.initProcessing()
    return application, plugin


def make(where: Where, made: int, layers: Path, pictures: Path, page: Path | None) -> None:
    """Lay out a site, draw it, and write its figures."""
    place = read(where)
    if place is None:
        return
    ways = (False, True) if where.templates else (False,)
    runs = [lay_out(place, layers, made, templates=way) for way in ways]
    size = sum(draw(place, run, pictures) for run in runs)
    table = figures(place, runs, made)
    print(f"{where.name}: {size / 1000:.0f} kB", *table, "", sep="\n", flush=True)
    if page is not None:
        write(page, where.key, table)


def main() -> None:
    """Make the gallery, or some of it."""
    parser = argparse.ArgumentParser(prog="gallery", description=__doc__.split(";")[0])
    every = [where.key for where in PLACES]
    parser.add_argument("sites", nargs="*", metavar="SITE", help=", ".join(every))
    parser.add_argument("--folder", type=Path, help="for pictures and layers; the page stays")
    parser.add_argument("--variations", type=int, default=MADE, metavar="N")
    given = parser.parse_args()
    unknown = sorted(set(given.sites) - set(every))
    if unknown:
        parser.error(f"there is no site {unknown[0]}; there are {', '.join(every)}")
    with tempfile.TemporaryDirectory() as name:
        started = start(Path(name))
        layers = given.folder or Path(name)
        layers.mkdir(parents=True, exist_ok=True)
        for where in PLACES:
            if not given.sites or where.key in given.sites:
                pictures, page = given.folder or PICTURES, None if given.folder else PAGE
                make(where, given.variations, layers, pictures, page)
    sys.stdout.flush()
    # What lives on at the end of the program would end it badly.
    os._exit(0 if started else 1)


if __name__ == "__main__":
    main()
