"""Grammars as JSON files: read, checked and written.

The format is described in docs/grammars.md and, for editors, in grammars/schema.json. The
parameters of a rule are those of CS Table 4, by their names.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..grammar import Grammar, Rule, State
from .check import check_grammar
from .faults import Place, shown
from .jsontext import Fields, load, read_text
from .rule import check_fields, read_rule, state_of
from .text import grammar_text

__all__ = ["grammar_text", "parse_grammar", "read_grammar"]

#: Fields of the file, those that it must have first.
REQUIRED = ("name", "angles", "rules")
GRAMMAR_FIELDS = (*REQUIRED, "text", "credit", "$schema")
#: What angles may be given in.
UNITS = ("degrees", "radians")
#: Most characters of each text.
LONGEST = {"name": 60, "text": 500, "credit": 500}


def read_grammar(path: str | Path) -> Grammar:
    """Read a grammar from a JSON file.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    Grammar
        With angles in radians.

    Raises
    ------
    InputError
        If it cannot be read, or as `parse_grammar` says.
    """
    path = Path(path)
    return parse_grammar(read_text(path), path.name)


def parse_grammar(text: str, source: str) -> Grammar:
    """Read a grammar from JSON. Nothing in it is evaluated.

    Parameters
    ----------
    text
        The JSON.
    source
        What errors call it, such as the name of its file.

    Returns
    -------
    Grammar
        With angles in radians.

    Raises
    ------
    InputError
        If it is not JSON, too large or nested too deep; or if the grammar has faults: names up to
        ten at once, each with state, number of the rule and field.
    """
    data = load(text, source)
    place = Place(source)
    if not isinstance(data, Fields):
        place.say(f"It is {shown(data)}.", "Write an object with name, angles and rules.")
        place.settle()
    if data and all(_is_label(key) for key in data):
        place.say(
            "It holds rules only.",
            'Put them under "rules", beside "name" and "angles" ("radians" for rules of '
            "CitySprout).",
        )
        place.settle()
    check_fields(data, GRAMMAR_FIELDS, REQUIRED, place)
    texts = {key: _text(data.get(key, key), place.at(key), most) for key, most in LONGEST.items()}
    for key in ("text", "credit"):
        texts[key] = texts[key] if key in data else ""
    unit = data.get("angles", UNITS[0])
    if unit not in UNITS:
        place.at("angles").say(f"The value is {shown(unit)}.", 'Give "degrees" or "radians".')
    rules = _rules(data.get("rules", Fields([])), place, unit != "radians")
    place.settle()
    grammar = Grammar(texts["name"], rules, texts["text"], texts["credit"])
    check_grammar(grammar, place)
    place.settle()
    return grammar


def _is_label(key: str) -> bool:
    # Generous, so that a label with a slip is still taken for one.
    return key[:1] in ("m", "l", "s") and key[1:2].isupper()


def _text(value: Any, place: Place, most: int) -> str:
    if not isinstance(value, str):
        place.say(f"The value is {shown(value)}.", "Give a text in double quotes.")
    elif not value.strip() and most == LONGEST["name"]:
        place.say("The text is empty.", "Give the grammar a name.")
    elif len(value) > most or not value.isprintable():
        place.say(
            f"The text has {len(value)} characters."
            if len(value) > most
            else "The text has line breaks or other characters that cannot be shown.",
            f"Give a single line of at most {most} characters.",
        )
    else:
        return value
    return ""


def _rules(data: Any, place: Place, in_degrees: bool) -> dict[State, tuple[Rule, ...]]:
    if not isinstance(data, Fields):
        place.at("rules").say(
            f"The value is {shown(data)}.",
            'Give an object of states and their rules, such as {"mStart": [...], "mL": [...]}.',
        )
        return {}
    for key in data.twice:
        place.at("rules").say(
            f"The state {key[:40]!r} is given more than once.", "Put all its rules in one list."
        )
    found = {}
    for label, entries in data.items():
        state = state_of(label, place.at("rules"))
        here = place.at(f"state {label[:40]}")
        if not isinstance(entries, list) or not entries:
            here.say(
                "The list of rules is empty." if entries == [] else f"It is {shown(entries)}.",
                "Leave the state out if its nodes never grow, or give a list of rules, "
                "[{...}, {...}].",
            )
            continue
        rules = [
            read_rule(entry, here.at(f"rule {number}"), in_degrees)
            for number, entry in enumerate(entries, 1)
        ]
        if state is not None:
            found[state] = tuple(rule for rule in rules if rule is not None)
    return found
