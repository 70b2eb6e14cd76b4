"""Control lines before they have their place in the tree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from ..types import Floats
from .need import Need
from .room import SLACK, Room

#: A line is parallel to its façades if its ends differ in depth by this at most, metres.
LEVEL = 1e-3


@dataclass(frozen=True)
class Draft:
    """A control line that carries buildings, as a pattern proposes it.

    Attributes
    ----------
    start, end
        Ends, metres.
    facing_deg
        Azimuth of the balconies.
    rank
        Placement order within the pattern: smaller first.
    spacing_m
        Least distance of centres, 0 for no wish.
    mirror
        Index of its mirror within the proposal, -1 for none.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    facing_deg: float
    rank: int = 0
    spacing_m: float = 0.0
    mirror: int = -1

    @property
    def length(self) -> float:
        """Length, metres."""
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]))


def row(
    room: Room, v: float, span: tuple[float, float] | Floats, rank: int = 0, spacing_m: float = 0.0
) -> Draft:
    """Draw a line parallel to the façades of a room, at depth v and over a span of u."""
    ends = room.world(np.array([[span[0], v], [span[1], v]]))
    return Draft(pair(ends[0]), pair(ends[1]), room.facing_deg, rank, spacing_m)


def pair(xy: Floats) -> tuple[float, float]:
    """Give a point as two plain numbers."""
    return float(xy[0]), float(xy[1])


def with_room(need: Need, drafts: Sequence[Draft]) -> list[Draft]:
    """Keep the lines on which some building stands, and mirrors only together.

    Parameters
    ----------
    need
        The patch and what is asked of it.
    drafts
        Lines; `mirror` is an index in this list.

    Returns
    -------
    list of Draft
        With their mirrors by the new indices.
    """
    good = [_has_room(need, draft) for draft in drafts]
    kept = [
        k for k, draft in enumerate(drafts) if good[k] and (draft.mirror < 0 or good[draft.mirror])
    ]
    place = {old: new for new, old in enumerate(kept)}
    return [replace(drafts[k], mirror=place.get(drafts[k].mirror, -1)) for k in kept]


def _has_room(need: Need, draft: Draft) -> bool:
    """Tell whether the centre of some building may lie on a line."""
    room = need.turned(draft.facing_deg)
    uv = room.local(np.array([draft.start, draft.end]))
    low, high = np.sort(uv[:, 0])
    if abs(uv[1, 1] - uv[0, 1]) > LEVEL:
        line = shapely.LineString([draft.start, draft.end])
        return any(line.intersects(need.room.centres(*size)) for size in need.sizes)
    v = float(uv[:, 1].mean())
    return any(
        bool((np.maximum(a, low) <= np.minimum(b, high) + SLACK).any())
        for length, width in need.sizes
        for spans in [room.spans(v, length, width)]
        for a, b in [(spans[:, 0] + length / 2, spans[:, 1] - length / 2)]
    )
