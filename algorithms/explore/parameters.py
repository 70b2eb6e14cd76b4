"""What can be varied, the runs that follow, and files that list them."""

from __future__ import annotations

import csv
import dataclasses
import itertools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

from ..errors import InputError
from ..network.specification import (
    FORBID,
    CoverageUnit,
    OneWay,
    RuleSet,
    SinkMode,
    Specification,
    Traffic,
)

#: Greatest number of runs; more are a mistake rather than a wish.
MOST = 400
#: Key of a run that names a set of exits.
SINKS = "sinks"
#: Keys of a run that are no field of the specification.
NAME = "name"
#: What a rule weight may be called: what streets never do, what costs as much as five edges of the
#: mesh, and what is free.
_RULE_WORDS = {"forbid": FORBID, "discourage": 5.0, "allow": 0.0}


@dataclass(frozen=True)
class Parameter:
    """One thing that can be varied.

    Attributes
    ----------
    label
        What tables and pictures call it.
    kind
        "number", "whole" (number), "rule" (a weight or a word for one), "yes/no" or "word".
    words
        The words that it may be.
    """

    label: str
    kind: str = "number"
    words: tuple[str, ...] = ()


#: By the field of the specification.
PARAMETERS: Mapping[str, Parameter] = {
    "weight_length": Parameter("weight of street length"),
    "weight_distance": Parameter("weight of the way out"),
    "weight_straight": Parameter("weight of straight streets"),
    "weight_continue": Parameter("weight of continued streets"),
    "block_width": Parameter("block width, m"),
    "block_length": Parameter("block length, m"),
    "coverage": Parameter("coverage range"),
    "dead_ends": Parameter("dead ends", "rule"),
    "zigzags": Parameter("zigzags", "rule"),
    "too_close": Parameter("streets too close", "rule"),
    "t_junctions": Parameter("T-junctions", "rule"),
    "branches": Parameter("branches", "rule"),
    "exits": Parameter("number of exits", "whole"),
    "length_budget": Parameter("length budget, m"),
    "max_distance": Parameter("longest way out, m"),
    "junction_spacing": Parameter("junction spacing, m"),
    "patch_size": Parameter("size of patches, m"),
    "detour": Parameter("detour"),
    "links": Parameter("weight of links"),
    "slope_weight": Parameter("weight of slopes"),
    "edge_length": Parameter("edge length of the mesh, m"),
    "cul_de_sac_length": Parameter("length of culs-de-sac, m"),
    "levels": Parameter("street levels", "whole"),
    "seed": Parameter("seed", "whole"),
    "cul_de_sacs": Parameter("culs-de-sac", "yes/no"),
    "rules": Parameter("rules", "word", get_args(RuleSet)),
    "coverage_unit": Parameter("unit of the coverage range", "word", get_args(CoverageUnit)),
    "sink_mode": Parameter("where streets leave", "word", get_args(SinkMode)),
    "traffic": Parameter("traffic", "word", get_args(Traffic)),
    "one_way": Parameter("one-way streets", "word", get_args(OneWay)),
}


@dataclass(frozen=True)
class Run:
    """One design that is asked for.

    Attributes
    ----------
    number
        From 1.
    name
        What tables and pictures call it.
    values
        What is asked otherwise than usual, by the field of the specification.
    specification
        All that is asked.
    sinks
        The set of given exits that it has; empty for all.
    """

    number: int
    name: str
    values: Mapping[str, Any] = field(default_factory=dict, hash=False)
    specification: Specification = field(default_factory=Specification)
    sinks: str = ""


def parsed(key: str, value: Any, where: str = "") -> Any:
    """Return a value of a parameter as the specification has it.

    Parameters
    ----------
    key
        Field of the specification.
    value
        A number, or a text of one or of a word; empty or None for as usual.
    where
        Where it was given, for messages.

    Raises
    ------
    InputError
        There is no such parameter, or it cannot have this value.

    Examples
    --------
    >>> parsed("dead_ends", "forbid"), parsed("exits", "3"), parsed("coverage", " 2 ")
    (inf, 3, 2.0)
    """
    at = f"{where}: " if where else ""
    if key not in PARAMETERS:
        raise InputError(
            f"{at}{key} is nothing that can be varied.", f"Choose from {', '.join(PARAMETERS)}."
        )
    own = PARAMETERS[key]
    text = str(value).strip().lower()
    if own.kind == "word":
        if text not in own.words:
            raise InputError(f"{at}{key} is {value}.", f"Give one of {', '.join(own.words)}.")
        return text
    if own.kind == "yes/no":
        if text not in ("yes", "no", "true", "false", "1", "0"):
            raise InputError(f"{at}{key} is {value}.", "Give yes or no.")
        return text in ("yes", "true", "1")
    if own.kind == "rule" and text in _RULE_WORDS:
        return _RULE_WORDS[text]
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if math.isnan(number) or (own.kind == "whole" and not number.is_integer()):
        words = f", or {', '.join(_RULE_WORDS)}" if own.kind == "rule" else ""
        kind = "a whole number" if own.kind == "whole" else "a number"
        raise InputError(f"{at}{key} is {value}.", f"Give {kind}{words}.")
    return int(number) if own.kind == "whole" else number


