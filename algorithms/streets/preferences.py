"""Where streets are wanted more or less: density by area, prices of the ground, slopes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon

from ..errors import InputError
from ..mesh import QuadMesh
from ..network.problem import FloatArray
from ..site.types import Site

#: Half the width of ground that a line with a price stands for (mesh edge lengths).
BESIDE = 0.2
#: A grade at which a street costs twice as much at a slope weight of 1. Steeper local streets
#: are widely held to be uncomfortable on foot and with wheels.
STEEP = 0.06
#: Heights are read at this many places along each edge.
HEIGHTS = 5


@dataclass(frozen=True)
class Zone:
    """A part of the ground with a value of its own.

    Attributes
    ----------
    shape
        Polygon, or line with a strip of ground beside it, in the working CRS (metres).
    value
        The value there.
    feature
        Feature id, for messages.
    """

    shape: shapely.Geometry
    value: float
    feature: int | str = 0


@dataclass(frozen=True)
class Preferences:
    """What a planner prefers by place, in the working CRS (metres).

    Attributes
    ----------
    density
        Coverage ranges by area, metres; elsewhere that of the specification holds.
    prices
        Factors on the cost of streets: below 1 on existing rights-of-way, above 1 where the
        ground is dear. Where zones overlap their factors multiply.
    elevation
        Heights (metres) at positions of shape (k, 2); NaN where nothing is known.
    partition
        Patches between which ways within the site are short; none to make them.
    routes
        Lines from one way into the site to another, along which traffic goes through.
    density_layer, price_layer, partition_layer, route_layer
        Names of the layers, for messages.
    """

    density: Sequence[Zone] = ()
    prices: Sequence[Zone] = ()
    elevation: Callable[[FloatArray], FloatArray] | None = None
    partition: Sequence[tuple[Polygon, int | str]] = ()
    routes: Sequence[tuple[LineString, int | str]] = ()
    density_layer: str = "Density"
    price_layer: str = "Prices of the ground"
    partition_layer: str = "Patches"
    route_layer: str = "Through routes"

    def __post_init__(self) -> None:
        """Check the values; raise `InputError` that names layer and feature."""
        for zones, layer, what in (
            (self.density, self.density_layer, "coverage range"),
            (self.prices, self.price_layer, "price factor"),
        ):
            for zone in zones:
                if not 0 < zone.value < math.inf:
                    raise InputError(
                        f"The {what} is {zone.value:g}; it must be greater than 0.",
                        "Correct the value, or leave the field empty where nothing special holds.",
                        layer=layer,
                        feature=zone.feature,
                    )


def coverage_ranges(mesh: QuadMesh, usual: float, density: Sequence[Zone]) -> FloatArray:
    """Return the coverage range of every vertex.

    Parameters
    ----------
    mesh
        The candidate mesh.
    usual
        Range where no zone says otherwise, metres.
    density
        Ranges by area; where areas overlap, the smallest counts.

    Returns
    -------
    numpy.ndarray
        Shape (n,), metres.
    """
    points = shapely.points(mesh.vertices)
    ranges = np.full(len(points), np.inf)
    for zone in density:
        inside = shapely.intersects(zone.shape, points)
        ranges[inside] = np.minimum(ranges[inside], zone.value)
    return np.where(np.isinf(ranges), usual, ranges)


def edge_prices(mesh: QuadMesh, preferences: Preferences, slope_weight: float = 1.0) -> FloatArray:
    """Return the factor on the cost of every edge (CND: weights of edges).

    Parameters
    ----------
    mesh
        The candidate mesh.
    preferences
        Prices by place, and heights.
    slope_weight
        Weight of the squared grade, see `Specification.slope_weight`.

    Returns
    -------
    numpy.ndarray
        Shape (e,). 1 where nothing is said. An edge that lies in a zone with a share of its
        length has that share of the zone's price.
    """
    factor = np.ones(len(mesh.edges))
    lines = shapely.linestrings(mesh.vertices[mesh.edges])
    lengths = np.maximum(shapely.length(lines), 1e-9)
    for zone in preferences.prices:
        ground = zone.shape
        if not shapely.area(ground):
            ground = shapely.buffer(ground, BESIDE * mesh.edge_length)
        shapely.prepare(ground)
        near = np.flatnonzero(shapely.intersects(ground, lines))
        inside = shapely.length(shapely.intersection(lines[near], ground)) / lengths[near]
        factor[near] *= 1 + (zone.value - 1) * inside
    if preferences.elevation is not None and slope_weight > 0:
        grade = grades(mesh, preferences.elevation)
        factor *= 1 + slope_weight * (grade / STEEP) ** 2
    return factor


def grades(mesh: QuadMesh, elevation: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Return the mean grade of every edge, as a share: climbs and descents both count.

    Parameters
    ----------
    mesh
        The candidate mesh.
    elevation
        Heights (metres) at positions of shape (k, 2).

    Returns
    -------
    numpy.ndarray
        Shape (e,). 0 where no height is known.
    """
    share = np.linspace(0, 1, HEIGHTS)[None, :, None]
    a, b = mesh.vertices[mesh.edges[:, 0]], mesh.vertices[mesh.edges[:, 1]]
    places = a[:, None, :] * (1 - share) + b[:, None, :] * share
    heights = np.asarray(elevation(places.reshape(-1, 2)), dtype=float).reshape(-1, HEIGHTS)
    rise = np.abs(np.diff(heights, axis=1))
    run = np.maximum(np.hypot(*(b - a).T), 1e-9)[:, None] / (HEIGHTS - 1)
    steep = rise / run
    known = np.isfinite(steep)
    total = np.where(known, steep, 0.0).sum(axis=1)
    mean: FloatArray = total / np.maximum(known.sum(axis=1), 1)
    return mean


def check_elevation(site: Site, preferences: Preferences) -> None:
    """Refuse heights that say nothing about a site.

    Raises
    ------
    InputError
        If no height is known anywhere in the site.
    """
    if preferences.elevation is None:
        return
    west, south, east, north = site.polygon.bounds
    x, y = np.meshgrid(np.linspace(west, east, 30), np.linspace(south, north, 30))
    places = np.column_stack([x.ravel(), y.ravel()])
    inside = shapely.intersects_xy(site.polygon, places[:, 0], places[:, 1])
    places = places[inside] if inside.any() else places
    if not np.isfinite(np.asarray(preferences.elevation(places), dtype=float)).any():
        raise InputError(
            "The elevation raster has no height in this site.",
            "Give a raster that covers the site, with heights in metres.",
            layer=site.name,
            feature=site.feature,
        )
