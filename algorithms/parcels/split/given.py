"""Key elements read from layers."""

from __future__ import annotations

import math

import geopandas as gpd
import pandas as pd
import shapely
from pyproj import CRS
from shapely.geometry import LineString

from ...errors import InputError
from ...measure.layers import read_features
from ..roadmesh import GivenStreet
from .elements import KeyArea

#: Fields that say what an area is, the first that there is counts.
USE_FIELDS = ("use", "land_use", "landuse", "kind", "label", "type")
#: What an area is where no field says so.
UNNAMED = "park"
#: Uses that a street runs around unless the field `around` says otherwise.
WITH_STREETS = ("school", "commercial", "retail", "civic", "kindergarten")
#: What the field `around` may say.
YES, NO = ("1", "1.0", "true", "yes", "y"), ("0", "0.0", "false", "no", "n")


def read_key_areas(frame: gpd.GeoDataFrame | None, crs: CRS, layer: str) -> list[KeyArea]:
    """Read polygons whose use is fixed.

    Parameters
    ----------
    frame
        Polygons. The field `use` (or land_use, landuse, kind, label, type) says what they are,
        park where it is missing or empty; the field `around` whether a street runs around.
        Without it one runs around schools, commercial and civic areas.
    crs
        Working CRS, in metres.
    layer
        Name of the layer, for messages.

    Raises
    ------
    InputError
        If the layer has no CRS, a feature is no polygon, or `around` is no yes or no.
    """
    if frame is None:
        return []
    rows = frame.reset_index(drop=True)
    uses, around = _column(rows, USE_FIELDS), _column(rows, ("around",))
    found = []
    for k, shape in read_features(rows, crs, layer):
        use = _word(uses, int(k)) or UNNAMED
        asked = _word(around, int(k)).lower()
        if asked and asked not in (*YES, *NO):
            raise InputError(
                f"Its field 'around' says '{asked}'.",
                "Write yes where a street is to run around the area, no where none is, or leave "
                "it empty.",
                layer=layer,
                feature=str(frame.index[int(k)]),
            )
        own = asked in YES if asked else use.lower() in WITH_STREETS
        parts = [p for p in shapely.get_parts(shape) if p.geom_type == "Polygon"]
        if not parts:
            raise InputError(
                f"It is a {shape.geom_type}, not a polygon.",
                "Give key areas as polygons, main streets as lines in a layer of their own.",
                layer=layer,
                feature=str(frame.index[int(k)]),
            )
        found += [KeyArea(part, use, own) for part in parts]
    return found


def read_key_streets(
    frame: gpd.GeoDataFrame | None, crs: CRS, layer: str, width: float
) -> list[GivenStreet]:
    """Read main streets that split the site first.

    Parameters
    ----------
    frame
        Lines; the field `width_m` says how wide they are, `name` what they are called.
    crs
        Working CRS, in metres.
    layer
        Name of the layer, for messages.
    width
        Where there is no field or it is empty, metres.

    Raises
    ------
    InputError
        If the layer has no CRS, a feature is no line, or a width is no number above 0.
    """
    if frame is None:
        return []
    rows = frame.reset_index(drop=True)
    widths, names = _column(rows, ("width_m", "width")), _column(rows, ("name",))
    found = []
    for k, shape in read_features(rows, crs, layer):
        label = str(frame.index[int(k)])
        parts = [p for p in shapely.get_parts(shape) if p.geom_type == "LineString"]
        if not parts:
            raise InputError(
                f"It is a {shape.geom_type}, not a line.",
                "Give main streets as lines, key areas as polygons in a layer of their own.",
                layer=layer,
                feature=label,
            )
        own = _width(widths, int(k), width, layer, label)
        found += [GivenStreet(LineString(p.coords), own, _word(names, int(k))) for p in parts]
    return found


def _width(column: pd.Series | None, row: int, usual: float, layer: str, label: str) -> float:
    """Read the width of a street, the usual one where there is none."""
    value = None if column is None else column.iloc[row]
    if value is None or value != value:
        return usual
    try:
        width = float(value)
    except (TypeError, ValueError):
        width = math.nan
    if not 0 < width < math.inf:
        raise InputError(
            f"Its width is {value}; it must be a number of metres greater than 0.",
            "Correct the value, or leave the field empty.",
            layer=layer,
            feature=label,
        )
    return width


def _column(rows: gpd.GeoDataFrame, names: tuple[str, ...]) -> pd.Series | None:
    """Find the first of some columns, whatever its case."""
    own = {str(column).lower(): column for column in rows.columns}
    return next((rows[own[name]] for name in names if name in own), None)


def _word(column: pd.Series | None, row: int) -> str:
    """Read a word, empty where there is none."""
    value = None if column is None else column.iloc[row]
    return "" if value is None or value != value else str(value).strip()
