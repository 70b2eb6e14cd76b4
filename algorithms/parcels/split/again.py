"""Parts of an existing layout made anew, everything else left as it is (UP section 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry import LineString, MultiLineString, Polygon
from shapely.geometry.polygon import orient
from shapely.ops import substring

from ...errors import InputError
from ...progress import Progress, Share, Silent
from ..fill import Filled, fill_blocks
from ..roadmesh import Ground, street_lines
from ..rules import ParcelRules
from ..types import Block
from .existing import (
    ON_PLOT,
    SLACK,
    WAYS,
    Existing,
    Floats,
    Geometries,
    closed_edges,
    edge_pieces,
    joined,
)
from .layout import Layout, lay_out
from .rules import SplitRules

#: Pieces of land that are smaller are left-overs of rounding (square metres).
SCRAP = 0.5
#: Streets whose ends are nearer than this meet (metres).
TOUCHES = 1.0
#: New streets go on to a centre line that lies so far ahead, times their width.
AHEAD = 1.5


@dataclass(frozen=True)
class NewStreets:
    """Land laid out anew.

    Attributes
    ----------
    layouts
        One for each connected piece of land.
    removed
        Numbers of the streets that are gone.
    connectors
        Lines from ends of new streets to the centre lines of the old ones.
    """

    layouts: Sequence[Layout]
    removed: Sequence[int]
    connectors: Sequence[LineString] = field(default_factory=tuple)


def chosen_land(existing: Existing, chosen: Sequence[int]) -> list[Polygon]:
    """Join the chosen plots that touch.

    Parameters
    ----------
    existing
        The layout.
    chosen
        Numbers of plots.

    Raises
    ------
    InputError
        If nothing is chosen.
    """
    if not len(chosen):
        raise InputError(
            "Nothing is chosen to be made anew.", "Select parcels in the map, or give their ids."
        )
    land = shapely.union_all([existing.plots[k] for k in chosen])
    return [orient(p) for p in shapely.get_parts(land) if p.geom_type == "Polygon"]


def blocks_again(existing: Existing, chosen: Sequence[int]) -> list[Block]:
    """Give the chosen land as blocks: their edges along other plots have no access.

    Parameters
    ----------
    existing, chosen
        See `chosen_land`.
    """
    others = _others(existing, chosen)
    found = []
    for number, land in enumerate(chosen_land(existing, chosen), start=1):
        found.append(Block(land, closed_edges(land, others, existing), number))
    return found


def parcels_again(
    existing: Existing,
    chosen: Sequence[int],
    rules: ParcelRules,
    *,
    seed: int = 0,
    progress: Progress | None = None,
) -> tuple[list[Block], Filled]:
    """Parcel the chosen land anew; the streets stay.

    Parameters
    ----------
    existing, chosen
        See `chosen_land`.
    rules
        What is asked of parcels.
    seed
        Of whatever is random.
    progress
        Told of the work.
    """
    blocks = blocks_again(existing, chosen)
    return blocks, fill_blocks(blocks, rules, seed=seed, progress=progress or Silent())


def streets_again(
    existing: Existing,
    chosen: Sequence[int],
    rules: ParcelRules,
    split: SplitRules,
    *,
    seed: int = 0,
    progress: Progress | None = None,
) -> NewStreets:
    """Lay out the chosen land anew, streets inside it included.

    Parameters
    ----------
    existing, chosen
        See `chosen_land`; streets with chosen land on both sides are given up.
    rules, split
        What is asked of parcels and streets.
    seed
        See `lay_out`.
    progress
        Told of the work.
    """
    told = progress or Silent()
    removed = _inner_streets(existing, chosen)
    kept = [k for k in range(len(existing.streets)) if k not in set(removed)]
    others = _others(existing, chosen)
    land = [
        orient(p)
        for p in shapely.get_parts(_with_streets(existing, chosen, removed, kept))
        if p.geom_type == "Polygon" and p.area > SCRAP
    ]
    layouts, connectors = [], []
    for at, part in enumerate(land):
        polygon = _with_corners(part, others)
        closed = closed_edges(polygon, others, existing)
        open_ = [LineString(piece) for piece in _open(polygon, closed)]
        ground = Ground(polygon, MultiLineString(open_), width=split.street_width)
        layout = lay_out(
            ground, rules, split, seed=seed, arriving=_arriving(polygon, existing, removed, kept),
            progress=Share(told, at / len(land), (at + 1) / len(land)),
        )  # fmt: skip
        layouts.append(layout)
        connectors += _connectors(layout, [existing.streets[k] for k in kept], others)
    return NewStreets(layouts, removed, connectors)


def _arriving(
    land: Polygon, existing: Existing, removed: Sequence[int], kept: Sequence[int]
) -> list[tuple[Floats, Floats]]:
    """Places on the edge of land where streets that stay led on, and their directions."""
    if not removed:
        return []
    gone = shapely.union_all([existing.streets[k] for k in removed])
    found = []
    for k in kept:
        line, reach = existing.streets[k], AHEAD * existing.widths[k]
        for end, before in ((0, 1), (-1, -2)):
            here, inner = (np.array(line.coords[at]) for at in (end, before))
            spot = shapely.Point(here)
            if gone.distance(spot) > TOUCHES or land.distance(spot) > reach:
                continue
            way = (here - inner) / max(float(np.hypot(*(here - inner))), 1e-9)
            ahead = shapely.intersection(
                LineString([here - way * SLACK, here + way * reach]), land.boundary
            )
            if not ahead.is_empty:
                place = shapely.shortest_line(spot, ahead).coords[-1]
                found.append((np.array(place), way))
    return found


def _with_corners(land: Polygon, others: Geometries) -> Polygon:
    """Put the corners of other plots into the rings of land, so that its edges are of one kind."""
    pieces = edge_pieces(land, others)
    begins = np.flatnonzero(np.r_[True, (pieces[1:, 0] != pieces[:-1, 1]).any(axis=1)])
    outer, *holes = np.split(pieces[:, 0], begins[1:])
    return Polygon(outer, holes)


def _open(land: Polygon, closed: MultiLineString) -> Floats:
    """Edges of land that are not closed, shape (n, 2, 2)."""
    edges = edge_pieces(land, np.array([], dtype=object))
    if closed.is_empty:
        return edges
    middles = shapely.points(edges.mean(axis=1))
    return np.asarray(edges[shapely.distance(middles, closed) > ON_PLOT])


def _others(existing: Existing, chosen: Sequence[int]) -> Geometries:
    """Find the plots that stay and give no access."""
    gone = set(chosen)
    uses = existing.uses or [""] * len(existing.plots)
    kept = [
        p for k, (p, use) in enumerate(zip(existing.plots, uses))
        if k not in gone and use not in WAYS
    ]  # fmt: skip
    return np.array(kept, dtype=object)


def _inner_streets(existing: Existing, chosen: Sequence[int]) -> list[int]:
    """Find the streets with chosen land on both sides."""
    if not existing.streets:
        return []
    inner = joined([existing.plots[k] for k in chosen], existing.half).buffer(SLACK)
    others = _others(existing, chosen)
    found = []
    for k, (line, width) in enumerate(zip(existing.streets, existing.widths)):
        # its ends lie in the junctions with the streets that stay
        if inner.covers(_shortened(line, width)) and not _serves(line, width, others):
            found.append(k)
    return found


def _serves(line: LineString, width: float, plots: Geometries) -> bool:
    """Tell whether plots lie along a street, besides those at its far corners."""
    if not len(plots):
        return False
    along = shapely.buffer(_shortened(line, 0.6 * width), width / 2 + SLACK, cap_style="flat")
    near = plots[shapely.intersects(plots, along)]
    shared = shapely.length(shapely.intersection(shapely.boundary(near), along))
    return bool(len(near)) and float(shared.max()) > TOUCHES


def _shortened(line: LineString, width: float) -> LineString:
    """Take a street's ends off, as far as other streets reach."""
    cut = min(width, line.length / 3)
    return substring(line, cut, line.length - cut)


