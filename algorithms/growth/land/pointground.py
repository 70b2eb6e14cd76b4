"""Ground with nothing on it but points where growth begins."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS

from ...errors import InputError
from ...site.crs import layer_crs, working_crs
from ...site.repair import Problems
from ..grammar import Grammar
from ..types import Ground
from .arrivals import Streets, asked_for, unit
from .given import GivenNetwork
from .ground import RealGround
from .legs import Sight
from .starts import settle


def ground_of_points(
    points: gpd.GeoDataFrame,
    grammar: Grammar,
    *,
    direction: float | None = None,
    point_layer: str = "Starts",
) -> RealGround:
    """Make a ground without a domain and without streets of points.

    Parameters
    ----------
    points
        Where growth begins, in any CRS. The field direction, degrees clockwise from north, says in
        which direction the first street leaves.
    grammar
        Gives the state of the starts.
    direction
        Of points for which the layer gives none, degrees clockwise from north; None for north.
    point_layer
        Name of the layer, for messages.

    Raises
    ------
    InputError
        If the layer has no CRS, its coordinates do not fit it, or it has no point.
    """
    own = layer_crs(points, point_layer)
    bounds = shapely.bounds(points.geometry.to_numpy()).reshape(-1, 4)
    bounds = bounds[np.isfinite(bounds).all(axis=1)]
    if not len(bounds):
        raise InputError(
            "has no point from which streets could grow.",
            "Draw points, or leave the layer out: growth then begins at the origin.",
            layer=point_layer,
        )
    extent = np.r_[bounds[:, :2].min(axis=0), bounds[:, 2:].max(axis=0)]
    crs = working_crs(own, extent, point_layer)
    problems = Problems()
    nothing = np.zeros(0, dtype=np.int64)
    net = GivenNetwork(
        (), np.zeros((0, 2)), nothing.reshape(0, 2), nothing, np.zeros(0, dtype=bool)
    )
    places = asked_for(
        points, crs, Streets(net, None), Sight(None, net, 0.0), problems,
        layer=point_layer, snap_distance=0.0, direction=unit(direction or 0.0),
    )  # fmt: skip
    starts, _ = settle(places, net, grammar)
    source = CRS.from_user_input(points.crs)
    return RealGround(Ground(starts), crs, source, (), problems.to_frame(source))
