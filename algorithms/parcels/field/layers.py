"""Fields and scored lines as layers, so that a planner sees why (UP Fig. 7)."""

from __future__ import annotations

from typing import Any

import geopandas as gpd
import numpy as np
import shapely

from .crosses import CrossField
from .score import GOOD, REASONS, Scores
from .streamlines import Streamlines

#: Arms of crosses, as a share of the size of the triangles.
ARM = 0.35


def field_layers(field: CrossField, crs: Any) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """Crosses and singularities of a field.

    Parameters
    ----------
    field
        The field.
    crs
        Its coordinate reference system.

    Returns
    -------
    crosses
        Crosses of two short lines at the vertices: `angle` of one arm (degrees clockwise from
        north, 0 to 90), `boundary` whether the vertex lies on it.
    singularities
        Points: `quarters`, how many quarters of a turn the crosses make around it.
    """
    at = field.mesh.points @ [1, 1j]
    arm = ARM * field.mesh.size * np.exp(1j * np.angle(field.cross) / 4)
    ends = np.stack([at - arm, at + arm, at - 1j * arm, at + 1j * arm], axis=1).reshape(-1, 2)
    strokes = shapely.linestrings(np.stack([ends.real, ends.imag], axis=-1))
    crosses = shapely.multilinestrings(strokes, indices=np.repeat(np.arange(len(at)), 2))
    on = np.zeros(len(at), bool)
    on[field.mesh.pieces.ravel()] = True
    angle = np.mod(90.0 - np.degrees(np.angle(arm)), 90.0)
    return (
        gpd.GeoDataFrame({"angle": angle, "boundary": on}, geometry=crosses, crs=crs),
        gpd.GeoDataFrame(
            {"quarters": field.index}, geometry=shapely.points(field.singularities), crs=crs
        ),
    )


def line_layer(lines: Streamlines, scores: Scores, crs: Any) -> gpd.GeoDataFrame:
    """Lines with all their scores, the best first.

    Parameters
    ----------
    lines, scores
        Lines and their scores.
    crs
        Their coordinate reference system.

    Returns
    -------
    layer
        `line` (its number), `rank` (1 is the best; 0: no candidate), `quality`, the columns of
        `Scores`, `length` (metres), `partner` (-1 for none) and `reason` (why it is no candidate).
    """
    rank = np.zeros(len(lines), np.int64)
    rank[scores.order] = np.arange(1, len(scores.order) + 1)
    columns = {
        "line": np.arange(len(lines)),
        "rank": rank,
        "quality": scores.quality,
        "div": scores.div,
        "db": scores.db,
        "ds": scores.ds,
        "ct": scores.ct,
        "offset": scores.offset,
        "angle": scores.angle,
        "closed": scores.closed,
        "balance": scores.balance,
        "bend": scores.bend,
        "least_angle": scores.least_angle,
        "length": lines.length,
        "partner": scores.partner,
        "reason": np.array([REASONS[value] for value in scores.reason], dtype=object),
    }
    layer = gpd.GeoDataFrame(columns, geometry=lines.geometry(), crs=crs)
    order = np.lexsort((layer["quality"], scores.reason != GOOD))
    return layer.iloc[order].reset_index(drop=True)
