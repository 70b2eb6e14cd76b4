"""The quality of parcels, designed or real, measured by the same code (UP section 7)."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely

from ..errors import InputError
from ..progress import Progress, Silent
from ..site.watch import ask
from .histogram import MEASURES, Histogram, histogram
from .parcel_figures import ParcelFigures, parcel_figures
from .parcel_ideal import ideal_area_ratio, ideal_distance
from .parcel_shape import TOLERANCE, corner_deviation, rectangle_ratio, rectangles, undesirable
from .polygons import areas_of, closed, largest_parts, read_polygons, read_shapes, united
from .street_edges import Edges, street_lengths
from .uses import read_uses, use_field

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

#: A parcel has access where at least this much of its outline lies along a street (metres).
ACCESS = 3.0
#: Share of a side of the rectangle around a parcel that has to lie along a street for it to be
#: the front.
FRONT = 0.4
#: Without a site, gaps up to this width between polygons belong to the ground (metres).
GAP = 40.0
#: Tolerance for surveyed parcels (metres).
SURVEYED = 1.0


@dataclass(frozen=True)
class Ideal:
    """What parcels are held against.

    Attributes
    ----------
    width, depth
        Sides of the ideal parcel, along its street and away from it; metres.
    tolerance
        Outlines are simplified by this before corners are looked at: 0.05 m for designs, 1 m for
        surveyed and digitised parcels, whose small jogs would count as corners else. Metres.

    Raises
    ------
    InputError
        If a length is not finite, a side is not above 0 or the tolerance is below 0.
    """

    width: float = 18.0
    depth: float = 30.0
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not (math.isfinite(value) and (value > 0 or (name == "tolerance" and value == 0))):
                raise InputError(
                    f"The {name} of the ideal parcel is {value:g}."
                    if name != "tolerance"
                    else f"Outlines are to be simplified by {value:g} m.",
                    "Give a length in metres above 0.",
                )


@dataclass(frozen=True, eq=False)
class ParcelReport:
    """What was found about the parcels of a layer.

    Attributes
    ----------
    parcels
        The layer as it was given, with the columns of `measure_shapes` set anew; features keep
        only what is polygon of them.
    figures
        Of all parcels that are counted.
    histograms
        Counts of each of `histogram.MEASURES`.
    problems
        What was left out, repaired or not understood, in the CRS of the layer.
    use_field
        The field that told what is a parcel; empty where all are.
    p_angle_surveyed
        Mean p_angle with outlines simplified by 1 m: much less than the one that was measured
        where parcels are surveyed and were simplified by too little.
    """

    parcels: gpd.GeoDataFrame
    figures: ParcelFigures
    histograms: list[Histogram]
    problems: gpd.GeoDataFrame
    use_field: str
    p_angle_surveyed: float


def measure_parcels(
    parcels: gpd.GeoDataFrame,
    *,
    streets: gpd.GeoDataFrame | None = None,
    site: gpd.GeoDataFrame | None = None,
    ideal: Ideal | None = None,
    reach: float = 15.0,
    field: str = "",
    parcel_layer: str = "Parcels",
    street_layer: str = "Streets",
    site_layer: str = "Site",
    progress: Progress | None = None,
) -> ParcelReport:
    """Measure the parcels of a layer.

    Polygons that are streets or parks by their use are no parcels: they have an area only, and
    edges along what is a street count as frontage.

    Parameters
    ----------
    parcels
        Polygons in any CRS; the index holds the feature ids. Of several parts the largest has
        the shape. Not changed.
    streets
        Lines or polygons; None: outlines that no other polygon shares lie along streets.
    site
        Polygons; None: see `ParcelFigures.ground_ha`. With a site the figures count the parcels
        that lie in it.
    ideal
        The ideal parcel; None: 18 m x 30 m.
    reach
        Greatest distance of a parcel from a street line or polygon that it lies along, metres.
    field
        Field with the use; empty: `uses.use_field` finds it, and without one all are parcels.
    parcel_layer, street_layer, site_layer
        Names of the layers, for messages.
    progress
        Told of stages and asked for cancellation, or None.

    Raises
    ------
    InputError
        If a layer has no CRS, or there are no polygons or no parcels among them.
    CancelledError
        If the caller cancels.

    Examples
    --------
    >>> lot = shapely.box(500_000, 0, 500_018, 30)
    >>> found = measure_parcels(gpd.GeoDataFrame(geometry=[lot], crs=32633))
    >>> round(found.figures.p_area, 6), found.parcels["frontage_m"].round(6).tolist()
    (1.0, [96.0])
    """
    told, wish = progress or Silent(), ideal or Ideal()
    told.stage("Reading the parcels", 0.0)
    layer = read_polygons(parcels, parcel_layer, None, progress)
    use = field or use_field(parcels)
    uses, _ = read_uses(parcels, use, parcel_layer)
    built = layer.usable & ~np.isin(uses, ("streets", "parks"))
    if not built.any():
        raise InputError(
            f"By the field '{use}' none of its polygons is a parcel.",
            "Choose another field with the use, or another layer.",
            layer=parcel_layer,
        )
    given = read_shapes(streets, layer.crs, street_layer)
    around = layer.shapes.copy()
    around[uses == "streets"] = None
    if given is not None:  # what the layer itself calls a street is one, too
        given = np.concatenate([given, layer.shapes[(uses == "streets") & layer.usable]])
    measured = layer.shapes.copy()
    measured[~built] = None
    values = measure_shapes(measured, around, given, wish, reach, told)
    values["area_m2"] = np.where(layer.usable, shapely.area(layer.shapes), np.nan)
    ask(progress)
    told.stage("Measuring the ground", 0.8)
    ground, inside = _ground(site, site_layer, layer, progress)
    counted = built & inside
    figures = parcel_figures({k: v[counted] for k, v in values.items()}, ground)
    coarse = corner_deviation(largest_parts(layer.shapes)[counted], SURVEYED)
    return ParcelReport(
        parcels=_with_columns(parcels, values, built),
        figures=figures,
        histograms=[histogram(values[m.name][counted], m) for m in MEASURES],
        problems=layer.problems.to_frame(layer.source_crs),
        use_field=use,
        p_angle_surveyed=float(coarse.mean()) if len(coarse) else math.nan,
    )


def measure_shapes(
    shapes: npt.NDArray[Any],
    around: npt.NDArray[Any],
    streets: npt.NDArray[Any] | None,
    ideal: Ideal,
    reach: float = 15.0,
    progress: Progress | None = None,
) -> dict[str, Floats]:
    """Measure polygons in metres.

    Parameters
    ----------
    shapes
        Valid polygons, or None for what is not measured; shape (n,).
    around
        What shares edges with them, they themselves first; see `street_edges.street_lengths`.
    streets, reach
        See `street_edges.street_lengths`.
    ideal
        The ideal parcel.
    progress
        Told of stages and asked for cancellation, or None.

    Returns
    -------
    dict
        Arrays of shape (n,), NaN where nothing is measured: area_m2; frontage_m; depth_m, the
        extent away from the street of the smallest rectangle around (the front is the side that
        lies along a street by 40 % or, where both or none do, the shorter one); width_m, area
        / depth; p_angle, p_area, p_ideal, p_similarity; outline_m, the outer length; undesirable
        and access as 0 and 1.
    """
    told = progress or Silent()
    told.stage("Finding frontage", 0.1)
    own = ~shapely.is_missing(shapes)
    edges, along = street_lengths(shapes, around, streets, reach, told)
    ask(progress)
    told.stage("Measuring shapes", 0.6)
    parts = largest_parts(shapes)[own]
    front = np.bincount(edges.owner, weights=along, minlength=len(shapes))
    outline = np.bincount(edges.owner, weights=edges.length, minlength=len(shapes))
    area = shapely.area(shapes[own])
    depth = depths(parts, edges, along, np.cumsum(own) - 1)
    angle = corner_deviation(parts, ideal.tolerance)
    ratio = rectangle_ratio(parts)
    found = {
        "area_m2": area,
        "frontage_m": front[own],
        "depth_m": depth,
        "width_m": area / np.maximum(depth, 1e-9),
        "p_angle": angle,
        "p_area": ratio,
        "p_ideal": ideal_area_ratio(shapes[own], ideal.width, ideal.depth),
        "p_similarity": ideal_distance(parts, ideal.width, ideal.depth, ideal.tolerance, told),
        "outline_m": outline[own],
        "undesirable": undesirable(angle, ratio),
        "access": front[own] >= ACCESS,
    }
    ask(progress)
    whole = {name: np.full(len(shapes), np.nan) for name in found}
    for name, values in found.items():
        whole[name][own] = values
    return whole


def depths(parts: npt.NDArray[Any], edges: Edges, along: Floats, row: Any) -> Floats:
    """Extent of polygons away from their street, shape (n,), metres; see `measure_shapes`.

    Parameters
    ----------
    parts
        Polygons, shape (n,), metres.
    edges
        Their outer edges.
    along
        How much of each edge lies along a street, shape (e,), metres.
    row
        Index of the polygon of each owner of edges.
    """
    axis, sides = rectangles(parts)
    owner = row[edges.owner]
    way = edges.direction
    cosine = (way * axis[owner]).sum(axis=1) ** 2
    first = np.bincount(owner, weights=along * cosine, minlength=len(parts))
    second = np.bincount(owner, weights=along * (1 - cosine), minlength=len(parts))
    front = np.stack([first, second], axis=1)
    share = front / np.maximum(sides, 1e-9)
    both = (share >= FRONT).all(axis=1) | (front.sum(axis=1) <= 0)
    fronting = np.where(both, sides.argmin(axis=1), share.argmax(axis=1))
    return np.asarray(sides[np.arange(len(parts)), 1 - fronting])


def _ground(
    site: gpd.GeoDataFrame | None, name: str, layer: Any, progress: Progress | None
) -> tuple[float, Flags]:
    """Area of the ground in square metres, and which polygons lie in it."""
    if site is None:
        land = united(layer.shapes, progress)
        ground = shapely.union(land, closed(land, GAP))
        return float(ground.area), np.ones(len(layer.shapes), dtype=bool)
    whole = united(read_polygons(site, name, layer.crs, progress).shapes)
    shapely.prepare(whole)
    points = shapely.point_on_surface(layer.shapes)
    return float(whole.area), np.asarray(shapely.intersects(whole, points))


def _with_columns(
    frame: gpd.GeoDataFrame, values: dict[str, Floats], built: Flags
) -> gpd.GeoDataFrame:
    """Give a layer with the measures as columns; yes and no where they are that."""
    columns: dict[str, Any] = {k: v for k, v in values.items() if k != "outline_m"}
    for name in ("undesirable", "access"):
        flags = np.full(len(frame), None, dtype=object)
        flags[built] = values[name][built].astype(bool)
        columns[name] = flags
    # names in capitals, as files have them, are the same fields
    same = [c for c in frame.columns if str(c).lower() in columns and c != frame.geometry.name]
    made = gpd.GeoDataFrame(frame.drop(columns=same).assign(**columns))
    return made.set_geometry(gpd.GeoSeries(areas_of(made.geometry), made.index, crs=made.crs))
