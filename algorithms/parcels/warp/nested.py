"""Faces of a template that other templates fill."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, MultiLineString, Polygon

from ..types import Block, Plot
from .form import ACCESS
from .regions import NEAR

#: How near the edge of a neighbour a vertex must lie to become one of its vertices (metres).
ON = 1e-6


def inner_block(
    piece: int,
    polygons: Sequence[Polygon],
    labels: Sequence[str],
    around: Block,
    shared: Sequence[tuple[int, Any]],
) -> Block:
    """Make a piece of a warped template a block of its own.

    Parameters
    ----------
    piece
        Which piece.
    polygons, labels
        All pieces of the template.
    around
        The block that they tile.
    shared
        Neighbours and edges of the piece, see `tiles.shared_edges`.

    Returns
    -------
    Block
        Its closed lines are those of the block around, and what it shares with pieces that are
        neither street nor lane.
    """
    own = polygons[piece]
    inside = {edge: other for other, edge in shared}
    xy = [tuple(point) for point in shapely.get_coordinates(own)]
    closed = []
    for edge in zip(xy[:-1], xy[1:]):
        other = inside.get(edge)
        line = LineString(edge)
        if other is not None:
            shut = labels[other] not in ACCESS
        else:
            middle = line.interpolate(0.5, normalized=True)
            shut = bool(around.closed.distance(middle) < 2 * NEAR) if around.closed else False
        if shut:
            closed.append(line)
    return Block(own, MultiLineString(closed), around.block_id)


def conform(plots: Sequence[Plot]) -> list[Plot]:
    """Give plots that touch the same vertices along their common edges.

    Parameters
    ----------
    plots
        Plots that tile a region.

    Returns
    -------
    list
        The same, with vertices of others put in where they lie on an edge.
    """
    rings = [shapely.get_coordinates(plot.polygon.exterior) for plot in plots]
    every = np.unique(np.concatenate(rings), axis=0)
    z = every[:, 0] + 1j * every[:, 1]
    found = []
    for plot, ring in zip(plots, rings):
        loop = ring[:, 0] + 1j * ring[:, 1]
        more = _between(loop, z)
        if more is None or plot.polygon.interiors:
            found.append(plot)
        else:
            xy = np.stack([more.real, more.imag], axis=1)
            found.append(replace(plot, polygon=Polygon(xy)))
    return found


def _between(
    loop: npt.NDArray[np.complex128], others: npt.NDArray[np.complex128]
) -> npt.NDArray[np.complex128] | None:
    """Insert points into a closed line where they lie on its edges; None where none does."""
    step = np.diff(loop)
    size = np.maximum(np.abs(step), 1e-12)
    local = (others[None, :] - loop[:-1, None]) * (step.conj() / size)[:, None]
    on = (np.abs(local.imag) < ON) & (local.real > ON) & (local.real < size[:, None] - ON)
    edge, which = np.nonzero(on)
    if not len(edge):
        return None
    order = np.lexsort((local.real[edge, which], edge))
    return np.insert(loop, edge[order] + 1, others[which[order]])
