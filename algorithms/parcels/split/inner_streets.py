"""Streets inside blocks, which templates bring along, as rows of the layer of streets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from shapely.geometry import LineString, MultiLineString

from ...levels import CUL_DE_SAC, LEVEL_NAMES, SPEEDS
from ..types import Plot

#: Ends this near to the centre line of a street, or to the frontage, are connected (metres).
REACH = 25.0
#: Ends further inside the space of their street than this end there, in a turning head (metres).
INSIDE = 1.0
#: Ends this near to a street are on it (metres).
MEETS = 1e-6
#: Plots that streets inside blocks lie on.
WAYS = ("street", "lane")


def with_inner_streets(
    frame: gpd.GeoDataFrame,
    inner: Sequence[LineString],
    plots: Sequence[Plot],
    frontage: MultiLineString,
    *,
    site_id: int = 1,
) -> gpd.GeoDataFrame:
    """Add the streets of templates to a layer of streets, drawn on to the streets outside.

    Parameters
    ----------
    frame
        Streets between junctions, see `roadmesh.street_layer`; working CRS.
    inner
        Centre lines inside blocks, metres.
    plots
        All plots; streets and lanes among them say how wide the lines are.
    frontage
        Edges of the site along existing streets.
    site_id
        Number of the site.
    """
    if not inner:
        return frame
    ways = np.array([p.polygon for p in plots if p.use in WAYS], dtype=object)
    rows = [_row(line, frame, frontage, ways) for line in inner]
    frame = _with_vertices(frame, [row["geometry"] for row in rows])
    for row in rows:
        row["site_id"] = site_id
    added = gpd.GeoDataFrame(rows, geometry="geometry", crs=frame.crs)
    joined = pd.concat([frame, added], ignore_index=True) if len(frame) else added
    joined["street_id"] = np.arange(1, len(joined) + 1)
    columns = [*(c for c in frame.columns if c != "geometry"), "geometry"]
    return gpd.GeoDataFrame(joined[columns], geometry="geometry", crs=frame.crs)


def _with_vertices(frame: gpd.GeoDataFrame, lines: Sequence[LineString]) -> gpd.GeoDataFrame:
    """Give streets a vertex where others meet them, so that networks are joined there."""
    shapes = frame.geometry.to_numpy().copy()
    for line in lines:
        for end in (line.coords[0], line.coords[-1]):
            here = shapely.Point(end)
            for k in np.flatnonzero(shapely.distance(shapes, here) < MEETS):
                xy = shapely.get_coordinates(shapes[k])
                at = float(shapes[k].project(here))
                step = np.r_[0.0, np.cumsum(np.hypot(*np.diff(xy, axis=0).T))]
                if np.abs(step - at).min() > MEETS:
                    shapes[k] = LineString(np.insert(xy, np.searchsorted(step, at), end, axis=0))
    return frame.set_geometry(gpd.GeoSeries(shapes, index=frame.index, crs=frame.crs))


def _row(
    line: LineString, frame: gpd.GeoDataFrame, frontage: MultiLineString, ways: Any
) -> dict[str, Any]:
    """Describe one street; it begins where it is entered."""
    xy = shapely.get_coordinates(line)
    starts = [_entry(shapely.Point(end), frame, frontage, ways) for end in (xy[0], xy[-1])]
    if starts[0] is None and starts[1] is not None:
        xy, starts = xy[::-1], starts[::-1]
    if starts[0] is not None:
        xy = np.vstack([starts[0][0], xy])
    if starts[1] is not None:
        xy = np.vstack([xy, starts[1][0]])
    whole = LineString(xy)
    known = [None if own is None else own[1] for own in starts]
    blind = starts[1] is None
    far = [own for own in known if own is not None]
    out = [None, None] if not far else _ways_out(known, float(whole.length))
    return {
        "level": CUL_DE_SAC,
        "level_name": LEVEL_NAMES[CUL_DE_SAC],
        "status": "new",
        "length_m": float(whole.length),
        "dist_to_sink_m": None if out[0] is None or out[1] is None else (out[0] + out[1]) / 2,
        "dist_start_m": out[0],
        "dist_end_m": out[1],
        "direction": -1 if blind and far else 0,
        "speed_kmh": SPEEDS[CUL_DE_SAC],
        "name": "",
        "turning_m": None,
        "oneway": False,
        "width_m": _width(line, ways),
        "geometry": whole,
    }


def _ways_out(known: Sequence[float | None], length: float) -> list[float | None]:
    """Give the ways out from both ends, the shorter way round."""
    start = np.inf if known[0] is None else known[0]
    stop = np.inf if known[1] is None else known[1]
    return [float(min(start, stop + length)), float(min(stop, start + length))]


def _entry(
    end: shapely.Point, frame: gpd.GeoDataFrame, frontage: MultiLineString, ways: Any
) -> tuple[Any, float] | None:
    """Find where a street is entered: the place, and how far it is from there to leave the site."""
    if len(ways) and shapely.contains(shapely.buffer(ways, -INSIDE), end).any():
        return None
    best: tuple[float, Any, float] | None = None
    if not frontage.is_empty and frontage.distance(end) < REACH:
        way = shapely.shortest_line(end, frontage)
        best = (float(way.length), shapely.get_coordinates(way)[1], 0.0)
    if len(frame):
        lines = frame.geometry.to_numpy()
        off = shapely.distance(lines, end)
        k = int(np.argmin(off))
        if off[k] < REACH and (best is None or off[k] < best[0]):
            at = float(shapely.line_locate_point(lines[k], end))
            place = shapely.get_coordinates(shapely.line_interpolate_point(lines[k], at))[0]
            best = (float(off[k]), place, _leaving(frame.iloc[k], at))
    return None if best is None else (best[1], best[2])


def _leaving(street: Any, at: float) -> float:
    """Way out from a place along a street, metres."""
    start, stop = (
        np.inf if street[name] is None or street[name] != street[name] else float(street[name])
        for name in ("dist_start_m", "dist_end_m")
    )
    return float(min(start + at, stop + float(street["length_m"]) - at))


def _width(line: LineString, ways: Any) -> float | None:
    """Width of the plot that a street lies on, measured at its middle, metres."""
    middle = line.interpolate(0.5, normalized=True)
    for way in ways[shapely.intersects(ways, middle)]:
        return round(2 * float(way.boundary.distance(middle)), 2)
    return None
