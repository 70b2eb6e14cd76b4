"""Layouts of sites as ordinary layers, in the CRS of the input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
from pyproj import CRS

from ...site.types import Site
from ..land import Place
from ..layers import parcel_layers
from ..roadmesh import street_layer
from ..roadmesh.layer import COLUMNS as STREET_COLUMNS
from ..types import Block, Plot
from .connectors import with_connectors
from .elements import KeyArea
from .inner_streets import with_inner_streets
from .layout import Layout, Remark

#: Columns that are added to the layers of streets, blocks and parcels.
VARIATION = "variation"
PROBLEMS = ("layer", "feature", "problem", "action", "severity")
SCORES: Mapping[str, str] = {
    "variation": "number of the variation, 1 is the best",
    "parcels": "number of parcels",
    "p_angle": "mean deviation of corners from 90 degrees",
    "p_area": "mean of smallest rectangle around / area",
    "undesirable_pct": "undesirable parcels, %",
    "green_pct": "land that became green, %",
    "street_pct": "land that became street, %",
    "street_m": "length of new streets, m",
    "score": "what they are ranked by, smaller is better",
    "seed": "seed of the variation",
}


@dataclass(frozen=True)
class SiteLayouts:
    """The layouts of a site.

    Attributes
    ----------
    site
        The site.
    variations
        For each variation, one layout for each piece of land that key elements leave.
    areas
        Key areas.
    remarks
        What a planner should know of all of them.
    """

    site: Site
    variations: Sequence[Sequence[Layout]]
    areas: Sequence[KeyArea] = ()
    remarks: Sequence[Remark] = ()


def site_layers(
    sites: Sequence[SiteLayouts], source_crs: CRS, *, turning: float = 0.0
) -> dict[str, gpd.GeoDataFrame]:
    """Give the layers of layouts.

    Parameters
    ----------
    sites
        The sites and their layouts.
    source_crs
        CRS of the layers.
    turning
        Radius of turning circles at blind ends, metres.

    Returns
    -------
    dict of str to geopandas.GeoDataFrame
        "streets", "parcels", "parcel_blocks", "problems" and, without geometry, "variations".
    """
    parts: dict[str, list[pd.DataFrame]] = {
        key: [] for key in ("streets", "parcels", "parcel_blocks", "problems", "variations")
    }
    count = max((len(own.variations) for own in sites), default=0)
    for k in range(count):
        chosen = [(own, own.variations[k]) for own in sites if k < len(own.variations)]
        own = _variation(chosen, source_crs, turning)
        for key, frame in own.items():
            frame[VARIATION] = k + 1
            parts[key].append(frame)
    parts["problems"].append(_problems(sites, source_crs))
    found = {}
    for key, frames in parts.items():
        full = [frame for frame in frames if len(frame)] or frames[:1]
        joined = pd.concat(full, ignore_index=True) if full else pd.DataFrame()
        shapes = joined["geometry"] if "geometry" in joined else [None] * len(joined)
        found[key] = gpd.GeoDataFrame(joined, geometry=list(shapes), crs=source_crs)
    return found


def _variation(
    chosen: Sequence[tuple[SiteLayouts, Sequence[Layout]]], source_crs: CRS, turning: float
) -> dict[str, pd.DataFrame]:
    """Give the layers of one variation of all sites."""
    blocks: list[Block] = []
    plots: list[list[Plot]] = []
    places: list[Place] = []
    streets = []
    for own, layouts in chosen:
        place = Place(own.site.crs, own.site.site_id, str(own.site.feature))
        for layout in layouts:
            for block, cut in zip(layout.blocks, layout.plots):
                blocks.append(Block(block.polygon, block.closed, len(blocks) + 1))
                plots.append(list(cut))
                places.append(place)
            names = [given.name for given in layout.ground.streets]
            frame = street_layer(
                layout.mesh, own.site.crs, site_id=own.site.site_id, names=names, turning=turning
            )
            every = [plot for cut in layout.plots for plot in cut]
            frame = with_inner_streets(
                frame, layout.streets, every, layout.ground.frontage, site_id=own.site.site_id
            )
            streets.append(with_connectors(frame, own.site).to_crs(source_crs))
    found = parcel_layers(blocks, plots, places, source_crs)
    found.pop("street_space", None)
    found["parcels"] = _with_areas(found["parcels"], [own for own, _ in chosen], source_crs)
    full = [frame for frame in streets if len(frame)]
    empty = gpd.GeoDataFrame({c: [] for c in STREET_COLUMNS}, geometry=[], crs=source_crs)
    joined = pd.concat(full, ignore_index=True) if full else empty
    joined["street_id"] = np.arange(1, len(joined) + 1)
    found["streets"] = gpd.GeoDataFrame(joined, geometry="geometry", crs=source_crs)
    found["variations"] = pd.DataFrame([_scores(chosen, found["streets"])])
    return found


def _with_areas(
    parcels: gpd.GeoDataFrame, sites: Sequence[SiteLayouts], source_crs: CRS
) -> gpd.GeoDataFrame:
    """Add the key areas to the parcels, with their use."""
    added = []
    for own in sites:
        rows = {
            "site_id": [own.site.site_id] * len(own.areas),
            "feature": [str(own.site.feature)] * len(own.areas),
            "land_use": [area.use for area in own.areas],
            "area_m2": [area.polygon.area for area in own.areas],
            "note": ["key area"] * len(own.areas),
        }
        shapes = [area.polygon for area in own.areas]
        added.append(gpd.GeoDataFrame(rows, geometry=shapes, crs=own.site.crs).to_crs(source_crs))
    full = [frame for frame in added if len(frame)]
    if not full:
        return parcels
    joined = pd.concat([parcels, *full], ignore_index=True)
    joined["parcel_id"] = np.arange(1, len(joined) + 1)
    return gpd.GeoDataFrame(joined, geometry="geometry", crs=source_crs)


def _scores(
    chosen: Sequence[tuple[SiteLayouts, Sequence[Layout]]], streets: gpd.GeoDataFrame
) -> dict[str, Any]:
    """Sum the scores of all sites up, weighted by what they are means of."""
    layouts = [layout for _, own in chosen for layout in own]
    parcels = np.array([layout.score.parcels for layout in layouts], dtype=float)
    area = np.array([layout.ground.polygon.area for layout in layouts])

    def mean(name: str, weight: Any) -> float:
        values = np.array([getattr(layout.score, name) for layout in layouts])
        return float((values * weight).sum() / max(weight.sum(), 1e-9))

    return {
        "parcels": int(parcels.sum()),
        "p_angle": mean("p_angle", parcels),
        "p_area": mean("p_area", parcels) if parcels.sum() else 1.0,
        "undesirable_pct": 100 * mean("undesirable", parcels),
        "green_pct": 100 * mean("green", area),
        "street_pct": 100 * mean("street", area),
        "street_m": float(streets.loc[streets["status"] == "new", "length_m"].sum()),
        "score": mean("value", area),
        "seed": layouts[0].seed if layouts else 0,
    }


def _problems(sites: Sequence[SiteLayouts], source_crs: CRS) -> gpd.GeoDataFrame:
    """Give what a planner should know of the best layouts."""
    rows: list[dict[str, Any]] = []
    geometry = []
    for own in sites:
        best = list(own.variations[0]) if own.variations else []
        remarks = [*own.remarks, *(remark for layout in best for remark in layout.remarks)]
        places = gpd.GeoSeries([r.place for r in remarks], crs=own.site.crs).to_crs(source_crs)
        for remark, place in zip(remarks, places):
            rows.append(
                {
                    "layer": own.site.name,
                    "feature": str(own.site.feature),
                    "problem": remark.problem,
                    "action": remark.action,
                    "severity": remark.severity,
                }
            )
            geometry.append(place)
    data = {name: [row[name] for row in rows] for name in PROBLEMS}
    return gpd.GeoDataFrame(data, geometry=geometry, crs=source_crs)
