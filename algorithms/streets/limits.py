"""The limits on a whole network in words, for reasons why streets are missing."""

from __future__ import annotations

from ..network.specification import Specification


def limits(spec: Specification) -> list[str]:
    """Name the limits on the whole network that a planner gave."""
    named = {
        "the number of exits": spec.exits,
        "the longest way out": spec.max_distance,
        "the length budget": spec.length_budget,
        "one-way streets": None if spec.one_way == "none" else spec.one_way,
    }
    return [name for name, value in named.items() if value is not None]


def why_blind(spec: Specification) -> str:
    """Say why streets end blind: for want of roads, or for what was asked."""
    given = limits(spec)
    if not given:
        return "since most sides have no road"
    return f"since most sides have no road, or {' and '.join(given)} cannot be had otherwise"


def or_limits(spec: Specification) -> str:
    """Say, after other reasons, that what was asked may be the cause."""
    given = limits(spec)
    return f"; or {' and '.join(given)} cannot be had with them" if given else ""
