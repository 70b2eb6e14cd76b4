"""What a planner chooses for each patch: patterns, paths, and where the balconies look."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import geopandas as gpd

from ...errors import InputError
from ..types import BUILDING_PATTERNS, DIRECT, PATH_PATTERNS, ROWS
from .cells import Row, plain, rows_of

#: Names of fields that mean the same, in `cells.plain` spelling.
FIELDS = {
    "residences": (
        "residences", "residence", "residence_pattern", "pattern", "building_pattern", "buildings",
    ),
    "facilities": ("facilities", "facility", "facility_pattern"),
    "paths": ("paths", "path", "path_pattern"),
    "direction": ("path_direction", "direction", "pd"),
    "facing": ("facing", "facing_deg", "facing_azimuth", "azimuth", "orientation"),
}  # fmt: skip
#: Other words for the patterns.
WORDS = {
    "determinant": "rows", "row": "rows", "parallel": "rows", "none": "empty", "no": "empty",
    "center": "centric", "centre": "centric", "closed": "enclosed", "court": "enclosed",
    "symmetry": "symmetrical", "symmetric": "symmetrical", "dots": "dotted",
    "circular": "circle", "loop": "circle", "end": "ending",
}  # fmt: skip
DIRECTIONS = {"1": 1, "same": 1, "inside": 1, "0": 0, "opposite": 0, "outside": 0}
COMPASS = {
    "north": 0.0, "northeast": 45.0, "east": 90.0, "southeast": 135.0, "south": 180.0,
    "southwest": 225.0, "west": 270.0, "northwest": 315.0,
    "n": 0.0, "ne": 45.0, "e": 90.0, "se": 135.0, "s": 180.0, "sw": 225.0, "w": 270.0, "nw": 315.0,
}  # fmt: skip


@dataclass(frozen=True)
class PatchChoice:
    """What is wished for a patch (RZ Tables 3 and 4).

    Attributes
    ----------
    residences, facilities
        Building patterns of the two uses, 0 to 5 (`types.BUILDING_PATTERNS`).
    paths
        Path pattern, 1 to 3 (`types.PATH_PATTERNS`).
    path_direction
        1 (same, inside) or 0 (opposite, outside).
    facing_deg
        Wished azimuth of the balconies, degrees clockwise from true north, 0 to 360; None for the
        side of the equator.

    Raises
    ------
    InputError
        If a number is out of bounds.
    """

    residences: int = ROWS
    facilities: int = ROWS
    paths: int = DIRECT
    path_direction: int = 1
    facing_deg: float | None = None

    def __post_init__(self) -> None:
        for what, number in (("residences", self.residences), ("facilities", self.facilities)):
            if number not in range(len(BUILDING_PATTERNS)):
                raise InputError(f"The pattern of {what} is {number}.", _choose(BUILDING_PATTERNS))
        if self.paths not in range(1, len(PATH_PATTERNS)):
            raise InputError(f"The pattern of paths is {self.paths}.", _choose(PATH_PATTERNS))
        if self.path_direction not in (0, 1):
            raise InputError(
                f"The direction of paths is {self.path_direction}.",
                "Give 1 (same, inside) or 0 (opposite, outside).",
            )
        if self.facing_deg is not None and not 0 <= self.facing_deg <= 360:
            raise InputError(
                f"Balconies shall look to azimuth {self.facing_deg:g}.",
                "Give degrees clockwise from north, from 0 to 360.",
            )


def patch_choices(
    frame: gpd.GeoDataFrame, layer: str, defaults: PatchChoice | None = None
) -> list[PatchChoice]:
    """Read what a layer of patches chooses in its fields.

    Fields, in upper or lower case: `residences` (or `pattern`) and `facilities`, a building
    pattern as a number 0 to 5 or a word; `paths`, a path pattern as 1 to 3 or a word;
    `path_direction` (or `direction`), 1 or 0, same or opposite, inside or outside; `facing`,
    degrees clockwise from true north, or a word such as southeast. `residences` may also hold the
    three numbers of RZ Table 4, such as 1/3/1: building pattern, path pattern and direction.

    Parameters
    ----------
    frame
        The patches, n of them; the index holds the ids of the features.
    layer
        Name of the layer.
    defaults
        What holds for empty cells and missing fields.

    Returns
    -------
    list of PatchChoice
        One for each row.

    Raises
    ------
    InputError
        If a cell cannot be read; the text names the layer and the feature.

    Examples
    --------
    >>> from shapely.geometry import box
    >>> patches = gpd.GeoDataFrame(
    ...     {"Pattern": ["rows", "5/1/0"], "facing": [None, "SE"]},
    ...     geometry=[box(0, 0, 9, 9), box(9, 0, 18, 9)],
    ... )
    >>> [(c.residences, c.paths, c.facing_deg) for c in patch_choices(patches, "Patches")]
    [(1, 2, None), (5, 1, 135.0)]
    """
    usual = PatchChoice() if defaults is None else defaults
    rows, _ = rows_of(frame, layer, FIELDS)
    return [_choice(row, usual) for row in rows]


def choosing_fields(frame: gpd.GeoDataFrame, layer: str) -> set[str]:
    """Return which of the fields of `patch_choices` a layer has."""
    return set(rows_of(frame, layer, FIELDS)[1])


def _choice(row: Row, usual: PatchChoice) -> PatchChoice:
    """Return what one row chooses."""
    given: dict[str, int | float] = {}
    three = row.text("residences").split("/")
    if len(three) == 3:
        values = {"residences": three[0], "paths": three[1], "direction": three[2]}
        # RZ writes 0/0/0 for patches without residences: no path pattern is meant.
        values = {k: v for k, v in values.items() if k != "paths" or v.strip() != "0"}
        row = dataclasses.replace(
            row, values={**row.values, **{k: v for k, v in values.items() if _unset(row, k)}}
        )
    facility = row.text("facilities").split("/")
    if len(facility) == 3:
        row = dataclasses.replace(row, values={**row.values, "facilities": facility[0]})
    for field in ("residences", "facilities"):
        pattern = _pattern(row, field, BUILDING_PATTERNS)
        if pattern is not None:
            given[field] = pattern
    paths = _pattern(row, "paths", PATH_PATTERNS)
    if paths is not None:
        given["paths"] = paths
    direction = _whole_text(row.text("direction"))
    if direction:
        if direction not in DIRECTIONS:
            raise row.error(
                f"The direction of paths is '{direction}'.",
                "Give 1 (same, inside) or 0 (opposite, outside), or leave it empty.",
            )
        given["path_direction"] = DIRECTIONS[direction]
    facing = _facing(row)
    if facing is not None:
        given["facing_deg"] = facing
    return dataclasses.replace(usual, **given)  # type: ignore[arg-type]


def _unset(row: Row, field: str) -> bool:
    """Tell whether a row says nothing else on a field that the three numbers fill."""
    return field == "residences" or not row.text(field)


def _whole_text(text: str) -> str:
    """Return a text in plain spelling, with whole numbers without their decimals."""
    try:
        number = float(text)
    except ValueError:
        return plain(text)
    return f"{number:g}"


def _pattern(row: Row, field: str, names: tuple[str, ...]) -> int | None:
    """Return the number of a pattern, None where the cell is empty."""
    # An empty cell and the word none are not the same here: none leaves the use out.
    raw = row.values.get(field)
    text = "none" if isinstance(raw, str) and plain(raw) == "none" else row.text(field)
    if not text:
        return None
    word = _whole_text(text)
    word = WORDS.get(word, word)
    numbers = {str(i): i for i, name in enumerate(names) if name}
    numbers.update({name: i for i, name in enumerate(names) if name})
    if word not in numbers:
        raise row.error(f"The pattern of {field} is '{text}'.", _choose(names))
    return numbers[word]


def _choose(names: tuple[str, ...]) -> str:
    """Return the patterns to choose from, as a sentence."""
    return "Choose " + ", ".join(f"{i} ({name})" for i, name in enumerate(names) if name) + "."


def _facing(row: Row) -> float | None:
    """Return an azimuth, degrees in [0, 360), None where the cell is empty."""
    word = plain(row.text("facing")).replace("_", "")
    if word in COMPASS:
        return COMPASS[word]
    remedy = "Give degrees clockwise from north, from 0 to 360, or a word such as south."
    degrees = row.number("facing", remedy)
    if degrees is None:
        return None
    if not -360 <= degrees <= 360:
        raise row.error(f"The facing is {degrees:g} degrees.", remedy)
    return degrees % 360.0
