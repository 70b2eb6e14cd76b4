"""Cells of tables that planners type: fields by many names, numbers as text, empty cells."""

from __future__ import annotations

import math
import re
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd

from ...errors import InputError

_UNIT = re.compile(r"\s*(m2|m²|m|%|°)\s*$", re.IGNORECASE)
#: What a cell without a value says.
EMPTY_WORDS = ("", "null", "none", "nan", "<na>", "-")


def plain(text: object) -> str:
    """Return a name in lower case, with underscores for all that is no letter or digit.

    Examples
    --------
    >>> plain("Length (m)"), plain("building:levels")
    ('length_m', 'building_levels')
    """
    return re.sub(r"[\W_]+", "_", str(text).strip().lower()).strip("_")


def fields_of(columns: Iterable[Hashable], aliases: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    """Find the column for each field of a table.

    Parameters
    ----------
    columns
        Names of the columns.
    aliases
        For each field the names that mean it, in `plain` spelling, the best first.

    Returns
    -------
    dict
        Field to column; fields that the table does not have are missing.
    """
    known: dict[str, Any] = {}
    for column in columns:
        known.setdefault(plain(column), column)
    found = {}
    for field, names in aliases.items():
        column = next((known[name] for name in names if name in known), None)
        if column is not None:
            found[field] = column
    return found


@dataclass(frozen=True)
class Row:
    """A row of a table, of which messages name the layer and the feature.

    Attributes
    ----------
    values
        Field to value, of the fields that the table has.
    layer
        Name of the layer.
    feature
        Id of the row.
    """

    values: Mapping[str, Any]
    layer: str
    feature: int | str

    def error(self, problem: str, remedy: str) -> InputError:
        """Return an error that names this row."""
        return InputError(problem, remedy, layer=self.layer, feature=self.feature)

    def text(self, field: str) -> str:
        """Return a cell as text, empty where it has no value."""
        value = self.values.get(field)
        if value is None or (not isinstance(value, str) and bool(pd.isna(value))):
            return ""
        text = str(value).strip()
        return "" if text.lower() in EMPTY_WORDS else text

    def number(self, field: str, remedy: str) -> float | None:
        """Return a cell as a number, None where it has no value.

        A decimal comma and a unit behind the number (m, m², %, °) are understood.

        Parameters
        ----------
        field
            The field.
        remedy
            What to do where it is no number, as a sentence.

        Raises
        ------
        InputError
            If it is no number, or infinite.
        """
        text = self.text(field)
        if not text:
            return None
        try:
            number = float(_UNIT.sub("", text).replace(",", "."))
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise self.error(f"The {field} is '{text}', which is no number.", remedy)
        return number

    def whole(self, field: str, remedy: str) -> int | None:
        """Return a cell as a whole number, None where it has no value.

        Raises
        ------
        InputError
            If it is no whole number.
        """
        number = self.number(field, remedy)
        if number is None:
            return None
        if abs(number - round(number)) > 1e-9:
            raise self.error(f"The {field} is {number:g}, which is no whole number.", remedy)
        return round(number)


def rows_of(
    table: pd.DataFrame, layer: str, aliases: Mapping[str, Sequence[str]]
) -> tuple[list[Row], dict[str, Any]]:
    """Return the rows of a table, and the column of each field that it has.

    Parameters
    ----------
    table
        Any table; its index holds the ids of the features.
    layer
        Its name.
    aliases
        As for `fields_of`.
    """
    geometry = getattr(table, "_geometry_column_name", None)
    found = fields_of((c for c in table.columns if c != geometry), aliases)
    columns = {field: table[column].tolist() for field, column in found.items()}
    rows = [
        Row(
            {field: values[at] for field, values in columns.items()},
            layer,
            label if isinstance(label, (int, str)) else str(label),
        )
        for at, label in enumerate(table.index.tolist())
    ]
    return rows, found
