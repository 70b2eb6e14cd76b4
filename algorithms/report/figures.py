"""Figures of a design: numbers with a name and a unit, and how they are written."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

#: From here on numbers are written without decimals, with groups of three digits.
_WHOLE = 100.0
#: Words that may stand in parentheses at the end of a name and are units.
_UNIT = re.compile(
    r"^(m|m2|m²|km|ha|s|h|%|m/ha|km/h|km/km2|per km|degrees|percent|vehicles/h|veh/h|min|mph|"
    r"EUR|persons|ppl/ha)$"
)
#: When a figure is empty: of no use beside one that is there.
_EMPTY = re.compile(r"(?:; |(?<=\())empty\b[^()]*(?=\))")
_LONG = {
    "metres": "m",
    "hectares": "ha",
    "m2": "m²",
    "square kilometres": "km²",
    "percent": "%",
    "share of the price": "",
}
#: Figures of which planners usually want less, by their keys,
LESS = frozenset(
    (
        "TOTAL_LENGTH", "MEAN_DISTANCE", "MAX_DISTANCE", "ACHIEVED_GAP", "GAP",
        "VIOLATIONS", "WARNINGS", "UNDESIRABLE", "MEAN_WAY_M", "LONGEST_WAY_M", "BENDS",
        "TOO_THIN_PCT", "MEAN_P_ANGLE", "MEAN_P_AREA", "P_ANGLE", "P_AREA", "P_SIMILARITY",
        "CIRCUITY", "DEAD_ENDS", "DEAD_ENDS_KM2", "DEAD_ENDS_PCT", "MEAN_EGRESS",
        "MAX_EGRESS", "CORRIDOR_LENGTH", "CORRIDOR_SHARE", "STREET_SHARE", "SHADED",
        "MEAN_WAY", "DEAD_ENDS_LEFT", "LEFT_OUT", "MEAN_TIME", "MAX_USE", "UNSERVED", "VEHICLE_KM",
        "VEHICLE_HOURS", "MEAN_WAITING", "MEAN_DELAY", "NOT_ENTERED", "NO_WAY", "MOVED_ON",
        "FAILED",
        *(
            f"{mean}_{kind}"
            for mean in ("DISTANCE", "TIME", "WAITING")
            for kind in ("OUT", "IN", "WITHIN", "THROUGH")
        ),
    )
)  # fmt: skip
#: and of which they usually want more.
MORE = frozenset(
    (
        "CONTINUED", "WIDE_ENOUGH_PCT", "RECTANGULAR_PCT", "WITH_ACCESS", "ACCESS_PCT",
        "NET_TO_GROSS", "GREEN", "GREEN_REACHED", "ACHIEVED", "PARCEL_COUNT", "DWELLINGS",
        "LEAST_SUN", "MEAN_SUN", "ROOM_COUNT", "LARGEST_PCT", "POPULATION_REACHED",
        "MEAN_FINISHED", "AGREEMENT",
    )
)  # fmt: skip


@dataclass(frozen=True)
class Figure:
    """One number of a design.

    Attributes
    ----------
    key
        Its name for ever, such as TOTAL_LENGTH.
    label
        What it says, in words, without its unit.
    value
        The number, or None where nobody knows it.
    unit
        Its unit; empty for a pure number.
    """

    key: str
    label: str
    value: float | None
    unit: str = ""

    @property
    def text(self) -> str:
        """The number with its unit, as it is written."""
        return figure_text(self.value, self.unit)

    @property
    def wish(self) -> int:
        """-1 where planners usually want less of it, 1 where they want more, 0 where neither."""
        return (self.key in MORE) - (self.key in LESS)


def split_unit(text: str) -> tuple[str, str]:
    """Return a name without the unit at its end, and that unit.

    Examples
    --------
    >>> split_unit("Length of the new streets (m)")
    ('Length of the new streets', 'm')
    >>> split_unit("Area of the ground (square kilometres): the site")
    ('Area of the ground: the site', 'km²')
    >>> split_unit("Mean way out of the site, m"), split_unit("Area of the site in hectares")
    (('Mean way out of the site', 'm'), ('Area of the site', 'ha'))
    >>> split_unit("Broken rules (empty where the check was cancelled)")
    ('Broken rules', '')
    >>> split_unit("Mean time of trips into the site (s; empty without any)")
    ('Mean time of trips into the site', 's')
    """
    text = _EMPTY.sub("", text).replace(" ()", "")
    for found in re.finditer(r" \(([^()]+)\)|, (?:in )?(\S+)$| in (metres|hectares)$", text):
        inner = found[1] or found[2] or found[3]
        if inner in _LONG or _UNIT.match(inner):
            rest = text[: found.start()] + text[found.end() :]
            return rest, _LONG.get(inner, inner)
    return text, ""


def figures_of(values: Mapping[str, object], labels: Mapping[str, str]) -> tuple[Figure, ...]:
    """Return the numbers of a result as figures.

    Parameters
    ----------
    values
        Numbers by key; None where there is none. What is no number is left out.
    labels
        What they say, by key, with the unit in parentheses. They come first and in this order;
        a key without a label is its own.
    """
    order = [
        *(key for key in labels if key in values),
        *(key for key in values if key not in labels),
    ]
    found = []
    for key in order:
        value = values[key]
        if value is not None and not isinstance(value, (int, float)):
            continue
        label, unit = split_unit(labels.get(key, "")) if key in labels else (plain(key), "")
        number = None if value is None or not math.isfinite(value) else float(value)
        found.append(Figure(key, label, number, unit))
    return tuple(found)


def plain(key: str) -> str:
    """Return a key as words.

    Examples
    --------
    >>> plain("WEIGHT_LENGTH"), plain("corner_width")
    ('Weight length', 'Corner width')
    """
    words = key.replace("_", " ").strip().lower()
    return words[:1].upper() + words[1:]


def figure_text(value: float | None, unit: str = "") -> str:
    """Return a number as it is written in a table: three digits that matter, or all whole ones.

    Examples
    --------
    >>> figure_text(1996.35, "m")
    '1,996 m'
    >>> figure_text(0.27), figure_text(24.0), figure_text(0.0), figure_text(None, "m")
    ('0.27', '24', '0', 'not known')
    """
    if value is None or not math.isfinite(value):
        return "not known"
    if abs(value) >= _WHOLE or float(value).is_integer():
        text = f"{value:,.0f}"
    else:
        digits = 3 - 1 - math.floor(math.log10(abs(value)))
        text = f"{value:.{min(max(digits, 0), 6)}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
    return f"{'0' if text == '-0' else text} {unit}".strip()
