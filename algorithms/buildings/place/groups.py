"""Groups: buildings that border upon each other (RZ section 3.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..shape import frames, sizes
from ..types import BuildingType, Floats, Ints, Placements

#: Side walls nearer than this are one wall (metres).
WALL = 0.05
#: Façades that differ by less than this are parallel (degrees).
PARALLEL = 0.1


def groups_of(types: Sequence[BuildingType], placed: Placements) -> Ints:
    """Tell which buildings border upon each other.

    Two buildings do where their façades have one direction and their side walls coincide over
    more than half the smaller depth.

    Returns
    -------
    numpy.ndarray
        Number of the group of each building, from 0, in the order of their first building,
        shape (n,).
    """
    count = len(placed)
    pairs = bordering(types, placed)
    links = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    _, label = connected_components(links, directed=False)
    _, first, label = np.unique(label, return_index=True, return_inverse=True)
    order = np.empty(len(first), dtype=np.int64)
    order[np.argsort(first)] = np.arange(len(first))
    return np.asarray(order[label.ravel()], dtype=np.int64)


def bordering(types: Sequence[BuildingType], placed: Placements) -> Ints:
    """Return the pairs of buildings that share a side wall, shape (m, 2)."""
    none = np.zeros((0, 2), dtype=np.int64)
    if len(placed) < 2:
        return none
    size = sizes(types, placed)
    along, out = frames(placed)
    reach = float(size[:, :2].max()) * 1.5
    pairs = np.asarray(cKDTree(placed.xy).query_pairs(reach, output_type="ndarray"), np.int64)
    if not len(pairs):
        return none
    a, b = pairs.T
    turn = np.abs((placed.facing[a] - placed.facing[b] + 180.0) % 360.0 - 180.0)
    apart = placed.xy[b] - placed.xy[a]
    side = np.abs((apart * along[a]).sum(axis=1)) - (size[a, 0] + size[b, 0]) / 2
    shift = np.abs((apart * out[a]).sum(axis=1))
    shared = (size[a, 1] + size[b, 1]) / 2 - shift
    least = np.minimum(size[a, 1], size[b, 1])
    shared = np.minimum(shared, least)
    good = (turn < PARALLEL) & (np.abs(side) < WALL) & (shared > least / 2)
    return np.asarray(pairs[good], dtype=np.int64)


def group_lengths(types: Sequence[BuildingType], placed: Placements, group: Ints) -> Floats:
    """Return the length of each group along its façades, metres, shape (number of groups,)."""
    length = sizes(types, placed)[:, 0] if len(placed) else np.zeros(0)
    total = np.bincount(group, weights=length) if len(group) else np.zeros(0)
    return np.asarray(total, dtype=float)
