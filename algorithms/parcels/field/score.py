"""Scores of streamlines as streets: which one should split a region (UP section 5, eq. 2)."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from ...errors import InputError
from .crosses import CrossField
from .junctions import CONTINUE, continuity
from .outline import Bools, Floats, Ints
from .pieces import shares
from .region import CLOSED, Region
from .samples import Samples, bends, ends, meeting_angles, outward, sample, to_sides
from .spacing import Spacing
from .streamlines import Streamlines

#: Exponent of the length in the divergence score (UP).
POWER = 0.9
#: Streets meet others at no less (degrees).
LEAST_ANGLE = 55.0
#: A street runs no nearer to the boundary than this share of the nearest good distance, on four
#: fifths of its length.
CLOSE, MOSTLY = 0.6, 0.2
#: Ends of lines say nothing about the distance to the boundary (metres).
ENDS = 12.0
#: Longest street across a narrow region, and what counts as narrow, in pitches.
ACROSS, NARROW = 1.6, 1.45
#: A turn within 25 m that is as bad as can be (radians).
SHARP = np.radians(60.0)
#: Differences smaller than these are none when a score is brought to 0..1: divergence,
#: distance to boundary, distance to singularities (metres).
FLOORS = (0.05, 0.1, 20.0)
#: Why a line is no candidate, by number.
REASONS = ("", "meets the boundary at an acute angle", "too near the boundary", "too long",
           "leaves a thin piece", "leads to a hole")  # fmt: skip
GOOD, ANGLE, THIN, LONG, PIECE, HOLE = range(6)


@dataclass(frozen=True)
class Weights:
    """How much each score counts (UP's lambda 1 to 4 are the first four).

    Attributes
    ----------
    div, db, ds, ct
        Divergence, distance to boundary, distance to singularities, continuity.
    offset
        Ends near other junctions.
    angle
        Ends that are not at right angles.
    closed
        Ends where there is no street.
    balance
        Pieces of unequal area; counts three times in narrow regions.
    bend
        Sharp bends.
    """

    div: float = 1.0
    db: float = 1.0
    ds: float = 1.0
    ct: float = 1.0
    offset: float = 1.0
    angle: float = 0.5
    closed: float = 1.0
    balance: float = 0.75
    bend: float = 0.5

    def __post_init__(self) -> None:
        values = [getattr(self, item.name) for item in fields(self)]
        if not (np.isfinite(values).all() and min(values) >= 0 and max(values) > 0):
            raise InputError(
                "The weights of the scores of streets are negative, or all 0.",
                "Give numbers of at least 0, one of them greater.",
            )


@dataclass(frozen=True)
class Scores:
    """Scores of lines; smaller is better in every column.

    Attributes
    ----------
    div
        Divergence along the line over its length to the power 0.9 (eq. 2), shape (n,).
    db
        Mean of `Spacing.opt` of the distances to the boundary on both sides, shape (n,).
    ds
        Distance to the nearest singularity, 0 without any, shape (n,), metres.
    ct
        0, 0.5, 1 where both ends, one or none continue a street, shape (n,).
    offset
        Share of the ends with another junction at 4 to 45 m, shape (n,).
    angle
        Largest cosine of the angles at the ends, 0 for right angles, shape (n,).
    closed
        Share of the ends on edges without street, shape (n,).
    balance
        Difference of the areas of the pieces over their sum, shape (n,).
    bend
        Sharpest turn within 25 m, as a share of 60 degrees, at most 1, shape (n,).
    least_angle
        Smallest angle with the boundary, shape (n,), degrees.
    quality
        All of them brought to 0..1 and weighed: 0 the best, 1 the worst, shape (n,).
    reason
        `GOOD`, or why the line is no candidate (`REASONS` in words), shape (n,).
    partner
        For lines that lead to a hole the line on its other side that makes up a split with it;
        else -1. Their quality is the mean of both. Shape (n,).
    """

    div: Floats
    db: Floats
    ds: Floats
    ct: Floats
    offset: Floats
    angle: Floats
    closed: Floats
    balance: Floats
    bend: Floats
    least_angle: Floats
    quality: Floats
    reason: Ints
    partner: Ints

    @property
    def order(self) -> Ints:
        """Numbers of the candidates, the best first; those that are none are left out."""
        good = np.flatnonzero(self.reason == GOOD)
        return good[np.argsort(self.quality[good], kind="stable")]


def score(
    field: CrossField,
    lines: Streamlines,
    region: Region,
    *,
    spacing: Spacing | None = None,
    weights: Weights | None = None,
    across: bool = False,
) -> Scores:
    """Score lines as streets that split a region.

    The four scores of UP section 5, with two changes. The distance to the boundary is measured at
    right angles to the line, to both sides, and not to the nearest point, which near the ends of
    the line is where it ends. Divergence counts with its absolute value, so that a line cannot
    make up for what spreads by what narrows. Added: junctions are pushed apart, right angles
    preferred, ends without street and unequal pieces avoided.

    Parameters
    ----------
    field, lines
        The field and lines traced through it.
    region
        The same polygon, and what is along it.
    spacing
        Widths wished for; None: the usual.
    weights
        None: the usual.
    across
        For narrow regions: only lines no longer than 1.6 pitches; distances do not count, the
        areas of the pieces do, three times.

    Returns
    -------
    scores
        One for each line.
    """
    spacing, weights = spacing or Spacing(), weights or Weights()
    count = len(lines)
    if not count:
        return no_scores()
    parts = sample(lines)
    spread = np.abs(field.divergence(parts.place, parts.along)) * parts.length
    div = np.bincount(parts.owner, spread, minlength=count) / lines.length**POWER
    db, near = _to_boundary(field, lines, region, spacing, parts)
    ct, offset = continuity(lines, region, field.mesh.outline)
    angles = meeting_angles(lines, field.mesh.outline)
    kinds = region.kinds[field.mesh.outline.first[lines.ring] + lines.edge]
    columns = {
        "div": div,
        "db": np.zeros(count) if across else db,
        "ds": _to_singularities(field, lines),
        "ct": ct,
        "offset": offset,
        "angle": np.abs(np.cos(np.radians(np.minimum(angles, 90.0)))).max(axis=1),
        "closed": (kinds == CLOSED).mean(axis=1),
        "balance": 1.0 - 2.0 * shares(lines, region.polygon, field.mesh.outline),
        "bend": np.minimum(bends(parts, count) / SHARP, 1.0),
    }
    reason = np.full(count, GOOD)
    if across:
        reason[lines.length > ACROSS * spacing.pitch] = LONG
    else:
        reason[near] = THIN
    reason[angles.min(axis=1) < LEAST_ANGLE] = ANGLE
    quality = _combine(columns, weights, across, reason == GOOD)
    scores = Scores(
        **columns,
        least_angle=angles.min(axis=1),
        quality=quality,
        reason=reason,
        partner=np.full(count, -1),
    )
    return _partners(lines, scores)


def no_scores() -> Scores:
    """Scores of no lines."""
    empty, none = np.zeros(0), np.zeros(0, np.int64)
    columns = [item.name for item in fields(Scores)][:11]
    return Scores(**dict.fromkeys(columns, empty), reason=none, partner=none)


def _to_boundary(
    field: CrossField, lines: Streamlines, region: Region, spacing: Spacing, parts: Samples
) -> tuple[Floats, Bools]:
    """Mean cost of the distances to both sides, and which lines run too near the boundary."""
    distance, edge = to_sides(field, parts)
    kind = region.kinds[edge]
    cost = spacing.opt(distance.ravel(), kind.ravel()).reshape(distance.shape).mean(axis=0)
    inner = np.minimum(parts.arc, lines.length[parts.owner] - parts.arc) > ENDS
    db = parts.mean(cost, len(lines), inner)
    share = (distance / spacing.least(kind.ravel()).reshape(kind.shape)).min(axis=0)
    tight = parts.mean((share < CLOSE).astype(float), len(lines), inner)
    return np.nan_to_num(db, nan=1.0), np.nan_to_num(tight) > MOSTLY


def _to_singularities(field: CrossField, lines: Streamlines) -> Floats:
    """Smallest distance of vertices of lines to a singularity."""
    if not len(field.singularities):
        return np.zeros(len(lines))
    a = lines.points
    best = np.full(len(lines), np.inf)
    way = np.diff(a, axis=0, append=a[-1:])
    way[lines.first[1:] - 1] = 0.0
    size = np.maximum((way * way).sum(axis=1), 1e-12)
    for place in field.singularities:
        t = np.clip(((place - a) * way).sum(axis=1) / size, 0.0, 1.0)
        off = np.hypot(*(place - a - t[:, None] * way).T)
        best = np.minimum(best, np.minimum.reduceat(off, lines.first[:-1]))
    return best


def _combine(columns: dict[str, Floats], weights: Weights, across: bool, use: Bools) -> Floats:
    """Weighted mean of the columns, each brought to 0..1 over the lines in use."""
    total, whole = np.zeros(len(use)), 0.0
    floors = dict(zip(("div", "db", "ds"), FLOORS))
    for name, column in columns.items():
        weight = getattr(weights, name) * (3.0 if across and name == "balance" else 1.0)
        value = column
        if name in floors and use.any():
            low, high = column[use].min(), column[use].max()
            value = np.clip((column - low) / max(high - low, floors[name]), 0.0, 1.0)
        total += weight * value
        whole += weight
    return np.asarray(total / max(whole, 1e-12))


def _partners(lines: Streamlines, scores: Scores) -> Scores:
    """Give lines that lead to a hole their best partner on its other side."""
    joins = lines.ring[:, 0] != lines.ring[:, 1]
    if not joins.any():
        return scores
    quality, reason, partner = scores.quality.copy(), scores.reason.copy(), scores.partner.copy()
    # a hole is opened from the exterior; lines between holes have to wait
    outer = joins & (lines.ring.min(axis=1) == 0)
    hole = lines.ring.max(axis=1)
    side = lines.ring.argmax(axis=1)
    rows = np.arange(len(lines))
    heading, place = outward(lines)[rows, side], ends(lines)[rows, side]
    usable = outer & (reason == GOOD)
    for line in np.flatnonzero(usable):
        others = np.flatnonzero(usable & (hole == hole[line]) & (rows != line))
        apart = np.hypot(*(place[others] - place[line]).T)
        others = others[apart > CONTINUE]
        if len(others):
            # best straight on through the hole
            bend = 0.5 * (1.0 + heading[others] @ heading[line])
            cost = scores.quality[others] + bend
            partner[line] = others[int(cost.argmin())]
            quality[line] = 0.5 * (scores.quality[line] + scores.quality[partner[line]])
    reason[joins & (reason == GOOD) & (partner < 0)] = HOLE
    kept = {item.name: getattr(scores, item.name) for item in fields(scores)}
    return Scores(**{**kept, "quality": quality, "reason": reason, "partner": partner})
