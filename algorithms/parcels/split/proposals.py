"""Streets that a region might be split along, from a cross field, best first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, Polygon

from ..field.crosses import cross_field
from ..field.propose import good_seeds
from ..field.region import Region
from ..field.score import ACROSS, score
from ..field.spacing import Spacing
from ..field.streamlines import streamlines
from ..rules import ParcelRules
from .rules import SplitRules

Floats = npt.NDArray[np.float64]
#: Where straight streets are tried, as shares of a side, and the quality that puts them last.
SHARES = (0.5, 0.42, 0.58, 0.34, 0.66)
LAST = 10.0
MOST_STRAIGHT = 2 * len(SHARES)


@dataclass(frozen=True)
class Proposal:
    """Streets that a region might be split along.

    Attributes
    ----------
    lines
        Centre lines from edge to edge of the region, metres: one, or two that meet the same
        hole from different sides.
    quality
        Smaller is better, see `field.score`.
    """

    lines: tuple[LineString, ...]
    quality: float


def propose(
    polygon: Polygon,
    kinds: npt.NDArray[np.int64],
    junctions: tuple[Floats, Floats],
    rules: ParcelRules,
    split: SplitRules,
    *,
    across: bool,
    guides: Sequence[LineString] = (),
    seed: int = 0,
) -> list[Proposal]:
    """Propose streets for a region.

    Parameters
    ----------
    polygon
        The region, metres.
    kinds
        What its edges are (`EdgeKind`), ring by ring, shape (e,).
    junctions
        Places and directions of streets that arrive at its edge, shape (j, 2) each.
    rules, split
        What is asked of parcels and streets.
    across
        Whether only streets across a narrow region are looked for.
    guides
        Drawn lines that the field follows where it is guided.
    seed
        Of the order in which lines are traced.

    Returns
    -------
    list of Proposal
        Best first; empty where the region is too small or thin for a street.
    """
    spacing = Spacing(rules.depth, split.street_width)
    region = Region(polygon, kinds, *junctions)
    if polygon.area < 2 * rules.depth**2:
        return []
    field = cross_field(polygon, split.field_kind, guides=guides)
    if not len(field.mesh.inner):
        return []
    first = None if across else good_seeds(field, region, spacing)
    longest = ACROSS * spacing.pitch if across else math.inf
    lines = streamlines(field, depth=rules.depth, seed=seed, first=first, longest=longest)
    scores = score(field, lines, region, spacing=spacing, weights=split.weights, across=across)
    shapes = lines.geometry()
    found = []
    seen: set[tuple[int, int]] = set()
    for number in scores.order.tolist():
        partner = int(scores.partner[number])
        pair = (min(number, partner), max(number, partner))
        if partner >= 0 and pair in seen:
            continue
        seen.add(pair)
        own = (shapes[number],) if partner < 0 else (shapes[number], shapes[partner])
        found.append(Proposal(own, float(scores.quality[number])))
    return found


def straight(polygon: Polygon) -> list[Proposal]:
    """Propose straight streets across the rectangle around a region, where no other will do.

    Parameters
    ----------
    polygon
        The region, metres.

    Returns
    -------
    list of Proposal
        First across its longer side, from the middle outwards; at most `MOST_STRAIGHT`.
    """
    box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(polygon))
    if len(box) < 5:
        return []
    sides = np.diff(box[:3], axis=0)
    short, long = sorted(sides, key=lambda way: float(np.hypot(*way)))
    middle = shapely.get_coordinates(shapely.minimum_rotated_rectangle(polygon).centroid)[0]
    found = []
    for along, over in ((long, short), (short, long)):
        for share in SHARES:
            centre = middle + (share - 0.5) * along
            ray = LineString([centre - over, centre + over])
            pieces = [
                piece
                for piece in shapely.get_parts(shapely.intersection(ray, polygon))
                if piece.geom_type == "LineString" and piece.length > 0
            ]
            if pieces:
                best = max(pieces, key=lambda piece: float(piece.length))
                found.append(Proposal((best,), LAST + abs(share - 0.5)))
    return found
