"""The parameters that make up a specification, shared by designing and validating streets."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from qgis.core import QgsProcessingParameterDefinition

from ...algorithms.errors import InputError
from .. import parameters, presets
from ..request import Request
from . import persite

SINK_MODES = {
    "existing streets": ("streets", "along the existing streets at the edge of the site"),
    "whole boundary": ("boundary", "anywhere on the edge of the site"),
    "access points": ("access", "only where existing streets arrive"),
    "given points": ("points", "at the points of the layer 'Given exits', inside or on the edge"),
}
RULE_SETS = {
    "planner": ("planner", "straight streets, blocks of the wished size, existing streets go on"),
    "as in the paper": ("paper", "only the rules of Peng and others (2016)"),
}
COVERAGE_UNITS = {
    "mesh edges": ("edges", "counted along the candidate mesh"),
    "metres": ("metres", "measured along the candidate mesh"),
    "metres straight": ("straight", "metres as the crow flies"),
}
SOLVERS = {
    "automatic": ("auto", "CP-SAT where it is installed, else HiGHS"),
    "CP-SAT": ("cpsat", "of OR-Tools"),
    "HiGHS": ("highs", "comes with the plugin's packages; slower"),
}

_BY_RULES = "as the rules say"
_STRICTNESS = {
    _BY_RULES: "what the chosen rules and the block size imply",
    "forbid": "never",
    "discourage": "at a price",
    "allow": "at no price",
}
#: Rule keys: field of the specification, text, help, default, price where discouraged (in
#: lengths of a mesh edge).
_LOCAL_RULES = {
    "DEAD_ENDS": (
        "dead_ends",
        "Dead ends",
        "Streets that end without a connection.",
        "forbid",
        5.0,
    ),
    "ZIGZAGS": ("zigzags", "Zigzags", "Two opposite turns within one mesh edge.", _BY_RULES, 5.0),
    "TOO_CLOSE": (
        "too_close",
        "Streets too close",
        "Two streets side by side, one mesh cell apart.",
        _BY_RULES,
        6.0,
    ),
    "T_JUNCTIONS": (
        "t_junctions",
        "T-junctions",
        "Junctions of three streets where four could meet.",
        "allow",
        1.0,
    ),
    "BRANCHES": ("branches", "Branches", "Junctions of three or more streets.", "allow", 1.0),
}


def _words(choices: dict[str, tuple[str, str]]) -> dict[str, str]:
    return {word: meaning for word, (_, meaning) in choices.items()}


def block_size() -> Iterator[QgsProcessingParameterDefinition]:
    """Declare the kind of neighbourhood and the wished block size."""
    yield presets.parameter()
    yield parameters.number(
        "BLOCK_WIDTH",
        "Block width",
        "Wished width of the blocks, from street centre line to centre line. Empty: as the kind "
        "of neighbourhood says. A field or an expression gives every site its own.",
        unit="m",
        minimum=10.0,
        maximum=2000.0,
        per_feature_of="INPUT",
        unset="by kind",
    )
    yield parameters.number(
        "BLOCK_LENGTH",
        "Block length",
        "Wished greatest length of the blocks, not less than their width. Empty: as the kind of "
        "neighbourhood says. A field or an expression gives every site its own.",
        unit="m",
        minimum=10.0,
        maximum=5000.0,
        per_feature_of="INPUT",
        unset="by kind",
    )


def sink_mode() -> QgsProcessingParameterDefinition:
    """Declare where traffic leaves."""
    return parameters.choice(
        "SINK_MODE",
        "Where streets may leave the site",
        "Every street must lead to such a place.",
        _words(SINK_MODES),
        default="existing streets",
    )


def sinks() -> QgsProcessingParameterDefinition:
    """Declare the layer of given exits."""
    return parameters.layer(
        "SINKS",
        "Given exits",
        "Points where traffic leaves, used where streets may leave the site at 'given points'.",
        "point",
        optional=True,
        advanced=True,
    )


def rule_set() -> Iterator[QgsProcessingParameterDefinition]:
    """Declare the preset, the coverage and the local rules."""
    yield parameters.choice(
        "RULES",
        "Rules",
        "The set of rules from which whatever is left empty below follows.",
        _words(RULE_SETS),
        default="planner",
        advanced=True,
    )
    yield parameters.number(
        "COVERAGE",
        "Coverage range",
        "No place of the candidate mesh is farther than this from a street. Empty: as the rules "
        "say.",
        minimum=0.0,
        advanced=True,
    )
    yield parameters.choice(
        "COVERAGE_UNIT",
        "Unit of the coverage range",
        "How the coverage range is measured.",
        _words(COVERAGE_UNITS),
        default="mesh edges",
        advanced=True,
    )
    for key, (_, text, help_text, default, _price) in _LOCAL_RULES.items():
        yield parameters.choice(key, text, help_text, _STRICTNESS, default=default, advanced=True)


def checked_rules() -> Iterator[QgsProcessingParameterDefinition]:
    """Declare how strictly streets that exist are checked against each local rule."""
    words = {"forbid": "an error", "discourage": "a warning", "allow": "not checked"}
    for key, (_, text, help_text, default, _price) in _LOCAL_RULES.items():
        own = "allow" if default == _BY_RULES else default
        yield parameters.choice(key, text, help_text, words, default=own, advanced=True)


def weights() -> Iterator[QgsProcessingParameterDefinition]:
    """Declare the weights of the objective."""
    unit = "per mesh edge length"
    yield parameters.number(
        "WEIGHT_LENGTH",
        "Weight of street length",
        "Price of building streets (lambda L of the paper).",
        unit=unit,
        default=1.0,
        minimum=0.0,
        advanced=True,
    )
    yield parameters.number(
        "WEIGHT_DISTANCE",
        "Weight of the way out",
        "Price of the way from each junction to the nearest exit (lambda D of the paper).",
        unit=unit,
        default=0.0,
        minimum=0.0,
        advanced=True,
    )
    yield parameters.number(
        "WEIGHT_STRAIGHT",
        "Weight of straight streets",
        "Price of each street end that does not go straight on. Empty: as the kind of "
        "neighbourhood or, where it has none, the rules say.",
        minimum=0.0,
        advanced=True,
    )
    yield parameters.number(
        "WEIGHT_CONTINUE",
        "Weight of continued streets",
        "Price of each existing street that does not go on into the site. Empty: as the rules say.",
        minimum=0.0,
        advanced=True,
    )


def search() -> Iterator[QgsProcessingParameterDefinition]:
    """Declare how long and how hard to search."""
    yield parameters.number(
        "LEVELS",
        "Street levels",
        "2: collectors first, then local streets between them; 1: one level.",
        default=2,
        minimum=1,
        maximum=2,
        integer=True,
        advanced=True,
    )
    yield parameters.number(
        "GAP",
        "Gap at which the search may stop",
        "The distance from the proven bound at which each program (collectors, then local streets "
        "block by block) may stop, as a share of its price.",
        unit="share, 0.01 = 1 %",
        default=0.01,
        minimum=0.0,
        maximum=1.0,
        advanced=True,
    )
    yield parameters.number(
        "SEED",
        "Seed",
        "Another number gives another search. The same number gives the same design as long as the "
        "run ends by itself, not by the time limit.",
        default=1,
        minimum=0,
        maximum=2**31 - 1,
        integer=True,
        advanced=True,
    )
    yield parameters.choice(
        "SOLVER",
        "Solver",
        "The program that searches.",
        _words(SOLVERS),
        default="automatic",
        advanced=True,
    )


def time_limit() -> QgsProcessingParameterDefinition:
    """Declare the time for all solving."""
    return parameters.number(
        "TIME_LIMIT",
        "Time limit",
        "Time for the search, all sites together. A design is there after a few seconds; more "
        "time makes it better. Cancel keeps the best one so far.",
        unit="s",
        default=30.0,
        minimum=1.0,
        maximum=86400.0,
        advanced=True,
    )


def _weight(request: Request, key: str) -> float | None:
    """Return the weight of a local rule; None where the rules decide."""
    price = _LOCAL_RULES[key][4]
    weights = {_BY_RULES: None, "forbid": math.inf, "discourage": price, "allow": 0.0}
    return weights[request.word(key)]


def rule_weights(request: Request) -> dict[str, float]:
    """Return the weights of the local rules where none is left to the rule set."""
    found = {name: _weight(request, key) for key, (name, *_) in _LOCAL_RULES.items()}
    return {name: weight for name, weight in found.items() if weight is not None}


def _block(request: Request) -> dict[str, float]:
    """Return the block size; what features give each for themselves is as the preset says."""
    keys = ("BLOCK_WIDTH", "BLOCK_LENGTH")
    implied = presets.implied(request)
    dynamic = persite.per_feature(request, keys)
    found = {
        key.lower(): implied[key] if key in dynamic else presets.number(request, key)
        for key in keys
    }
    width, length = found["block_width"], found["block_length"]
    # What the features say is looked at site by site.
    if keys[0] in dynamic:
        found["block_width"] = min(width, length)
    elif keys[1] in dynamic:
        found["block_length"] = max(width, length)
    elif length < width and not all(request.has(key) for key in keys):
        raise InputError(
            f"Block length ({length:g} m) is less than block width ({width:g} m).",
            "Give both: what is left empty is as the kind of neighbourhood says.",
        )
    return found


def specification(request: Request) -> Any:
    """Return the `Specification` that the parameters describe, as far as the tool has them.

    Raises
    ------
    InputError
        Values contradict each other.
    """
    from ...algorithms.network.specification import Specification

    fields: dict[str, Any] = {
        "rules": RULE_SETS[request.word("RULES")][0],
        "sink_mode": SINK_MODES[request.word("SINK_MODE")][0],
        "coverage": request.optional_number("COVERAGE"),
        "coverage_unit": COVERAGE_UNITS[request.word("COVERAGE_UNIT")][0],
    }
    # What is left to the rule set keeps the value that the specification has for it.
    fields |= rule_weights(request)
    for key in ("WEIGHT_LENGTH", "WEIGHT_DISTANCE", "TIME_LIMIT"):
        if request.declares(key):
            fields[key.lower()] = request.number(key)
    for key in ("EDGE_LENGTH", "WEIGHT_STRAIGHT", "WEIGHT_CONTINUE"):
        if request.declares(key):
            fields[key.lower()] = presets.number(request, key)
    fields |= _block(request)
    for key in ("LEVELS", "SEED"):
        if request.declares(key):
            fields[key.lower()] = request.integer(key)
    if request.declares("GAP"):
        fields["gap"] = request.number("GAP")
    if request.declares("SOLVER"):
        fields["solver"] = SOLVERS[request.word("SOLVER")][0]
    return Specification(**fields)
