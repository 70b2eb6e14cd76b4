"""Rays from façades to the sun, and the buildings in their way."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..shape import frames, sizes
from ..types import BuildingType, Floats, Ints, Placements
from .track import SunSteps

Bools = npt.NDArray[np.bool_]

#: Where along the façade the sun is looked for, in lengths from its middle.
SPOTS = np.array([-0.25, 0.0, 0.25])
#: A façade has sun while at least so many of the spots have.
NEEDED = 2
#: Spots lie this far in front of the façade, metres, so that walls in line with it hide nothing.
AHEAD_M = 0.01
#: Sun that grazes a façade (sine of the angle, about half a degree) is none: at noon it lies in the
#: plane of façades to the east and to the west, and must not be counted for one of them by chance.
GRAZING = 0.01
#: Pairs that are looked at together.
TOGETHER = 2_000_000


@dataclass(frozen=True, eq=False)
class Facades:
    """What is looked at: the balcony façades of buildings.

    Attributes
    ----------
    middle
        Middle of each façade, a little ahead of it, metres, shape (n, 2).
    along, out
        Unit vectors along it and out of it, shape (n, 2).
    length
        Metres, shape (n,).
    front
        Whether the sun stands in front of it at an instant, shape (k, n).
    """

    middle: Floats
    along: Floats
    out: Floats
    length: Floats
    front: Bools

    @classmethod
    def of(cls, types: Sequence[BuildingType], placed: Placements, steps: SunSteps) -> Facades:
        """Return the façades of buildings under a sun."""
        size = sizes(types, placed)
        along, out = frames(placed)
        middle = placed.xy + out * (size[:, 1:2] / 2 + AHEAD_M)
        return cls(middle, along, out, size[:, 0], steps.towards @ out.T > GRAZING)


@dataclass(frozen=True, eq=False)
class Hits:
    """The pairs whose blocker hides the sun from some spot of the façade at an instant.

    Attributes
    ----------
    step
        Index of the instant.
    pair
        Indices of the pairs, shape (m,).
    hidden
        Which spots are hidden, shape (m, 3).
    """

    step: int
    pair: Ints
    hidden: Bools


def near_pairs(
    facades: Facades, types: Sequence[BuildingType], blockers: Placements, reach: Floats
) -> Iterator[tuple[Ints, Ints]]:
    """Yield pairs (façade, blocker in front of it) no further apart than the blocker reaches.

    Parameters
    ----------
    facades
        What is looked at.
    types
        Kinds of buildings.
    blockers
        Buildings, m of them.
    reach
        How far from its centre each of them may shade a façade's middle, metres, shape (m,);
        those with 0 or less are left out.

    Yields
    ------
    tuple
        Indices of façades and of blockers, a batch at a time.
    """
    tall = np.flatnonzero(reach > 0)
    if not len(tall) or not len(facades.middle):
        return
    most = float(reach[tall].max())
    size = sizes(types, blockers)
    radius = np.hypot(size[:, 0], size[:, 1]) / 2
    tree = cKDTree(blockers.xy[tall])
    batch = max(1, TOGETHER // len(tall))
    for begin in range(0, len(facades.middle), batch):
        own = cKDTree(facades.middle[begin : begin + batch])
        found = own.sparse_distance_matrix(tree, most, output_type="ndarray")
        at = tall[found["j"]]
        seen = found["i"] + begin
        offset, out = blockers.xy[at] - facades.middle[seen], facades.out[seen]
        # What lies behind the plane of a façade cannot hide the sun in front of it.
        ahead = offset[:, 0] * out[:, 0] + offset[:, 1] * out[:, 1]
        near = (found["v"] <= reach[at]) & (ahead > -radius[at])
        yield seen[near].astype(np.int64), at[near].astype(np.int64)


def hits(
    facades: Facades,
    types: Sequence[BuildingType],
    blockers: Placements,
    pairs: tuple[Ints, Ints],
    steps: SunSteps,
    sill_m: float,
) -> Iterator[Hits]:
    """Yield, instant by instant, which blockers hide the sun from which spots of façades.

    A blocker hides a spot if the level ray to the sun's azimuth enters its footprint while the
    true ray is not yet above its roof. The ray is clipped in the frame of the blocker, where its
    footprint is a box; no geometry library is asked.

    Parameters
    ----------
    facades
        What is looked at, under the same sun.
    types
        Kinds of buildings.
    blockers
        Buildings.
    pairs
        Indices of façades and of blockers. A building does not hide the sun in front of its own
        façade, so it may be among its own blockers.
    steps
        The sun.
    sill_m
        Height of the spots above the ground, metres.
    """
    seen, by = pairs
    size = sizes(types, blockers)
    half, height = size[:, :2] / 2, size[:, 2] - sill_m
    axes = np.stack(frames(blockers), axis=1)  # (m, 2 axes, 2)
    offset = blockers.xy[by] - facades.middle[seen]
    radius = np.hypot(half[:, 0], half[:, 1])[by] + facades.length[seen] * SPOTS.max()
    rise = height[by]
    box = half[by]
    # Where the spots are in the frame of the blocker: the middle, and what a façade length adds.
    middle = -np.einsum("pac,pc->pa", axes[by], offset)
    shift = np.einsum("pac,pc->pa", axes[by], facades.along[seen] * facades.length[seen][:, None])
    for step in range(len(steps)):
        sun, tangent = steps.towards[step], float(steps.tangent[step])
        ahead = offset @ sun
        aside = np.abs(offset[:, 0] * sun[1] - offset[:, 1] * sun[0])
        some = np.flatnonzero(
            facades.front[step][seen]
            & (aside < radius)
            & (ahead > -radius)
            & ((ahead - radius) * tangent < rise)
        )
        if not len(some):
            continue
        level = (axes @ sun)[by[some]]
        hidden = _clipped(middle[some], shift[some], level, box[some], rise[some] / tangent)
        any_spot = hidden.any(axis=1)
        if any_spot.any():
            yield Hits(step, some[any_spot], hidden[any_spot])


def _clipped(middle: Floats, shift: Floats, level: Floats, half: Floats, shade: Floats) -> Bools:
    """Tell which spots' rays enter a box within the length of its shadow, shape (p, 3).

    Parameters
    ----------
    middle, shift
        Middle of the façade and the vector along it, in the frame of the box, shape (p, 2).
    level
        Direction of the level ray there, shape (p, 2).
    half
        Half sides of the box, shape (p, 2).
    shade
        Length of the shadow of the box at the height of the spots, metres, shape (p,).
    """
    entry = np.zeros((len(middle), len(SPOTS)))
    leave = np.full_like(entry, np.inf)
    for axis in (0, 1):
        step = level[:, axis]
        step = np.where(np.abs(step) < 1e-12, 1e-12, step)[:, None]
        start = middle[:, axis, None] + shift[:, axis, None] * SPOTS
        side = half[:, axis, None]
        one, two = (-side - start) / step, (side - start) / step
        entry = np.maximum(entry, np.minimum(one, two))
        leave = np.minimum(leave, np.maximum(one, two))
    hidden: Bools = (leave > entry) & (entry < shade[:, None])
    return hidden
