"""How good adapted corridors are as those of a residential zone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...parcels.streetspace import StreetWidths
from ...site import Site
from ...site.repair import overlay
from ..zone import Corridor
from .adapt import Adapted
from .space import space_in
from .square import obliqueness, triples

#: Patches are wished between these sizes (hectares).
SMALLEST, LARGEST = 0.8, 3.0
#: Less than this is no patch at all (hectares).
SCRAP = 0.25
#: Ground further than this from any street is remote (metres).
REMOTE = 90.0
#: Patches narrower than this have no room for two rows of buildings (metres).
NARROW = 60.0
#: Corridors nearer than this to a street along the edge waste the ground between (metres), but
#: where they lead to it.
BESIDE, LEADING = 50.0, 75.0
#: Streets that meet at less than this angle make poor junctions (radians).
ACUTE = math.radians(50.0)


@dataclass(frozen=True)
class Judgement:
    """What is wrong with corridors; each number is 0 at best.

    Attributes
    ----------
    size
        Patches too large or too small.
    form
        Patches too narrow, scraps.
    remote
        Share of the ground that is far from any street.
    junctions
        Acute and crowded junctions, crossings that are none.
    length
        Length of corridors, 100 m per hectare counting 1.
    entries
        Missing ways in and out.
    drawing
        Streets that meet the edge askew, or bend where they should be straight.
    damage
        Share of the sample that was lost or led around.
    beside
        Corridors close beside a street along the edge, 100 m per hectare counting 1.
    """

    size: float
    form: float
    remote: float
    junctions: float
    length: float
    entries: float
    drawing: float
    damage: float
    beside: float = 0.0

    @property
    def cost(self) -> float:
        """All of it as one number."""
        return (
            2.0 * self.size + self.form + 2.5 * self.remote + self.junctions
            + 0.25 * self.length + self.entries + self.drawing
            + self.damage + 2.0 * self.beside
        )  # fmt: skip


def judge(
    site: Site, adapted: Adapted, corridors: Sequence[Corridor], edge: Sequence[Corridor]
) -> Judgement:
    """Judge the corridors that a sample gives a zone.

    Parameters
    ----------
    site
        The zone.
    adapted
        How they came about.
    corridors
        The corridors.
    edge
        Existing streets along the edge of the zone.

    Returns
    -------
    Judgement
    """
    size, form, remote = ground_figures(site, [*corridors, *edge])
    used = {at for own in adapted.edges for at in (own.start, own.end)}
    ins = sum(1 for at in used if at < adapted.sample.entries)
    wished = 1 if site.area_ha < 2 else 2 if site.area_ha < 8 else 3
    return Judgement(
        size=size,
        form=form,
        remote=remote,
        junctions=_junctions(adapted),
        length=sum(own.line.length for own in corridors) / site.area_ha / 100.0,
        entries=0.25 * max(0, wished - ins),
        drawing=_askew(site, adapted),
        damage=1.2 * adapted.lost + 0.6 * adapted.bent,
        beside=_beside(site, corridors) / site.area_ha / 100.0,
    )


def _beside(site: Site, corridors: Sequence[Corridor]) -> float:
    """Return how far corridors run close beside the streets along the edge, metres."""
    along = site.street_frontage
    if along.is_empty or not corridors:
        return 0.0
    lines = shapely.union_all([own.line for own in corridors])
    near = shapely.intersection(lines, shapely.buffer(along, BESIDE, quad_segs=4))
    # what leads to the edge is near to it, too
    ways_out = shapely.intersection(lines, shapely.buffer(along, 3.0, quad_segs=4))
    return float(shapely.difference(near, shapely.buffer(ways_out, LEADING, quad_segs=4)).length)


def _askew(site: Site, adapted: Adapted) -> float:
    """Return the cost of streets that meet the edge askew or bend where they should not."""
    edge = site.polygon.exterior
    ways = [
        xy[:2]
        for own in adapted.edges
        for at, xy in ((own.start, own.xy), (own.end, own.xy[::-1]))
        if at < adapted.sample.entries
    ]
    both = np.array(ways).reshape(-1, 2, 2)
    turns = obliqueness(both[:, 0], both[:, 1], edge).tolist()
    used = {own.start for own in adapted.edges} | {own.end for own in adapted.edges}
    for a, b, c in triples(adapted.sample):
        if used >= {a, b, c}:
            first, second = adapted.nodes[b] - adapted.nodes[a], adapted.nodes[c] - adapted.nodes[b]
            cross = first[0] * second[1] - first[1] * second[0]
            turns.append(abs(math.atan2(cross, float(first @ second))))
    over = np.maximum(np.array(turns) - math.radians(10.0), 0.0) / math.radians(30.0)
    return float(0.15 * np.sum(over**2))


def ground_figures(site: Site, corridors: Sequence[Corridor]) -> tuple[float, float, float]:
    """Judge what corridors leave of a zone.

    Parameters
    ----------
    site
        The zone.
    corridors
        In it and along its edge.

    Returns
    -------
    tuple of float
        Size, form and remote of a `Judgement`.
    """
    space = space_in(site.polygon, corridors)
    streets = shapely.union_all([space, site.street_frontage])
    ground = overlay(shapely.difference, site.polygon, shapely.union(space, site.obstacle_union))
    parts = shapely.get_parts(ground)
    parts = parts[(shapely.get_type_id(parts) == 3) & (shapely.area(parts) > 1.0)]
    area = shapely.area(parts) / 1e4
    share = area / max(area.sum(), 1e-9)
    over = np.maximum(np.log(area / LARGEST), 0.0)
    under = np.where(area > SCRAP, np.maximum(np.log(SMALLEST / area), 0.0), 0.0)
    width = 4e4 * area / np.maximum(shapely.length(parts), 1e-9)
    narrow = np.clip(NARROW / width - 1.0, 0.0, 1.0)
    scraps = float(np.sum((area < SCRAP) & (area > 0.01)))
    far = overlay(shapely.difference, ground, shapely.buffer(streets, REMOTE, quad_segs=4))
    return (
        float(np.sum(share * over) + np.sum(share * under)),
        float(0.5 * np.sum(share * narrow) + 0.12 * scraps),
        float(far.area / site.polygon.area),
    )


def _junctions(adapted: Adapted) -> float:
    """Return the cost of acute junctions, crowded ones and crossings without a node."""
    arms: dict[int, list[float]] = {}
    for own in adapted.edges:
        for at, xy in ((own.start, own.xy), (own.end, own.xy[::-1])):
            step = xy[1] - xy[0]
            arms.setdefault(at, []).append(math.atan2(step[1], step[0]))
    cost = 0.0
    for at, angles in arms.items():
        if len(angles) < 2:
            continue
        around = np.sort(np.array(angles))
        gap = np.diff(np.append(around, around[0] + 2 * math.pi))
        # two arms are a bend: that may not be a hairpin
        cost += 0.25 * int(np.sum(gap < ACUTE)) if len(angles) > 2 else 0.3 * (gap.min() < ACUTE)
        if at < adapted.sample.entries:
            cost += 0.1
    places = adapted.nodes[sorted(at for at, own in arms.items() if len(own) != 2)]
    if len(places) > 1:
        away = np.hypot(*np.moveaxis(places[:, None] - places[None], 2, 0))
        cost += 0.25 * int(np.sum(away[np.triu_indices(len(places), 1)] < 30.0))
    lines: list[BaseGeometry] = [shapely.LineString(own.xy) for own in adapted.edges]
    for at, line in enumerate(lines):
        for other in range(at):
            mine, its = adapted.edges[at], adapted.edges[other]
            if {mine.start, mine.end} & {its.start, its.end}:
                overlap = shapely.length(
                    shapely.intersection(line, shapely.buffer(lines[other], 8.0))
                )
                cost += 0.5 * (overlap > 40.0)
            elif shapely.dwithin(line, lines[other], 20.0):
                cost += 0.5
    return cost


def corridors_of(lines: Sequence[tuple[BaseGeometry, int]], widths: StreetWidths) -> list[Corridor]:
    """Return lines with their levels as corridors."""
    by_level = widths.by_level if widths.every is None else np.full(4, widths.every)
    return [
        Corridor(shapely.LineString(line), float(by_level[level - 1]), level)
        for line, level in lines
    ]
