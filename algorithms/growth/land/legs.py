"""Streets as they leave a node: their directions, levels, and the free ground between them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely

from ..types import FloatArray, IntArray
from .given import GivenNetwork

#: Directions of streets are measured over this length (metres).
WALK = 15.0
#: Streets whose ends come this near to another street meet it, though the layer has a gap (metres).
GAP = 0.5
#: Nothing nearer than this counts as in sight of a place: the street that it lies on (metres).
CLEAR = 0.5


@dataclass(frozen=True)
class Leg:
    """A street as it leaves a node.

    Attributes
    ----------
    way
        Unit vector from the node.
    level
        Of the street.
    """

    way: tuple[float, float]
    level: int


class Legs:
    """The streets at the nodes of a network.

    Parameters
    ----------
    net
        The network.
    """

    def __init__(self, net: GivenNetwork) -> None:
        count = len(net.nodes)
        source = net.ends.T.ravel()
        order = np.argsort(source, kind="stable")
        self.first = np.searchsorted(source[order], np.arange(count + 1)).tolist()
        self.target = net.ends[:, ::-1].T.ravel()[order].tolist()
        self.piece = np.tile(np.arange(len(net.ends)), 2)[order].tolist()
        self.level = net.levels.tolist() if len(net.ends) else []
        self.xy = net.nodes.tolist()

    def at(self, node: int) -> list[Leg]:
        """Give the streets at a node.

        Parameters
        ----------
        node
            Index of the node.
        """
        return [self._leg(node, half) for half in range(self.first[node], self.first[node + 1])]

    def _leg(self, node: int, half: int) -> Leg:
        """Follow a street until it is long enough to have a direction, or ends."""
        x, y = self.xy[node]
        piece, here = self.piece[half], self.target[half]
        px, py = self.xy[here]
        while (dist := math.hypot(px - x, py - y)) < WALK:
            low, high = self.first[here], self.first[here + 1]
            onward = [h for h in range(low, high) if self.piece[h] != piece]
            if high - low != 2 or len(onward) != 1 or self.target[onward[0]] == node:
                break
            piece, here = self.piece[onward[0]], self.target[onward[0]]
            px, py = self.xy[here]
        # a street that turns back at once has the direction in which it leaves
        if dist < 1e-6:
            px, py = self.xy[self.target[half]]
            dist = math.hypot(px - x, py - y)
        return Leg(((px - x) / dist, (py - y) / dist), self.level[self.piece[half]])


def widest_gap(legs: list[Leg]) -> tuple[float, tuple[float, float]]:
    """Find the widest sector without a street at a node.

    Parameters
    ----------
    legs
        The streets there, at least one.

    Returns
    -------
    tuple
        Its angle, radians, and the unit vector in its middle.

    Examples
    --------
    >>> angle, way = widest_gap([Leg((1.0, 0.0), 3), Leg((-1.0, 0.0), 3), Leg((0.0, -1.0), 3)])
    >>> round(math.degrees(angle)), round(way[0], 9), round(way[1], 9)
    (180, 0.0, 1.0)
    """
    angles = sorted(math.atan2(leg.way[1], leg.way[0]) for leg in legs)
    gaps = [(b - a, a) for a, b in zip(angles, [*angles[1:], angles[0] + 2 * math.pi])]
    # of equal gaps the first counts, whatever the last bits say
    wide, start = max(gaps, key=lambda gap: (round(gap[0], 6), -gap[1]))
    middle = start + wide / 2
    return wide, (math.cos(middle), math.sin(middle))


def touches_another(net: GivenNetwork, nodes: IntArray) -> list[bool]:
    """Tell which loose ends come so near to another street that they are none.

    Parameters
    ----------
    net
        The network.
    nodes
        Shape (k,). Nodes with one piece.
    """
    own = np.full(len(net.nodes), -1, dtype=np.int64)
    own[net.ends.ravel()] = np.repeat(np.arange(len(net.ends)), 2)
    tree = shapely.STRtree(shapely.linestrings(net.nodes[net.ends]))
    row, piece = tree.query(
        shapely.points(net.nodes[nodes]), predicate="dwithin", distance=GAP
    )  # fmt: skip
    mine = net.ends[own[nodes[row]]]
    apart = (mine[:, :, None] != net.ends[piece][:, None, :]).all(axis=(1, 2))
    found = np.zeros(len(nodes), dtype=bool)
    found[row[apart]] = True
    return [bool(f) for f in found]


class Sight:
    """How far one sees over open ground.

    Parameters
    ----------
    domain
        Ground that streets may grow in, or None for everywhere.
    net
        The streets that are there.
    limit
        Nothing further away matters, metres.

    Attributes
    ----------
    walls
        Shape (k, 2, 2). What blocks the view: the pieces of the streets, then the domain's rings.
    pieces
        Number of the former.
    """

    def __init__(self, domain: shapely.Geometry | None, net: GivenNetwork, limit: float) -> None:
        self.domain, self.limit = domain, limit
        walls = net.nodes[net.ends]
        if domain is not None:
            shapely.prepare(domain)
            xy, ring = shapely.get_coordinates(
                shapely.get_rings(shapely.get_parts(domain)), return_index=True
            )
            inner = ring[:-1] == ring[1:]
            rings = np.stack([xy[:-1][inner], xy[1:][inner]], axis=1)
            walls = np.concatenate([walls, rings])
        self.walls, self.pieces = walls, len(net.ends)
        self.tree = shapely.STRtree(shapely.linestrings(walls)) if len(walls) else None

    def pieces_near(self, area: shapely.Geometry, reach: float) -> IntArray:
        """Find the pieces of streets that come near an area, in their order.

        Parameters
        ----------
        area
            Any geometry.
        reach
            How near, metres.
        """
        if self.tree is None:
            return np.zeros(0, dtype=np.int64)
        found = np.unique(self.tree.query(area, predicate="dwithin", distance=reach))
        return np.asarray(found[found < self.pieces], dtype=np.int64)

    def from_places(self, xy: FloatArray, way: FloatArray) -> FloatArray:
        """Measure how far it is to the edge of the domain or the next street.

        Parameters
        ----------
        xy, way
            Shape (k, 2). Places and unit vectors.

        Returns
        -------
        ndarray
            Shape (k,). Metres up to the limit; 0 where one looks out of the domain.
        """
        xy, way = xy.reshape(-1, 2), way.reshape(-1, 2)
        start = xy + CLEAR * way
        far = np.full(len(xy), self.limit)
        if self.domain is not None:
            far[~shapely.contains_xy(self.domain, start[:, 0], start[:, 1])] = 0.0
        if self.tree is None or not len(xy):
            return far
        stretch = self.limit * way
        rays = shapely.linestrings(np.stack([start, start + stretch], axis=1))
        ray, wall = self.tree.query(rays, predicate="intersects")
        a, b = self.walls[wall, 0], self.walls[wall, 1]
        side = b - a
        area = way[ray, 0] * side[:, 1] - way[ray, 1] * side[:, 0]
        gap = a - start[ray]
        with np.errstate(divide="ignore", invalid="ignore"):
            at = (gap[:, 0] * side[:, 1] - gap[:, 1] * side[:, 0]) / area
        # a street that runs along the way
        at = np.where(np.isfinite(at), at, 0.0)
        np.minimum.at(far, ray, np.clip(at, 0.0, self.limit))
        return far
