"""Parts of an existing layout made anew, everything else left as it is (UP section 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

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
#: Edges whose middle is this near to a plot lie on it (metres).
ON_PLOT = 0.02
#: Pieces of land that are smaller are left-overs of rounding (square metres).
SCRAP = 0.5
#: Gaps this much wider than a street are none (metres).
SLACK = 0.2


@dataclass(frozen=True)
class Existing:
    """A layout as it lies in layers, in metres.

    Attributes
    ----------
    site
        The whole site.
    frontage
        Its edges along existing streets.
    plots
        Parcels, greens and whatever else is no street, shape (n,).
    streets, widths
        Centre lines and their widths, metres.
    """

    site: Polygon
    frontage: MultiLineString
    plots: Sequence[Polygon]
    streets: Sequence[LineString] = ()
    widths: Sequence[float] = ()


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
    return [orient(p) for p in shapely.get_parts(land) if p.area > SCRAP]


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
        closed = _closed(part, others, existing)
        front = shapely.difference(part.boundary, closed.buffer(ON_PLOT)) if closed else None
        lines = part.boundary if front is None else front
        frontage = MultiLineString(
            [g for g in shapely.get_parts(lines) if g.geom_type in ("LineString", "LinearRing")]
        )
        ground = Ground(part, frontage, width=split.street_width)
        layout = lay_out(
            ground, rules, split, seed=seed,
            progress=Share(told, at / len(land), (at + 1) / len(land)),
        )  # fmt: skip
        layouts.append(layout)
        connectors += _connectors(layout, [existing.streets[k] for k in kept], frontage)
    return NewStreets(layouts, removed, connectors)


def _others(existing: Existing, chosen: Sequence[int]) -> shapely.Geometry:
    """Edges of the plots that stay."""
    gone = set(chosen)
    rings = [p.boundary for k, p in enumerate(existing.plots) if k not in gone]
    return shapely.union_all(rings) if rings else MultiLineString()


def _closed(land: Polygon, others: shapely.Geometry, existing: Existing) -> MultiLineString:
    """Edges of land along plots that stay, or along edges of the site without a street."""
    kept: list[Floats] = []
    edge = existing.site.boundary
    for ring in (land.exterior, *land.interiors):
        xy = shapely.get_coordinates(ring)
        middles = shapely.points((xy[1:] + xy[:-1]) / 2)
        beside = np.zeros(len(middles), dtype=bool)
        if not others.is_empty:
            beside = shapely.distance(middles, others) < ON_PLOT
        outer = shapely.distance(middles, edge) < ON_PLOT
        if not existing.frontage.is_empty:
            outer &= shapely.distance(middles, existing.frontage) > ON_PLOT
        kept += [xy[k : k + 2] for k in np.flatnonzero(beside | outer)]
    return MultiLineString(kept)


def _inner_streets(existing: Existing, chosen: Sequence[int]) -> list[int]:
    """Find the streets with chosen land on both sides."""
    if not existing.streets:
        return []
    half = max(existing.widths) / 2 + SLACK
    land = shapely.union_all([existing.plots[k] for k in chosen])
    closing = land.buffer(half, join_style="mitre").buffer(-half, join_style="mitre")
    inner = closing.buffer(SLACK)
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
    space = shapely.union_all(
        [existing.streets[k].buffer(existing.widths[k] / 2 + SLACK) for k in removed]
    )
    stay = [existing.streets[k].buffer(existing.widths[k] / 2, cap_style="flat") for k in kept]
    rest = [p for k, p in enumerate(existing.plots) if k not in gone]
    space = shapely.difference(
        shapely.intersection(space, existing.site), shapely.union_all([*stay, *rest])
    )
    return shapely.union_all([*plots, space])


def _connectors(
    layout: Layout, streets: Sequence[LineString], frontage: MultiLineString
) -> list[LineString]:
    """Lead the ends of new streets at the frontage to the centre lines beyond it."""
    if not streets:
        return []
    centres = shapely.union_all(streets)
    found = []
    for street in street_lines(layout.mesh):
        for xy in (street.line.coords[0], street.line.coords[-1]):
            end = shapely.Point(xy)
            if frontage.distance(end) > ON_PLOT:
                continue
            way = shapely.shortest_line(end, centres)
            if 0.01 < way.length < 2 * street.width:
                found.append(way)
    return found
