"""What the rules of a grammar must have in common so that streets grow from it."""

from __future__ import annotations

import math
from collections.abc import Iterable

from ..grammar import NEVER_GROW, Grammar, Rule, State
from .faults import Place


def next_states(state: State, rules: Iterable[Rule]) -> set[State]:
    """Return what a node and the ends of its streets may be after one iteration.

    Parameters
    ----------
    state
        What the node is.
    rules
        Rules of that state.
    """
    rules = tuple(rules)
    own = {State(state.road, rule.becomes) for rule in rules}
    return own | {child.state for rule in rules for child in rule.children}


def possible_states(grammar: Grammar) -> set[State]:
    """Return every state that can occur.

    Parameters
    ----------
    grammar
        The rules.

    Returns
    -------
    set of State
        What can come of the start, and of the leaf from which growth on given streets begins.
    """
    found: set[State] = set()
    waiting = [grammar.start, grammar.leaf]
    while waiting:
        state = waiting.pop()
        if state not in found:
            found.add(state)
            waiting.extend(next_states(state, grammar.rules.get(state, ())))
    return found


def check_grammar(grammar: Grammar, place: Place) -> None:
    """Note what keeps a grammar whose rules are sound one by one from growing well.

    Parameters
    ----------
    grammar
        The rules.
    place
        Takes note of every fault.
    """
    if grammar.start not in grammar.rules:
        place.say(
            f"The state {grammar.start.label} has no rule, so that nothing would ever grow.",
            f"Add a rule for {grammar.start.label}: it draws the first streets.",
        )
    for state in grammar.rules:
        if state.node in NEVER_GROW:
            place.at(f"state {state.label}").say(
                f"Nodes of type {state.node} never grow, but there are rules.",
                "Leave the state out, or give the rules to another.",
            )
    for state in sorted(possible_states(grammar) & grammar.rules.keys()):
        here = place.at(f"state {state.label}")
        if state.node in NEVER_GROW:
            continue
        if all(rule.min_distances for rule in grammar.rules[state]):
            here.say(
                "Every rule has minDistances, so that none fits where nodes are near (CS "
                "section 1).",
                "Add a rule without minDistances, such as one that draws no street.",
            )
        if _waits_for_ever(state, grammar):
            here.say(
                "Nodes of this state would wait for ever: no rule draws a street, and none "
                "changes the node to a type without rules.",
                "Add a rule that draws a street, or change the node to K.",
            )


def _waits_for_ever(state: State, grammar: Grammar) -> bool:
    """Tell whether a node only ever changes its type and never comes to rest."""
    seen: set[State] = set()
    waiting = [state]
    while waiting:
        here = waiting.pop()
        rules = grammar.rules.get(here, ())
        if not rules or any(rule.children for rule in rules):
            return False
        if here not in seen:
            seen.add(here)
            waiting.extend(next_states(here, rules))
    return True


def grammar_remarks(grammar: Grammar) -> tuple[str, ...]:
    """Tell what is odd about a grammar and yet allowed.

    Parameters
    ----------
    grammar
        A grammar that passed all checks.

    Returns
    -------
    tuple of str
        Sentences for the planner; empty where all is well.
    """
    found = []
    idle = sorted(grammar.rules.keys() - possible_states(grammar))
    if idle:
        labels = ", ".join(state.label for state in idle)
        found.append(
            f"The rules of {labels} are never used: no node becomes that, neither from "
            f"{grammar.start.label} nor from {grammar.leaf.label}."
        )
    turns = [
        math.degrees(abs(angle))
        for rules in grammar.rules.values()
        for rule in rules
        for child in rule.children
        for angle in child.angle
    ]
    if 0 < max(turns, default=0.0) < 6.3:
        found.append(
            f"No street turns by more than {max(turns):.3g} degrees: are the angles of the file "
            "radians?"
        )
    return tuple(found)
