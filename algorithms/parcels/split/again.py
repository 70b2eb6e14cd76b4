"""Parts of an existing layout made anew, everything else left as it is (UP section 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
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
from .layout import Layout, lay_out
from .rules import SplitRules

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Geometries = npt.NDArray[Any]
#: Edges whose middle is this near to a plot lie on it (metres).
ON_PLOT = 0.02
#: Pieces of land that are smaller are left-overs of rounding (square metres).
SCRAP = 0.5
#: Gaps this much wider than a street are none (metres).
SLACK = 0.2
#: Land this near to a street lies along it, times its width: corners are further than the half.
BESIDE = 0.75
#: Streets whose ends are nearer than this meet (metres).
TOUCHES = 1.0
#: New streets go on to a centre line that lies so far ahead, times their width.
AHEAD = 1.5
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
        found.append(Block(land, _closed(land, others, existing), number))
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
        closed = _closed(polygon, others, existing)
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
    pieces = _pieces(land, others)
    begins = np.flatnonzero(np.r_[True, (pieces[1:, 0] != pieces[:-1, 1]).any(axis=1)])
    outer, *holes = np.split(pieces[:, 0], begins[1:])
    return Polygon(outer, holes)


def _open(land: Polygon, closed: MultiLineString) -> Floats:
    """Edges of land that are not closed, shape (n, 2, 2)."""
    edges = _pieces(land, np.array([], dtype=object))
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


def _closed(land: Polygon, others: Geometries, existing: Existing) -> MultiLineString:
    """Edges of land along plots that stay, and those without a street beside them."""
    pieces = _pieces(land, others)
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


def _pieces(land: Polygon, others: Geometries) -> Floats:
    """Edges of land, cut where corners of other plots lie on them, shape (n, 2, 2)."""
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


def _inner_streets(existing: Existing, chosen: Sequence[int]) -> list[int]:
    """Find the streets with chosen land on both sides."""
    if not existing.streets:
        return []
    inner = joined([existing.plots[k] for k in chosen], existing.half).buffer(SLACK)
    return [
        k
        for k, (line, width) in enumerate(zip(existing.streets, existing.widths))
        # its ends lie in the junctions with the streets that stay
        if inner.covers(_shortened(line, width))
    ]


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
