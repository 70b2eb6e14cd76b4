"""A layout as it lies in layers, and where chosen land of it has access."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, MultiLineString, Polygon

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Geometries = npt.NDArray[Any]
#: Edges whose middle is this near to a plot lie on it (metres).
ON_PLOT = 0.02
#: Gaps this much wider than a street are none (metres).
SLACK = 0.2
#: Land this near to a street lies along it, times its width: corners are further than the half.
BESIDE = 0.75
#: Plots that give access.
WAYS = ("lane", "street")


@dataclass(frozen=True)
class Existing:
    """A layout as it lies in layers, in metres.

    Attributes
    ----------
    plots
        Parcels, greens and whatever else is no street, shape (n,).
    uses
        What each of them is, shape (n,); lanes and streets among them give access. Empty where
        all are land.
    site
        The whole site, with holes for what is not to be built on; None where it is unknown.
    frontage
        Its edges along existing streets; None for the whole outer edge.
    streets, widths
        Centre lines, and how wide the streets are (or the turning circles at their ends, where
        these are wider), metres.
    """

    plots: Sequence[shapely.Geometry]
    uses: Sequence[str] = ()
    site: shapely.Geometry | None = None
    frontage: shapely.Geometry | None = None
    streets: Sequence[LineString] = ()
    widths: Sequence[float] = ()

    @property
    def half(self) -> float:
        """Half the width of the widest street and a little more, metres."""
        return max(self.widths, default=0.0) / 2 + SLACK


def closed_edges(land: Polygon, others: Geometries, existing: Existing) -> MultiLineString:
    """Edges of land along plots that stay, and those without a street beside them.

    Parameters
    ----------
    land
        A piece of chosen land, metres.
    others
        Plots that stay and give no access, shape (n,).
    existing
        The layout.
    """
    pieces = edge_pieces(land, others)
    middles = shapely.points(pieces.mean(axis=1))
    closed = np.zeros(len(pieces), dtype=bool)
    if len(others):
        tree = shapely.STRtree(others)
        closed[np.unique(tree.query(middles, "dwithin", ON_PLOT)[0])] = True
    open_ = ~closed
    if existing.streets:
        # besides streets of the layer only the edge of the site can have one
        lines = np.array(existing.streets, dtype=object)
        reach = np.array(existing.widths) * BESIDE + SLACK
        near = np.zeros(len(pieces), dtype=bool)
        for wide in np.unique(reach):
            found = shapely.STRtree(lines[reach == wide]).query(middles, "dwithin", wide)[0]
            near[np.unique(found)] = True
        open_ &= near | _on_edge(middles, existing)
    elif existing.site is not None:
        outer = shapely.distance(middles, shapely.boundary(existing.site)) < ON_PLOT
        open_ &= ~outer | _on_edge(middles, existing)
    return MultiLineString(list(pieces[~open_]))


def edge_pieces(land: Polygon, others: Geometries) -> Floats:
    """Edges of land, cut where corners of other plots lie on them, shape (n, 2, 2).

    Parameters
    ----------
    land
        Metres.
    others
        Plots, shape (m,).
    """
    rings = shapely.get_rings(land)
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    inner = np.flatnonzero(ring[1:] == ring[:-1])
    edges = np.stack([xy[inner], xy[inner + 1]], axis=1)
    near = others[shapely.intersects(others, shapely.buffer(land, ON_PLOT))] if len(others) else []
    if not len(near):
        return np.asarray(edges)
    corners = shapely.points(np.unique(shapely.get_coordinates(near), axis=0))
    lines = shapely.linestrings(edges)
    point, edge = shapely.STRtree(lines).query(corners, "dwithin", ON_PLOT)
    along = shapely.line_locate_point(lines[edge], corners[point])
    length = shapely.length(lines)
    inside = (along > ON_PLOT) & (along < length[edge] - ON_PLOT)
    at = np.r_[np.zeros(len(edges)), along[inside], length]
    own = np.r_[np.arange(len(edges)), edge[inside], np.arange(len(edges))]
    order = np.lexsort((at, own))
    at, own = at[order], own[order]
    same = np.flatnonzero((own[1:] == own[:-1]) & (at[1:] > at[:-1]))
    way = (edges[:, 1] - edges[:, 0]) / np.maximum(length, 1e-12)[:, None]
    start, stop = (edges[own[k], 0] + at[k, None] * way[own[k]] for k in (same, same + 1))
    return np.asarray(np.stack([start, stop], axis=1))


def _on_edge(middles: Geometries, existing: Existing) -> Flags:
    """Tell which points lie on the edge of the site along an existing street."""
    if existing.frontage is not None:
        return np.asarray(shapely.distance(middles, existing.frontage) < ON_PLOT)
    whole = existing.site
    if whole is None:
        whole = joined(existing.plots, existing.half)
    rings = [shapely.get_exterior_ring(part) for part in shapely.get_parts(whole)]
    return np.asarray(shapely.distance(middles, shapely.union_all(rings)) < ON_PLOT)


def joined(plots: Sequence[shapely.Geometry], half: float) -> shapely.Geometry:
    """Join plots and the streets between them.

    Parameters
    ----------
    plots
        Metres.
    half
        Half the width of the streets, metres.
    """
    wide = shapely.buffer(shapely.union_all(plots), half, join_style="mitre")
    return shapely.buffer(wide, -half, join_style="mitre")
