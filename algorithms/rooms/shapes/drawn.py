"""Templates from polygons drawn on a grid of unit squares."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from shapely.geometry import MultiPolygon, Polygon

from ...errors import InputError
from ..types import Cells, FloatArray, Template
from .checks import set_fault, template_fault
from .orient import settled

#: How far an outline may lie off the unit grid, in units.
TOLERANCE = 0.05
#: The smallest distance between sides is taken to be at most so many units.
MOST_UNITS = 8
#: A side leans when it is so much off the direction of the grid (tangent).
LEANING = 0.1
#: Most squares along a template, and where the unit is not told: else one side that is a little
#: off would pass for a template of tiny squares.
MOST_SQUARES, MOST_FOUND = 60, 12
#: Fields by what they hold; capitals do not matter.
FIELDS = {
    "name": ("name",),
    "min": ("min",),
    "max": ("max",),
    "min_share": ("min_share",),
    "max_share": ("max_share",),
    "colour": ("colour", "color"),
    "use": ("use",),
    "rotate": ("rotate", "rotations"),
    "mirror": ("mirror",),
    "unit": ("unit",),
}
YES, NO = ("true", "yes", "t", "y", "1"), ("false", "no", "f", "n", "0")


def drawn_templates(
    table: gpd.GeoDataFrame, layer: str = "Room templates", unit: float | None = None
) -> tuple[Template, ...]:
    """Read templates from a layer of polygons, each made of whole unit squares.

    Every polygon may lie anywhere, with its sides along x and y. Fields that are used where they
    are there: name, min, max, min_share and max_share (0 to 1), colour, use, mirror (yes or no),
    rotate (yes, no, or angles such as "0, 180") and unit.

    Parameters
    ----------
    table
        The layer.
    layer
        Its name, for messages.
    unit
        Side of a unit square in units of the layer; None takes the field unit, else finds it as
        `drawn_unit` says.

    Returns
    -------
    tuple of Template
        In the order of the layer; unnamed ones are called "shape 1", "shape 2"...

    Raises
    ------
    InputError
        If a polygon is not made of whole unit squares (5 % of a unit is tolerated), a field cannot
        be understood, or the templates make no sense, as for JSON; names layer and feature.

    Examples
    --------
    >>> corner = Polygon([(10, 0), (18, 0), (18, 4), (14, 4), (14, 8), (10, 8)])
    >>> (template,) = drawn_templates(gpd.GeoDataFrame({"name": ["L"]}, geometry=[corner]))
    >>> sorted(template.cells)
    [(0, 0), (0, 1), (1, 0)]
    """
    shapes = _polygons(table, layer)
    columns = {str(column).strip().casefold(): column for column in table.columns}
    found = {
        field: columns[name]
        for field, names in FIELDS.items()
        for name in reversed(names)
        if name in columns
    }
    rows = [
        {field: _known(row[column]) for field, column in found.items()}
        for _, row in table.iterrows()
    ]
    units = _units(rows, shapes, table.index.tolist(), layer, unit)
    templates = []
    for number, (feature, shape) in enumerate(zip(table.index.tolist(), shapes)):
        cells = _cells(shape, units[number])
        if cells is None:
            raise _error(
                f"The polygon is not made of whole squares of {units[number]:.4g} by "
                f"{units[number]:.4g}.",
                "Draw it along the lines of a grid, or give the side of a square as unit.",
                layer,
                feature,
            )
        template = _template(rows[number], cells, f"shape {number + 1}", layer, feature)
        fault = template_fault(template)
        if fault:
            raise _error(*fault, layer, feature)
        templates.append(template)
    fault = set_fault(templates)
    if fault:
        raise InputError(*fault, layer=layer)
    return tuple(templates)


def drawn_unit(table: gpd.GeoDataFrame, layer: str = "Room templates") -> float:
    """Find the side of the unit squares that templates are drawn of.

    That is the largest length of which all distances between parallel sides of a polygon are
    multiples, for as many polygons as possible, at most 12 to a side. A layer in which every
    distance is even, such as one of a single square of 2 x 2, is read as one of larger squares:
    give the unit there.

    Parameters
    ----------
    table, layer
        As for `drawn_templates`.

    Returns
    -------
    float
        In units of the layer.

    Raises
    ------
    InputError
        If the layer has no polygons, or none of them has sides along x and y.
    """
    gaps = [_gaps(shape) for shape in _polygons(table, layer)]
    # Distances of less than a hundredth of the shape are two spots of one wobbly side.
    all_gaps = [gap[gap > 0.01 * gap.max()] for gap in gaps if len(gap)]
    if not all_gaps:
        raise InputError(
            "None of its polygons is made of squares.",
            "Draw the templates along the lines of a grid, along x and y.",
            layer=layer,
            feature=table.index.tolist()[0],
        )
    lengths = np.concatenate(all_gaps)
    longest = lengths.max()
    # Lengths that differ by less are the same to a planner; so the tries stay few.
    lengths = np.unique(np.round(lengths / longest, 4)) * longest
    tries = np.unique(np.outer(lengths, 1 / np.arange(1, MOST_UNITS + 1)))[::-1]
    tries = tries[tries * (MOST_FOUND + 0.5) > longest]
    best, unit = -1, 0.0
    for length in tries.tolist():
        refined = [_fitted(gap, length) for gap in gaps if len(gap)]
        fits = [value for value in refined if value]
        if len(fits) > best:
            best, unit = len(fits), float(np.median(fits)) if fits else length
    return unit


# ---------------------------------------------------------------------- geometry
def _polygons(table: gpd.GeoDataFrame, layer: str) -> list[Polygon]:
    """Return the polygons of a layer, pieces that touch joined."""
    if len(table) == 0:
        raise InputError("It is empty.", "Draw at least one template.", layer=layer)
    found = []
    for feature, shape in zip(table.index.tolist(), table.geometry.tolist()):
        if shape is None or shape.is_empty:
            raise _error("It has no geometry.", "Delete the feature or draw it.", layer, feature)
        if not isinstance(shape, (Polygon, MultiPolygon)):
            raise _error("It is not a polygon.", "Give polygons only.", layer, feature)
        flat = shapely.force_2d(shape)
        if not np.isfinite(shapely.get_coordinates(flat)).all() or not flat.convex_hull.area > 0:
            raise _error("The polygon has no area.", "Draw it again.", layer, feature)
        # Pieces of one feature may overlap or share sides; that is no fault of the drawing.
        flat = shapely.union_all(shapely.get_parts(flat)) if _simple_parts(flat) else flat
        if not flat.is_valid:
            raise _error("The outline crosses itself.", "Draw it again.", layer, feature)
        found.append(flat)
    return found


def _simple_parts(shape: Polygon | MultiPolygon) -> bool:
    return bool(shapely.is_valid(shapely.get_parts(shape)).all())


def _sides(shape: Polygon) -> tuple[FloatArray, FloatArray]:
    """Return the sides along y as (x, length), and those along x as (y, length)."""
    rings = shapely.get_rings(shapely.get_parts(shape))
    ends = [np.stack([c[:-1], c[1:]], axis=1) for c in map(shapely.get_coordinates, rings)]
    sides = np.concatenate(ends) - shapely.get_coordinates(shape).min(axis=0)
    dx, dy = np.abs(sides[:, 1] - sides[:, 0]).T
    middle = sides.mean(axis=1)
    upright, flat = dx < LEANING * dy, dy < LEANING * dx
    return (
        np.column_stack([middle[upright, 0], dy[upright]]),
        np.column_stack([middle[flat, 1], dx[flat]]),
    )


def _gaps(shape: Polygon) -> FloatArray:
    """Return the distances of parallel sides from the first, ascending; none if sides lean."""
    gaps = [along[:, 0] - along[:, 0].min() for along in _sides(shape) if len(along)]
    # A shape without two sides across cannot tell a unit.
    if len(gaps) < 2 or min(len(gap) for gap in gaps) < 2:
        return np.zeros(0)
    found: FloatArray = np.sort(np.concatenate(gaps))
    return found


def _fitted(gaps: FloatArray, unit: float) -> float | None:
    """Return the unit that fits distances best, near a given one; None if they are no multiples."""
    step = unit
    multiples = np.round(gaps / step)
    for _ in range(3):  # long distances find their multiple once short ones have set the unit
        if not multiples.any():
            return None
        step = float(gaps @ multiples / (multiples @ multiples))
        multiples = np.round(gaps / step)
    near = np.abs(gaps - multiples * step).max() <= 2 * TOLERANCE * step
    return step if near and multiples.any() and abs(step - unit) < TOLERANCE * unit else None


def _cells(shape: Polygon, unit: float) -> Cells | None:
    """Return the unit squares that a polygon is made of, None if it is not."""
    low = shapely.get_coordinates(shape).min(axis=0)
    high = shapely.get_coordinates(shape).max(axis=0)
    if max(high - low) > (MOST_SQUARES + TOLERANCE) * unit:
        return None
    origin = low + [_phase(along, unit) for along in _sides(shape)]
    count = np.round((high - origin) / unit).astype(int)
    if (count < 1).any():
        return None
    column, row = (a.ravel() for a in np.mgrid[0 : count[0], 0 : count[1]])
    x, y = origin[0] + column * unit, origin[1] + row * unit
    boxes = shapely.box(x, y, x + unit, y + unit)
    full = shapely.area(shapely.intersection(boxes, shape)) > unit**2 / 2
    if not full.any():
        return None
    squares = shapely.union_all(boxes[full])
    slack = TOLERANCE * unit * (1 + 1e-6)
    inside = shapely.buffer(squares, -slack, join_style="mitre")
    around = shapely.buffer(squares, slack, join_style="mitre")
    if not (shapely.covers(around, shape) and shapely.covers(shape, inside)):
        return None
    return settled(zip(column[full].tolist(), row[full].tolist()))


def _phase(along: FloatArray, unit: float) -> float:
    """Return where the lines of the grid lie, as the mean over sides (position, length)."""
    if not len(along):
        return 0.0
    turn = np.exp(2j * np.pi * along[:, 0] / unit) @ along[:, 1]
    return float(np.angle(turn)) * unit / (2 * math.pi)


# ---------------------------------------------------------------------- fields
def _error(problem: str, remedy: str, layer: str, feature: object) -> InputError:
    name = feature if isinstance(feature, (int, str)) else str(feature)
    return InputError(problem, remedy, layer=layer, feature=name)


def _known(value: Any) -> Any:
    """Return the value of a field, None where it has none."""
    if value is None or (not isinstance(value, str) and pd.api.types.is_scalar(value)):
        return None if value is None or pd.isna(value) else value
    text = str(value).strip()
    return None if text.casefold() in ("", "null", "none", "nan") else text


def _units(
    rows: list[dict[str, Any]],
    shapes: list[Polygon],
    features: list[Any],
    layer: str,
    given: float | None,
) -> list[float]:
    """Return the unit of each polygon: the given one, that of the field, or the one found."""
    if given is not None:
        if not (math.isfinite(given) and given > 0):
            raise InputError(f"The unit is {given:g}.", "Give a length greater than 0.")
        return [given] * len(rows)
    units = [_number(row, "unit", layer, feature) for row, feature in zip(rows, features)]
    for unit, feature in zip(units, features):
        if unit is not None and unit <= 0:
            raise _error(f"The unit is {unit:g}.", "Give a length above 0.", layer, feature)
    told = [unit for unit in units if unit is not None]
    if len(told) == len(units):
        return told
    other = gpd.GeoDataFrame(geometry=shapes, index=features)
    found = told[0] if len(set(told)) == 1 else drawn_unit(other, layer)
    return [found if unit is None else unit for unit in units]


def _number(row: Mapping[str, Any], field: str, layer: str, feature: object) -> float | None:
    value = row.get(field)
    if value is None:
        return None
    try:
        number = float(str(value).replace(",", "."))
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise _error(
            f"The field {field} is '{value}'.", "Give a number, or nothing.", layer, feature
        )
    return number


def _whole(row: Mapping[str, Any], field: str, layer: str, feature: object) -> int | None:
    number = _number(row, field, layer, feature)
    if number is not None and number != round(number):
        raise _error(
            f"The field {field} is {number:g}.", "Give a whole number, or nothing.", layer, feature
        )
    return None if number is None else round(number)


def _flag(row: Mapping[str, Any], field: str) -> bool | None:
    """Return a field that says yes or no, yes where it says nothing, None for anything else."""
    word = str(row.get(field, "yes") if row.get(field) is not None else "yes").casefold()
    word = word.removesuffix(".0")
    return True if word in YES else False if word in NO else None


def _rotations(row: Mapping[str, Any], layer: str, feature: object) -> tuple[int, ...]:
    flag = _flag(row, "rotate")
    if flag is not None:
        return (0, 1, 2, 3) if flag else (0,)
    parts = re.split(r"[\s,;°\[\]]+", str(row["rotate"]))
    words = [part.removesuffix(".0") for part in parts if part]
    if not words or set(words) - {"0", "90", "180", "270"}:
        raise _error(
            f"The field rotate is '{row['rotate']}'.",
            "Give yes, no, or angles of 0, 90, 180 and 270.",
            layer,
            feature,
        )
    return tuple(sorted({int(word) // 90 for word in words}))


def _template(
    row: Mapping[str, Any], cells: Cells, name: str, layer: str, feature: object
) -> Template:
    mirror = _flag(row, "mirror")
    if mirror is None:
        raise _error(f"The field mirror is '{row['mirror']}'.", "Give yes or no.", layer, feature)
    return Template(
        str(row.get("name") or name),
        cells,
        _rotations(row, layer, feature),
        mirror,
        _whole(row, "min", layer, feature) or 0,
        _whole(row, "max", layer, feature),
        _number(row, "min_share", layer, feature) or 0.0,
        _number(row, "max_share", layer, feature),
        str(row.get("colour") or Template.colour),
        str(row.get("use") or ""),
    )
