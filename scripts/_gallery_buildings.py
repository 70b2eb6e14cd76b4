"""Lay out residential zones in QGIS in six patterns, draw them, write figures; see `gallery`."""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import geopandas as gpd
import pyogrio

from _gallery import ROOT, start
from _gallery_building_places import (
    CORRIDORS,
    DRAWN,
    KINDS,
    MIX,
    MIXED,
    PATTERNS,
    TITLES,
    ZONES,
    Zoned,
)
from _gallery_growth import run, styled
from _gallery_places import data_folder
from _pages import write

PICTURES, PAGE = ROOT / "docs" / "images" / "buildings", ROOT / "docs" / "residential.md"
HEAD = (
    "| pattern | FAR | density | green | buildings | dwellings | sun, h | way, m | objective | s |",
    "|---|---|---|---|---|---|---|---|---|---|",
)


@dataclass(frozen=True)
class Folders:
    """Where layers and pictures go, and what every run is asked."""

    layers: Path
    pictures: Path
    asked: dict[str, Any]


def given(zone: Zoned) -> Path | None:
    """Return the file of a zone; say so and return None where it is not there."""
    path = data_folder() / zone.file
    if path.is_file():
        return path
    print(f"SKIPPED: {zone.name}, {zone.file} is not there (PLATWRIGHT_TEST_DATA says where)")
    return None


def layers_of(path: Path) -> dict[str, str]:
    """Return the inputs that every tool takes from a site: zone, roads and obstacles."""
    names = {str(name) for name, _ in pyogrio.list_layers(path)}
    inputs = {"INPUT": "site", "ROADS": "streets", "OBSTACLES": "obstacles"}
    return {key: f"{path}|layername={name}" for key, name in inputs.items() if name in names}


def lay_out(zone: Zoned, path: Path, folders: Folders) -> dict[str, Any]:
    """Lay a zone out in six patterns; return the numbers of each."""
    streets = folders.layers / f"{zone.key}_streets.gpkg"
    run("designstreets", streets, {"STREETS": "streets"}, {**layers_of(path), **CORRIDORS})
    asked = {
        **layers_of(path),
        "CORRIDORS": f"{streets}|layername=streets",
        "TYPE_SET": zone.types,
        **zone.asked,
        **folders.asked,
    }
    made = {}
    for pattern in (*PATTERNS, MIXED):
        target = folders.layers / f"{zone.key}_{pattern}.gpkg"
        if pattern == MIXED:
            patches = folders.layers / f"{zone.key}_patches.gpkg"
            mix(folders.layers / f"{zone.key}_rows.gpkg", patches)
            chosen = {"PATCHES": f"{patches}|layername=patches", "PATTERN": "rows"}
        else:
            chosen = {"PATTERN": pattern}
        made[pattern] = run("layoutresidential", target, DRAWN, {**asked, **chosen})
    return made


def mix(laid: Path, target: Path) -> None:
    """Give the patches of a plan patterns of their own, as a planner fills a column in.

    Parameters
    ----------
    laid
        The layers of a plan.
    target
        GeoPackage for the patches.
    """
    patches = gpd.read_file(laid, layer="patches")
    patches = patches[patches.area > 0].sort_values("area_m2", ascending=False)
    middle = patches.union_all().centroid
    large = patches[patches["area_m2"] >= 0.4 * patches["area_m2"].median()]
    park = large.distance(middle).idxmin() if len(patches) > 1 else None
    others = [name for name in patches.index if name != park]
    chosen = {name: MIX[at % len(MIX)] for at, name in enumerate(others)}
    patches["residences"] = [chosen.get(name, "empty") for name in patches.index]
    patches["facilities"] = ["empty" if name == park else "rows" for name in patches.index]
    columns = ["residences", "facilities", "geometry"]
    target.unlink(missing_ok=True)
    patches[columns].to_file(target, layer="patches", VERSION="1.2")


def drawn(path: Path, laid: Path, style: str = "") -> tuple[list[Any], Any]:
    """Return the layers of a plan in their styles, from the top down, and the zone itself."""
    from qgis.core import QgsVectorLayer

    import _gallery_pictures as maps

    found = []
    for table in DRAWN.values():
        own = style if table == "buildings" else ""
        found.append(styled(laid, table, f"building_fields.{KINDS[table]}", own))
    names = {str(name) for name, _ in pyogrio.list_layers(path)}
    for name, symbol in (
        ("streets", maps.ROADS), ("obstacles", maps.GROUND), ("site", maps.SITE)
    ):  # fmt: skip
        if name in names:
            layer = QgsVectorLayer(f"{path}|layername={name}", name, "ogr")
            found.append(maps.single(layer, symbol))
    return found, found[-1]


