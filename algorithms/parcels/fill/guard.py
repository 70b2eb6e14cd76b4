"""An independent look at the plots of blocks: whether they tile, and parcels have access.

Nothing here knows how the plots came about.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Point

from ...measure.parcel_shape import frontage
from ..rules import ParcelRules
from ..types import Block, Plot

Floats = npt.NDArray[np.float64]
#: Areas of blocks and of their plots may differ by this much, as a share.
AREA = 1e-6
#: Plots may overlap by this much (square metres).
OVERLAP = 1e-4
#: Edges of plots within this distance of the outline lie on it (metres).
NEAR = 0.01
#: Frontages may fall short by rounding, as a share.
ROUND = 0.99
#: Note of parcels behind others, which need only the width of their access strip.
BEHIND = "behind another parcel, with an access strip"


@dataclass(frozen=True)
class Fault:
    """Why the plots of a block are not accepted.

    Attributes
    ----------
    reason
        A sentence.
    place
        Where.
    """

    reason: str
    place: Point


def faults(
    blocks: Sequence[Block], plots: Sequence[Sequence[Plot]], rules: ParcelRules
) -> list[Fault | None]:
    """Check the plots of blocks.

    Parameters
    ----------
    blocks
        Valid blocks.
    plots
        The plots of each.
    rules
        What parcels need: `min_frontage` along a street, a lane or inner street space;
        `flag_width` for those whose note says that they lie behind another.

    Returns
    -------
    list
        For each block its first fault, or None.
    """
    owner = np.repeat(np.arange(len(blocks)), [len(row) for row in plots])
    flat = [plot for row in plots for plot in row]
    if not flat:
        return [
            Fault("There are no plots.", block.polygon.representative_point()) for block in blocks
        ]
    polygons = np.array([plot.polygon for plot in flat], dtype=object)
    lands = np.array([block.polygon for block in blocks], dtype=object)
    found: list[Fault | None] = [None] * len(blocks)
    sound = shapely.is_valid(polygons) & (shapely.get_type_id(polygons) == 3)
    for plot in np.flatnonzero(~sound).tolist():
        found[owner[plot]] = Fault("A plot crosses itself.", _in(polygons[plot]))
    area = np.bincount(owner, weights=shapely.area(polygons), minlength=len(blocks))
    whole = shapely.area(lands)
    for block in np.flatnonzero(np.abs(area - whole) > AREA * whole + 1e-9).tolist():
        off = area[block] - whole[block]
        found[block] = Fault(
            f"The plots have {abs(off):.3g} m2 {'more' if off > 0 else 'less'} than the block.",
            _in(lands[block]),
        )
    fronts, matched = edge_frontages(blocks, flat, polygons, owner)
    for block in np.flatnonzero(~matched).tolist():
        if found[block] is None:
            mine = np.flatnonzero(owner == block)
            found[block] = _overlap(polygons[mine])
            fronts[mine] = _frontages(blocks[block], [flat[i] for i in mine])
    need = np.array(
        [rules.flag_width if plot.note == BEHIND else rules.min_frontage for plot in flat]
    )
    parcel = np.array([plot.use == "parcel" for plot in flat])
    short = np.flatnonzero(parcel & (fronts < ROUND * need))
    for plot in short.tolist():
        if found[owner[plot]] is None:
            found[owner[plot]] = Fault(
                f"A parcel has {fronts[plot]:.1f} m along streets.", _in(polygons[plot])
            )
    return found


def _in(polygon: shapely.Geometry) -> Point:
    return shapely.point_on_surface(polygon)


def edge_frontages(
    blocks: Sequence[Block],
    flat: Sequence[Plot],
    polygons: npt.NDArray[np.object_],
    owner: npt.NDArray[np.int_],
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Return the frontage of each plot from edges that two plots share exactly.

    An edge whose reverse is no edge of another plot of the block must lie on its outline; the
    lengths of these must add up to it. With equal areas this proves the tiling.

    Parameters
    ----------
    blocks, flat, polygons
        Blocks; plots of all of them, and their polygons, shape (n,).
    owner
        Index of the block of each plot, shape (n,).

    Returns
    -------
    fronts
        Length of each plot along streets, lanes and inner streets, shape (n,), metres.
    matched
        Whether all edges of a block's plots are matched, shape (number of blocks,).
    """
    plot, ends = _directed_edges(polygons)
    block = owner[plot]
    # vertices as numbers; equal places of different blocks stay apart by the block in the key
    _, vertex = np.unique(ends.reshape(-1, 2) @ np.array([1.0, 1j]), return_inverse=True)
    start, end = vertex.reshape(-1, 2).T.astype(np.int64)
    low, high = np.minimum(start, end), np.maximum(start, end)
    order = np.lexsort((high, low, block))
    same = np.zeros(len(order), bool)
    keys = np.stack([block, low, high])[:, order]
    same[1:] = (keys[:, 1:] == keys[:, :-1]).all(axis=0)
    partner = np.full(len(order), -1)
    twin = np.flatnonzero(same)
    partner[order[twin]], partner[order[twin - 1]] = order[twin - 1], order[twin]
    # more than two on one edge, or two on the same side of it, overlap
    bad = np.zeros(len(order), bool)
    bad[order[twin[same[twin - 1]]]] = True
    paired = partner >= 0
    bad[paired] |= start[paired] != end[partner[paired]]
    alone = ~paired
    lengths = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    rims = np.array([b.polygon.boundary for b in blocks], dtype=object)
    middle = shapely.points(ends.mean(axis=1))
    bad[alone] |= shapely.distance(middle[alone], rims[block[alone]]) > NEAR
    rim = np.bincount(block[alone], weights=lengths[alone], minlength=len(blocks))
    perimeter = shapely.length(rims)
    matched = np.abs(rim - perimeter) <= 1e-5 * perimeter + 1e-6
    matched &= np.bincount(block[bad], minlength=len(blocks)) == 0
    gives = alone.copy()
    closed = np.array([not b.closed.is_empty for b in blocks])
    check = np.flatnonzero(alone & closed[block])
    if len(check):
        shut = shapely.buffer([b.closed for b in blocks], 2 * NEAR, cap_style="flat", quad_segs=2)
        lines = shapely.linestrings(ends[check])
        # what a flat end of a closed line leaves of an edge beside it is no access
        lengths[check] = shapely.length(shapely.difference(lines, shut[block[check]]))
    way = np.array([p.use in ("lane", "street") for p in flat])
    gives[paired] = way[plot[partner[paired]]]
    fronts = np.bincount(plot[gives], weights=lengths[gives], minlength=len(flat))
    return np.asarray(fronts, dtype=float), np.asarray(matched)