def listed(key: str, text: str) -> list[Any]:
    """Return the values of a text such as "0; 0.5; 1", in their order.

    Raises
    ------
    InputError
        There is none, one is there twice, or one cannot be.
    """
    label = PARAMETERS[key].label if key in PARAMETERS else key
    values = [parsed(key, part, label) for part in text.split(";") if part.strip()]
    if not values:
        raise InputError(f"{label}: no values are given.", "Give some, such as 0; 0.5; 1.")
    if len(set(values)) < len(values):
        raise InputError(f"{label}: a value is there twice ({text}).", "Give each once.")
    return values


def grid(base: Specification, axes: Mapping[str, Sequence[Any]]) -> list[Run]:
    """Return a run for each combination of values; the last parameter changes fastest.

    Parameters
    ----------
    base
        What is asked apart from that.
    axes
        Values by the field of the specification.

    Raises
    ------
    InputError
        A combination contradicts itself, or there are too many.

    Examples
    --------
    >>> [run.name for run in grid(Specification(), {"weight_distance": [0.0, 1.0]})]
    ['weight of the way out 0', 'weight of the way out 1']
    """
    rows = [dict(zip(axes, values)) for values in itertools.product(*axes.values())]
    return runs_of(base, rows)


def runs_of(base: Specification, rows: Sequence[Mapping[str, Any]]) -> list[Run]:
    """Return a run for each row of values.

    Parameters
    ----------
    base
        What is asked apart from that.
    rows
        Values by the field of the specification; "name" for what the run is called, "sinks" for
        the set of given exits that it has. What is empty or None is as in `base`.

    Raises
    ------
    InputError
        A key or a value is unknown, values contradict each other, or there are too many rows.
    """
    if not rows:
        raise InputError("No runs are given.", "Give the values of a parameter, or a list of runs.")
    if len(rows) > MOST:
        raise InputError(f"{len(rows)} runs are asked for.", f"Give at most {MOST}.")
    made = []
    for number, row in enumerate(rows, 1):
        where = f"Run {number}"
        given = {k.strip().lower(): v for k, v in row.items() if v is not None and str(v).strip()}
        name, sinks = str(given.pop(NAME, "")).strip(), str(given.pop(SINKS, "")).strip()
        values = {key: parsed(key, value, where) for key, value in given.items()}
        asked: dict[str, Any] = {"sink_mode": "points", **values} if sinks else dict(values)
        try:
            specification = dataclasses.replace(base, **asked)
        except InputError as error:
            raise InputError(f"{where}: {error.problem}", error.remedy) from error
        if sinks:
            values = {**values, SINKS: sinks}
        made.append(Run(number, name or told(values), values, specification, sinks))
    return made


def told(values: Mapping[str, Any]) -> str:
    """Return values as a planner reads them.

    Examples
    --------
    >>> told({"dead_ends": math.inf, "exits": 3})
    'dead ends forbidden, number of exits 3'
    """
    parts = []
    for key, value in values.items():
        label = PARAMETERS[key].label if key in PARAMETERS else "exits"
        shown = f"{value:g}" if isinstance(value, (int, float)) else str(value)
        if key in PARAMETERS and PARAMETERS[key].kind == "rule":
            shown = {0.0: "allowed", FORBID: "forbidden"}.get(value, shown)
        if isinstance(value, bool):
            shown = "yes" if value else "no"
        if value is None:
            parts.append(f"{label.partition(', ')[0]} as usual")
            continue
        name, _, unit = label.partition(", ")
        parts.append(f"{name} {shown}{f' {unit}' if unit else ''}")
    return ", ".join(parts) or "as usual"


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Read a list of runs: JSON (a list of objects), or CSV with a head line.

    Raises
    ------
    InputError
        The file cannot be read, or is no such list.
    """
    remedy = (
        "Give a CSV file whose head line names parameters, or a JSON file with a list of objects."
    )
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        raise InputError(f"The list of runs {path} cannot be read ({error}).", remedy) from error
    if path.suffix.lower() == ".json":
        try:
            rows = json.loads(text)
        except ValueError as error:
            raise InputError(f"{path.name} is no JSON ({error}).", remedy) from error
        if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            raise InputError(f"{path.name} is no list of objects.", remedy)
        return rows
    lines = [line for line in text.splitlines() if line.strip()]
    separator = ";" if lines and lines[0].count(";") > lines[0].count(",") else ","
    found = list(csv.DictReader(lines, delimiter=separator))
    if any(None in row for row in found):
        raise InputError(f"{path.name}: a line has more values than the head line.", remedy)
    return [dict(row) for row in found]
