"""Kinds of buildings from a table, and the sets of them that are shipped."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from ...errors import InputError
from ..types import FACILITY, RESIDENCE, BuildingType
from .cells import Row, plain, rows_of

#: Height of a storey where a table gives only one of height and storeys, metres (RZ section 5).
STOREY_M = 3.0
#: Floor area of a dwelling with its share of stairs, where a table does not give the dwellings.
DWELLING_M2 = 100.0
#: Larger numbers are taken for another unit than metres.
LONGEST_M, HIGHEST_M = 500.0, 1000.0
#: Lower storeys are taken for a mistake, metres.
LOWEST_STOREY_M = 1.8
#: Names of fields that mean the same, in `cells.plain` spelling, the best first.
FIELDS = {
    "name": ("name", "building_type", "type", "kind", "label"),
    "length": ("length", "length_m", "facade", "facade_m", "frontage", "frontage_m"),
    "width": ("width", "width_m", "depth", "depth_m"),
    "height": ("height", "height_m"),
    "storeys": (
        "storeys", "stories", "storey", "floors", "levels", "num_floors", "building_levels",
    ),
    "use": ("use", "usage", "function", "category"),
    "share": ("share", "share_pct", "share_percent", "percent", "percentage"),
    "count": ("count", "max_count", "most", "number"),
    "entrance": ("entrance", "entrance_side", "entry"),
    "dwellings": ("dwellings", "dwelling_units", "units", "flats", "apartments", "homes"),
    "parking": ("parking", "parking_per_dwelling", "parking_ratio", "parking_places"),
}  # fmt: skip
USES = {
    **dict.fromkeys(
        ("residence", "residences", "residential", "housing", "dwelling", "apartments", "r"),
        RESIDENCE,
    ),
    **dict.fromkeys(
        ("facility", "facilities", "public", "public_facility", "commercial", "service", "f"),
        FACILITY,
    ),
}
METRES = "Give metres as a number greater than 0."
_HERE = Path(__file__).parent
#: The shipped sets: RZ Table 4, demo 1 and demo 2, and others that are usual.
TYPE_SETS = ("multistorey", "highrise", "slabs", "terraced", "mixed")


def shipped_types(name: str) -> tuple[BuildingType, ...]:
    """Return a shipped set of building types.

    "multistorey" and "highrise" are those of RZ Table 4, demo 1 and demo 2.

    Parameters
    ----------
    name
        One of `TYPE_SETS`. Each is a file of comma-separated values beside this module, which may
        serve as a pattern for one's own table.

    Returns
    -------
    tuple of BuildingType

    Raises
    ------
    InputError
        If there is no such set.

    Examples
    --------
    >>> [kind.storeys for kind in shipped_types("highrise") if kind.use == "residence"]
    [20, 12, 20]
    """
    if name not in TYPE_SETS:
        raise InputError(
            f"There is no set of building types '{name}'.",
            f"Choose one of: {', '.join(TYPE_SETS)}.",
        )
    return building_types(pd.read_csv(_HERE / f"{name}.csv"), name)


def building_types(table: pd.DataFrame, layer: str = "building types") -> tuple[BuildingType, ...]:
    """Read kinds of buildings from a table, one row for each, in the order of placement.

    Fields, in upper or lower case and by several names (`FIELDS`): `length` and `width` in metres;
    `height` in metres or `storeys` or both (3 m a storey stand in for the other); and as wished
    `name`, `use` (residence or facility), `share` (0 to 1, or percent where one is above 1),
    `count`, `entrance` (same or opposite to the balconies), `dwellings` (by default one for 100 m2
    of floor of a residence) and `parking` (places per dwelling, or per 100 m2 of floor). Numbers
    may be text, with a decimal comma or a unit.

    Parameters
    ----------
    table
        The table; the index holds the ids of the features. A geometry is ignored.
    layer
        Its name, for messages.

    Returns
    -------
    tuple of BuildingType
        One for each row.

    Raises
    ------
    InputError
        If a field is missing or a cell cannot be used, two types have one name, the shares are
        more than the whole, or no type is a residence. The text names layer, feature and field.

    Examples
    --------
    >>> table = pd.DataFrame({"Length": ["40,5"], "Width (m)": [12], "Floors": [4]})
    >>> building_types(table)[0].height_m, building_types(table)[0].dwellings
    (12.0, 19)
    """
    rows, fields = rows_of(table, layer, FIELDS)
    if not rows:
        raise InputError("The table has no row.", "Give one row for each kind.", layer=layer)
    _check_fields(table, fields, layer)
    percent = _in_percent(rows)
    kinds = []
    names: dict[str, int | str] = {}
    for row in rows:
        kind = _kind(row, percent)
        if kind.name in names:
            raise row.error(
                f"The name '{kind.name}' is that of feature {names[kind.name]}, too.",
                "Give each kind a name of its own.",
            )
        names[kind.name] = row.feature
        kinds.append(kind)
    if all(kind.use != RESIDENCE for kind in kinds):
        raise InputError(
            "No kind of building is a residence.",
            "Set the field use of at least one row to residence, or leave it empty.",
            layer=layer,
        )
    _check_shares(kinds, layer)
    return tuple(kinds)


def _check_fields(table: pd.DataFrame, fields: dict[str, object], layer: str) -> None:
    """Raise where a field is missing that nothing can stand in for."""
    missing = [field for field in ("length", "width") if field not in fields]
    if "height" not in fields and "storeys" not in fields:
        missing.append("height or storeys")
    if missing:
        there = ", ".join(str(c) for c in table.columns if c != "geometry") or "none"
        raise InputError(
            f"The field{'s' if len(missing) > 1 else ''} {' and '.join(missing)} "
            f"{'are' if len(missing) > 1 else 'is'} missing; the table has: {there}.",
            "Add or rename: length and width in metres, and height in metres or storeys.",
            layer=layer,
        )


def _in_percent(rows: Sequence[Row]) -> bool:
    """Tell whether the shares of a table are percent: one is above 1 or says so."""
    texts = [row.text("share") for row in rows]
    if any(text.endswith("%") for text in texts):
        return True
    shares = [row.number("share", "Give a share from 0 to 1, or percent.") for row in rows]
    return max((share for share in shares if share is not None), default=0.0) > 1 + 1e-9


def _check_shares(kinds: Sequence[BuildingType], layer: str) -> None:
    """Raise where the shares of a use are more than the whole."""
    for use in (RESIDENCE, FACILITY):
        total = sum(kind.share or 0.0 for kind in kinds if kind.use == use)
        if total > 1.01:
            raise InputError(
                f"The shares of the kinds of {use} add up to {total:.0%}.",
                "Give shares of at most 1 (100 %) together, or leave some empty.",
                layer=layer,
            )


def _kind(row: Row, percent: bool) -> BuildingType:
    """Return the kind of building that a row describes."""
    length, width = (_metres(row, field, LONGEST_M) for field in ("length", "width"))
    height, storeys = _heights(row)
    use = _use(row)
    share = row.number("share", "Give a share from 0 to 1, or percent.")
    dwellings = row.whole("dwellings", "Give the number of dwellings, or leave it empty.")
    if dwellings is None:
        floor = length * width * storeys
        dwellings = max(1, round(floor / DWELLING_M2)) if use == RESIDENCE else 0
    parking = row.number("parking", "Give parking places per dwelling, or leave it empty.")
    name = row.text("name") or f"{use} {length:g} x {width:g} x {height:g}"
    given = {} if parking is None else {"parking": parking}
    try:
        return BuildingType(
            name=name,
            length_m=length,
            width_m=width,
            height_m=height,
            storeys=storeys,
            use=use,
            share=share / 100 if percent and share is not None else share,
            count=row.whole("count", "Give the most buildings of this kind, or leave it empty."),
            entrance=plain(row.text("entrance")) or "opposite",
            dwellings=dwellings,
            **given,
        )
    except InputError as error:
        if error.layer is not None:
            raise
        raise row.error(error.problem, error.remedy) from error


def _metres(row: Row, field: str, most: float) -> float:
    """Return a length that must be given, metres."""
    value = row.number(field, METRES)
    if value is None:
        raise row.error(f"The {field} is missing.", METRES)
    if value <= 0:
        raise row.error(f"The {field} is {value:g}.", METRES)
    if value > most:
        raise row.error(f"The {field} is {value:g} m, more than {most:g} m.", METRES)
    return value


def _heights(row: Row) -> tuple[float, int]:
    """Return height and storeys; one stands in for the other."""
    storeys = row.whole("storeys", "Give a whole number of storeys, at least 1, or the height.")
    if storeys is not None and storeys < 1:
        raise row.error(f"The number of storeys is {storeys}.", "Give at least 1.")
    if not row.text("height"):
        if storeys is None:
            raise row.error(
                "Both height and storeys are missing.", "Give one of them: metres or a number."
            )
        return STOREY_M * storeys, storeys
    height = _metres(row, "height", HIGHEST_M)
    if storeys is None:
        # Rounded down, so that no floor is counted that is not there.
        return height, max(1, int(height / STOREY_M + 1e-6))
    if height / storeys < LOWEST_STOREY_M:
        raise row.error(
            f"{storeys} storeys in {height:g} m of height are {height / storeys:.1f} m each.",
            f"Give at least {LOWEST_STOREY_M:g} m a storey, or leave one of the two empty.",
        )
    return height, storeys


def _use(row: Row) -> str:
    """Return the use, residence where the cell is empty."""
    text = row.text("use")
    if not text:
        return RESIDENCE
    use = USES.get(plain(text))
    if use is None:
        raise row.error(f"The use is '{text}'.", "Choose residence or facility.")
    return use