def _directed_edges(
    polygons: npt.NDArray[np.object_],
) -> tuple[npt.NDArray[np.int_], Floats]:
    """Return owner and ends, shape (k, 2, 2), of all edges, land on their left."""
    rings, plot = shapely.get_rings(polygons, return_index=True)
    inner = np.r_[False, plot[1:] == plot[:-1]]
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    edge = np.flatnonzero(ring[1:] == ring[:-1])
    ends = np.stack([xy[edge], xy[edge + 1]], axis=1)
    turned = (shapely.is_ccw(rings) == inner)[ring[edge]]
    ends[turned] = ends[turned, ::-1]
    return plot[ring[edge]], ends


def _overlap(polygons: npt.NDArray[np.object_]) -> Fault | None:
    """Return a fault if plots overlap; missing vertices alone are none."""
    one, two = shapely.STRtree(polygons).query(polygons, predicate="intersects")
    pair = one < two
    one, two = one[pair], two[pair]
    common = shapely.area(shapely.intersection(polygons[one], polygons[two]))
    if len(common) and common.max() > OVERLAP:
        worst = int(np.argmax(common))
        return Fault(f"Two plots overlap by {common[worst]:.3g} m2.", _in(polygons[one[worst]]))
    return None


def _frontages(block: Block, plots: Sequence[Plot]) -> Floats:
    """Return the frontages of plots that do not share all vertices."""
    rim = block.polygon.boundary
    if not block.closed.is_empty:
        rim = shapely.difference(rim, shapely.buffer(block.closed, 2 * NEAR, cap_style="flat"))
    ways = [plot.polygon.boundary for plot in plots if plot.use in ("lane", "street")]
    shapes = np.array([plot.polygon for plot in plots], dtype=object)
    return frontage(shapes, shapely.union_all([rim, *ways]))
