"""Grammars written as JSON that a planner can read and edit, and that reads back as the same."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

from ..grammar import Child, Grammar, Rule


def grammar_text(grammar: Grammar) -> str:
    """Write a grammar as JSON.

    Parameters
    ----------
    grammar
        A grammar that passes the checks of `parse_grammar`.

    Returns
    -------
    str
        JSON with angles in degrees, or in radians where one of them is no double-precision number
        of degrees. `parse_grammar` makes exactly the same grammar of it.
    """
    found = {
        angle: in_degrees(angle)
        for rules in grammar.rules.values()
        for rule in rules
        for child in rule.children
        for angle in child.angle
    }
    exact = None not in found.values()

    def angle_text(angle: float) -> Any:
        return _plain(found[angle] if exact else angle)

    head: dict[str, str] = {"name": grammar.name}
    if grammar.text:
        head["text"] = grammar.text
    if grammar.credit:
        head["credit"] = grammar.credit
    head["angles"] = "degrees" if exact else "radians"
    states = []
    for state, rules in grammar.rules.items():
        written = ",\n".join(_rule(rule, angle_text) for rule in rules)
        states.append(f"    {_json(state.label)}: [\n{written}\n    ]")
    lines = [f"  {_json(key)}: {_json(value)}" for key, value in head.items()]
    lines.append('  "rules": {\n' + ",\n".join(states) + "\n  }")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def in_degrees(angle: float) -> float | None:
    """Return the number of degrees, as round as can be, that is read as an angle.

    Parameters
    ----------
    angle
        Radians.

    Returns
    -------
    float or None
        None where no number of degrees becomes exactly this angle: degrees lie less dense than
        radians in parts of the range.
    """
    value = math.degrees(angle)
    rounded = [round(value, digits) for digits in range(16)]
    near = (value, math.nextafter(value, math.inf), math.nextafter(value, -math.inf))
    return next((d for d in (*rounded, *near) if math.radians(d) == angle), None)


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _plain(value: float | None) -> Any:
    """Return a number without a decimal point where it has none."""
    # Where Grammar objects are made in Python an int may stand for a float.
    if value is not None and float(value).is_integer() and abs(value) < 2**53:
        return int(value)
    return value


def _span(span: tuple[float, float], text: Callable[[float], Any]) -> Any:
    low, high = span
    return text(low) if low == high else [text(low), text(high)]


def _rule(rule: Rule, angle_text: Callable[[float], Any]) -> str:
    """Write a rule, one field per line; what has its usual value is left out."""
    fields: dict[str, Any] = {
        "occurProb": _plain(rule.probability),
        "changeNodeTo": rule.becomes,
    }
    children = rule.children
    if children:
        fields |= {
            "thetas": [_span(child.angle, angle_text) for child in children],
            "randDirection": _flags(children, "mirrored"),
            "lengths": [_span(child.length, _plain) for child in children],
            "newRoadTypes": [child.state.road for child in children],
            "newNodeTypes": [child.state.node for child in children],
            "newRoad": _flags(children, "new_road"),
        }
    if rule.min_distances:
        fields["minDistances"] = {s.label: _plain(d) for s, d in rule.min_distances.items()}
    lines = ",\n".join(
        f"        {_json(key)}: {_json(value)}" for key, value in fields.items() if value != []
    )
    return f"      {{\n{lines}\n      }}"


def _flags(children: tuple[Child, ...], name: str) -> list[bool]:
    """Return a flag of every street, or nothing where all are false."""
    flags = [bool(getattr(child, name)) for child in children]
    return flags if any(flags) else []
