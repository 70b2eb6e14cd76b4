"""Where traffic enters and leaves: points that are given, or where streets meet the edge."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import pandas as pd
import shapely
from scipy.spatial import cKDTree

from ..errors import InputError
from ..site.crs import layer_crs
from ..site.repair import Problems
from .types import BoolArray, FloatArray, IntArray, TrafficNetwork

#: Ends of streets this near to the edge of the ground lead out of it, and nodes this near to the
#: edge of a hull lie on it (metres).
_NEAR_EDGE, _ON_HULL = 30.0, 5.0
#: What the field `is_sink` of junctions says of exits.
_YES = ("true", "1", "1.0", "yes", "t")
#: Stands between the names of gates that share a node.
_AND = " / "


@dataclass(frozen=True, eq=False)
class Gates:
    """Gates, g of them, at nodes of a network.

    Attributes
    ----------
    node
        Shape (g,). All different.
    name
        Shape (g,). Texts, not empty.
    """

    node: IntArray
    name: npt.NDArray[np.object_]


def gates_of_layer(
    frame: gpd.GeoDataFrame,
    network: TrafficNetwork,
    layer: str,
    reach_m: float,
    problems: Problems,
) -> Gates:
    """Bring the points of a layer to the nearest nodes of the streets.

    Of junctions with a field `is_sink` only the exits count. Points at one node are one gate.

    Parameters
    ----------
    frame
        Points in any CRS, such as access points; the field `name` names them.
    network
        The streets.
    layer
        Name of the layer, for messages.
    reach_m
        A point farther than this from all ends and junctions of streets is left out, metres.
    problems
        Told of points that are left out.

    Raises
    ------
    InputError
        If the layer has no CRS, no junction is an exit, or no point is near a street.
    """
    source = layer_crs(frame, layer)
    exits = _exits(frame)
    if len(frame) and not exits.any():
        raise InputError(
            "has no exit: is_sink is true nowhere.",
            "Choose the junctions of a design with exits, or leave the layer empty.",
            layer=layer,
        )
    usable = ~(frame.geometry.isna() | frame.geometry.is_empty).to_numpy() & exits
    rows = np.flatnonzero(usable)
    places = shapely.centroid(frame.geometry.iloc[rows].to_crs(network.crs).to_numpy())
    xy = shapely.get_coordinates(places)
    gap, node = cKDTree(network.nodes).query(xy) if len(xy) else (np.zeros(0), np.zeros(0, int))
    names: dict[int, list[str]] = {}
    for k, row in enumerate(rows.tolist()):
        if gap[k] > reach_m:
            text = f"is {gap[k]:.0f} m from the nearest end or junction of streets"
            what = "left out: move it, or let gates be farther from streets"
            shape = frame.geometry.iloc[row]
            problems.add(layer, frame.index[row], text, what, "warning", shape, source)
            continue
        own = frame["name"].iloc[row] if "name" in frame.columns else None
        names.setdefault(int(node[k]), []).append(name_of(own))
    if not names:
        raise InputError(
            f"has no point within {reach_m:g} m of an end or a junction of the streets.",
            "Choose the access points of this site, or leave the layer empty.",
            layer=layer,
        )
    texts = [_AND.join(dict.fromkeys(n for n in found if n)) for found in names.values()]
    return _named(np.array(list(names), dtype=np.int64), texts)


def gates_at_edge(
    network: TrafficNetwork, ground: shapely.Geometry, inner: BoolArray, *, is_site: bool
) -> Gates:
    """Find the nodes where the streets of the ground meet its edge.

    These are nodes where a street inside meets one that is not, and blind ends near the edge.

    Parameters
    ----------
    network
        The streets.
    ground, inner, is_site
        See `ground.inner_pieces`.

    Returns
    -------
    Gates
        Clockwise from the north around the middle of the ground; may be none.
    """
    count = len(network.nodes)
    within, without = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    within[network.ends[inner].ravel()] = True
    without[network.ends[~inner].ravel()] = True
    found = within & without
    edge = shapely.boundary(ground)
    shapely.prepare(edge)
    gap = shapely.distance(edge, shapely.points(network.nodes))
    degree = np.bincount(network.ends.ravel(), minlength=count)
    found |= within & (degree == 1) & ((gap <= _NEAR_EDGE) | _outside(ground, network.nodes))
    if not is_site:
        found |= within & (gap <= _ON_HULL)
    node = np.flatnonzero(found)
    turn = network.nodes[node] - np.array(ground.centroid.coords[0])
    node = node[np.argsort(np.arctan2(turn[:, 0], turn[:, 1]) % (2 * np.pi), kind="stable")]
    return _named(node, [""] * len(node))


def name_of(value: object) -> str:
    """Return what a field says as a name, empty where it says nothing.

    Whole numbers are written without decimals: tables turn 3 into 3.0 where a number is missing.

    Parameters
    ----------
    value
        Of any field.
    """
    if value is None or value is pd.NA or value != value:
        return ""
    whole = isinstance(value, float) and value.is_integer()
    return str(int(value) if whole and isinstance(value, float) else value).strip()


def names_within(name: str) -> list[str]:
    """Give all names that a gate goes by, in lower case: several points may share its node.

    Parameters
    ----------
    name
        Name of a gate.
    """
    return list(dict.fromkeys(part.lower() for part in (name, *name.split(_AND))))


def _outside(ground: shapely.Geometry, nodes: FloatArray) -> BoolArray:
    shapely.prepare(ground)
    return ~np.asarray(shapely.contains_xy(ground, nodes[:, 0], nodes[:, 1]))


def _exits(frame: gpd.GeoDataFrame) -> BoolArray:
    if "is_sink" not in frame.columns:
        return np.ones(len(frame), dtype=bool)
    return np.isin([str(value).lower() for value in frame["is_sink"]], _YES)


def _named(node: IntArray, names: list[str]) -> Gates:
    """Name gates without a name by their number, or by a later one where it is a name."""
    taken = {part for name in names for part in names_within(name)}
    spare = (str(k) for k in itertools.count(len(names) + 1) if str(k) not in taken)
    texts = [
        name or (str(k) if str(k) not in taken else next(spare)) for k, name in enumerate(names, 1)
    ]
    return Gates(node, np.array(texts, dtype=object))
