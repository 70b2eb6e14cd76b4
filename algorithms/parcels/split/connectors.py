"""Pieces that carry new streets on from the edge of the site to the centre lines beyond it."""

from __future__ import annotations

from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from shapely.geometry import LineString, MultiLineString

from ...site.types import Site

#: Ends this near to the edge of the site are on it (metres).
ON_EDGE = 0.05
#: Shorter pieces are not worth a feature (metres).
SHORTEST = 0.5


def with_connectors(frame: gpd.GeoDataFrame, site: Site) -> gpd.GeoDataFrame:
    """Add connectors to a layer of streets.

    Parameters
    ----------
    frame
        Streets between junctions, see `roadmesh.street_layer`; working CRS.
    site
        Its boundary streets are what is connected to; where the edge of the site is their centre
        line, nothing is to be added.
    """
    if not site.boundary_streets or not len(frame):
        return frame
    centres = MultiLineString([street.line for street in site.boundary_streets])
    rows: list[dict[str, Any]] = []
    seen: set[tuple[float, float]] = set()
    for _, street in frame.iterrows():
        xy = shapely.get_coordinates(street.geometry)
        for end in (xy[0], xy[-1]):
            key = (round(float(end[0]), 2), round(float(end[1]), 2))
            way = _way(end, site, centres)
            if key not in seen and way is not None:
                seen.add(key)
                rows.append(
                    {
                        **street.to_dict(),
                        "status": "connector",
                        "length_m": float(way.length),
                        "dist_to_sink_m": 0.0,
                        "dist_start_m": 0.0,
                        "dist_end_m": 0.0,
                        "direction": 0,
                        "geometry": way,
                    }
                )
    if not rows:
        return frame
    added = gpd.GeoDataFrame(rows, geometry="geometry", crs=frame.crs)
    joined = pd.concat([frame, added], ignore_index=True)
    joined["street_id"] = np.arange(1, len(joined) + 1)
    return gpd.GeoDataFrame(joined, geometry="geometry", crs=frame.crs)


def _way(end: Any, site: Site, centres: MultiLineString) -> LineString | None:
    """Find the way from the end of a street to the centre line beyond the edge, or None."""
    here = shapely.Point(end)
    if site.street_frontage.distance(here) > ON_EDGE:
        return None
    way = shapely.shortest_line(here, centres)
    return way if SHORTEST < way.length <= site.snap_distance + 1.0 else None
