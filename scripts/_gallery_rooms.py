"""Design floor plans and game levels in QGIS, draw them, write figures; see `gallery`."""

from __future__ import annotations

import argparse
import os
import re
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from _gallery import PACKAGE, ROOT, start
from _gallery_rooms_places import ROOMS, Room
from _pages import write

PICTURES = ROOT / "docs" / "images" / "rooms"
#: Page and name of the table of a tool.
PAGES = {
    "designfloor": (ROOT / "docs" / "floors.md", "floors"),
    "designgamelevel": (ROOT / "docs" / "levels.md", "levels"),
}
HEADS = {
    "designfloor": (
        "| plan | cells' sides | rooms | area, m² | corridors | way, mean / longest, m "
        "| objective (bound) | gap | first plan, s | s |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ),
    "designgamelevel": (
        "| level | blocks | doors | treasures | route, m | objective (bound) | gap "
        "| first plan, s | s |",
        "|---|---|---|---|---|---|---|---|---|",
    ),
}
#: Outputs that are kept, by tool and key: the table.
TABLES = {
    "designfloor": {
        "DOORS": "doors", "CORRIDOR_LINES": "lines", "SHAFTS": "shafts", "CORRIDORS": "corridors",
        "ROOMS": "rooms", "CELLS": "cells", "PROBLEMS": "problems",
    },
    "designgamelevel": {
        "START_GOAL": "ends", "DOORS": "doors", "ROUTE": "route", "BLOCKS": "blocks",
        "PROBLEMS": "problems",
    },
}  # fmt: skip
#: What is drawn, from the top down: table and kind of the layer.
DRAWN = {
    "designfloor": {
        "doors": "FLOOR_DOORS", "lines": "CORRIDOR_LINES", "shafts": "FLOOR_OBSTACLES",
        "corridors": "FLOOR_CORRIDORS", "rooms": "ROOMS",
    },
    "designgamelevel": {
        "ends": "ENDS", "doors": "DOORS", "route": "ROUTE", "blocks": "BLOCKS"
    },
}  # fmt: skip
#: What the log says of plans.
BETTER = re.compile(r"Best design .* after ([0-9.]+) s")


@dataclass(frozen=True)
class Made:
    """A design: its layers, the numbers of the tool, and seconds until the first plan."""

    path: Path
    numbers: dict[str, Any]
    first: float


def design(room: Room, inputs: dict[str, str], path: Path) -> Made:
    """Run the tool of a plan; its layers go into one GeoPackage.

    Raises
    ------
    RuntimeError
        If the tool fails, or finds no plan.
    """
    from qgis.core import QgsApplication, QgsProcessingContext, QgsProcessingFeedback

    said: list[str] = []

    class Heard(QgsProcessingFeedback):
        def pushInfo(self, info: str) -> None:  # noqa: N802
            said.append(info)

        def pushWarning(self, warning: str) -> None:  # noqa: N802
            print(f"{room.key}: {warning}", file=sys.stderr)

        def reportError(self, error: str, fatalError: bool = False) -> None:  # noqa: N802, N803, ARG002
            print(f"{room.key}: {error}", file=sys.stderr)

    path.unlink(missing_ok=True)
    sinks = {
        key: f"ogr:dbname='{path}' table=\"{name}\" (geom)"
        for key, name in TABLES[room.tool].items()
    }
    tool = QgsApplication.processingRegistry().createAlgorithmById(f"platwright:{room.tool}")
    asked = {**room.asked, **inputs, **sinks}
    numbers, good = tool.run(asked, QgsProcessingContext(), Heard(False))
    if not good or "OBJECTIVE" not in numbers:
        msg = f"{room.key}: {room.tool} made no plan"
        raise RuntimeError(msg)
    return Made(path, numbers, first_plan(said))


def first_plan(said: Sequence[str]) -> float:
    """Return the seconds until the first plan of the slowest storey, from the log."""
    firsts = []
    waiting = True
    for line in said:
        found = BETTER.search(line)
        if line.startswith("Storey"):
            waiting = True
        elif found and waiting:
            firsts.append(float(found.group(1)))
            waiting = False
    return max(firsts, default=float("nan"))


def row(room: Room, made: Made) -> str:
    """Write the figures of a plan."""
    n = made.numbers
    ends = (
        f"{n['OBJECTIVE']:.0f} ({n['BOUND']:.0f})", f"{n['GAP']:.0f} %", f"{made.first:.1f}",
        f"{n['SECONDS']:.0f}",
    )  # fmt: skip
    if room.tool == "designfloor":
        areas = [room["area_m2"] for room in features(made.path, "rooms")]
        own = (
            f"{edges(made.path)}", f"{len(areas)}", f"{sum(areas):.0f}",
            f"{n['CORRIDOR_SHARE']:.1f} %", f"{n['MEAN_EGRESS']:.0f} / {n['MAX_EGRESS']:.0f}",
        )  # fmt: skip
    else:
        own = (
            f"{n['BLOCK_COUNT']:.0f}", f"{n['DOOR_COUNT']:.0f}",
            f"{n['TREASURES']:.0f}", f"{n['ROUTE_LENGTH']:.0f}",
        )  # fmt: skip
    return f"| {' | '.join((room.name, *own, *ends))} |"


def features(path: Path, table: str) -> list[Any]:
    """Return the features of a table: QGIS has the file open, and no other library may read it."""
    from qgis.core import QgsVectorLayer

    return list(QgsVectorLayer(f"{path}|layername={table}", table, "ogr").getFeatures())


def edges(path: Path) -> int:
    """Return the number of sides of the cells of a storey."""
    cells = features(path, "cells")
    lowest = min(cell["floor"] for cell in cells)
    found = set()
    for cell in cells:
        if cell["floor"] == lowest:
            at = [(round(p.x(), 3), round(p.y(), 3)) for p in cell.geometry().vertices()]
            found |= {tuple(sorted(pair)) for pair in zip(at, at[1:])}
    return len(found)


def styled(path: Path, table: str, kind: str, style: str) -> Any:
    """Return a copy of a layer in the style that the plugin gives its kind, or a further one."""
    import importlib

    from qgis.core import QgsFeatureRequest, QgsVectorLayer

    layer = QgsVectorLayer(f"{path}|layername={table}", table, "ogr")
    copy = layer.materialize(QgsFeatureRequest())
    what = getattr(importlib.import_module(f"{PACKAGE}.plugin.room_fields"), kind)
    importlib.import_module(f"{PACKAGE}.plugin.styles").apply(copy, what)
    others = importlib.import_module(f"{PACKAGE}.plugin.renderers").OTHERS.get(what.style, {})
    if style in others:
        copy.setRenderer(others[style](copy))
    return copy


def draw(room: Room, given: dict[str, str], made: Made, target: Path) -> int:
    """Draw a plan in the styles that the plugin gives its layers; return the bytes."""
    from qgis.core import QgsVectorLayer

    import _gallery_rooms_maps as maps

    outline = QgsVectorLayer(given["INPUT"], "outline", "ogr")
    plans = []
    for storey in room.shown:
        layers = []
        for table, kind in DRAWN[room.tool].items():
            layer = styled(made.path, table, kind, room.style)
            layers.append(maps.of_storey(layer, storey))
        if "SINKS" in given and room.tool == "designfloor":
            exits = QgsVectorLayer(given["SINKS"], "exits", "ogr")
            layers.insert(0, maps.exits(exits, storey))
        plans.append((f"storey {storey}", layers))
    if len(plans) == 1:
        return maps.plan(plans[0][1], outline, room.wide, room.credit, target)
    return maps.storeys(plans, outline, room.credit, target)


def main() -> None:
    """Make the gallery of rooms, or some of it."""
    parser = argparse.ArgumentParser(prog="gallery rooms", description=__doc__.split(";")[0])
    every = [room.key for room in ROOMS]
    parser.add_argument("names", nargs="*", metavar="PLAN", help=", ".join(every))
    parser.add_argument("--folder", type=Path, help="for pictures and layers; the pages stay")
    parser.add_argument("--drawn", action="store_true", help="draw what lies in the folder anew")
    options = parser.parse_args()
    unknown = sorted(set(options.names) - set(every))
    if unknown:
        parser.error(f"there is no plan {unknown[0]}; there are {', '.join(every)}")
    with tempfile.TemporaryDirectory() as name:
        started = start(Path(name))
        make(options, Path(name))
    sys.stdout.flush()
    # What lives on at the end of the program would end it badly.
    os._exit(0 if started else 1)


def make(options: argparse.Namespace, folder: Path) -> None:
    """Design, draw and tell of the plans that are asked for."""
    layers = options.folder or folder
    layers.mkdir(parents=True, exist_ok=True)
    rows: dict[str, dict[str, str]] = {tool: {} for tool in PAGES}
    for room in ROOMS:
        if options.names and room.key not in options.names:
            continue
        inputs = room.make()
        if inputs is None:
            continue
        given = inputs.write(
            layers / f"{room.key}_given.gpkg", room.asked.get("TEMPLATE_SET", "caves")
        )
        made = Made(layers / f"{room.key}.gpkg", {}, 0.0)
        if not options.drawn:
            made = design(room, given, made.path)
            rows[room.tool][room.name] = row(room, made)
            print(row(room, made), flush=True)
        size = draw(room, given, made, (options.folder or PICTURES) / f"{room.key}.png")
        print(f"{room.key}.png: {size / 1000:.0f} kB", flush=True)
    for tool, found in rows.items():
        if found and not options.folder:
            page, key = PAGES[tool]
            write(page, key, table(page, tool, found))


def table(page: Path, tool: str, found: dict[str, str]) -> list[str]:
    """Return the table of a page: the rows that were made, and those it has of other plans."""
    lines = page.read_text(encoding="utf-8").splitlines()
    names = [room.name for room in ROOMS if room.tool == tool]
    kept = {name: line for name in names for line in lines if line.startswith(f"| {name} |")}
    rows = {**kept, **found}
    return [*HEADS[tool], *(rows[name] for name in names if name in rows)]


if __name__ == "__main__":
    main()
