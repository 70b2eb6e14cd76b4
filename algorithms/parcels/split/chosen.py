"""The chosen parcels of a layout and what lies around them, read from layers."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import pandas as pd
import shapely
from pyproj import CRS
from shapely.geometry import LineString

from ...errors import InputError
from ...site.crs import layer_crs, working_crs
from ...site.prepare import prepare_sites
from ...site.repair import Problems, make_valid
from ...site.types import Site
from ..streetspace import StreetWidths, widths_of
from .existing import SLACK, WAYS, Existing, joined
from .rows import column

#: Parcels and streets further away than this from what is chosen have no say (metres).
AROUND = 300.0
#: A chosen lane that touches parcels that stay along so much of its edge stays, too (metres).
TOUCH = 0.5


@dataclass(frozen=True)
class Around:
    """What lies around the parcels; all of it may be missing.

    Attributes
    ----------
    streets
        Centre lines of the layout; without them every edge beside no other parcel has a street.
    site, roads
        Site polygons, and the existing roads around: without roads the whole edge of the site
        counts as a street.
    widths
        Widths of streets without a field `width_m`.
    snap_distance
        Of the roads, metres.
    parcel_layer, street_layer, site_layer, road_layer
        Names of the layers, for messages.
    """

    streets: gpd.GeoDataFrame | None = None
    site: gpd.GeoDataFrame | None = None
    roads: gpd.GeoDataFrame | None = None
    widths: StreetWidths = StreetWidths()  # noqa: RUF009
    snap_distance: float = 30.0
    parcel_layer: str = "Parcels"
    street_layer: str = "Streets"
    site_layer: str = "Site"
    road_layer: str = "Roads"


@dataclass(frozen=True)
class Chosen:
    """What was read.

    Attributes
    ----------
    frame
        The layer of parcels.
    source, crs
        Its CRS, and the working CRS.
    near
        Rows that have a say, shape (n,).
    plots, uses
        Their polygons in the working CRS, and what they are; shape (n,).
    chosen
        Which of these n are chosen.
    existing
        The layout around.
    street_rows
        Row in the layer of streets of each of its streets.
    problems
        What was found.
    sites
        The sites with their boundary streets, where a site or roads are given.
    """

    frame: gpd.GeoDataFrame
    source: CRS
    crs: CRS
    near: npt.NDArray[np.intp]
    plots: npt.NDArray[Any]
    uses: list[str]
    chosen: list[int]
    existing: Existing
    street_rows: list[int]
    problems: Problems
    sites: Sequence[Site] = ()


def covered(
    parcels: gpd.GeoDataFrame,
    areas: gpd.GeoDataFrame,
    *,
    parcel_layer: str = "Parcels",
    area_layer: str = "Area",
) -> list[Hashable]:
    """Labels of the parcels of which polygons cover more than half.

    Parameters
    ----------
    parcels, areas
        Polygons in any CRS.
    parcel_layer, area_layer
        Names of the layers, for messages.

    Raises
    ------
    InputError
        If a layer has no CRS.
    """
    layer_crs(areas, area_layer)
    source = layer_crs(parcels, parcel_layer)
    shapes = valid_polygons(parcels.geometry)
    some = np.flatnonzero(shapely.area(shapes) > 0)
    if not len(some):
        return []
    crs = working_crs(source, shapely.total_bounds(shapes[some]), parcel_layer)
    own = gpd.GeoSeries(shapes[some], crs=source).to_crs(crs).to_numpy()
    whole = shapely.union_all(valid_polygons(areas.geometry.to_crs(crs)))
    near = np.flatnonzero(shapely.intersects(own, whole))
    share = shapely.area(shapely.intersection(own[near], whole)) / shapely.area(own[near])
    return [parcels.index[k] for k in some[near[share > 0.5]].tolist()]


def read_chosen(
    parcels: gpd.GeoDataFrame,
    chosen: Sequence[Hashable],
    around: Around,
    *,
    lanes: bool = False,
    width: float = 15.0,
) -> Chosen:
    """Read the chosen parcels and what lies around them.

    Parameters
    ----------
    parcels, chosen, around
        See `redo.redo_parcels`.
    lanes
        Whether lanes may be chosen that parcels need which stay.
    width
        Of streets where no layer tells, metres.

    Raises
    ------
    InputError
        If nothing usable is chosen, the chosen are of several variations, or a layer has no CRS.
    """
    source = layer_crs(parcels, around.parcel_layer)
    problems = Problems()
    shapes = valid_polygons(parcels.geometry)
    picked = _picked(parcels, chosen, shapes, around, problems, source)
    beside = (shapely.area(shapes) > 0) & _same_variation(parcels, picked, around)
    crs = working_crs(source, shapely.total_bounds(shapes[picked]), around.parcel_layer)
    moved = shapes.copy()
    moved[beside] = gpd.GeoSeries(shapes[beside], crs=source).to_crs(crs)
    reach = shapely.box(*shapely.total_bounds(moved[picked])).buffer(AROUND)
    beside[beside] = shapely.intersects(moved[beside], reach)
    near = np.flatnonzero(beside)
    plots = moved[near]
    uses = _uses(parcels, near)
    mine = np.flatnonzero(picked[near]).tolist()
    if not lanes:
        mine = _without_lanes(mine, plots, uses, near, parcels, around, problems, crs)
    streets, widths, rows = _streets(around, crs, reach, _variation(parcels, picked))
    site, frontage, sites = _site(around, plots, crs, width)
    existing = Existing(list(plots), uses, site, frontage, streets, widths)
    return Chosen(parcels, source, crs, near, plots, uses, mine, existing, rows, problems, sites)


def valid_polygons(shapes: gpd.GeoSeries) -> npt.NDArray[Any]:
    """Give polygons as valid ones, everything else as empty ones; shape (n,).

    Parameters
    ----------
    shapes
        Geometries of any kind.
    """
    own = shapely.force_2d(np.asarray(shapes.array, dtype=object))
    polygonal = np.isin(shapely.get_type_id(own), (3, 6))
    finite = np.isfinite(shapely.bounds(own).reshape(-1, 4)).all(axis=1)
    own[~(polygonal & finite)] = shapely.Polygon()
    for k in np.flatnonzero(~shapely.is_valid(own)):
        own[k] = make_valid(own[k])
    return np.asarray(own)


def _picked(
    parcels: gpd.GeoDataFrame,
    chosen: Sequence[Hashable],
    shapes: npt.NDArray[Any],
    around: Around,
    problems: Problems,
    source: CRS,
) -> npt.NDArray[np.bool_]:
    """Tell which features are chosen and can be used."""
    wanted = set(chosen)
    picked = np.array([label in wanted for label in parcels.index], dtype=bool)
    usable = shapely.area(shapes) > 0
    for at in np.flatnonzero(picked & ~usable).tolist():
        problems.add(
            around.parcel_layer, parcels.index[at], "it has no area", "it stays as it is",
            "warning", None, source,
        )  # fmt: skip
    picked &= usable
    if not picked.any():
        raise InputError(
            "Nothing is chosen to be made anew.",
            "Give a condition that parcels meet, or an area that covers more than half of some.",
            layer=around.parcel_layer,
        )
    return picked


def _uses(parcels: gpd.GeoDataFrame, near: npt.NDArray[np.intp]) -> list[str]:
    """Say what features are, empty where that is unknown."""
    uses = column(parcels, "land_use")
    if uses is None:
        return [""] * len(near)
    return ["" if pd.isna(own) else str(own) for own in uses.iloc[near]]


def _same_variation(
    parcels: gpd.GeoDataFrame, picked: npt.NDArray[np.bool_], around: Around
) -> npt.NDArray[np.bool_]:
    """Tell which features are of the variation of those chosen."""
    own = column(parcels, "variation")
    if own is None:
        return np.ones(len(parcels), dtype=bool)
    mine = pd.unique(own[picked].dropna())
    if len(mine) > 1:
        raise InputError(
            f"Parcels of {len(mine)} variations are chosen, which lie on each other.",
            "Choose those of one, as with the condition variation = 1.",
            layer=around.parcel_layer,
        )
    return np.asarray(own.isna() | own.isin(mine), dtype=bool)


def _without_lanes(
    chosen: list[int],
    plots: npt.NDArray[Any],
    uses: list[str],
    near: npt.NDArray[np.intp],
    parcels: gpd.GeoDataFrame,
    around: Around,
    problems: Problems,
    crs: CRS,
) -> list[int]:
    """Leave out lanes that parcels need which stay."""
    picked = set(chosen)
    rest = [k for k in range(len(plots)) if k not in picked and uses[k] == "parcel"]
    edges = shapely.boundary(plots[rest])
    found = []
    for k in chosen:
        if uses[k] in WAYS and rest:
            shared = shapely.length(shapely.intersection(edges, shapely.buffer(plots[k], SLACK)))
            if shared.max() > TOUCH:
                problems.add(
                    around.parcel_layer, parcels.index[near[k]],
                    f"this {uses[k]} gives access to parcels that stay", "it stays, too",
                    "info", plots[k], crs,
                )  # fmt: skip
                continue
        found.append(k)
    if not found:
        raise InputError(
            "Only lanes are chosen, and parcels that stay have their access from them.",
            "Choose the parcels along them, too.",
            layer=around.parcel_layer,
        )
    return found


def _variation(parcels: gpd.GeoDataFrame, picked: npt.NDArray[np.bool_]) -> Any:
    """Tell of which variation the chosen parcels are, None where they are of none."""
    own = column(parcels, "variation")
    known = None if own is None else own[picked].dropna()
    return None if known is None or known.empty else known.iloc[0]


def _streets(
    around: Around, crs: CRS, reach: shapely.Geometry, variation: Any
) -> tuple[list[LineString], list[float], list[int]]:
    """Read the streets near the chosen parcels, how wide they are and the rows that they are of."""
    frame = around.streets
    if frame is None or not len(frame):
        return [], [], []
    layer_crs(frame, around.street_layer)
    shapes = shapely.force_2d(frame.geometry.to_crs(crs).to_numpy())
    wide = widths_of(frame, around.widths)
    turning = column(frame, "turning_m")
    if turning is not None:
        circles = pd.to_numeric(turning, errors="coerce").fillna(0).to_numpy(dtype=float)
        wide = np.maximum(wide, 2 * circles)
    usable = shapely.intersects(shapes, reach)
    own = column(frame, "variation")
    if own is not None and variation is not None:
        usable &= (own.isna() | (own == variation)).to_numpy(dtype=bool)
    parts, row = shapely.get_parts(shapes[usable], return_index=True)
    rows = np.flatnonzero(usable)[row]
    good = (shapely.get_type_id(parts) == 1) & (shapely.length(parts) > 0)
    rows = rows[good]
    return list(parts[good]), wide[rows].tolist(), rows.tolist()


def _site(
    around: Around, plots: npt.NDArray[Any], crs: CRS, width: float
) -> tuple[shapely.Geometry | None, shapely.Geometry | None, Sequence[Site]]:
    """Read the site, its edges along existing roads, and the sites one by one."""
    given, layer = around.site, around.site_layer
    if given is None:
        if around.roads is None:
            return None, None, ()
        given = gpd.GeoDataFrame(geometry=[joined(list(plots), width / 2 + SLACK)], crs=crs)
        layer = around.parcel_layer
    prepared = prepare_sites(
        given, around.roads, snap_distance=around.snap_distance,
        polygon_layer=layer, road_layer=around.road_layer,
    )  # fmt: skip
    site = _moved(prepared.sites, "polygon", crs)
    if around.roads is None:
        return site, None, prepared.sites
    return site, _moved(prepared.sites, "street_frontage", crs), prepared.sites


def _moved(sites: Sequence[Site], name: str, crs: CRS) -> shapely.Geometry:
    """Join something of all sites in the working CRS."""
    own = [gpd.GeoSeries([getattr(s, name)], crs=s.crs).to_crs(crs).iloc[0] for s in sites]
    return shapely.union_all(own)
