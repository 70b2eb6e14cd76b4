"""Targets of figures: read from lines of text, held against the designs."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from ..errors import InputError
from .figures import Figure, figure_text

_SIGNS = {"<=": "at most", ">=": "at least", "<": "less than", ">": "more than", "=": "exactly"}
_SAME = {"≤": "<=", "≥": ">=", "==": "=", "=<": "<=", "=>": ">="}
_LINE = re.compile(r"^(?P<what>[^<>=≤≥]+?)\s*(?P<sign><=|>=|==|=<|=>|[<>=≤≥])\s*(?P<rest>.+)$")
_NUMBER = re.compile(r"^(?P<value>[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?)\s*(?P<unit>\D.*)?$", re.I)
_HOLDS: Mapping[str, Callable[[float, float], bool]] = {
    "<=": lambda a, b: a <= b or math.isclose(a, b),
    ">=": lambda a, b: a >= b or math.isclose(a, b),
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "=": math.isclose,
}
_EXAMPLE = "Write each as a figure, a sign and a number, such as: TOTAL_LENGTH <= 5000"


@dataclass(frozen=True)
class Target:
    """What a figure should be.

    Attributes
    ----------
    what
        Key of the figure, such as TOTAL_LENGTH, or what it says.
    sign
        One of <=, >=, <, > and =.
    value
        The number.
    unit
        Unit as it was written; empty where none was.
    """

    what: str
    sign: str
    value: float
    unit: str = ""

    def finds(self, figures: Sequence[Figure]) -> Figure | None:
        """Return the figure that is meant, the first where several have the name, or None."""
        wanted = self.what.casefold()
        by_key = (own for own in figures if own.key.casefold() == wanted)
        by_label = (own for own in figures if own.label.casefold() == wanted)
        return next(by_key, None) or next(by_label, None)

    def words(self, unit: str) -> str:
        """Return the target in words, such as "at most 5,000 m"."""
        return f"{_SIGNS[self.sign]} {figure_text(self.value, unit)}"


@dataclass(frozen=True)
class TargetResult:
    """One target held against one design.

    Attributes
    ----------
    target
        The target.
    design
        Name of the design.
    figure
        The figure, or None where the design has none of that name.
    met
        Whether it holds, or None where there is no number.
    """

    target: Target
    design: str
    figure: Figure | None
    met: bool | None


def parse_targets(text: str) -> tuple[Target, ...]:
    """Read targets, one a line or divided by semicolons; what follows a # is a remark.

    Raises
    ------
    InputError
        A line is no target; the text shows it.

    Examples
    --------
    >>> for target in parse_targets("TOTAL_LENGTH <= 5000 m; DEAD_ENDS = 0"):
    ...     print(target.what, target.words(target.unit))
    TOTAL_LENGTH at most 5,000 m
    DEAD_ENDS exactly 0
    """
    lines = [line.partition("#")[0].strip() for line in re.split(r"[;\n\r]+", text)]
    return tuple(_target(line) for line in lines if line)


def _target(line: str) -> Target:
    parts = _LINE.match(line)
    if parts is None:
        raise InputError(f"'{line}' is no target.", f"{_EXAMPLE}.")
    # 5,000 and 5 000 are one number; a comma before other digits would be a decimal one
    rest = re.sub(r"(?<=\d)[, \u00a0\u202f](?=\d{3}(?!\d))", "", parts["rest"].strip())
    number = _NUMBER.match(rest)
    if number is None or not math.isfinite(float(number["value"])):
        raise InputError(
            f"'{parts['rest'].strip()}' in the target '{line}' is no number.",
            f"{_EXAMPLE}. Decimals stand behind a point.",
        )
    sign = _SAME.get(parts["sign"], parts["sign"])
    unit = (number["unit"] or "").strip()
    if unit.startswith(","):
        raise InputError(f"The target '{line}' has a comma in its number.", f"{_EXAMPLE}.")
    return Target(parts["what"].strip(), sign, float(number["value"]), unit)


def target_of(what: str, at_least: float | None, at_most: float | None) -> tuple[Target, ...]:
    """Return the targets of one row of a table: a figure with its limits, either or both."""
    limits = ((">=", at_least), ("<=", at_most))
    return tuple(Target(what, sign, value) for sign, value in limits if value is not None)


def check_targets(
    targets: Sequence[Target], figures: Mapping[str, Sequence[Figure]]
) -> tuple[TargetResult, ...]:
    """Hold targets against the figures of designs.

    Parameters
    ----------
    targets
        The targets.
    figures
        Figures by the name of their design.

    Raises
    ------
    InputError
        No design has such a figure, or it has another unit; the text names those there are.
    """
    found = []
    for target in targets:
        rows = {name: target.finds(own) for name, own in figures.items()}
        known = [own for own in rows.values() if own is not None]
        if not known:
            keys = sorted({own.key for row in figures.values() for own in row})
            raise InputError(
                f"Target '{target.what}': no design has such a figure.",
                f"Figures of these layers: {', '.join(keys)}."
                if keys
                else "The layers of this report have no figures at all: give outputs of tools of "
                "Platwright that are files.",
            )
        _check_unit(target, known[0])
        for name, figure in rows.items():
            value = None if figure is None else figure.value
            met = None if value is None else _HOLDS[target.sign](value, target.value)
            found.append(TargetResult(target, name, figure, met))
    return tuple(found)


def _check_unit(target: Target, figure: Figure) -> None:
    same = {"m2": "m²", "km2": "km²", "percent": "%"}
    unit = same.get(target.unit, target.unit)
    if unit and unit.casefold() != figure.unit.casefold():
        raise InputError(
            f"Target '{target.what}' is in {target.unit}, but the figure "
            + (f"is in {figure.unit}." if figure.unit else "has no unit."),
            "Write the number in the unit of the figure, or without a unit.",
        )
