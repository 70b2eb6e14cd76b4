"""The specification of a run in plain words: what was asked, first what is not as usual."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .figures import figure_text, plain, split_unit

#: Longest text of one value; the rest of a longer one is left out.
_LONGEST = 300


@dataclass(frozen=True)
class InputFacts:
    """What a tool declares of an input.

    Attributes
    ----------
    title
        What it is called, with the unit in parentheses.
    default
        Its usual value, or None where it has none.
    """

    title: str
    default: Any = None


@dataclass(frozen=True)
class Wish:
    """One thing that was asked.

    Attributes
    ----------
    label
        What it is called.
    text
        What was asked, with its unit.
    usual
        Whether this is what the tool does unless told otherwise.
    """

    label: str
    text: str
    usual: bool


def wishes_of(specification: str, inputs: Mapping[str, InputFacts]) -> tuple[Wish, ...]:
    """Return a specification in words, what differs from the usual first.

    Parameters
    ----------
    specification
        JSON as it is stored with every layer: an object, nested or not, or `{"sites": {...}}`
        with one for each site. What is no such JSON gives no wishes.
    inputs
        What the tool declares, by the key of its inputs in lower case.

    Examples
    --------
    >>> facts = {"block_width": InputFacts("Block width (m)", 72.0)}
    >>> for wish in wishes_of('{"block_width": 95.0, "zigzags": null}', facts):
    ...     print(wish.label, wish.text, wish.usual)
    Block width 95 m False
    Zigzags not set True
    """
    try:
        return _wishes(json.loads(specification or "{}"), inputs)
    except (ValueError, RecursionError):  # no JSON, or nested beyond all reason
        return ()


def _wishes(values: Any, inputs: Mapping[str, InputFacts]) -> tuple[Wish, ...]:
    if not isinstance(values, dict):
        return ()
    sites = values.get("sites")
    if isinstance(sites, dict) and sites and all(isinstance(own, dict) for own in sites.values()):
        found = _of_sites(sites, inputs)
    else:
        found = _flat(values, inputs)
    return tuple(sorted(found, key=lambda wish: wish.usual))


def _of_sites(
    sites: Mapping[str, Mapping[str, Any]], inputs: Mapping[str, InputFacts]
) -> list[Wish]:
    """Return what all sites share once, and the rest site by site."""
    rows = {site: _flat(own, inputs) for site, own in sites.items()}
    shared = [
        wish for wish in next(iter(rows.values())) if all(wish in own for own in rows.values())
    ]
    own = [
        Wish(f"{wish.label}, site {site}", wish.text, usual=False)
        for site, found in rows.items()
        for wish in found
        if wish not in shared
    ]
    return own + shared


def _flat(
    values: Mapping[str, Any], inputs: Mapping[str, InputFacts], above: str = ""
) -> list[Wish]:
    """Return a nested object as a list."""
    found: list[Wish] = []
    for key, value in values.items():
        facts = inputs.get(str(key).lower())
        label, unit = f"{above}{plain(str(key))}", ""
        if facts is not None:
            label, unit = split_unit(facts.title)
        if isinstance(value, dict) and value:
            found += _flat(value, inputs, f"{label}: ")
            continue
        found.append(Wish(label, _text(value, unit), _usual(value, facts)))
    return found


def _text(value: Any, unit: str) -> str:
    if value is None or value in ("", [], {}):
        return "not set"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (int, float)):
        return "infinite" if math.isinf(value) else figure_text(value, unit)
    if isinstance(value, list) and all(isinstance(own, dict) for own in value):
        names = [str(own["name"]) for own in value if own.get("name")]
        text = ", ".join(names) if len(names) == len(value) else f"{len(value)} entries"
    elif isinstance(value, list):
        text = ", ".join(_text(own, "") for own in value)
    else:
        text = str(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def _usual(value: Any, facts: InputFacts | None) -> bool:
    """Tell whether a value is what a tool does by itself; unknown defaults are nothing asked."""
    if value is None:
        return True
    if facts is not None and facts.default is not None:
        if isinstance(value, (int, float)) and isinstance(facts.default, (int, float)):
            return math.isclose(value, facts.default)
        # choices are kept as words, here and there with another ending: auto, automatic
        short, long = sorted((str(value).lower(), str(facts.default).lower()), key=len)
        return bool(short) and long.startswith(short)
    return value is False or value in ("", [], {}) or (facts is None and value == 0)
