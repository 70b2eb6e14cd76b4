"""How the area of a row is shared out among its parcels."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ..rules import ParcelRules
from .line import Floats
from .profile import Overhang, Profile

#: Narrowest and widest parcel, in widths wished for.
NARROW, WIDE = 0.62, 1.6
#: Deeper stretches than that many depths may have narrower parcels, of that many widths.
VERY_DEEP, NARROWER = 1.6, 0.55
#: Slanted ends get no more land if the others would get less than that share of an equal part.
LEAST_SHARE = 0.7


def shared(total: float, count: int, shares: list[float], needs: list[float]) -> Floats:
    """Share out an area: the first and the last parcel get what they need, the others the rest."""
    weights = np.ones(count)
    if count >= 2:
        weights[0], weights[-1] = shares
    areas = weights / weights.sum() * total
    if count < 3:
        return np.asarray(areas)
    given = [max(need, a) for need, a in zip(needs, (areas[0], areas[-1]))]
    ends = np.array([given[0] > areas[0], given[1] > areas[-1]])
    if not ends.any():
        return np.asarray(areas)
    fixed = float(np.array(given)[ends].sum())
    free = np.ones(count, dtype=bool)
    free[[0, -1]] = ~ends
    rest = areas * ((total - fixed) / max(float(areas[free].sum()), 1e-9))
    if not free.any() or rest[free].min() < LEAST_SHARE * total / count:
        return np.asarray(areas)
    areas = np.where(free, rest, 0.0)
    areas[[0, -1]] = np.where(ends, given, areas[[0, -1]])
    return np.asarray(areas)


def how_many(
    wish: float, total: float, length: float, rules: ParcelRules, usual: float = 0.0
) -> int:
    """Return into how many parcels a stretch of a row is cut.

    Parameters
    ----------
    wish
        Area of the stretch in parcels wished for.
    total
        Its area, square metres.
    length
        Its length along the street, metres.
    rules
        What is asked of parcels.
    usual
        Depth of the stretch, metres.
    """
    narrow = (NARROWER if usual > VERY_DEEP * rules.depth else NARROW) * rules.width
    most = max(1, int(length / max(narrow, rules.min_frontage) + 1e-9))
    most = min(most, max(1, int(total / rules.least_area + 1e-9)))
    least = math.ceil(length / (WIDE * rules.width) - 1e-9)
    least = max(least, math.ceil(total / rules.largest_area - 1e-9))
    # n parcels of total / n each: the ratio to the wish is what should be near 1
    down = max(1, math.floor(wish))
    count = down + 1 if wish * wish > down * (down + 1) else down
    return min(max(1, count, least), most)


def whole_parcels(
    total: float, first: float, last: float, usual: float, rules: ParcelRules
) -> Floats:
    """Return the areas of parcels as wide as wished for, and of what is left at the end."""
    one = rules.width * usual
    inner = max(0, math.floor((total - (first - 1 + last - 1) * one) / one + 1e-6))
    areas = [one * first] + [one] * (inner - 2) + [one * last] if inner > 1 else [total]
    rest = total - sum(areas)
    enough = rest >= max(rules.least_area, rules.min_frontage * usual)
    too_large = areas[-1] + rest > rules.largest_area
    if rules.remainder == "last" and enough:
        return np.array([*areas, rest])
    if too_large and inner > 1:
        # the last parcel would be larger than allowed: the last two share what they have
        both = areas[-1] + rest
        return np.array([*areas[:-1], both / 2, both / 2])
    areas[-1] += rest
    return np.array(areas)


def needs_of(
    profile: Profile,
    inside: npt.NDArray[np.bool_],
    more: tuple[Overhang, Overhang],
    usual: float,
    ends: tuple[bool, bool],
    rules: ParcelRules,
    widest: float,
    spare: float,
) -> list[float]:
    """Return how large slanted end parcels have to be, square metres.

    The rectangle around a parcel with one slanted side is larger than it by lack / (2 width).
    """
    place, depth = profile.place[inside], profile.depth[inside]
    full = np.flatnonzero(depth > 0.9 * usual)
    found = [0.0, 0.0]
    for k, at in ((0, 0), (1, -1)):
        if not ends[k] or len(full) == 0:
            continue
        lack = max(abs(float(place[full[at]] - place[at])) / 0.9, more[k].lack)
        need = lack / (2 * spare) * usual
        found[k] = min(need, widest * rules.area, rules.largest_area)
    return found
