"""Why streets lie where they lie: field and candidates of the first split (UP Fig. 7)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import geopandas as gpd
import numpy as np
import pandas as pd
from pyproj import CRS
from shapely.geometry import LineString

from ...progress import Progress, Silent
from ...site.types import Site
from ..field.crosses import cross_field
from ..field.layers import field_layers, line_layer
from ..field.propose import good_seeds
from ..field.region import Region
from ..field.score import score
from ..field.spacing import Spacing
from ..field.streamlines import streamlines
from ..roadmesh import begin_mesh
from ..rules import ParcelRules
from .junctions import junctions_of
from .layout import Layout
from .rules import SplitRules
from .site_layers import SiteLayouts
from .sites import Elements
from .variations import Arriving

#: Smaller regions have no street, times the square of the depth of parcels.
SMALLEST = 2.0
FIELD = ("site_id", "angle_deg", "boundary")
CANDIDATES = ("site_id", "rank", "quality", "div", "db", "ds", "ct", "length_m", "reason")


def first_splits(
    sites: Sequence[SiteLayouts],
    rules: ParcelRules,
    split: SplitRules,
    source_crs: CRS,
    *,
    elements: Callable[[Site], Elements] | None = None,
    progress: Progress | None = None,
) -> dict[str, gpd.GeoDataFrame]:
    """Give the cross field of each site before its first split, and the streets it offers.

    Parameters
    ----------
    sites
        The sites and their layouts.
    rules, split
        What was asked of parcels and streets.
    source_crs
        CRS of the layers.
    elements
        What the planner fixed on a site, see `lay_out_sites`.
    progress
        Told of the sites; where the caller cancels, the layers are of those that are done.

    Returns
    -------
    dict of str to geopandas.GeoDataFrame
        "cross_field" and "candidates".
    """
    told = progress or Silent()
    crosses: list[gpd.GeoDataFrame] = []
    lines: list[gpd.GeoDataFrame] = []
    for k, own in enumerate(sites):
        told.stage("Drawing the cross field", k / len(sites))
        guides = elements(own.site).guides if elements is not None else ()
        arriving = [(np.array(p.xy), np.array(p.direction)) for p in own.site.access_points]
        for layout in own.variations[0]:
            if told.cancelled():
                break
            field, candidates = _first_split(layout, rules, split, own.site.crs, arriving, guides)
            for frame, found in ((field, crosses), (candidates, lines)):
                frame["site_id"] = own.site.site_id
                found.append(frame.to_crs(source_crs))
    return {
        "cross_field": _joined(crosses, FIELD, source_crs),
        "candidates": _joined(lines, CANDIDATES, source_crs),
    }


def _first_split(
    layout: Layout,
    rules: ParcelRules,
    split: SplitRules,
    crs: CRS,
    arriving: Arriving,
    guides: Sequence[LineString],
) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """Give field and candidates of the regions that a site begins with."""
    mesh, _ = begin_mesh(layout.ground)
    spacing = Spacing(rules.depth, split.street_width)
    crosses, lines = [], []
    for number in sorted(mesh.regions):
        polygon = mesh.polygon(number)
        if polygon.area < SMALLEST * rules.depth**2:
            continue
        region = Region(polygon, mesh.kinds(number), *junctions_of(mesh, number, arriving))
        field = cross_field(polygon, split.field_kind, guides=guides)
        if not len(field.mesh.inner):
            continue
        crosses.append(field_layers(field, crs)[0])
        traced = streamlines(
            field, depth=rules.depth, seed=layout.seed, first=good_seeds(field, region, spacing)
        )
        scores = score(field, traced, region, spacing=spacing, weights=split.weights, across=False)
        lines.append(line_layer(traced, scores, crs))
    return (
        _joined([own.rename(columns={"angle": "angle_deg"}) for own in crosses], FIELD[1:], crs),
        _joined([own.rename(columns={"length": "length_m"}) for own in lines], CANDIDATES[1:], crs),
    )


def _joined(
    frames: Sequence[gpd.GeoDataFrame], columns: Sequence[str], crs: CRS
) -> gpd.GeoDataFrame:
    """Give layers as one, with some of their columns."""
    full = [frame[[*columns, "geometry"]] for frame in frames if len(frame)]
    if not full:
        empty: dict[str, list[object]] = {name: [] for name in columns}
        return gpd.GeoDataFrame(empty, geometry=[], crs=crs)
    found = pd.concat(full, ignore_index=True)
    found = found.replace([np.inf, -np.inf], np.nan)
    return gpd.GeoDataFrame(found, geometry="geometry", crs=crs)
