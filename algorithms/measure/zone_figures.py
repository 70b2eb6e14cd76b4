"""Figures of laid out residential zones, from their layers alone (RZ Table 5)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from ..errors import InputError
from ..site.crs import layer_crs, working_crs

Floats = npt.NDArray[np.float64]
Shapes = npt.NDArray[np.object_]
#: Layers that are read; the first two must be there.
READ = ("zone", "buildings", "paths", "corridors", "parking", "green")
SQUARE_METRES = 10_000.0


@dataclass(frozen=True)
class ZoneFigures:
    """Figures of zones; NaN where there is nothing to measure.

    Attributes
    ----------
    zone_ha
        Area of the zones, hectares. All shares refer to it.
    far
        Floor area / area.
    density
        Ground that is built on / area.
    green
        Ground that is green / area.
    residence_pct, facility_pct
        Ground under residences and under facilities, % (RZ: residence plot, facility plot).
    path_pct, street_pct
        Ground under paths, and under corridors inside the zones, %; together RZ's path plot.
    parking_pct
        Ground under parking, %.
    buildings, dwellings
        Numbers.
    dwellings_ha
        Dwellings per hectare.
    parking_places
        Number of parking places,
    parking_per_dwelling
        and per dwelling.
    shaded
        Residences that lack sun by the rule.
    mean_sun, least_sun
        Hours of sun of residences.
    mean_way, longest_way
        Ways from entrances to streets, metres.
    """

    zone_ha: float
    far: float
    density: float
    green: float
    residence_pct: float
    facility_pct: float
    path_pct: float
    street_pct: float
    parking_pct: float
    buildings: int
    dwellings: int
    dwellings_ha: float
    parking_places: int
    parking_per_dwelling: float
    shaded: int
    mean_sun: float
    least_sun: float
    mean_way: float
    longest_way: float

    def as_dict(self) -> dict[str, float]:
        """Give the figures by name, in the order of the class."""
        return asdict(self)


def zone_figures(layers: Mapping[str, gpd.GeoDataFrame], *, crs: CRS | None = None) -> ZoneFigures:
    """Measure laid out zones (RZ Table 5).

    Areas are those of the geometries, so that a plan that was edited by hand is measured as it
    is; ground that overlaps counts once, floors count for each building.

    Parameters
    ----------
    layers
        "zone" (polygons) and "buildings" (polygons with `use`, `storeys`, `dwellings`,
        `sun_hours`, `shaded`, `way_m`); where there, "paths" and "corridors" (lines with
        `width_m`), "parking" (polygons with `places`) and "green" (polygons).
    crs
        CRS to measure in, projected, in metres; None for one that fits the zones.

    Returns
    -------
    ZoneFigures

    Raises
    ------
    InputError
        If a layer is missing, has no CRS, the buildings have no use, or the zones no area.
    """
    _check(layers)
    if crs is None:
        source = layer_crs(layers["zone"], "zone")
        crs = working_crs(source, layers["zone"].total_bounds, "zone")
    shape = {name: _shapes(layers[name], name, crs) for name in READ if name in layers}
    zone = shapely.union_all(shape["zone"])
    area = float(zone.area)
    if not area > 0:
        raise InputError("The zones have no area.", "Give polygons.", layer="zone")
    built = layers["buildings"]
    residence = (built["use"] == "residence").to_numpy(dtype=bool)
    covered = shapely.union_all(shape["buildings"])
    dwellings = int(_numbers(built, "dwellings", 0.0).sum())
    parking = layers.get("parking")
    places = 0 if parking is None else int(_numbers(parking, "places", 0.0).sum())
    sun = _numbers(built, "sun_hours")[residence]
    way = _numbers(built, "way_m")

    def share(ground: shapely.Geometry) -> float:
        return float(shapely.intersection(ground, zone).area) / area

    def strips(name: str) -> float:
        if name not in layers:
            return 0.0
        half = _numbers(layers[name], "width_m", 0.0) / 2
        ground = shapely.union_all(shapely.buffer(shape[name], half, cap_style="flat"))
        return 100.0 * share(shapely.difference(ground, covered))

    def areas(name: str) -> float:
        return share(shapely.union_all(shape[name])) if name in shape else 0.0

    floors = shapely.area(shape["buildings"]) * _numbers(built, "storeys", 1.0)
    return ZoneFigures(
        zone_ha=area / SQUARE_METRES,
        far=float(np.nansum(floors)) / area,
        density=share(covered),
        green=areas("green"),
        residence_pct=100.0 * share(shapely.union_all(shape["buildings"][residence])),
        facility_pct=100.0 * share(shapely.union_all(shape["buildings"][~residence])),
        path_pct=strips("paths"),
        street_pct=strips("corridors"),
        parking_pct=100.0 * areas("parking"),
        buildings=len(built),
        dwellings=dwellings,
        dwellings_ha=dwellings / area * SQUARE_METRES,
        parking_places=places,
        parking_per_dwelling=places / dwellings if dwellings else math.nan,
        shaded=int((_numbers(built, "shaded", 0.0) > 0)[residence].sum()),
        mean_sun=_of(np.mean, sun),
        least_sun=_of(np.min, sun),
        mean_way=_of(np.mean, way),
        longest_way=_of(np.max, way),
    )


def _check(layers: Mapping[str, gpd.GeoDataFrame]) -> None:
    """Raise `InputError` where a layer that is needed is missing or says too little."""
    for name in READ[:2]:
        if name not in layers:
            raise InputError(
                "is missing.", f"Give the layers {' and '.join(READ[:2])}.", layer=name
            )
    if "use" not in layers["buildings"].columns:
        raise InputError(
            "has no field use.", "Add it: residence or facility for each.", layer="buildings"
        )
    if not np.isfinite(layers["zone"].total_bounds).all():
        raise InputError("There is no zone.", "Give polygons.", layer="zone")


def _shapes(frame: gpd.GeoDataFrame, layer: str, crs: CRS) -> Shapes:
    """Give the geometries of a layer in the CRS to measure in, row by row, shape (n,)."""
    if not len(frame):
        return np.zeros(0, dtype=object)
    moved = frame if layer_crs(frame, layer) == crs else frame.to_crs(crs)
    shapes: Shapes = shapely.force_2d(moved.geometry.to_numpy())
    wrong = ~shapely.is_valid(shapes) & ~shapely.is_missing(shapes)
    shapes[wrong] = shapely.make_valid(shapes[wrong])
    return shapes


def _numbers(frame: gpd.GeoDataFrame, name: str, missing: float = math.nan) -> Floats:
    """Give a field as numbers, shape (n,); what is empty or no field is `missing`."""
    if name not in frame.columns:
        return np.full(len(frame), missing)
    values: Floats = frame[name].astype(float).to_numpy(copy=True)
    values[np.isnan(values)] = missing
    return values


def _of(what: Callable[[Floats], Any], values: Floats) -> float:
    """Give a statistic of the numbers that there are."""
    known = values[np.isfinite(values)]
    return float(what(known)) if len(known) else math.nan
