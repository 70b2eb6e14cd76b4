"""The plots of many blocks as one planar mesh whose faces share their vertices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..types import Block, Plot

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Flags = npt.NDArray[np.bool_]
#: Vertices nearer than this to each other, or to an edge, are taken as touching (metres).
TOUCH = 1e-3


@dataclass(frozen=True)
class Mesh:
    """Plots as faces of vertices; everything outside a block is one more face of it.

    A *place* is a vertex in the ring of a face. Faces keep their left, holes and the face outside
    included, so that every edge is met twice, once in each direction.

    Attributes
    ----------
    xy
        Vertices, sorted by block, shape (n, 2), metres.
    local
        The same from the middle of their block, shape (n, 2), metres.
    origin
        The middle of each block, shape (b, 2), metres.
    block
        Block of each vertex, shape (n,).
    own
        Whether a vertex belongs to the outline of its block, and not only a cut ends there,
        shape (n,).
    vertex, face, ring
        Of each place, shape (p,); places of a ring follow each other. Faces are the plots, then
        what is outside of each block.
    after
        Place that follows in the ring, shape (p,).
    across
        Face on the other side of the edge that begins at the place, shape (p,).
    block_of_face
        Block of each face, shape (f,).
    sound
        Whether the plots of each block tile it; others have no places here. Shape (b,).
    noded
        Whether vertices had to be added or moved (by less than `TOUCH`) for that, shape (b,).
    """

    xy: Floats
    local: Floats
    origin: Floats
    block: Ints
    own: Flags
    vertex: Ints
    face: Ints
    ring: Ints
    after: Ints
    across: Ints
    block_of_face: Ints
    sound: Flags
    noded: Flags


@dataclass
class _Places:
    """Rings of all faces as they are collected, see `Mesh`."""

    vertex: Ints
    face: Ints
    ring: Ints

    def keep(self, which: Any) -> None:
        self.vertex, self.face, self.ring = self.vertex[which], self.face[which], self.ring[which]


def total(index: Ints, values: Any, count: int) -> Floats:
    """Add up values by index, shape (count,), in their order and so always to the same bit."""
    return np.asarray(np.bincount(index, values, minlength=count), dtype=np.float64)


def starts(ring: Ints) -> Flags:
    """Which of some numbers are not those before them, shape (p,)."""
    found = np.ones(len(ring), bool)
    found[1:] = ring[1:] != ring[:-1]
    return found


def following(ring: Ints) -> Ints:
    """Place that follows each place in its ring, the rings being contiguous, shape (p,)."""
    after = np.arange(1, len(ring) + 1)
    if len(ring):
        first = np.flatnonzero(starts(ring))
        after[first[1:] - 1] = first[:-1]
        after[-1] = first[-1]
    return after


def build_mesh(blocks: Sequence[Block], plots: Sequence[Sequence[Plot]]) -> Mesh:
    """Join the plots of all blocks to a mesh.

    Parameters
    ----------
    blocks
        The blocks.
    plots
        The plots of each block, which tile it.

    Returns
    -------
    Mesh
        Blocks whose plots do not tile them to 1 mm are not `sound` and have no places.
    """
    count = len(blocks)
    polygons = np.array(
        [b.polygon for b in blocks] + [p.polygon for group in plots for p in group], dtype=object
    )
    sizes = [len(group) for group in plots]
    block_of_plot = np.repeat(np.arange(count), sizes)
    # the outside comes first here, so that its vertices win where others are merged with them
    face = np.r_[np.arange(count) + len(block_of_plot), np.arange(len(block_of_plot))]
    block_of_face = np.r_[block_of_plot, np.arange(count)]
    bounds = shapely.bounds(polygons[:count]).reshape(-1, 4)
    origin = np.round((bounds[:, :2] + bounds[:, 2:]) / 2)
    xy, places = _collect(polygons, face, block_of_face, origin)
    block = block_of_face[places.face]
    vertices, own = _merge(xy, block, places, origin, len(block_of_face))
    noded = np.zeros(count, bool)
    moved = (vertices[places.vertex, 1:] != xy).any(axis=1) & (places.face < len(block_of_plot))
    noded[block[moved]] = True
    block_of_vertex, vertices = vertices[:, 0].astype(int), vertices[:, 1:]
    places.keep(places.vertex != places.vertex[following(places.ring)])
    faces = _insert(places, vertices, block_of_vertex)
    noded[block_of_plot[faces[faces < len(block_of_plot)]]] = True
    sound, across = _twins(places, block_of_face, len(vertices), count)
    keep = sound[block_of_face[places.face]]
    places.keep(keep)
    return Mesh(
        vertices,
        vertices - origin[block_of_vertex],
        origin,
        block_of_vertex,
        own,
        places.vertex,
        places.face,
        places.ring,
        following(places.ring),
        across[keep],
        block_of_face,
        sound,
        noded,
    )


def _collect(
    polygons: npt.NDArray[Any], face: Ints, block_of_face: Ints, origin: Floats
) -> tuple[Floats, _Places]:
    """Coordinates of all rings without the closing ones, faces on their left."""
    rings, polygon = shapely.get_rings(polygons, return_index=True)
    first = starts(polygon)
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    closing = np.r_[ring[1:] != ring[:-1], True] if len(ring) else np.zeros(0, bool)
    xy, ring = xy[~closing], ring[~closing]
    own_face = face[polygon[ring]]
    here = xy - origin[block_of_face[own_face]]
    there = here[following(ring)]
    twice = total(ring, here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0], len(rings))
    outside = polygon < len(origin)
    turn = (twice > 0) != (first ^ outside)
    begin = np.searchsorted(ring, np.arange(len(rings)))
    end = np.searchsorted(ring, np.arange(len(rings)), side="right")
    place = np.arange(len(ring))
    order = np.where(turn[ring], begin[ring] + end[ring] - 1 - place, place)
    return xy[order], _Places(place, own_face, ring)


def _merge(
    xy: Floats, block: Ints, places: _Places, origin: Floats, faces: int
) -> tuple[Floats, Flags]:
    """Give places that touch one vertex; return (block, x, y) of vertices, and which are own."""
    rows, inverse = np.unique(np.column_stack([block, xy]), axis=0, return_inverse=True)
    inverse = inverse.reshape(-1)
    outside = places.face >= faces - len(origin)
    own = np.zeros(len(rows), bool)
    own[inverse[outside]] = True
    owner = rows[:, 0].astype(int)
    # blocks are kept apart by a third coordinate
    apart = np.column_stack([rows[:, 1:] - origin[owner], rows[:, 0]])
    pairs = cKDTree(apart).query_pairs(TOUCH, output_type="ndarray")
    if not len(pairs):
        places.vertex = inverse
        return rows, own
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(rows), len(rows)))
    group = connected_components(graph, directed=False)[1]
    order = np.lexsort((np.arange(len(rows)), ~own, group))
    best = order[starts(group[order])]
    kept = np.unique(best)
    number = np.full(len(rows), -1)
    number[kept] = np.arange(len(kept))
    places.vertex = number[best[group]][inverse]
    return rows[kept], own[kept]


def _keys(places: _Places, count: int) -> tuple[Ints, Ints]:
    """Numbers of the directed edges at the places, and of their reverses."""
    tail, head = places.vertex, places.vertex[following(places.ring)]
    return np.asarray(tail * count + head), np.asarray(head * count + tail)


def _insert(places: _Places, xy: Floats, block: Ints) -> Ints:
    """Add vertices that lie on edges to their rings; return the faces of which."""
    key, back = _keys(places, len(xy))
    lone = np.flatnonzero(~np.isin(back, key))
    if not len(lone):
        return np.zeros(0, int)
    tail, head = places.vertex[lone], places.vertex[following(places.ring)[lone]]
    tree = shapely.STRtree(shapely.linestrings(np.stack([xy[tail], xy[head]], axis=1)))
    near = np.unique(np.r_[tail, head])
    lower, upper = (xy[near] - TOUCH).T, (xy[near] + TOUCH).T
    point, edge = tree.query(shapely.box(*lower, *upper))
    point = near[point]
    a, b = xy[tail[edge]], xy[head[edge]]
    along, off = b - a, xy[point] - a
    length = np.hypot(*along.T)
    at = (along * off).sum(axis=1) / length
    beside = np.abs(along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0]) / length
    hit = (
        (block[point] == block[tail[edge]])
        & (beside <= TOUCH)
        & (at > TOUCH / 2)
        & (at < length - TOUCH / 2)
        & (point != tail[edge])
        & (point != head[edge])
    )
    place = np.r_[np.arange(len(places.vertex)), lone[edge[hit]]]
    order = np.lexsort((np.r_[np.zeros(len(places.vertex)), at[hit]], place))
    faces = places.face[lone[edge[hit]]]
    vertex = np.r_[places.vertex, point[hit]]
    places.keep(place[order])
    places.vertex = vertex[order]
    return np.asarray(np.unique(faces))


def _twins(places: _Places, block_of_face: Ints, vertices: int, count: int) -> tuple[Flags, Ints]:
    """Tell which blocks are tiled, and the face across each edge."""
    key, back = _keys(places, vertices)
    order = np.argsort(key, kind="stable")
    at = np.minimum(np.searchsorted(key[order], back), max(len(key) - 1, 0))
    twin = order[at] if len(key) else at
    found = key[twin] == back
    double = np.zeros(len(key), bool)
    double[order[1:]] = key[order[1:]] == key[order[:-1]]
    across = np.where(found, places.face[twin], -1)
    # a face on both sides of an edge has a spike
    wrong = ~found | double | (across == places.face)
    sound = np.ones(count, bool)
    sound[block_of_face[places.face[wrong]]] = False
    return sound, across
