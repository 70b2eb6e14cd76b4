"""Values of OpenStreetMap tags as numbers and texts; what cannot be read becomes None.

Anybody may write anything into a tag, and osmnx joins the tags of the ways that it merges to
lists, so nothing in here raises. What the values mean: https://wiki.openstreetmap.org/wiki/Key:maxspeed,
Key:lanes, Key:height, Key:building:levels.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

MPH = 1.609344
KNOT = 1.852
FOOT = 0.3048
INCH = 0.0254

_NUMBER = re.compile(r"(?<![\d.])\d+(?:\.\d+)?")
_COUNTRY_ZONE = re.compile(r"(?:^|:)zone:?(\d+)$")
#: Speed limits in words, km/h; the rest ("none", "signals", "XX:rural") differ too much.
_SPEED_WORDS = {"walk": 7.0, "urban": 50.0, "living_street": 20.0}
_FASTEST = 200.0
_MOST_LANES = 30
_HIGHEST = 1000.0
_MOST_LEVELS = 250.0


def is_missing(value: Any) -> bool:
    """Tell whether a value of a table is missing: None, NaN, or an empty text.

    Parameters
    ----------
    value
        Anything that a column may hold.
    """
    if isinstance(value, (list, tuple, set)):
        return not value
    return value is None or value == "" or bool(value != value)


def values(value: Any) -> list[str]:
    """Return the values of a tag one by one, without blanks and each once.

    Parameters
    ----------
    value
        A text such as "2;3", a number, a list of these, or nothing.

    Returns
    -------
    list of str
        In the order of a text; sorted where a list is given, since osmnx leaves no order.

    Examples
    --------
    >>> values("2; 3"), values(["b", "a"]), values(None)
    (['2', '3'], ['a', 'b'], [])
    """
    if is_missing(value):
        return []
    given: Iterable[Any] = value if isinstance(value, (list, tuple, set)) else [value]
    parts = [part.strip() for one in given if not is_missing(one) for part in str(one).split(";")]
    found = dict.fromkeys(part for part in parts if part)
    return sorted(found) if isinstance(value, (list, tuple, set)) else list(found)


def text(value: Any) -> str | None:
    """Return a tag as one text, several values joined by "; ", or None.

    Parameters
    ----------
    value
        A text, a list, or nothing.
    """
    return "; ".join(values(value)) or None


def is_yes(value: Any) -> bool:
    """Tell whether a tag such as bridge, tunnel or oneway says anything but no.

    Parameters
    ----------
    value
        A text, a truth value, a list, or nothing.
    """
    return any(v.lower() not in ("no", "false", "0") for v in values(value))


def speed_kmh(value: Any) -> float | None:
    """Return a speed limit in km/h, the lowest where there are several.

    Parameters
    ----------
    value
        Value of maxspeed, such as "50", "30 mph", "DE:urban" or "FR:zone30".

    Examples
    --------
    >>> speed_kmh("30 mph"), speed_kmh(["50", "30"]), speed_kmh("none")
    (48.0, 30.0, None)
    """
    found = [s for s in map(_one_speed, values(value)) if s is not None and 1 <= s <= _FASTEST]
    return round(min(found)) * 1.0 if found else None


def _one_speed(value: str) -> float | None:
    word = value.lower()
    zone = _COUNTRY_ZONE.search(word)
    if zone:
        return float(zone.group(1))
    number = re.fullmatch(r"(\d+(?:\.\d+)?)\s*(mph|knots|km/?h|kph)?", word.replace(",", "."))
    if number:
        factor = {"mph": MPH, "knots": KNOT}.get(number.group(2) or "", 1.0)
        return float(number.group(1)) * factor
    return _SPEED_WORDS.get(word.rsplit(":", 1)[-1])


def lanes(value: Any) -> int | None:
    """Return a number of lanes, the least where there are several.

    Parameters
    ----------
    value
        Value of lanes, such as "2" or "2;3".

    Examples
    --------
    >>> lanes("2;3"), lanes("1.5"), lanes("two")
    (2, 1, None)
    """
    numbers = [int(float(v)) for v in values(value) if re.fullmatch(r"\d{1,4}(\.\d+)?", v.strip())]
    fitting = [n for n in numbers if 1 <= n <= _MOST_LANES]
    return min(fitting) if fitting else None


def height_m(value: Any) -> float | None:
    """Return a height or width in metres, the largest where there are several.

    Parameters
    ----------
    value
        Value of height or width, such as "12", "12,5 m", "40 ft" or 40'6".

    Examples
    --------
    >>> height_m("12,5 m"), height_m("10 ft"), height_m("tall")
    (12.5, 3.05, None)
    """
    found = [h for h in map(_one_height, values(value)) if h is not None and 0.01 <= h <= _HIGHEST]
    return round(max(found), 2) if found else None


def _one_height(value: str) -> float | None:
    word = value.lower().replace(",", ".").lstrip("~<>≈ ")
    feet = re.fullmatch(r"(\d+(?:\.\d+)?)\s*'\s*(?:(\d+(?:\.\d+)?)\s*\")?", word)
    if feet:
        return float(feet.group(1)) * FOOT + float(feet.group(2) or 0) * INCH
    number = re.fullmatch(r"(\d+(?:\.\d+)?)\s*(m|metres?|meters?|ft|feet|foot)?\.?", word)
    if number is None:
        return None
    in_feet = (number.group(2) or "m").startswith("f")
    return float(number.group(1)) * (FOOT if in_feet else 1.0)


def levels(value: Any) -> float | None:
    """Return a number of storeys, the largest where there are several.

    Parameters
    ----------
    value
        Value of building:levels, such as "5", "2.5" or "3-4".

    Examples
    --------
    >>> levels("3-4"), levels("2.5"), levels("-1")
    (4.0, 2.5, None)
    """
    found = [
        float(number)
        for v in values(value)
        if not v.startswith("-")
        for number in _NUMBER.findall(v.replace(",", "."))
    ]
    fitting = [n for n in found if 0 < n <= _MOST_LEVELS]
    return max(fitting) if fitting else None


def below_ground(tags: dict[str, Any]) -> bool:
    """Tell whether something lies in a tunnel or below the ground.

    Parameters
    ----------
    tags
        The tags of the thing.
    """
    if is_yes(tags.get("tunnel")):
        return True
    if any(v == "underground" for v in values(tags.get("location"))):
        return True
    return any(v.startswith("-") for v in values(tags.get("layer")))