def _with_streets(
    existing: Existing,
    chosen: Sequence[int],
    removed: Sequence[int],
    kept: Sequence[int],
) -> shapely.Geometry:
    """Join chosen plots and the space of the streets between them."""
    plots = [existing.plots[k] for k in chosen]
    if not removed:
        return shapely.union_all(plots)
    gone = set(chosen)
    around = joined(plots, existing.half)
    space = shapely.union_all(
        [existing.streets[k].buffer(existing.widths[k] / 2 + SLACK) for k in removed]
    )
    stay = [existing.streets[k].buffer(existing.widths[k] / 2, cap_style="flat") for k in kept]
    rest = [p for k, p in enumerate(existing.plots) if k not in gone]
    space = shapely.difference(shapely.intersection(space, around), shapely.union_all(stay + rest))
    if existing.site is not None:
        space = shapely.intersection(space, existing.site)
    return shapely.union_all([*plots, space])


def _connectors(
    layout: Layout, streets: Sequence[LineString], others: Geometries
) -> list[LineString]:
    """Lead the ends of new streets straight on to the centre lines that stay."""
    if not streets:
        return []
    centres = shapely.union_all(streets)
    plots = shapely.union_all(others) if len(others) else Polygon()
    ring = layout.ground.polygon.boundary
    found = []
    for street in street_lines(layout.mesh):
        for end, before in ((0, 1), (-1, -2)):
            here, inner = (np.array(street.line.coords[k]) for k in (end, before))
            if ring.distance(shapely.Point(here)) > ON_PLOT:
                continue
            way = (here - inner) / max(float(np.hypot(*(here - inner))), 1e-9)
            hit = shapely.intersection(
                LineString([here + way * 1e-3, here + way * AHEAD * street.width]), centres
            )
            if hit.is_empty:
                continue
            line = shapely.shortest_line(shapely.Point(here), hit)
            if shapely.intersection(line, plots).length < ON_PLOT:
                found.append(line)
    return found
