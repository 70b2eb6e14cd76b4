"""Coverage that differs by area: every part of the ground with a range of its own."""

from __future__ import annotations

import math

import geopandas as gpd
import shapely
from pyproj import CRS

from ..errors import InputError
from .layers import StreetLayer, read_features
from .problems import Problem
from .surroundings import Area, Surroundings, coverage_gaps

#: Field with the range of an area (metres).
RANGE_FIELD = "coverage_m"
#: Name of the layer, for messages.
LAYER = "Coverage areas"


def read_areas(frame: gpd.GeoDataFrame | None, crs: CRS) -> list[Area]:
    """Read polygons with a coverage range of their own.

    Parameters
    ----------
    frame
        Polygons with the field `coverage_m`; where it is empty nothing special holds.
    crs
        Working CRS.

    Raises
    ------
    InputError
        If the field is missing, or a range is no number above 0.
    """
    if frame is None:
        return []
    if RANGE_FIELD not in frame.columns:
        raise InputError(
            f"It has no field '{RANGE_FIELD}'.",
            "Give each area its range in metres in this field.",
            layer=LAYER,
        )
    ranges, labels = frame[RANGE_FIELD].tolist(), [str(label) for label in frame.index]
    found = []
    # by position, since parts of one feature share its id
    for k, shape in read_features(frame.reset_index(drop=True), crs, LAYER):
        value, label = ranges[int(k)], labels[int(k)]
        if value is None or value != value:
            continue
        if not isinstance(value, (int, float)) or not 0 < value < math.inf:
            raise InputError(
                f"The coverage range is {value}; it must be a number greater than 0.",
                "Correct the value, or leave the field empty.",
                layer=LAYER,
                feature=label,
            )
        found.append((shape, float(value), f"area {label}"))
    return found


def gaps_by_area(
    streets: StreetLayer,
    around: Surroundings,
    reach: float | None,
    areas: list[Area],
    slack: float,
) -> tuple[list[Problem], float]:
    """Find uncovered ground, area by area; where areas overlap, the smallest range counts.

    Parameters
    ----------
    streets, around
        See `coverage_gaps`.
    reach
        Range outside the areas, metres; None for no check there.
    areas
        Parts of the ground with ranges of their own.
    slack
        Metres by which every area's range may be missed, and within which of an area's edge
        the ground is left out: what is promised holds at the corners of a mesh only.

    Returns
    -------
    list, float
        One problem per connected gap in each area, and the area of all gaps, square metres.
    """
    problems: list[Problem] = []
    total = 0.0
    finer: shapely.Geometry = shapely.Polygon()
    for shape, own, name in sorted(areas, key=lambda area: area[1]):
        ground = shapely.buffer(shape, -slack) if slack else shape
        part = (shapely.difference(ground, finer), own, name)
        gaps, area = coverage_gaps(streets, around, own + slack, part)
        problems += gaps
        total += area
        finer = shapely.union(finer, shapely.buffer(shape, slack) if slack else shape)
    if reach is not None:
        rest: Area | None = None
        if areas:
            rest = (shapely.difference(around.site, finer), reach, "the other ground")
        gaps, area = coverage_gaps(streets, around, reach, rest)
        problems += gaps
        total += area
    return problems, total
