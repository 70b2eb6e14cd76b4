"""The streets of a mesh as a layer with the fields that designed streets have."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import geopandas as gpd
import numpy as np
from pyproj import CRS

from ...levels import CUL_DE_SAC, LEVEL_NAMES, SPEEDS
from .mesh import StreetMesh
from .ranks import street_levels, ways_out
from .streets import dead_ends, street_lines

#: The fields, in their order.
COLUMNS = (
    "street_id", "site_id", "level", "status", "length_m", "dist_to_sink_m", "dist_start_m",
    "dist_end_m", "direction", "speed_kmh", "name", "level_name", "turning_m", "oneway", "width_m",
)  # fmt: skip
#: Ways out that differ by less have no direction (metres).
LEVEL = 0.01


def street_layer(
    mesh: StreetMesh,
    crs: CRS,
    *,
    site_id: int = 1,
    names: Sequence[str] = (),
    turning: float = 0.0,
) -> gpd.GeoDataFrame:
    """Give the streets between junctions as a layer in the working CRS.

    Parameters
    ----------
    mesh
        The mesh.
    crs
        Its CRS, in metres.
    site_id
        Number of the site.
    names
        Names of the given streets, by their number.
    turning
        Radius of turning circles at blind ends, metres.

    Returns
    -------
    geopandas.GeoDataFrame
        One row per street between junctions, columns `COLUMNS`; lengths and distances in metres,
        speeds in km/h.
    """
    streets = street_lines(mesh)
    blind = dead_ends(mesh)
    levels = street_levels(mesh, streets, blind)
    out = ways_out(mesh, streets)
    rows: list[dict[str, Any]] = []
    for k, (street, level, ways) in enumerate(zip(streets, levels.tolist(), out), start=1):
        start, stop = (float(way) if np.isfinite(way) else None for way in ways)
        rows.append(
            {
                "street_id": k,
                "site_id": site_id,
                "level": level,
                "status": "given" if street.fixed else "new",
                "length_m": street.line.length,
                "dist_to_sink_m": None if start is None or stop is None else (start + stop) / 2,
                "dist_start_m": start,
                "dist_end_m": stop,
                "direction": _direction(start, stop),
                "speed_kmh": SPEEDS[level],
                "name": names[street.street] if street.street < len(names) else "",
                "level_name": LEVEL_NAMES[level],
                "turning_m": turning if level == CUL_DE_SAC else None,
                "oneway": False,
                "width_m": street.width,
            }
        )
    data = {name: [row[name] for row in rows] for name in COLUMNS}
    return gpd.GeoDataFrame(data, geometry=[s.line for s in streets], crs=crs)


def _direction(start: float | None, stop: float | None) -> int:
    """Tell which way leads out: 1 along the line, -1 against it, 0 neither."""
    if start is None or stop is None or abs(start - stop) < LEVEL:
        return 0
    return 1 if stop < start else -1