def draw(zone: Zoned, path: Path, folders: Folders) -> None:
    """Draw the six plans of a zone on a sheet, and one of them large."""
    import _gallery_building_maps as maps

    plans = []
    for pattern in (*PATTERNS, MIXED):
        plans.append((TITLES[pattern], *drawn(path, folders.layers / f"{zone.key}_{pattern}.gpkg")))
    maps.sheet(plans, zone.credit, folders.pictures / f"{zone.key}.png")
    if not zone.shown:
        return
    laid = folders.layers / f"{zone.key}_{zone.shown}.gpkg"
    for name, style in zone.styles.items():
        layers, site = drawn(path, laid, style)
        if style == "2.5D":  # trees stand on the ground
            layers = [layers[1], layers[0], *layers[2:]]
        maps.large(layers, site, zone.credit, folders.pictures / f"{zone.key}_{name}.png")
    solid(laid, folders.pictures / f"{zone.key}_3d.png")


def solid(laid: Path, target: Path) -> None:
    """Draw a plan in a 3D view of QGIS, which wants a screen or what stands in for one."""
    screen = shutil.which("xvfb-run")
    if screen is None:
        print("SKIPPED: the view in 3D, xvfb-run is not installed")
        return
    script = Path(__file__).with_name("_gallery_building_solids.py")
    own = {"QT_QPA_PLATFORM": "xcb", "LIBGL_ALWAYS_SOFTWARE": "1"}
    command = [screen, "-a", sys.executable, str(script), str(laid), str(target)]
    subprocess.run(command, env={**os.environ, **own}, check=True, timeout=300)


def figures(made: dict[str, Any]) -> list[str]:
    """Write the table of a zone."""
    lines = list(HEAD)
    for pattern, numbers in made.items():
        cells = (
            TITLES[pattern],
            f"{numbers['FAR_REACHED']:.2f}",
            f"{numbers['DENSITY_REACHED']:.1%}",
            f"{numbers['GREEN_REACHED']:.1%}",
            f"{int(numbers['BUILDING_COUNT'])}",
            f"{int(numbers['DWELLINGS'])}",
            f"{numbers['LEAST_SUN']:.1f} to {numbers['MEAN_SUN']:.1f}",
            f"{numbers['MEAN_WAY']:.0f}",
            f"{numbers['OBJECTIVE']:.2f}",
            f"{numbers['SECONDS']:.0f}",
        )
        lines.append(f"| {' | '.join(cells)} |".replace("%", " %"))
    return lines


def asked_of(zone: Zoned, path: Path) -> str:
    """Say what a zone was asked."""
    import importlib

    from _gallery import PACKAGE

    kinds = importlib.import_module(f"{PACKAGE}.plugin.tools.buildinginputs").TYPE_SETS
    usual = kinds[zone.types]
    hectares = gpd.read_file(path, layer="site").area.sum() / 1e4
    return (
        f"{hectares:.1f} ha, types *{zone.types}*: a floor area ratio of {usual.far:g} is asked, a "
        f"density of {100 * usual.density:g} %, and 35 % green."
    )


def main() -> None:
    """Make the gallery of residential zones, or some of it."""
    parser = argparse.ArgumentParser(prog="gallery buildings", description=__doc__.split(";")[0])
    every = [zone.key for zone in ZONES]
    parser.add_argument("names", nargs="*", metavar="SITE", help=", ".join(every))
    parser.add_argument("--folder", type=Path, help="for pictures and layers; the page stays")
    parser.add_argument("--method", default="optimise", help="as of the tool")
    parser.add_argument("--drawn", action="store_true", help="draw what lies in the folder anew")
    options = parser.parse_args()
    unknown = sorted(set(options.names) - set(every))
    if unknown:
        parser.error(f"there is no site {unknown[0]}; there are {', '.join(every)}")
    with tempfile.TemporaryDirectory() as name:
        started = start(Path(name))
        folders = Folders(
            options.folder or Path(name), options.folder or PICTURES, {"METHOD": options.method}
        )
        folders.layers.mkdir(parents=True, exist_ok=True)
        for zone in ZONES:
            path = given(zone)
            if path is None or (options.names and zone.key not in options.names):
                continue
            if not (options.drawn and options.folder):
                lines = [asked_of(zone, path), "", *figures(lay_out(zone, path, folders))]
                print(zone.name, *lines, "", sep="\n", flush=True)
                if not options.folder:
                    write(PAGE, zone.key, lines)
            draw(zone, path, folders)
    sys.stdout.flush()
    # What lives on at the end of the program would end it badly.
    os._exit(0 if started else 1)


if __name__ == "__main__":
    main()
