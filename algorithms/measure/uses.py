"""What land is used for: words of many layers in the four classes of UP section 7."""

from __future__ import annotations

from typing import Any, Literal

import geopandas as gpd
import numpy as np
import numpy.typing as npt

from ..errors import InputError

#: Streets (ls), residential parcels (lr), parks (lp) and the rest (lo) of UP section 7.
Use = Literal["streets", "parcels", "parks", "other"]
USES: tuple[Use, ...] = ("streets", "parcels", "parks", "other")

#: Words of each class in lower case, single; designs of ours use parcel, green, court, lane and
#: street, the rest is from OpenStreetMap and from planners.
WORDS: dict[Use, str] = {
    "streets": """
        street, road, roadway, lane, rear lane, alley, avenue, highway, carriageway, street space,
        right of way, pavement, sidewalk, path, footway, cycleway, square, plaza, pedestrian,
        living street
    """,
    "parcels": """
        parcel, residential parcel, lot, plot, building plot, residential, residence, housing,
        house, home, dwelling, living, single family, single family home, single family house,
        detached, semi detached, terraced, terrace, row house, townhouse, apartment, flat, villa
    """,
    "parks": """
        park, green, court, courtyard, garden, public garden, playground, common, lawn, grass,
        meadow, forest, wood, open space, green space, greenspace, recreation,
        recreation ground, village green, nature reserve, pitch, sport, orchard, allotment,
        cemetery
    """,
    "other": """
        other, commercial, commerce, retail, shop, industrial, industry, office, work, mixed,
        mixed use, public, civic, institutional, institution, education, school, kindergarten,
        university, college, hospital, church, religious, parking, utility, infrastructure,
        railway, rail, transport, water, lake, river, pond, farmland, farming, farm, agriculture,
        agricultural, vacant, development, construction, brownfield, greenfield, military, quarry,
        landfill, reserve
    """,
}
_CLASS = {word: use for use in USES for word in " ".join(WORDS[use].split()).split(", ")}
#: Fields in which a use is looked for, in this order.
FIELDS = ("land_use", "use", "label", "landuse", "theme")


def plain_word(value: Any) -> str:
    """Give a value as a word in lower case without signs; empty for a missing one.

    Parameters
    ----------
    value
        An attribute.

    Examples
    --------
    >>> plain_word(" Single_Family ")
    'single family'
    """
    if value is None or value != value:
        return ""
    return " ".join(str(value).lower().replace("_", " ").replace("-", " ").split())


def use_of(word: str) -> Use | None:
    """Give the class of a word, or None where it is not known; plurals count.

    Parameters
    ----------
    word
        As `plain_word` gives it.

    Examples
    --------
    >>> use_of("parks"), use_of("court"), use_of("R-2")
    ('parks', 'parks', None)
    """
    for form in (word, word[:-1] if word.endswith("s") else word, word.removesuffix("es")):
        if form in _CLASS:
            return _CLASS[form]
    return None


def use_field(frame: gpd.GeoDataFrame) -> str:
    """Find the field that tells the use: the first of `FIELDS` with a word that is known.

    Parameters
    ----------
    frame
        A layer.

    Returns
    -------
    str
        Name of the field as it is written; empty where there is none.
    """
    names = {str(name).lower(): str(name) for name in frame.columns if name != "geometry"}
    for name in FIELDS:
        if name in names:
            words = {plain_word(value) for value in frame[names[name]].unique().tolist()}
            if any(use_of(word) for word in words):
                return names[name]
    return ""


def read_uses(
    frame: gpd.GeoDataFrame, field: str, layer: str
) -> tuple[npt.NDArray[np.object_], dict[str, int]]:
    """Tell the class of each feature.

    Parameters
    ----------
    frame
        A layer.
    field
        The field with the use; empty: all are parcels.
    layer
        Name of the layer, for messages.

    Returns
    -------
    uses
        A `Use` each, shape (n,); features without a word, or with one that is not known, are
        other.
    unknown
        How many features have each word that is not known, the empty one among them.

    Raises
    ------
    InputError
        If there is no such field.
    """
    if not field:
        return np.full(len(frame), "parcels", dtype=object), {}
    if field not in frame.columns:
        raise InputError(
            f"It has no field '{field}'.", "Choose the field with the use.", layer=layer
        )
    words = [plain_word(value) for value in frame[field].tolist()]
    known = {word: use_of(word) for word in set(words)}
    uses = np.array([known[word] or "other" for word in words], dtype=object)
    lost: dict[str, int] = {}
    for word in words:
        if known[word] is None:
            lost[word] = lost.get(word, 0) + 1
    return uses, dict(sorted(lost.items(), key=lambda entry: (-entry[1], entry[0])))
