"""The layers of laid out zones, in the CRS of the input."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
from pyproj import CRS

from ...errors import InputError
from ..layout import Layout
from ..rules import LayoutRules
from .built import building_rows, shadow_rows
from .laid import (
    corridor_rows,
    green_rows,
    parking_rows,
    patch_rows,
    path_rows,
    problem_rows,
    tree_rows,
    zone_rows,
)

Rows = Mapping[str, Any]

COLUMNS: Mapping[str, Sequence[str]] = {
    "zone": (
        "site_id", "feature", "name", "area_m2", "method", "seed", "seconds", "objective",
        "remainder", "grouping", "ways", "pattern",
    ),
    "buildings": (
        "building_id", "site_id", "patch_id", "type", "use", "height_m", "storeys", "footprint_m2",
        "floor_area_m2", "dwellings", "parking", "group", "sun_hours", "shaded", "facing_deg",
        "rotation", "reached", "way_m", "turns",
    ),
    "shadows": ("building_id", "site_id", "rule", "area_m2"),
    "paths": (
        "path_id", "site_id", "patch_id", "kind", "buildings", "length_m", "turns", "width_m",
        "exit",
    ),
    "corridors": ("corridor_id", "site_id", "level", "name", "width_m", "length_m", "edge"),
    "parking": ("parking_id", "site_id", "places", "area_m2"),
    "green": ("green_id", "site_id", "area_m2"),
    "trees": ("tree_id", "site_id", "beside"),
    "patches": (
        "patch_id", "site_id", "feature", "residences", "facilities", "paths", "area_m2",
        "buildings", "far", "density",
    ),
    "problems": ("layer", "feature", "problem", "action", "severity"),
}  # fmt: skip
#: Numbers that go through all zones, by layer.
NUMBERS: Mapping[str, Sequence[str]] = {
    "buildings": ("building_id", "patch_id", "group"),
    "shadows": ("building_id",),
    "paths": ("path_id", "patch_id"),
    "corridors": ("corridor_id",),
    "parking": ("parking_id",),
    "green": ("green_id",),
    "trees": ("tree_id",),
    "patches": ("patch_id",),
}
_ROWS: Mapping[str, Callable[[Layout], Rows]] = {
    "zone": zone_rows,
    "corridors": corridor_rows,
    "parking": parking_rows,
    "green": green_rows,
    "trees": tree_rows,
    "patches": patch_rows,
    "problems": problem_rows,
}
#: Those that tell what was asked.
_RULED: Mapping[str, Callable[[Layout, LayoutRules], Rows]] = {
    "buildings": building_rows,
    "shadows": shadow_rows,
    "paths": path_rows,
}


def zone_layers(layouts: Sequence[Layout], rules: LayoutRules) -> dict[str, gpd.GeoDataFrame]:
    """Give the layers of laid out zones.

    Parameters
    ----------
    layouts
        One for each zone; all from one layer, at least one.
    rules
        What was asked of all of them.

    Returns
    -------
    dict of str to geopandas.GeoDataFrame
        "zone", "buildings", "shadows", "paths", "corridors", "parking", "green", "trees",
        "patches" and "problems", fields as in `COLUMNS`. Numbers of buildings, patches, groups
        and so on begin at 1 and go through all zones. All measures are taken in the working CRS,
        in metres and square metres; `facing_deg` is a true azimuth, and `rotation` turns a symbol
        that has its balconies below into place on a map in the CRS of the layer, degrees
        clockwise.

    Raises
    ------
    InputError
        If there is no layout.
    """
    if not layouts:
        raise InputError("There is no zone to make layers of.", "Lay out a zone first.")
    source = layouts[0].zone.source_crs
    parts: dict[str, list[gpd.GeoDataFrame]] = {name: [] for name in COLUMNS}
    before: dict[str, int] = {}
    for layout in layouts:
        rows = {name: of(layout) for name, of in _ROWS.items()}
        rows.update({name: of(layout, rules) for name, of in _RULED.items()})
        for name, own in rows.items():
            frame = _frame(own, name, layout.zone.crs, source)
            for number in NUMBERS.get(name, ()):
                frame[number] += before.get(number, 0)
            parts[name].append(frame)
        for number, size in {
            "building_id": len(layout.placements),
            "patch_id": len(layout.zone.patches),
            "group": len(np.unique(layout.group)),
            "path_id": len(layout.paths.paths),
            "corridor_id": len(layout.zone.corridors),
            "parking_id": len(layout.details.parking),
            "green_id": len(layout.details.green),
            "tree_id": len(layout.details.trees),
        }.items():
            before[number] = before.get(number, 0) + size
    return {name: _joined(frames, source) for name, frames in parts.items()}


def layout_layers(layout: Layout, rules: LayoutRules) -> dict[str, gpd.GeoDataFrame]:
    """Give the layers of one laid out zone; see `zone_layers`."""
    return zone_layers([layout], rules)


def _frame(rows: Rows, name: str, crs: CRS, source: CRS) -> gpd.GeoDataFrame:
    """Give columns as a layer in the CRS of the input."""
    geometry = np.empty(len(rows["geometry"]), dtype=object)
    geometry[:] = list(rows["geometry"])
    data = {column: rows[column] for column in COLUMNS[name]}
    frame = gpd.GeoDataFrame(data, geometry=gpd.GeoSeries(geometry, crs=crs), crs=crs)
    return frame if crs == source else frame.to_crs(source)


def _joined(frames: Sequence[gpd.GeoDataFrame], source: CRS) -> gpd.GeoDataFrame:
    """Give layers as one."""
    full = [frame for frame in frames if len(frame)]
    if not full:
        return frames[0].set_crs(source, allow_override=True)
    if len(full) == 1:
        return full[0]
    return gpd.GeoDataFrame(pd.concat(full, ignore_index=True), geometry="geometry", crs=source)
