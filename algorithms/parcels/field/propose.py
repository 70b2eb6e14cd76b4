"""From a region to the streets that may split it, the best first."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from .crosses import CrossField, FieldKind, cross_field
from .junctions import meet_streets
from .outline import Floats
from .pieces import solid, split
from .region import Region
from .score import NARROW, PIECE, Scores, Weights, no_scores, score
from .spacing import Spacing
from .streamlines import Streamlines, no_lines, streamlines

#: Least radius of a circle inside a piece, in depths of a parcel, besides a quarter of a street.
THICK = 0.75
#: Least area of a piece, in squares of the depth of a parcel.
SMALL = 2.4
#: At most so many lines are tried for each one that is wanted.
TRIES = 6
#: Seeds at good distances from the boundary are this far apart along it (metres).
ALONG = 60.0


@dataclass(frozen=True)
class Proposal:
    """Streets that may split a region.

    Attributes
    ----------
    field
        The cross field, None where the region is too small for one.
    lines, scores
        All lines, and their scores.
    best
        Numbers of the lines that were tried and split the region well, the best first.
    pieces
        What each of them makes of the region, two polygons each.
    across
        Whether only streets across a narrow region were looked for.
    """

    field: CrossField | None
    lines: Streamlines
    scores: Scores
    best: tuple[int, ...]
    pieces: tuple[tuple[Polygon, ...], ...]
    across: bool


def propose(
    region: Region,
    *,
    kind: FieldKind = "smooth",
    spacing: Spacing | None = None,
    weights: Weights | None = None,
    across: bool | None = None,
    guides: Sequence[BaseGeometry] = (),
    seed: int = 0,
    wanted: int = 4,
) -> Proposal:
    """Field, lines, scores and pieces of a region in one go.

    Parameters
    ----------
    region
        The land to be split.
    kind, guides
        See `cross_field`.
    spacing, weights
        See `score`.
    across
        Whether to look only for streets across; None: where the largest circle inside is
        narrower than 1.45 pitches.
    seed
        The same seed gives the same lines.
    wanted
        How many streets to try for that leave no thin piece.

    Returns
    -------
    proposal
        Without lines where the region is too small or thin for a street.
    """
    spacing = spacing or Spacing()
    if region.polygon.is_empty or region.polygon.area < 2 * SMALL * spacing.depth**2:
        return _nothing(None, bool(across))
    field = cross_field(region.polygon, kind, guides=guides)
    if not len(field.mesh.inner):
        return _nothing(field, bool(across))
    if across is None:
        across = 2 * field.grid.inside.max() < NARROW * spacing.pitch
    first = None if across else good_seeds(field, region, spacing)
    lines = streamlines(field, depth=spacing.depth, seed=seed, first=first)
    lines = meet_streets(lines, region, field.mesh.outline)
    scores = score(field, lines, region, spacing=spacing, weights=weights, across=across)
    return _try(field, lines, scores, spacing, wanted, across)


def good_seeds(field: CrossField, region: Region, spacing: Spacing) -> Floats:
    """Points at the first good distance from the boundary, shape (k, 2), metres.

    Lines through inner vertices pass good distances by as much as the vertices are apart.

    Parameters
    ----------
    field
        A field over the region.
    region, spacing
        What the boundary is, and which distances are good.
    """
    edges = field.mesh.outline
    long = np.flatnonzero(edges.length > 0.5 * ALONG)
    count = np.ceil(edges.length[long] / ALONG).astype(np.int64)
    edge = np.repeat(long, count)
    rank = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    t = (rank + 0.5) / np.repeat(count, count)
    way = (edges.end - edges.start)[edge] / edges.length[edge, None]
    base = edges.start[edge] + t[:, None] * (edges.end - edges.start)[edge]
    far = spacing.least(region.kinds[edge])
    both = []
    for sense in (1.0, -1.0):
        points = base + (sense * far)[:, None] * np.c_[-way[:, 1], way[:, 0]]
        # outside, or nearer to another part of the boundary: not theirs
        both.append(points[field.distance(points) > 0.97 * far - 0.5])
    return np.concatenate(both)


def _try(
    field: CrossField,
    lines: Streamlines,
    scores: Scores,
    spacing: Spacing,
    wanted: int,
    across: bool,
) -> Proposal:
    """Split along the best lines, and keep those that leave no thin piece."""
    reason = scores.reason.copy()
    best, kept = [], []
    seen: set[tuple[int, int]] = set()
    radius = THICK * spacing.depth + 0.25 * spacing.street
    least = SMALL * spacing.depth**2
    for number in scores.order[: TRIES * wanted]:
        partner = int(scores.partner[number])
        pair = (min(int(number), partner), max(int(number), partner))
        if partner >= 0 and pair in seen:
            continue
        seen.add(pair)
        pieces = split(field.polygon, lines, int(number), partner, field.mesh.outline)
        if pieces is None or not solid(pieces, radius, least):
            reason[number] = PIECE
            continue
        best.append(int(number))
        kept.append(tuple(pieces))
        if len(best) == wanted:
            break
    scores = dataclasses.replace(scores, reason=reason)
    return Proposal(field, lines, scores, tuple(best), tuple(kept), across)


def _nothing(field: CrossField | None, across: bool) -> Proposal:
    """No streets."""
    return Proposal(field, no_lines(), no_scores(), (), (), across)
