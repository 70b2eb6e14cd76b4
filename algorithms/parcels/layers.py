"""Blocks and their plots as ordinary layers, in the CRS of the input."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import pandas as pd
import shapely
from pyproj import CRS

from ..errors import InputError
from ..measure.parcel_shape import corner_deviation, rectangle_ratio, undesirable
from ..measure.parcels import ACCESS, depths
from ..measure.street_edges import beside, edges_of, pieces
from ..progress import Progress
from ..site.watch import ask
from .land import Place
from .types import Block, Plot

if TYPE_CHECKING:
    from .fill.result import FillProblem

Floats = npt.NDArray[np.float64]

#: What goes on here, for those who cancel it.
_WORK = "the layers of parcels were collected"
#: Plots have their edges this near to the edges of their block (metres).
NEAR = 0.05
#: A parcel lies at a corner where it has at least so much along each of two streets ... (metres)
CORNER_SIDE = 3.0
#: ... that differ in their direction by more than this (degrees).
CORNER_TURN = 45.0
#: Plots from which others have their access.
WAYS = ("lane", "street")

COLUMNS: Mapping[str, Sequence[str]] = {
    "parcels": (
        "parcel_id", "block_id", "site_id", "feature", "land_use", "area_m2", "frontage_m",
        "depth_m", "width_m", "p_angle", "p_area", "undesirable", "corner", "access", "template",
        "note",
    ),
    "parcel_blocks": (
        "block_id", "site_id", "feature", "area_m2", "perimeter_m", "open_m", "parcels", "green_m2",
    ),
    "street_space": ("site_id", "feature", "area_m2"),
    "problems": ("layer", "feature", "problem", "action", "severity"),
}  # fmt: skip


@dataclass(frozen=True)
class _Sides:
    """What lies along streets of plots, one number for each, metres.

    Attributes
    ----------
    frontage
        Length of the outline along streets.
    depth
        Extent away from the street.
    corner
        Whether it lies along two streets of different direction.
    """

    frontage: Floats
    depth: Floats
    corner: npt.NDArray[np.bool_]


def parcel_layers(
    blocks: Sequence[Block],
    plots: Sequence[Sequence[Plot]],
    places: Sequence[Place],
    source_crs: CRS,
    *,
    space: Sequence[tuple[shapely.Geometry, Place]] = (),
    progress: Progress | None = None,
) -> dict[str, gpd.GeoDataFrame]:
    """Give the layers of blocks that were cut into plots.

    Parameters
    ----------
    blocks
        The blocks, n of them, metres.
    plots
        Plots of each block, n lists.
    places
        Where each block is from, n of them.
    source_crs
        CRS of the layers.
    space
        Street space, with where it is from.
    progress
        Asked for cancellation.

    Returns
    -------
    dict of str to geopandas.GeoDataFrame
        "parcels": one row for each plot, block by block; frontage, depth, width, p_angle, p_area,
        undesirable, corner and access of parcels alone. "parcel_blocks" and "street_space". Fields
        as in `COLUMNS`; all measures are taken in the working CRS, in metres and square metres.

    Raises
    ------
    InputError
        If there are not as many lists of plots and places as blocks.
    CancelledError
        If the caller cancels.
    """
    if not len(blocks) == len(plots) == len(places):
        raise InputError(
            f"There are {len(blocks)} blocks, {len(plots)} lists of plots and {len(places)} "
            "places.",
            "Give one of each for every block.",
        )
    parcels: list[gpd.GeoDataFrame] = []
    own_blocks: list[gpd.GeoDataFrame] = []
    streets: list[gpd.GeoDataFrame] = []
    crss = list(dict.fromkeys([p.crs for p in places] + [p.crs for _, p in space]))
    for crs in crss:
        ask(progress, _WORK)
        here = [at for at, place in enumerate(places) if place.crs == crs]
        some = [blocks[at] for at in here]
        edges = _open_edges(some)
        rows = _parcel_rows(some, [plots[at] for at in here], [places[at] for at in here], edges)
        parcels.append(_frame(rows, "parcels", crs, source_crs))
        rows = _block_rows(some, [plots[at] for at in here], [places[at] for at in here], edges)
        own_blocks.append(_frame(rows, "parcel_blocks", crs, source_crs))
        taken = [(shape, place) for shape, place in space if place.crs == crs]
        rows = {
            "site_id": [place.site_id or None for _, place in taken],
            "feature": [place.feature for _, place in taken],
            "area_m2": [shape.area for shape, _ in taken],
            "geometry": [shape for shape, _ in taken],
        }
        streets.append(_frame(rows, "street_space", crs, source_crs))
    found = {
        "parcels": _joined(parcels, "parcels", source_crs),
        "parcel_blocks": _joined(own_blocks, "parcel_blocks", source_crs),
        "street_space": _joined(streets, "street_space", source_crs),
    }
    order = np.argsort(found["parcels"]["block_id"].to_numpy(), kind="stable")
    found["parcels"] = found["parcels"].iloc[order].reset_index(drop=True)
    found["parcels"]["parcel_id"] = np.arange(1, len(order) + 1)
    return found


def parcel_numbers(parcels: gpd.GeoDataFrame) -> dict[str, float]:
    """Give the figures of a layer of parcels.

    Parameters
    ----------
    parcels
        The layer "parcels" of `parcel_layers`.

    Returns
    -------
    dict of str to float
        PARCELS, their number; MEAN_P_ANGLE (degrees), MEAN_P_AREA; UNDESIRABLE and WITH_ACCESS,
        shares of their number, %; GREEN, the share of plots that are green or court in the area of
        all, %. nan where there is no parcel.
    """
    own = parcels[parcels["land_use"] == "parcel"]
    area = float(parcels["area_m2"].sum())
    green = float(parcels.loc[parcels["land_use"].isin(["green", "court"]), "area_m2"].sum())

    def mean(name: str, factor: float = 1.0) -> float:
        return factor * float(own[name].astype(float).mean()) if len(own) else math.nan

    return {
        "PARCELS": float(len(own)),
        "MEAN_P_ANGLE": mean("p_angle"),
        "MEAN_P_AREA": mean("p_area"),
        "UNDESIRABLE": mean("undesirable", 100.0),
        "WITH_ACCESS": mean("access", 100.0),
        "GREEN": 100.0 * green / area if area else math.nan,
    }


def block_problems(
    problems: Sequence[FillProblem],
    blocks: Sequence[Block],
    places: Sequence[Place],
    layer: str,
    source_crs: CRS,
) -> gpd.GeoDataFrame:
    """Give what went otherwise than asked while blocks were cut, as a layer of problems.

    Parameters
    ----------
    problems
        As `fill_blocks` tells them.
    blocks, places
        See `parcel_layers`.
    layer
        Name of the layer that the blocks are from.
    source_crs
        CRS of the layer of problems.
    """
    of = {block.block_id: place for block, place in zip(blocks, places)}
    frames = []
    for crs in dict.fromkeys(place.crs for place in places):
        own = [problem for problem in problems if of[problem.block_id].crs == crs]
        rows = {
            "layer": [layer] * len(own),
            "feature": [of[problem.block_id].feature for problem in own],
            "problem": [f"Block {problem.block_id}: {problem.reason}" for problem in own],
            "action": [problem.done for problem in own],
            "severity": ["warning"] * len(own),
            "geometry": [problem.place for problem in own],
        }
        frames.append(_frame(rows, "problems", crs, source_crs))
    return _joined(frames, "problems", source_crs)


def _parcel_rows(
    blocks: Sequence[Block],
    plots: Sequence[Sequence[Plot]],
    places: Sequence[Place],
    edges: npt.NDArray[Any],
) -> dict[str, Any]:
    """Columns of the parcels."""
    every = [plot for own in plots for plot in own]
    of = np.repeat(np.arange(len(blocks)), [len(own) for own in plots])
    polygons = np.array([plot.polygon for plot in every], dtype=object)
    parcel = np.array([plot.use == "parcel" for plot in every], dtype=bool)
    ways = np.array([plot.polygon for plot in every if plot.use in WAYS], dtype=object)
    sides = _sides(polygons, [*edges, *ways])
    area = shapely.area(polygons)
    angle, ratio = corner_deviation(polygons), rectangle_ratio(polygons)

    def told(values: Any) -> list[Any]:
        """Leave out what is no parcel."""
        return [value if yes else None for value, yes in zip(values.tolist(), parcel)]

    return {
        "parcel_id": np.arange(1, len(every) + 1),
        "block_id": [blocks[at].block_id for at in of],
        "site_id": [places[at].site_id or None for at in of],
        "feature": [places[at].feature for at in of],
        "land_use": [plot.use for plot in every],
        "area_m2": area,
        "frontage_m": told(sides.frontage),
        "depth_m": told(sides.depth),
        "width_m": told(area / np.maximum(sides.depth, 1e-9)),
        "p_angle": told(angle),
        "p_area": told(ratio),
        "undesirable": told(undesirable(angle, ratio)),
        "corner": told(sides.corner),
        "access": told(sides.frontage >= ACCESS),
        "template": [plot.template for plot in every],
        "note": [plot.note for plot in every],
        "geometry": polygons,
    }


def _block_rows(
    blocks: Sequence[Block],
    plots: Sequence[Sequence[Plot]],
    places: Sequence[Place],
    edges: npt.NDArray[Any],
) -> dict[str, Any]:
    """Columns of the blocks."""
    green = [[p.polygon.area for p in own if p.use in ("green", "court")] for own in plots]
    return {
        "block_id": [block.block_id for block in blocks],
        "site_id": [place.site_id or None for place in places],
        "feature": [place.feature for place in places],
        "area_m2": [block.polygon.area for block in blocks],
        "perimeter_m": [block.polygon.length for block in blocks],
        "open_m": shapely.length(edges),
        "parcels": [sum(p.use == "parcel" for p in own) for own in plots],
        "green_m2": [float(sum(own)) for own in green],
        "geometry": [block.polygon for block in blocks],
    }


def _open_edges(blocks: Sequence[Block]) -> npt.NDArray[Any]:
    """Parts of the rings of blocks along which there is access."""
    found = shapely.boundary(np.array([block.polygon for block in blocks], dtype=object))
    closed = np.array([block.closed for block in blocks], dtype=object)
    some = ~shapely.is_empty(closed)
    shut = shapely.buffer(closed[some], NEAR, cap_style="flat")
    found[some] = shapely.difference(found[some], shut)
    return np.asarray(found)


def _sides(polygons: npt.NDArray[Any], streets: Sequence[Any]) -> _Sides:
    """Find what of plots lies along streets."""
    count = len(polygons)
    edges = edges_of(polygons, holes=False)
    along = np.empty(len(streets), dtype=object)
    along[:] = list(streets)
    ways = edges_of(along, holes=True)
    open_: Floats = np.zeros(len(edges.owner))
    if len(edges.owner) and len(ways.owner):
        edge, length, inside = pieces(edges, [beside(edges, ways, NEAR, facing=False)])
        open_ = np.asarray(
            np.bincount(edge, weights=length * inside[0], minlength=len(edges.owner)), dtype=float
        )
    depth = depths(polygons, edges, open_, np.arange(count))
    total = np.bincount(edges.owner, weights=open_, minlength=count)
    # the direction of the longest front of each, by sorting
    front = np.zeros((count, 2))
    use = np.flatnonzero(open_ > 0)
    order = use[np.lexsort((-open_[use], edges.owner[use]))]
    owner, first = np.unique(edges.owner[order], return_index=True)
    front[owner] = edges.direction[order[first]]
    cosine = np.abs((edges.direction * front[edges.owner]).sum(axis=1))
    alike = cosine > math.cos(math.radians(CORNER_TURN))
    same = np.bincount(edges.owner, weights=open_ * alike, minlength=count)
    corner = (same >= CORNER_SIDE) & (total - same >= CORNER_SIDE)
    return _Sides(np.asarray(total), depth, corner)


def _frame(rows: Mapping[str, Any], layer: str, crs: CRS, source: CRS) -> gpd.GeoDataFrame:
    """Give columns as a layer in the CRS of the input."""
    geometry = np.empty(len(rows["geometry"]), dtype=object)
    geometry[:] = list(rows["geometry"])
    data = {name: rows[name] for name in COLUMNS[layer]}
    frame = gpd.GeoDataFrame(data, geometry=gpd.GeoSeries(geometry, crs=crs), crs=crs)
    return frame if crs == source else frame.to_crs(source)


def _joined(frames: list[gpd.GeoDataFrame], layer: str, source: CRS) -> gpd.GeoDataFrame:
    """Give layers as one."""
    full = [own for own in frames if len(own)]
    if not full:
        empty: dict[str, list[Any]] = {name: [] for name in COLUMNS[layer]}
        return gpd.GeoDataFrame(empty, geometry=gpd.GeoSeries([], crs=source), crs=source)
    return gpd.GeoDataFrame(pd.concat(full, ignore_index=True), geometry="geometry", crs=source)
