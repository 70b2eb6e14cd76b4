"""The ground that traffic comes from: spread evenly over it, gathered along its streets."""

from __future__ import annotations

import math

import geopandas as gpd
import numpy as np
import shapely

from ..errors import InputError
from ..site.crs import layer_crs
from .speeds import numbers_of
from .types import BoolArray, FloatArray, IntArray, TrafficNetwork

#: Points that sample the ground.
_SAMPLES = 20_000
#: Most places: trips between all pairs of them are kept.
MOST_PLACES = 2000
#: Streets that run along the edge of the site this near or outside do not serve its inside: new
#: ones, and existing ones, which need not lie on the edge exactly (metres).
_RIM, _RIM_EXISTING = 5.0, 15.0


def ground_of(network: TrafficNetwork, site: shapely.Geometry | None) -> shapely.Geometry:
    """Give the ground: the site or, without one, the convex hull of the streets.

    Parameters
    ----------
    network
        The streets.
    site
        Polygons in the working CRS; None or empty without one.

    Raises
    ------
    InputError
        If the ground has no area.
    """
    given = site is not None and not site.is_empty
    found = site if given else shapely.convex_hull(shapely.multilinestrings(list(network.lines)))
    if found is None or not found.area > 0:
        what = "The site has no area." if given else "The streets lie on one line."
        raise InputError(what, "Choose a layer of sites.")
    return found


def inner_pieces(network: TrafficNetwork, ground: shapely.Geometry, *, is_site: bool) -> BoolArray:
    """Tell which pieces of streets serve the inside of the ground, shape (m,).

    With a site those that run inside it for at least half of their length, away from its edge.
    Without one the new streets where there are existing ones too, else all.

    Parameters
    ----------
    network
        The streets.
    ground
        See `ground_of`.
    is_site
        Whether it is a site.

    Raises
    ------
    InputError
        If no street touches the site.
    """
    if not is_site:
        return ~network.existing if not network.existing.all() else network.existing
    size = network.length
    inner = np.zeros(len(size), dtype=bool)
    for rim, use in ((_RIM, ~network.existing), (_RIM_EXISTING, network.existing)):
        core = ground.buffer(-rim)
        shapely.prepare(core)
        inside = shapely.length(shapely.intersection(network.lines[use], core))
        inner[use] = inside >= size[use] / 2
    if not inner.any():
        shapely.prepare(ground)
        inner = np.asarray(shapely.intersects(ground, network.lines))
    if not inner.any():
        raise InputError(
            "No street lies in the site.", "Choose the streets and the site of the same place."
        )
    return inner


def even_samples(ground: shapely.Geometry, count: int = _SAMPLES) -> FloatArray:
    """Give about so many points on a regular grid over the ground, shape (k, 2), at least one.

    The grid depends on the ground alone, so that all designs of a site have the same demand.

    Parameters
    ----------
    ground
        Polygons.
    count
        About how many.
    """
    step = math.sqrt(ground.area / count)
    west, south = ground.bounds[:2]
    found = []
    # Part by part: between parts that lie far apart there may be any number of points.
    for part in shapely.get_parts(ground):
        low_x, low_y, high_x, high_y = part.bounds
        x = _ticks(west + step / 2, step, low_x, high_x)
        y = _ticks(south + step / 2, step, low_y, high_y)
        points = np.array(np.meshgrid(x, y)).reshape(2, -1).T
        shapely.prepare(part)
        found.append(points[shapely.contains_xy(part, points[:, 0], points[:, 1])])
    if sum(map(len, found)):
        return np.asarray(np.concatenate(found), dtype=np.float64)
    return np.asarray(shapely.get_coordinates(ground.representative_point()), dtype=np.float64)


def _ticks(first: float, step: float, low: float, high: float) -> FloatArray:
    """Numbers first + k * step from low to high, k from 0."""
    begin = max(0, math.ceil((low - first) / step))
    return np.asarray(first + step * np.arange(begin, math.floor((high - first) / step) + 1))


def weighted_samples(
    frame: gpd.GeoDataFrame, network: TrafficNetwork, layer: str, field: str
) -> tuple[FloatArray, FloatArray]:
    """Give a point in each feature of a layer, such as buildings, and its weight.

    Parameters
    ----------
    frame
        Points or polygons in any CRS.
    network
        The streets, for the working CRS.
    layer
        Name of the layer, for messages.
    field
        Field with the weight, such as dwellings; empty for the area, or 1 for points.

    Returns
    -------
    array, array
        Shapes (k, 2) and (k,).

    Raises
    ------
    InputError
        If the layer has no CRS, the field is missing, a weight is negative or not finite, or none
        is greater than 0.
    """
    layer_crs(frame, layer)
    if field and field not in frame.columns:
        raise InputError(f"has no field '{field}'.", "Choose a field that it has.", layer=layer)
    usable = ~(frame.geometry.isna() | frame.geometry.is_empty)
    shapes = frame.geometry[usable].to_crs(network.crs)
    if field:
        own = numbers_of(frame, field)[usable.to_numpy()]
        weight = np.where(np.isnan(own), 0.0, own)
    else:
        area = shapes.area.to_numpy()
        weight = np.where(area > 0, area, 1.0) if not (area > 0).any() else area
    for wrong, text in ((weight < 0, "negative"), (np.isinf(weight), "not finite")):
        for row in frame.index[usable.to_numpy()][wrong]:
            msg = f"The weight is {text}."
            raise InputError(msg, "Mend it.", layer=layer, feature=str(row))
    if not weight.sum() > 0:
        raise InputError("has no weight greater than 0.", "Choose another field.", layer=layer)
    points = shapely.point_on_surface(shapes.to_numpy())
    return shapely.get_coordinates(points), weight


def gather(
    network: TrafficNetwork, use: BoolArray, points: FloatArray, weight: FloatArray, part_m: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Bring points to the nearest street, and gather them in parts of streets.

    Parameters
    ----------
    network
        The streets.
    use
        Shape (m,). Pieces that serve the points.
    points
        Shape (k, 2). Positions in the working CRS.
    weight
        Shape (k,). Not negative, with a sum greater than 0.
    part_m
        Each piece is parted into equal parts of at most so many metres.

    Returns
    -------
    array, array, array
        Piece, metres along it and weight of each place; the weights add up to 1.
    """
    pieces = np.flatnonzero(use)
    shapes = shapely.points(points)
    piece = pieces[shapely.STRtree(network.lines[pieces]).nearest(shapes)]
    along = shapely.line_locate_point(network.lines[piece], shapes)
    size = network.length[piece]
    parts = np.ceil(size / part_m)
    part = np.minimum(np.floor(along / size * parts), parts - 1).astype(np.int64)
    keys = np.column_stack([piece, part])[weight > 0]
    found, back = np.unique(keys, axis=0, return_inverse=True)
    some, back = weight[weight > 0], back.reshape(-1)
    total = np.bincount(back, some)
    place = np.bincount(back, some * along[weight > 0]) / total
    return found[:, 0], np.asarray(place), np.asarray(total / total.sum())
