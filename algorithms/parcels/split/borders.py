"""Parcels without streets: the borders between them improved, the outlines of blocks kept."""

from __future__ import annotations

from typing import cast

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from pyproj import CRS
from shapely.geometry import Polygon
from shapely.geometry.polygon import orient

from ...errors import CancelledError
from ...progress import Progress, Silent
from ...site.repair import Problems
from ..land import Place
from ..layers import parcel_layers
from ..refine import refine_blocks
from ..roadmesh import Ground
from ..rules import ParcelRules
from ..types import Block, Plot, PlotUse
from .layout import judge
from .old import LAND, Improved, OldParcels

#: Plots are the same where their corners differ by no more than this (metres).
SAME = 1e-9
#: Smaller plots are left-overs of rounding (square metres).
CRUMB = 0.01


def improve_borders(
    parcels: gpd.GeoDataFrame,
    rules: ParcelRules,
    *,
    layer: str = "Parcels",
    progress: Progress | None = None,
) -> Improved:
    """Make parcels squarer and of more even size; the outlines of their blocks stay.

    A block is what parcels that touch make together; land of other uses stays.

    Parameters
    ----------
    parcels
        Polygons in any CRS; feature ids are the index.
    rules
        What is asked of parcels.
    layer
        Its name, for messages.
    progress
        Told of the work.

    Raises
    ------
    InputError
        If the layer has no CRS or no polygon.
    CancelledError
        If the caller cancels.
    """
    told = progress or Silent()
    old = OldParcels(parcels, layer)
    crs = cast(CRS, old.crs)
    problems = Problems()
    size = shapely.area(old.plots)
    single = [
        k for k, (plot, use) in enumerate(zip(old.plots, old.uses))
        if plot.geom_type == "Polygon" and use in LAND and size[k] > CRUMB
    ]  # fmt: skip
    for k in sorted(set(range(len(old.plots))) - set(single)):
        if old.uses[k] in LAND:
            what = "it has several parts" if size[k] > CRUMB else "it has hardly any area"
            problems.add(
                layer, old.labels[k], what, "it stays as it is", "info",
                old.plots[k], crs,
            )  # fmt: skip
    plots = old.plots[single]
    land = shapely.get_parts(shapely.union_all(plots))
    land = land[shapely.get_type_id(land) == 3]
    home = shapely.STRtree(land).nearest(shapely.point_on_surface(plots))
    blocks, groups, rows = [], [], []
    for number, part in enumerate(land.tolist(), start=1):
        mine = np.flatnonzero(home == number - 1).tolist()
        blocks.append(Block(orient(part), block_id=number))
        rows.append([single[k] for k in mine])
        groups.append([_plot(plots[k], old.uses[single[k]]) for k in mine])
    after = refine_blocks(blocks, groups, rules, told)
    if told.cancelled():
        msg = "cancelled while borders were improved"
        raise CancelledError(msg)
    better = sum(
        any(not _same(a, b) for a, b in zip(one, other)) for one, other in zip(groups, after)
    )
    source = parcels.crs
    places = [Place(crs)] * len(blocks)
    found = parcel_layers(blocks, after, places, source)["parcels"]
    labels = [old.labels[k] for own in rows for k in own]
    found.index = pd.Index(labels)
    _keep_what_stays(
        found, old, [(a, b) for one, other in zip(groups, after) for a, b in zip(one, other)]
    )
    rest = [label for label in old.labels if label not in set(labels)]
    whole = Ground(cast(Polygon, shapely.union_all(old.plots)))
    every = [found.astype(dict.fromkeys(found.columns.drop("geometry"), object))]
    if rest:
        every.append(old.as_given(rest, source))
    joined = gpd.GeoDataFrame(pd.concat(every), geometry="geometry", crs=source)
    joined = joined.loc[[label for label in parcels.index if label in joined.index]]
    return Improved(
        None, joined, problems.to_frame(source), judge(whole, groups), judge(whole, after), 0.0,
        better,
    )  # fmt: skip


def _plot(polygon: Polygon, use: str) -> Plot:
    return Plot(orient(polygon), cast(PlotUse, use or "parcel"))


def _same(one: Plot, other: Plot) -> bool:
    """Tell whether a plot has stayed."""
    return bool(shapely.equals_exact(one.polygon, other.polygon, tolerance=SAME))


def _keep_what_stays(
    found: gpd.GeoDataFrame, old: OldParcels, pairs: list[tuple[Plot, Plot]]
) -> None:
    """Give plots their old numbers, and those that stayed their old geometry."""
    frame = gpd.GeoDataFrame(old.frame)
    shapes = found.geometry.to_numpy().copy()
    for at, (label, (one, other)) in enumerate(zip(found.index, pairs)):
        if _same(one, other):
            shapes[at] = frame.geometry.loc[label]
    found.geometry = gpd.GeoSeries(shapes, index=found.index, crs=found.crs)
    for name in ("parcel_id", "block_id", "site_id", "feature", "note", "template"):
        own = {str(column).lower(): column for column in frame.columns}
        if name in own:
            found[name] = frame.loc[found.index, own[name]].astype(object)
