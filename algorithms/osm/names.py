"""What a planner types for a place, and how well it fits what a thing is called."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Optional

from ..errors import InputError

_KINDS = {"n": "node", "w": "way", "r": "relation"}
_SHORT = re.compile(r"(n|node|w|way|r|rel|relation)[\s/:#]*(\d+)", re.IGNORECASE)
_ADDRESS = re.compile(
    r"(?:https?://)?(?:www\.)?(?:openstreetmap|osm)\.org/(node|way|relation)/(\d+)(?:\D.*)?",
    re.IGNORECASE,
)
_DETAILS = re.compile(r".*[?&]osmtype=([nwr])&osmid=(\d+).*", re.IGNORECASE)
_LARGEST = 2**63 - 1
#: Keys of names, with or without a language such as de, zh-Hant or be-tarask.
_NAME_KEY = re.compile(r"(?:|alt_|official_|short_|old_|loc_|int_)name(?::[a-z]{2,3}(?:[-_].+)?)?")

# Letters that Unicode does not take apart into a base and a mark.
_PLAIN = str.maketrans(
    {"ø": "o", "ł": "l", "đ": "d", "\u0131": "i", "æ": "ae", "œ": "oe", "þ": "th"}
)


@dataclass(frozen=True)
class OsmId:
    """Identity of a thing in OpenStreetMap.

    Attributes
    ----------
    kind
        "node", "way" or "relation".
    number
        Its number, greater than 0.
    """

    kind: str
    number: int

    def __str__(self) -> str:
        return f"{self.kind[0].upper()}{self.number}"


def other_names(tags: Mapping[str, str], name: str) -> tuple[str, ...]:
    """Return what a thing is called besides its name: in other languages, officially, of old.

    Parameters
    ----------
    tags
        Its tags.
    name
        Its name, which is left out.

    Examples
    --------
    >>> other_names({"name:fr": "Vienne", "alt_name": "A;B", "name:etymology": "C"}, "Wien")
    ('Vienne', 'A', 'B')
    """
    found = [
        part.strip()
        for key, text in tags.items()
        if _NAME_KEY.fullmatch(key)
        for part in str(text).split(";")
    ]
    return tuple(dict.fromkeys(part for part in found if part and part != name))


def parse_osm_id(text: str) -> Optional[OsmId]:
    """Read an id such as R123, way/123, or the address of a thing on openstreetmap.org.

    Parameters
    ----------
    text
        What was typed.

    Returns
    -------
    OsmId or None
        None where the text is no id but, presumably, a name.

    Raises
    ------
    InputError
        It is a web address without a thing, or the number cannot be an id.

    Examples
    --------
    >>> str(parse_osm_id("https://www.openstreetmap.org/relation/34914#map=9/60.1/25.1"))
    'R34914'
    >>> parse_osm_id("Helsinki") is None
    True
    """
    text = text.strip()
    found = next(
        (match for form in (_SHORT, _ADDRESS, _DETAILS) if (match := form.fullmatch(text))), None
    )
    if found is None:
        if re.match(r"https?://", text, re.IGNORECASE):
            raise InputError(
                f"The address {text} names nothing in OpenStreetMap.",
                "Copy the address of a relation or a way, such as "
                "https://www.openstreetmap.org/relation/34914, or type a name.",
            )
        return None
    number = int(found[2])
    if not 0 < number <= _LARGEST:
        raise InputError(
            f"'{text}' cannot be an OpenStreetMap id.", "Give a number from 1, as in R34914."
        )
    return OsmId(_KINDS[found[1][0].lower()], number)


def fold(text: str) -> str:
    """Return a text without accents, case, punctuation and superfluous spaces.

    Examples
    --------
    >>> fold("  Sainte-Dévote ")
    'sainte devote'
    """
    apart = unicodedata.normalize("NFKD", text.casefold())
    bare = "".join(c for c in apart if not unicodedata.combining(c)).translate(_PLAIN)
    return " ".join(re.sub(r"[^\w]+", " ", bare).split())


@dataclass(frozen=True)
class Match:
    """How well a name fits.

    Attributes
    ----------
    grade
        0 for the best.
    text
        In words.
    """

    grade: int
    text: str


def match_name(wanted: str, name: str, others: Iterable[str] = ()) -> Optional[Match]:
    """Compare what was typed with what a thing is called.

    Parameters
    ----------
    wanted
        What was typed.
    name
        The name of the thing.
    others
        Its names in other languages, its old and its official ones.

    Returns
    -------
    Match or None
        None where nothing fits.
    """
    if wanted.strip() == name and name:
        return Match(0, "exact name")
    typed, own = fold(wanted), fold(name)
    if not typed:
        return None
    if typed == own:
        return Match(1, "name in another spelling")
    folded = {fold(other): other for other in others}
    if typed in folded:
        return Match(2, f"other name: {folded[typed]}")
    if own.startswith(typed):
        return Match(3, "beginning of the name")
    beginning = next((other for bare, other in folded.items() if bare.startswith(typed)), None)
    if beginning is not None:
        return Match(4, f"beginning of another name: {beginning}")
    if all(word in own.split() for word in typed.split()):
        return Match(5, "part of the name")
    return None
