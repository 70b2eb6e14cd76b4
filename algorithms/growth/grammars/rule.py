"""One rule of a grammar's file, field by field: the names are those of CS Table 4.

How many streets a rule draws is said by its lists: each has one entry per street, and a single
value stands for all of them. A list is never a range; a range is a list inside the list.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from ..grammar import EDGE, NODE_TYPES, ROAD_TYPES, STATES, Child, Rule, State
from .faults import Place, shown
from .jsontext import Fields

T = TypeVar("T")

#: Fields with one value per street.
CHILD_FIELDS = ("thetas", "randDirection", "lengths", "newRoadTypes", "newNodeTypes", "newRoad")
#: Those of them that have a value unless one is given.
OPTIONAL = {"randDirection": False, "newRoad": False}
#: All fields of a rule.
RULE_FIELDS = ("occurProb", "changeNodeTo", *CHILD_FIELDS, "minDistances")

#: Least and greatest probability, and length or distance in the grammar's unit.
PROBABILITIES = (1e-9, 1e9)
DISTANCES = (1e-6, 1e6)

#: Other ways to say what grammars say in letters.
ROAD_WORDS = {word: letter for letter, word in ROAD_TYPES.items()}
NODE_WORDS = {word: letter for letter, word in NODE_TYPES.items()}
STATE_WORDS = {
    way: label
    for label, state in STATES.items()
    for way in (
        state.words,
        state.words.replace(" ", ""),
        state.road + NODE_TYPES[state.node],
        ROAD_TYPES[state.road] + state.node,
    )
}


def read_rule(data: Any, place: Place, in_degrees: bool) -> Rule | None:
    """Read and check one rule.

    Parameters
    ----------
    data
        What the file holds in its place.
    place
        That place; takes note of every fault.
    in_degrees
        Whether angles are degrees, and not radians.

    Returns
    -------
    Rule or None
        None where a fault was noted.
    """
    before = len(place.faults)
    if not isinstance(data, Fields):
        place.say(
            f"The rule is {shown(data)}.",
            "Write it as an object with curly brackets, such as "
            '{"changeNodeTo": "B", "thetas": [0], ...}.',
        )
        return None
    check_fields(data, RULE_FIELDS, ("changeNodeTo",), place)
    probability = number(data.get("occurProb", 1.0), place.at("occurProb"), PROBABILITIES)
    becomes = None
    if "changeNodeTo" in data:
        becomes = node_type(data["changeNodeTo"], place.at("changeNodeTo"))
    distances = _distances(data.get("minDistances", Fields([])), place.at("minDistances"))
    children = _children(data, place, in_degrees)
    if len(place.faults) > before or probability is None or becomes is None:
        return None
    return Rule(probability, becomes, children, distances)


def check_fields(data: Fields, known: Iterable[str], required: Iterable[str], place: Place) -> None:
    """Note fields that are unknown, given twice or missing.

    Parameters
    ----------
    data
        The object.
    known
        Fields that it may have.
    required
        Fields that it must have.
    place
        Where it is.
    """
    known = tuple(known)
    for key in data:
        if key not in known:
            place.say(
                f"There is no field {key[:40]!r}.",
                f"{place.nearest(key, known)}The fields are {', '.join(known)}.",
            )
    for key in data.twice:
        place.say(f"The field {key[:40]!r} is given more than once.", "Keep one of them.")
    for key in required:
        if key not in data:
            place.say(f"The field {key} is missing.", "Add it.")


def number(value: Any, place: Place, bounds: tuple[float, float]) -> float | None:
    """Return a number within bounds, or note a fault.

    Parameters
    ----------
    value
        What the file holds.
    place
        Where.
    bounds
        Least and greatest number.
    """
    if not isinstance(value, float) or math.isnan(value):
        place.say(
            f"The value is {shown(value)}.",
            "Give a number without quotes; nothing in a grammar is calculated."
            if isinstance(value, str)
            else "Give a number.",
        )
    elif not bounds[0] <= value <= bounds[1]:
        place.say(f"The value is {shown(value)}.", f"Give {bounds[0]:g} to {bounds[1]:g}.")
    else:
        return value
    return None


def node_type(value: Any, place: Place) -> str | None:
    """Return a type of node that a rule may give, or note a fault.

    Parameters
    ----------
    value
        What the file holds.
    place
        Where.
    """
    if value == EDGE:
        place.say(
            f"{EDGE} is what nodes at the edge of the ground become by themselves.",
            "Give K for a node that never grows.",
        )
        return None
    names = tuple(name for name in NODE_TYPES if name != EDGE)
    return _name(value, place, names, NODE_WORDS, "node type")


def state_of(label: str, place: Place) -> State | None:
    """Return the state that a label means, or note a fault.

    Parameters
    ----------
    label
        Such as mStart or lB.
    place
        Where it is.
    """
    if label not in STATES:
        place.say(
            f"There is no state {label[:40]!r}.",
            f"{place.nearest(label, STATES, STATE_WORDS)}A state is a road type "
            f"({', '.join(ROAD_TYPES)}) and a node type ({', '.join(NODE_TYPES)}), such as mL.",
        )
    return STATES.get(label)


def _name(
    value: Any, place: Place, names: tuple[str, ...], words: dict[str, str], what: str
) -> str | None:
    if isinstance(value, str) and value in names:
        return value
    text = f"There is no {what} {value[:40]!r}." if isinstance(value, str) else ""
    guess = place.nearest(value, names, words) if isinstance(value, str) else ""
    place.say(text or f"The value is {shown(value)}.", f"{guess}Give {', '.join(names)}.")
    return None


def _road_type(value: Any, place: Place) -> str | None:
    return _name(value, place, tuple(ROAD_TYPES), ROAD_WORDS, "road type")


def _flag(value: Any, place: Place) -> bool | None:
    if isinstance(value, bool):
        return value
    place.say(f"The value is {shown(value)}.", "Give true or false, without quotes.")
    return None


def _span(value: Any, place: Place, bounds: tuple[float, float]) -> tuple[float, float] | None:
    """Return a number or a range as least and greatest value, or note a fault."""
    if not isinstance(value, list):
        one = number(value, place, bounds)
        return None if one is None else (one, one)
    if len(value) != 2:
        place.say(
            f"The range has {len(value)} values.", "Give the least and the greatest, [low, high]."
        )
        return None
    low, high = (number(v, place, bounds) for v in value)
    if low is None or high is None:
        return None
    if low > high:
        place.say(
            f"The range begins with {low:.15g} and ends with {high:.15g}.",
            "Give the smaller number first.",
        )
        return None
    return low, high


def _angle(value: Any, place: Place, in_degrees: bool) -> tuple[float, float] | None:
    full = 360.0 if in_degrees else math.tau
    before = len(place.faults)
    span = _span(value, place, (-math.inf, math.inf))
    if span is not None and not all(abs(v) <= full for v in span):
        hint = "" if in_degrees else " Or are the angles in degrees? Then say so in angles."
        place.say(
            f"The angle {shown(max(span, key=abs))} is more than a full turn.",
            f"Give {-full:.4g} to {full:.4g}.{hint}",
        )
    if span is None or len(place.faults) > before:
        return None
    return (math.radians(span[0]), math.radians(span[1])) if in_degrees else span


def _distances(data: Any, place: Place) -> dict[State, float]:
    if not isinstance(data, Fields):
        place.say(
            f"The value is {shown(data)}.",
            'Give an object of states and distances, such as {"mB": 3}, also where the rule draws '
            "several streets: they are measured from the node that grows.",
        )
        return {}
    for key in data.twice:
        place.say(f"The state {key[:40]!r} is given more than once.", "Keep one of them.")
    found = {}
    for label, value in data.items():
        state = state_of(label, place)
        distance = number(value, place.at(label[:40]), DISTANCES)
        if state is not None and distance is not None:
            found[state] = distance
    return found


def _children(data: Fields, place: Place, in_degrees: bool) -> tuple[Child, ...]:
    """Return the streets that a rule draws; none of them where a fault was noted."""
    given = [name for name in CHILD_FIELDS if name in data]
    if not given:
        return ()
    missing = [name for name in CHILD_FIELDS if name not in data and name not in OPTIONAL]
    for name in missing:
        place.say(
            f"The field {name} is missing.",
            f"Add it: the rule has {given[0]}, so it draws streets.",
        )
    count = _count(data, given, place)
    if missing or count is None:
        return ()

    def each(name: str, read: Callable[[Any, Place], T | None]) -> list[T | None]:
        value = data.get(name, OPTIONAL.get(name))
        if not isinstance(value, list):
            # Checked also where the rule draws no street.
            return [read(value, place.at(name))] * count
        where = place.at(name)
        many = len(value) > 1
        return [read(v, where.at(f"street {i}") if many else where) for i, v in enumerate(value, 1)]

    columns = zip(
        each("thetas", lambda value, at: _angle(value, at, in_degrees)),
        each("lengths", lambda value, at: _span(value, at, DISTANCES)),
        each("newRoadTypes", _road_type),
        each("newNodeTypes", node_type),
        each("randDirection", _flag),
        each("newRoad", _flag),
    )
    children = []
    for angle, length, road, node, mirrored, new_road in columns:
        if angle is None or length is None or road is None or node is None:
            return ()
        if mirrored is None or new_road is None:
            return ()
        children.append(Child(angle, length, State(road, node), mirrored, new_road))
    return tuple(children)


def _count(data: Fields, given: list[str], place: Place) -> int | None:
    """Return how many streets a rule draws, or note why that is not clear."""
    lists = {name: data[name] for name in given if isinstance(data[name], list)}
    counts = {len(values) for values in lists.values()}
    if len(counts) > 1:
        found = ", ".join(f"{name} {len(values)}" for name, values in lists.items())
        place.say(
            f"The lists differ in length: {found}.",
            "Give each one entry per street that the rule draws, or a single value for all. A "
            "range is a list inside the list, such as [[0, 20]].",
        )
        return None
    pairs = counts == {2} and lists.keys() <= {"thetas", "lengths"}
    if pairs and all(isinstance(v, float) for values in lists.values() for v in values):
        place.say(
            f"{' and '.join(lists)} may mean two streets or one street of a range.",
            "For two streets write newNodeTypes as a list too, with an entry for each; for a "
            "range write a list inside the list, such as [[0, 20]].",
        )
        return None
    return counts.pop() if counts else 1
