"""Small streets and demands made by hand, and the simulator where it is installed."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from platwright.errors import MissingDependencyError
from platwright.traffic.sumo import find_sumo
from platwright.traffic.types import INTERIOR_INTERIOR, Demand, Places, TrafficNetwork
from pyproj import CRS

#: Somewhere in Tallinn, so that nothing works only near zero.
ORIGIN = np.array([541_000.0, 6_588_000.0])


@pytest.fixture(scope="session")
def sumo():
    """Where SUMO is; tests that ask for it are skipped, visibly, where it is missing."""
    try:
        return find_sumo()
    except MissingDependencyError:
        pytest.skip("Eclipse SUMO absent: pip install eclipse-sumo")


def _streets(nodes, pieces, *, level=3, speed=10.0, direction=0, lanes=1, lines=None):
    nodes = np.asarray(nodes, dtype=np.float64) + ORIGIN
    ends = np.asarray(pieces, dtype=np.int64).reshape(-1, 2)
    size = len(ends)
    shapes = np.empty(size, dtype=np.object_)
    for number, pair in enumerate(ends):
        given = None if lines is None else lines.get(number)
        shapes[number] = (
            shapely.LineString(nodes[pair])
            if given is None
            else shapely.LineString(np.asarray(given, dtype=np.float64) + ORIGIN)
        )
    return TrafficNetwork(
        nodes=nodes,
        ends=ends,
        lines=shapes,
        feature=np.arange(size) + 100,
        direction=np.broadcast_to(np.asarray(direction), size).copy(),
        speed=np.broadcast_to(np.asarray(speed, dtype=np.float64), size).copy(),
        capacity=np.full(size, 800.0),
        lanes=np.broadcast_to(np.asarray(lanes), size).copy(),
        level=np.broadcast_to(np.asarray(level), size).copy(),
        existing=np.zeros(size, dtype=bool),
        crs=CRS.from_epsg(3301),
    )


@pytest.fixture(scope="session")
def make_streets():
    """Build a network of nodes (x, y) and pieces (node, node)."""
    return _streets


def _places(interior=(), gates=()):
    count = len(interior)
    size = count + len(gates)
    return Places(
        piece=np.array([piece for piece, _ in interior] + [0] * len(gates), dtype=np.int64),
        along=np.array([along for _, along in interior] + [0.0] * len(gates)),
        node=np.array([-1] * count + list(gates), dtype=np.int64),
        weight=np.array([1.0 / max(count, 1)] * count + [0.0] * len(gates)),
        name=np.array([""] * size, dtype=np.object_),
    )


@pytest.fixture(scope="session")
def make_demand():
    """Build a demand of places (piece, metres) and gates (node), and of trips by pair."""

    def make(trips, interior=(), gates=(), kind=INTERIOR_INTERIOR):
        places = _places(interior, gates)
        matrix = np.zeros((len(places.piece),) * 2)
        for (origin, destination), number in trips.items():
            matrix[origin, destination] = number
        return Demand(places, {kind: matrix})

    return make


@pytest.fixture(scope="session")
def make_grid():
    """Build a grid of n by n nodes, 100 m apart, its rim level 1; with everyone to everyone."""

    def make(n, rate, lanes=1):
        nodes = [(100.0 * i, 100.0 * j) for i in range(n) for j in range(n)]
        pieces, level = [], []
        for i in range(n):
            for j in range(n):
                for a, b, on_rim in ((i + 1, j, j in (0, n - 1)), (i, j + 1, i in (0, n - 1))):
                    if a < n and b < n:
                        pieces.append((i * n + j, a * n + b))
                        level.append(1 if on_rim else 3)
        network = _streets(nodes, pieces, level=level, lanes=lanes)
        inside = np.flatnonzero(network.level > 1)
        places = _places([(int(piece), 50.0) for piece in inside])
        trips = np.full((len(inside),) * 2, rate / (len(inside) * (len(inside) - 1)))
        np.fill_diagonal(trips, 0.0)
        return network, Demand(places, {INTERIOR_INTERIOR: trips})

    return make
