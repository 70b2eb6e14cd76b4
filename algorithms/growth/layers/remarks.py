"""What a planner should know of a growth, place by place."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from pyproj import CRS
from scipy.spatial import cKDTree

from ...site.repair import Problems
from ..rules import GrowthRules
from ..types import FloatArray, Growth, IntArray
from .outward import at_nodes, components, existing_edges

if TYPE_CHECKING:
    from ..land.ground import RealGround

#: What problems name as their layer.
LAYER = "streets"
#: Share by which a sum of lengths may miss a limit.
ROUNDING = 1e-9
#: A start is the node that lies this near (metres).
SAME = 1e-6


def growth_problems(growth: Growth, real: RealGround, rules: GrowthRules) -> gpd.GeoDataFrame:
    """Give the problems of the ground with those of the growth.

    Parameters
    ----------
    growth, real, rules
        What has grown, where, and what was asked.

    Returns
    -------
    geopandas.GeoDataFrame
        Columns layer, feature, problem, action, severity and the geometry concerned, in the CRS
        of the input.
    """
    crs = CRS.from_user_input(real.source_crs)
    own = Problems()
    for problem, action, severity, place in _remarks(growth, real, rules):
        own.add(LAYER, "", problem, action, severity, place, CRS.from_user_input(real.crs))
    found = own.to_frame(crs)
    if not len(real.problems):
        return found
    given = real.problems if real.problems.crs == crs else real.problems.to_crs(crs)
    if not len(found):
        return given.reset_index(drop=True)
    joined = pd.concat([given, found], ignore_index=True)
    return gpd.GeoDataFrame(joined, geometry="geometry", crs=crs)


_Remark = tuple[str, str, str, "shapely.Geometry | None"]


def _remarks(growth: Growth, real: RealGround, rules: GrowthRules) -> Iterator[_Remark]:
    short = list(_too_small(growth, rules))
    yield from short
    # whoever asked for no size misses none
    if short and growth.left_out:
        streets = "1 street was" if growth.left_out == 1 else f"{growth.left_out} streets were"
        yield (
            f"{streets} not built, because there was no room.",
            "left out; a smaller nearness of junctions or least angle leaves out fewer",
            "info",
            None,
        )
    yield from _idle(growth, real)
    yield from _isolated(growth, real)


def _too_small(growth: Growth, rules: GrowthRules) -> Iterator[_Remark]:
    """Tell what size was asked for and what grew, where growth ended by itself or was cancelled.

    The record is asked, since dead ends may have been taken away meanwhile.
    """
    if not growth.steps:
        return
    last = growth.steps[-1]
    sizes = [
        (rules.max_segments, last.segments, "streets"),
        (rules.max_length, last.length, "m of streets"),
        (rules.population, last.population, "people"),
    ]
    asked = [(rules.iterations, len(growth.steps), "iterations"), *sizes]
    limits = [(limit, got, unit) for limit, got, unit in asked if limit is not None]
    if any(got >= limit * (1 - ROUNDING) for limit, got, _ in limits):
        return
    words = " and ".join(f"{got:,.0f} of {limit:,.0f} {unit}" for limit, got, unit in limits)
    # iterations alone are no wish for a size
    if all(limit is None for limit, _, _ in sizes) and "cancelled" not in growth.stopped:
        return
    action = (
        "left so; give more starts, more ground, a smaller scale or a smaller nearness of junctions"
    )
    if "cancelled" in growth.stopped:
        action = "left so; run it again to the end"
    wished = any(limit is not None for limit, _, _ in sizes)
    text = f"Growth ended with {words}, because {growth.stopped}."
    yield text, action, "warning" if wished else "info", None


def _idle(growth: Growth, real: RealGround) -> Iterator[_Remark]:
    """Tell of starts from which nothing grew: those that were given, and those of streets."""
    starts = real.ground.starts
    if not len(starts) or not len(growth.xy):
        return
    grown = at_nodes(growth, growth.grown)
    node = np.array([start.node for start in starts], dtype=np.int64)
    xy = np.array([start.xy for start in starts], dtype=float)
    gap, near = cKDTree(growth.xy).query(xy)
    given = node < 0
    idle = np.where(given, (gap > SAME) | ~grown[near], ~grown[node])
    for at in xy[idle & given]:
        yield (
            "Nothing grew from this start.",
            "left so; there is no room for a street, or none that its rules draw",
            "warning",
            shapely.Point(at),
        )
    rest = xy[idle & ~given]
    if len(rest):
        yield (
            f"Nothing grew from {len(rest)} of {int((~given).sum())} ends and junctions of "
            "existing streets.",
            "left so; there is no room for a street, or none that the rules draw",
            "info",
            shapely.MultiPoint(rest),
        )


def _isolated(growth: Growth, real: RealGround) -> Iterator[_Remark]:
    """Tell of grown streets that are connected to none of the others that traffic leaves by."""
    label = components(growth)
    size = _length_of_parts(growth, label)
    there = np.zeros(len(size), dtype=bool)
    existing = existing_edges(growth, real)
    there[label[at_nodes(growth, existing)]] = True
    grown = np.flatnonzero(size > 0)
    alone = grown[~there[grown]]
    if not existing.any():
        # the largest part is what the others are not connected to
        alone = alone[alone != size.argmax()] if len(alone) else alone
    other = "an existing street" if existing.any() else "the largest part of the streets"
    first = np.full(len(size), len(growth.xy), dtype=np.int64)
    np.minimum.at(first, label, np.arange(len(growth.xy)))
    for part in alone.tolist():
        yield (
            f"{size[part]:.0f} m of streets that grew here are not connected to {other}.",
            "left so; begin at an existing street, or let them grow until they meet",
            "warning",
            shapely.Point(growth.xy[first[part]]),
        )


def _length_of_parts(growth: Growth, label: IntArray) -> FloatArray:
    """Length of grown streets in each connected part, metres."""
    grown = growth.grown
    return np.bincount(
        label[growth.ends[grown, 0]],
        weights=growth.lengths[grown],
        minlength=int(label.max(initial=-1)) + 1,
    ).astype(float)
