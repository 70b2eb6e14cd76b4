"""Faces of the straight skeleton as parts of a mosaic, one per side of the block."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import Polygon

from .mosaic import Mosaic
from .rings import Face, Loop, pairs
from .wavefront import Floats, Skeleton, SkeletonError, face_rings, straight_skeleton

#: A side ends where the outline turns by more (degrees).
CORNER = 28.0
#: How far outlines may be simplified for the skeleton, until they have few vertices (metres).
COARSER = (0.3, 1.0, 3.0, 10.0)
MANY = 120
#: Sideways moves that part events at one place and time, tried in turn (metres).
SHAKES = (0.0, 0.0005, 0.003, 0.02)


class Side(NamedTuple):
    """A side of the block and the land that is nearer to it than to others.

    Attributes
    ----------
    face
        Number of its face in the mosaic.
    chain
        Vertices of the outline from its beginning to its end.
    street
        Whether it gives access.
    ring
        Number of the ring that it is on.
    """

    face: int
    chain: list[int]
    street: bool
    ring: int


def skeleton_faces(mosaic: Mosaic, depth: float, deep: float) -> tuple[list[Side], list[int]]:
    """Divide a mosaic of one face into the faces of its straight skeleton, joined by side.

    Parameters
    ----------
    mosaic
        Of one face, number 0.
    depth
        Width of the strips of land where the block is too deep, metres.
    deep
        Distance from the outline beyond which it is, metres.

    Returns
    -------
    sides
        In the order of the rings.
    cores
        Numbers of the faces that are further than `depth` from the outline, if it is too deep.

    Raises
    ------
    SkeletonError
        If no skeleton was found whose faces, one per edge, tile the block.
    """
    chains = outline_chains(mosaic)
    problem = SkeletonError("The outline has no skeleton.")
    for shake in SHAKES:
        try:
            skeleton = _run(mosaic, chains, shake, math.inf)
            if skeleton.reach > deep:
                skeleton = _run(mosaic, chains, shake, depth)
            faces, cores = _parts(mosaic, chains, skeleton)
        except SkeletonError as error:
            problem = error
            continue
        break
    else:
        raise problem
    numbers = mosaic.divide(0, [*faces, *cores])
    sides = []
    count = 0
    for ring, ring_chains in enumerate(chains):
        for first, last in _runs(mosaic, ring_chains):
            index = [(first + i) % len(ring_chains) for i in range(last - first)]
            chain = [ring_chains[index[0]][0]]
            for i in index:
                chain += ring_chains[i][1:]
            face = numbers[count + index[0]]
            if len(index) > 1:
                joined = mosaic.join([numbers[count + i] for i in index])
                if joined is None:
                    msg = "The land along one side of the block is in pieces."
                    raise SkeletonError(msg)
                face = joined
            sides.append(Side(face, chain, _is_street(mosaic, chain), ring))
        count += len(ring_chains)
    return sides, numbers[len(faces) :]


def outline_chains(mosaic: Mosaic) -> list[list[Loop]]:
    """Return the edges of the simplified outline, each as the chain of vertices it stands for.

    Parameters
    ----------
    mosaic
        Of one face, number 0.
    """
    rings = mosaic.refine(0)
    polygon = mosaic.polygons([0])[0]
    for tolerance in COARSER:
        simple = polygon.simplify(tolerance)
        kept = [set(map(tuple, ring.coords)) for ring in (simple.exterior, *simple.interiors)]
        if len(kept) < len(rings):
            msg = "A hole is too small for a skeleton."
            raise SkeletonError(msg)
        if sum(map(len, kept)) <= MANY:
            break
    else:
        msg = "The outline has too many vertices for a skeleton."
        raise SkeletonError(msg)
    found = []
    for ring, places in zip(rings, kept):
        at = [i for i, vertex in enumerate(ring) if mosaic.xy[vertex] in places]
        if len(at) < 3:
            msg = "A ring has no area."
            raise SkeletonError(msg)
        doubled = [*ring, *ring]
        found.append([doubled[a : b + 1] for a, b in zip(at, [*at[1:], at[0] + len(ring)])])
    return found


def _run(mosaic: Mosaic, chains: Sequence[Sequence[Loop]], shake: float, until: float) -> Skeleton:
    """Return the skeleton of the simplified outline, near the origin."""
    origin = mosaic.xy[0]
    rng = np.random.default_rng(0)
    rings: list[Floats] = []
    for ring in chains:
        xy = np.array([mosaic.xy[chain[0]] for chain in ring]) - origin
        rings.append(xy + rng.uniform(-shake, shake, xy.shape) if shake else xy)
    return straight_skeleton(rings, until)


def _parts(
    mosaic: Mosaic, chains: Sequence[Sequence[Loop]], skeleton: Skeleton
) -> tuple[list[Face], list[Face]]:
    """Return faces and cores as rings of vertices of the mosaic, checked to tile it."""
    after: list[int] = []
    flat: list[Loop] = []
    for ring in chains:
        start = len(after)
        after += [start + (i + 1) % len(ring) for i in range(len(ring))]
        flat += list(ring)
    rings = face_rings(skeleton, after)
    known = len(mosaic.xy)
    ox, oy = mosaic.xy[0]
    number = [chain[0] for chain in flat]
    number += [mosaic.vertex(x + ox, y + oy) for x, y in skeleton.nodes[len(flat) :]]
    faces: list[Face] = [
        [[*flat[edge][:-1], *(number[node] for node in ring[1:])]]
        for edge, ring in enumerate(rings)
    ]
    cores = mosaic.trace([(number[a], number[b]) for a, b, _ in skeleton.front])
    if not _tiles(mosaic, [*faces, *cores]) or (skeleton.front and not cores):
        del mosaic.xy[known:]
        msg = "The faces of the skeleton do not tile the block."
        raise SkeletonError(msg)
    return faces, cores


def _tiles(mosaic: Mosaic, faces: Sequence[Face]) -> bool:
    """Tell whether faces are simple, lie on the left of their edges, and add up to the block."""
    polygons = np.array(
        [
            Polygon([mosaic.xy[v] for v in face[0]], [[mosaic.xy[v] for v in h] for h in face[1:]])
            for face in faces
        ],
        dtype=object,
    )
    if not (
        shapely.is_valid(polygons).all()
        and shapely.is_ccw(shapely.get_exterior_ring(polygons)).all()
    ):
        return False
    whole = mosaic.area(0)
    return abs(float(shapely.area(polygons).sum()) - whole) <= 1e-7 * whole


def _runs(mosaic: Mosaic, chains: Sequence[Loop]) -> list[tuple[int, int]]:
    """Return where sides begin and end in a ring of edges; the last may run past its end."""
    xy = np.array([mosaic.xy[chain[0]] for chain in chains])
    way = np.roll(xy, -1, axis=0) - xy
    heading = np.arctan2(way[:, 1], way[:, 0])
    turn = np.degrees((heading - np.roll(heading, 1) + np.pi) % (2 * np.pi) - np.pi)
    street = np.array([_is_street(mosaic, chain) for chain in chains])
    corners = np.flatnonzero((np.abs(turn) > CORNER) | (street != np.roll(street, 1))).tolist()
    if len(corners) < 2:
        # round: a side must not run all around, so it is taken in quarters
        size = np.r_[0.0, np.cumsum(np.hypot(way[:, 0], way[:, 1]))]
        quarters = np.searchsorted(
            size, size[-1] * np.arange(4) / 4 + size[corners[0] if corners else 0]
        )
        corners = sorted(set((quarters % len(chains)).tolist()))
    return list(zip(corners, [*corners[1:], corners[0] + len(chains)]))


def _is_street(mosaic: Mosaic, chain: Loop) -> bool:
    edges = pairs(chain)[:-1]
    street = mosaic.length(edge for edge in edges if mosaic.is_front(edge))
    return street > 0.5 * mosaic.length(edges)
