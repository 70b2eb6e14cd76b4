"""Grow the streets of the gallery in QGIS, draw them, and write their figures; see `gallery`."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pyogrio

from _gallery import PACKAGE, ROOT, start
from _gallery_growth_places import (
    FRAMES,
    GRAMMARS,
    MEASURED,
    MEASURED_OPEN,
    OPEN,
    OPEN_CRS,
    PAIR,
    PAIR_SIDE,
    PLAYED,
    SEED,
    SHOWN,
    SITES,
    TOWNS,
    Grown,
)
from _gallery_places import OSM, data_folder
from _pages import write

PICTURES, PAGE = ROOT / "docs" / "images" / "growth", ROOT / "docs" / "growth.md"


@dataclass(frozen=True)
class Folders:
    """Where layers and pictures go."""

    layers: Path
    pictures: Path


def run(tool: str, target: Path, outputs: dict[str, str], options: dict[str, Any]) -> Any:
    """Run a tool; its layers go into one GeoPackage, its numbers are returned.

    Raises
    ------
    RuntimeError
        If the tool fails.
    """
    from qgis.core import QgsApplication, QgsProcessingContext, QgsProcessingFeedback

    class Loud(QgsProcessingFeedback):
        def reportError(self, error: str, fatalError: bool = False) -> None:  # noqa: N802, N803, ARG002
            print(error, file=sys.stderr)

    target.unlink(missing_ok=True)
    sinks = {key: f"ogr:dbname='{target}' table=\"{name}\" (geom)" for key, name in outputs.items()}
    found = QgsApplication.processingRegistry().createAlgorithmById(f"platwright:{tool}")
    numbers, good = found.run({**options, **sinks}, QgsProcessingContext(), Loud(False))
    if not good or not target.is_file():
        msg = f"{target.stem}: the tool {tool} failed"
        raise RuntimeError(msg)
    return numbers


def styled(path: Path, table: str, kind: str, style: str = "") -> Any:
    """Open a layer in a style that the plugin gives its kind, the first or a named one."""
    from qgis.core import QgsVectorLayer

    layer = QgsVectorLayer(f"{path}|layername={table}", table, "ogr")
    if not layer.isValid():
        msg = f"there is no layer {table} in {path.name}"
        raise RuntimeError(msg)
    fields = importlib.import_module(f"{PACKAGE}.plugin.{kind.partition('.')[0]}")
    what = getattr(fields, kind.partition(".")[2])
    importlib.import_module(f"{PACKAGE}.plugin.styles").apply(layer, what)
    if style:
        others = importlib.import_module(f"{PACKAGE}.plugin.renderers").OTHERS
        layer.setRenderer(others[what.style][style](layer))
    return layer


def said(numbers: Any) -> str:
    """Say what grew."""
    blocks, ends = int(numbers["BLOCK_COUNT"]), int(numbers["DEAD_ENDS_LEFT"])
    return (
        f"{int(numbers['SEGMENTS'])} streets, {numbers['TOTAL_LENGTH'] / 1000:.1f} km, "
        f"{blocks} blocks, {ends or 'no'} dead end{'' if ends == 1 else 's'}; "
        f"{numbers['SECONDS']:.1f} s."
    )


def grammars(folders: Folders) -> list[str]:
    """Grow the grammars that come along on open ground: a picture of each, and a sheet."""
    import _gallery_growth_maps as maps

    lines = [
        "| grammar | streets | km | iterations | blocks | dead ends | s |",
        "|---|---|---|---|---|---|---|",
    ]
    made = []
    for name in GRAMMARS:
        path = folders.layers / f"open_{name}.gpkg"
        numbers = _open(path, GRAMMAR=name, SEED=SEED, **OPEN)
        layer = styled(path, "streets", "growth_fields.STREETS")
        made.append((name, layer))
        maps.alone(layer, folders.pictures / f"{name}.png")
        lines.append(
            f"| {name} | {int(numbers['SEGMENTS'])} | {numbers['TOTAL_LENGTH'] / 1000:.1f} "
            f"| {int(numbers['ITERATIONS_DONE'])} | {int(numbers['BLOCK_COUNT'])} "
            f"| {int(numbers['DEAD_ENDS_LEFT'])} | {numbers['SECONDS']:.1f} |"
        )
    maps.sheet(made, 3, folders.pictures / "grammars.png")
    return lines


def _open(path: Path, **asked: Any) -> Any:
    """Grow streets on open ground."""
    return run("growstreets", path, {"STREETS": "streets"}, {"CRS": OPEN_CRS, **asked})


def pair(folders: Folders) -> list[str]:
    """Grow the same twice, as published and planar, and mark what is no junction."""
    import _gallery_growth_maps as maps
    from _gallery_growth_measures import faults
    from _gallery_pictures import single

    lines = ["| | streets | nodes | km | places without a junction |", "|---|---|---|---|---|"]
    for key, title, published in (
        ("published", "as published", True), ("planar", "planar", False)
    ):  # fmt: skip
        path = folders.layers / f"pair_{key}.gpkg"
        numbers = _open(path, SEED=SEED, AS_PUBLISHED=published, **PAIR)
        marks = faults(gpd.read_file(path, layer="streets"))
        layers = [styled(path, "streets", "growth_fields.STREETS")]
        if len(marks):
            marks.to_file(path, layer="marks", VERSION="1.2")
            from qgis.core import QgsVectorLayer

            shown = QgsVectorLayer(f"{path}|layername=marks", "marks", "ogr")
            layers.insert(0, single(shown, maps.FAULT))
        box = maps.around(0.0, 0.0, PAIR_SIDE)
        maps.zoomed(layers, box, folders.pictures / f"{key}.png")
        lines.append(
            f"| {title} | {int(numbers['SEGMENTS'])} | {int(numbers['NODE_COUNT'])} "
            f"| {numbers['TOTAL_LENGTH'] / 1000:.1f} | {len(marks)} |"
        )
    return lines


def grow_site(site: Grown, folders: Folders) -> Any:
    """Grow streets into a site; return the numbers, None where its data is not there."""
    path = _given(site)
    if path is None:
        return None
    names = {str(name) for name, _ in pyogrio.list_layers(path)}
    options = {"INPUT": f"{path}|layername=site", "ROADS": f"{path}|layername=streets"}
    if "obstacles" in names:
        options["OBSTACLES"] = f"{path}|layername=obstacles"
    target = folders.layers / f"{site.key}.gpkg"
    return run("growstreets", target, {"STREETS": "streets"}, {**options, **site.asked})


def _given(site: Grown) -> Path | None:
    """Return the file of a site; say so and return None where it is not there."""
    folder = ROOT if site.file.startswith("data/") else data_folder()
    path = folder / site.file
    if path.is_file():
        return path
    print(f"SKIPPED: {site.name}, {site.file} is not there (PLATWRIGHT_TEST_DATA says where)")
    return None


def below(site: Grown) -> tuple[list[Any], Any]:
    """Return what lies below the streets of a site, from the top down, and the site itself."""
    from qgis.core import QgsVectorLayer

    import _gallery_pictures as maps

    path = _given(site)
    names = {str(name) for name, _ in pyogrio.list_layers(path)}
    found = []
    for name, symbol in (
        ("obstacles", maps.GROUND), ("streets", maps.ROADS), ("site", maps.SITE)
    ):  # fmt: skip
        if name in names:
            layer = QgsVectorLayer(f"{path}|layername={name}", name, "ogr")
            found.append(maps.single(layer, symbol))
    return found, found[-1]


def draw_site(site: Grown) -> Callable[[Folders], list[str] | None]:
    """Return what grows streets into a site and draws them."""

    def make(folders: Folders) -> list[str] | None:
        import _gallery_pictures as maps

        numbers = grow_site(site, folders)
        if numbers is None:
            return None
        made = styled(folders.layers / f"{site.key}.gpkg", "streets", "growth_fields.STREETS")
        under, ground = below(site)
        maps.draw([made, *under], ground, site.credit, folders.pictures / f"{site.key}.png")
        return [f"*{site.words()}:* {said(numbers)}"]

    return make


def play(folders: Folders) -> list[str] | None:
    """Draw a growth as the temporal controller plays it."""
    from qgis.PyQt.QtCore import QDateTime

    import _gallery_growth_maps as maps

    (site,) = [own for own in SITES if own.key == PLAYED]
    if grow_site(site, folders) is None:
        return None
    path = folders.layers / f"{site.key}.gpkg"
    streets = gpd.read_file(path, layer="streets")
    grown = streets[streets["iteration"] > 0].sort_values("iteration")
    days = []
    for share in FRAMES:
        at = grown.iloc[max(0, round(share * len(grown)) - 1)]
        begins = str(np.datetime64(at["appeared"].to_datetime64(), "s"))
        days.append((int(at["iteration"]), QDateTime.fromString(begins, "yyyy-MM-ddTHH:mm:ss")))
    made = styled(path, "streets", "growth_fields.STREETS")
    under, ground = below(site)
    maps.played([made, *under], ground, days, site.credit, folders.pictures / "played.png")
    shown = [int((grown["iteration"] <= day).sum()) for day, _ in days]
    told = ", ".join(f"day {day}: {count}" for (day, _), count in zip(days, shown))
    return [f"*{site.words()}.* Streets that are there on {told} (the last day)."]


def measured(folders: Folders) -> list[str] | None:
    """Measure real towns and grown ones, and draw one of them in two styles."""
    import _gallery_growth_maps as maps
    import _gallery_growth_measures as tables

    lines = tables.head()
    for town in TOWNS:
        file = data_folder() / town.file
        if not file.is_file():
            print(f"SKIPPED: {town.name}, {town.file} is not there")
            return None
        given = folders.layers / f"{town.key}_streets.gpkg"
        tables.streets_of_town(file).to_file(given, layer="streets", VERSION="1.2")
        path = folders.layers / f"{town.key}.gpkg"
        numbers = _measure(given, path)
        lines.append(tables.row(town.name, numbers))
        if town.key == SHOWN:
            for style, name in (("", "natural"), ("Betweenness", "betweenness")):
                layer = styled(path, "measured", "street_fields.MEASURED_STREETS", style)
                maps.whole([layer], OSM, folders.pictures / f"{town.key}_{name}.png")
    for name in MEASURED:
        grown = folders.layers / f"measured_{name}.gpkg"
        _open(grown, GRAMMAR=name, SEED=SEED, **MEASURED_OPEN)
        numbers = _measure(grown, folders.layers / f"measured_{name}_fields.gpkg")
        lines.append(tables.row(f"grown: {name}", numbers))
    return lines


def _measure(given: Path, target: Path) -> Any:
    return run("measurestreets", target, {"OUTPUT": "measured"},
               {"INPUT": f"{given}|layername=streets"})  # fmt: skip


def published(_: Folders) -> list[str]:
    """Compare with the medians that CitySprout publishes."""
    from _gallery_growth_measures import published as table

    return table()


PARTS: dict[str, Callable[[Folders], list[str] | None]] = {
    "grammars": grammars,
    **{site.key: draw_site(site) for site in SITES},
    "pair": pair,
    "played": play,
    "measured": measured,
    "published": published,
}


def main() -> None:
    """Make the gallery of growth, or some of it."""
    parser = argparse.ArgumentParser(prog="gallery growth", description=__doc__.split(";")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(PARTS))
    parser.add_argument("--folder", type=Path, help="for pictures and layers; the page stays")
    given = parser.parse_args()
    unknown = sorted(set(given.names) - set(PARTS))
    if unknown:
        parser.error(f"there is no {unknown[0]}; there are {', '.join(PARTS)}")
    with tempfile.TemporaryDirectory() as name:
        started = start(Path(name))
        folders = Folders(given.folder or Path(name), given.folder or PICTURES)
        folders.layers.mkdir(parents=True, exist_ok=True)
        for key, make in PARTS.items():
            if given.names and key not in given.names:
                continue
            lines = make(folders)
            print(key, *(lines or []), "", sep="\n", flush=True)
            if lines and not given.folder:
                write(PAGE, key, lines)
    sys.stdout.flush()
    # What lives on at the end of the program would end it badly.
    os._exit(0 if started else 1)


if __name__ == "__main__":
    main()
