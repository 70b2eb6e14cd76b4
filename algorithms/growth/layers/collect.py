"""What has grown as ordinary layers, in the CRS of the input."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import geopandas as gpd
import numpy as np
import shapely

from ...measure.polygons import block_sizes
from ...progress import Progress
from ...site.watch import ask
from ..grammar import ROAD_TYPES
from ..rules import GrowthRules
from ..types import Growth
from .blocks import grown_blocks
from .moments import last_moment, moments
from .outward import Shapes
from .remarks import growth_problems
from .roads import grown_roads
from .ways import LEVELS, Columns, node_columns, street_columns

if TYPE_CHECKING:
    from ..land.ground import RealGround

#: What goes on here, for those who cancel it.
_WORK = "the layers of streets were collected"
COLUMNS: Mapping[str, Sequence[str]] = {
    "streets": (
        "street_id", "status", "level", "level_name", "road", "road_type", "iteration", "length_m",
        "start_state", "end_state", "dist_to_sink_m", "dist_start_m", "dist_end_m", "direction",
        "speed_kmh", "name", "appeared", "until",
    ),
    "nodes": (
        "node_id", "state", "node_type", "road_type", "iteration", "degree", "road", "kind",
        "appeared", "until",
    ),
    "roads": (
        "road", "road_type", "level", "segments", "length_m", "first_iteration", "last_iteration",
        "junctions", "appeared", "until",
    ),
    "blocks": (
        "block_id", "area_m2", "perimeter_m", "width_m", "length_m", "sides", "enclosed",
        "compactness", "iteration", "appeared", "until",
    ),
    "problems": ("layer", "feature", "problem", "action", "severity"),
    "steps": (
        "iteration", "nodes", "segments", "length_m", "population", "growing", "seconds",
    ),
}  # fmt: skip


def growth_layers(
    growth: Growth, real: RealGround, rules: GrowthRules, progress: Progress | None = None
) -> dict[str, gpd.GeoDataFrame]:
    """Give the layers of a growth.

    All measures are taken in the working CRS: metres, square metres, km/h. Fields as in
    `COLUMNS`; "appeared" and "until" are for a player of time, see `moments`.

    Parameters
    ----------
    growth
        What has grown.
    real
        Where.
    rules
        What was asked, for the problems.
    progress
        Asked for cancellation, or None.

    Returns
    -------
    dict of str to geopandas.GeoDataFrame
        "streets" (LineString): grown streets as they grew, from node to node, then those that
        were there, from junction to junction. Streets along the edge of the domain that the
        planner asked for are new. Distances are the shortest ways along streets to an existing
        one or, for streets that meet none, to the edge of the domain; empty where there is
        neither. "nodes" (Point). "roads" (MultiLineString): grown streets of one road number.
        "blocks" (Polygon): what streets and the edge of the domain enclose; compactness is
        4 pi area / perimeter^2, 1 for a circle. "problems": those of the ground and of the growth.
        "steps", without geometry: size and seconds after each iteration (the "complexity data"
        of CS).

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    last = max((step.iteration for step in growth.steps), default=0)
    found = {}
    for key, columns_of in _COLUMNS_OF.items():
        ask(progress, _WORK)
        columns, shapes = columns_of(growth, real)
        found[key] = _frame(key, columns, shapes, real, last)
    columns, shapes = _block_columns(growth, real, progress)
    found["blocks"] = _frame("blocks", columns, shapes, real, last)
    ask(progress, _WORK)
    found["problems"] = growth_problems(growth, real, rules)
    found["steps"] = _steps(growth, real)
    return found


def _frame(
    key: str, columns: Columns, shapes: Shapes, real: RealGround, last: int
) -> gpd.GeoDataFrame:
    """Make a layer of columns; they tell the iteration, which becomes a moment."""
    iteration = columns["first_iteration" if key == "roads" else "iteration"]
    columns["appeared"] = moments(iteration)
    columns["until"] = np.full(len(shapes), last_moment(last))
    geometry = gpd.GeoSeries(shapes, crs=real.crs)
    frame = gpd.GeoDataFrame(
        {name: columns[name] for name in COLUMNS[key]}, geometry=geometry, crs=real.crs
    )
    return frame if real.crs == real.source_crs else frame.to_crs(real.source_crs)


def _road_columns(growth: Growth, _real: RealGround) -> tuple[Columns, Shapes]:
    roads = grown_roads(growth)
    columns = {
        "road": roads.number,
        "road_type": [ROAD_TYPES[kind] for kind in roads.kind],
        "level": np.array([LEVELS[kind] for kind in roads.kind], dtype=np.int64),
        "segments": roads.segments,
        "length_m": roads.length,
        "first_iteration": roads.first,
        "last_iteration": roads.last,
        "junctions": roads.junctions,
    }
    return columns, roads.lines


def _block_columns(
    growth: Growth, real: RealGround, progress: Progress | None
) -> tuple[Columns, Shapes]:
    blocks = grown_blocks(growth, real, progress)
    ask(progress, _WORK)
    area, around = shapely.area(blocks.polygons), shapely.length(blocks.polygons)
    width, length = block_sizes(blocks.polygons)
    columns = {
        "block_id": np.arange(1, len(area) + 1),
        "area_m2": area,
        "perimeter_m": around,
        "width_m": width,
        "length_m": length,
        "sides": blocks.sides,
        "enclosed": np.where(blocks.closed, "streets", "edge").astype(object),
        "compactness": 4 * math.pi * area / around**2,
        "iteration": blocks.iteration,
    }
    return columns, blocks.polygons


_COLUMNS_OF: Mapping[str, Callable[[Growth, RealGround], tuple[Columns, Shapes]]] = {
    "streets": street_columns,
    "nodes": node_columns,
    "roads": _road_columns,
}


def _steps(growth: Growth, real: RealGround) -> gpd.GeoDataFrame:
    """Give the record of the iterations as a table without geometry."""
    rows: dict[str, Any] = {
        name: [getattr(step, name.removesuffix("_m")) for step in growth.steps]
        for name in COLUMNS["steps"]
    }
    return gpd.GeoDataFrame(rows, geometry=[None] * len(growth.steps), crs=real.source_crs)
