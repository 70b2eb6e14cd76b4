"""Partitions of a mesh into patches, and the links between them (CND section 4.2 L1)."""

from __future__ import annotations

import math
from typing import Literal, Optional

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

from ..errors import InputError
from ..mesh.quadmesh import QuadMesh
from .growing import grow_patches
from .problem import BoolArray, FloatArray, IntArray, NetworkProblem
from .requirements.corridor import step_lengths
from .requirements.links import Link
from .structure import Structure, structure

#: What a tolerance is measured in; see `link_limit`.
Measure = Literal["hops", "metres", "share"]


def patches(
    mesh: QuadMesh, size: float, *, weight: Optional[FloatArray] = None, seed: int = 1
) -> IntArray:
    """Divide the faces of a mesh into connected, compact patches of about a wished size.

    Parameters
    ----------
    mesh
        The mesh with m faces.
    size
        Wished size of a patch: a number of faces, or a sum of weights.
    weight
        Shape (m,). Size of each face, for instance its area in square metres
        (`face_areas`) or the people who live there; None for 1 each. Not negative.
    seed
        Seed of the random choices.

    Returns
    -------
    IntArray
        Shape (m,). Patch of each face, numbered from 0 in the order of their first faces. A
        part of the mesh that is smaller than a patch is one patch.

    Raises
    ------
    InputError
        If the size is not greater than 0, or a weight is negative or not finite.
    """
    count = len(mesh.faces)
    weights = np.ones(count) if weight is None else np.asarray(weight, dtype=float)
    if not (size > 0 and math.isfinite(size)):
        raise InputError(f"Patches of size {size:g} are not possible.", "Give a size above 0.")
    if weights.shape != (count,) or not (np.isfinite(weights).all() and (weights >= 0).all()):
        raise InputError(
            f"The sizes of faces must be {count} numbers of at least 0, one for each face.",
            "Check the field that they come from.",
        )
    found = grow_patches(mesh, size, weights, np.random.default_rng(seed))
    return in_order(found)


def face_areas(mesh: QuadMesh) -> FloatArray:
    """Return the area of every face between its vertices; shape (m,), square metres."""
    x, y = np.moveaxis(mesh.vertices[mesh.faces], 2, 0)
    cross = x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y
    areas: FloatArray = np.abs(cross.sum(axis=1)) / 2
    return areas


def in_order(labels: IntArray) -> IntArray:
    """Return labels numbered anew from 0 in the order in which they appear first."""
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first, kind="stable")] = np.arange(len(first))
    ordered: IntArray = rank[inverse.reshape(-1)]
    return ordered


def broken_patches(mesh: QuadMesh, patch: IntArray) -> list[int]:
    """Return the patches whose faces do not hang together along edges, ascending.

    Parameters
    ----------
    mesh
        The mesh with m faces.
    patch
        Shape (m,). Patch of each face; faces with a negative number belong to none.
    """
    f, g = face_pairs(mesh)
    same = (patch[f] == patch[g]) & (patch[f] >= 0)
    shape = (len(patch), len(patch))
    matrix = csr_matrix((np.ones(int(same.sum())), (f[same], g[same])), shape=shape)
    _, label = connected_components(matrix, directed=False)
    parts = np.unique(np.column_stack([patch, label]), axis=0)
    numbers, counts = np.unique(parts[:, 0], return_counts=True)
    broken: list[int] = numbers[(counts > 1) & (numbers >= 0)].tolist()
    return broken


def face_pairs(mesh: QuadMesh) -> tuple[IntArray, IntArray]:
    """Return the two faces at each inner edge."""
    pairs = mesh.edge_faces[~mesh.boundary_edges]
    return pairs[:, 0], pairs[:, 1]


def adjacent_patches(mesh: QuadMesh, patch: IntArray) -> list[tuple[int, int]]:
    """List the pairs of patches that share an edge, each once, ascending.

    Parameters
    ----------
    mesh
        The mesh with m faces.
    patch
        Shape (m,). Patch of each face; faces with a negative number belong to none.
    """
    f, g = face_pairs(mesh)
    a, b = np.minimum(patch[f], patch[g]), np.maximum(patch[f], patch[g])
    shared = (a != b) & (a >= 0)
    return [(int(i), int(j)) for i, j in np.unique(np.column_stack([a, b])[shared], axis=0)]


def sample_vertices(mesh: QuadMesh, patch: IntArray, able: BoolArray, *, seed: int = 1) -> IntArray:
    """Draw a vertex in every patch at random (CND section 4.2 L1).

    Vertices that belong to no other patch come first; a patch without any such vertex gives
    one of those that it shares.

    Parameters
    ----------
    mesh
        The mesh with n vertices and m faces.
    patch
        Shape (m,). Patch of each face, from 0; faces with a negative number belong to none.
    able
        Shape (n,). Vertices where a street can be.
    seed
        Seed of the draw. The choice in one patch does not depend on the other patches.

    Returns
    -------
    IntArray
        Shape (number of patches,). The vertex of each patch, -1 where no street can be.
    """
    count = int(patch.max(initial=-1)) + 1
    inside = np.repeat(patch, 4) >= 0
    owners = np.column_stack([mesh.faces.ravel(), np.repeat(patch, 4)])[inside]
    owners = np.unique(owners, axis=0)
    own = np.bincount(owners[:, 0], minlength=len(mesh.vertices)) == 1
    drawn = np.full(count, -1, dtype=np.int64)
    for number in range(count):
        mine = owners[owners[:, 1] == number, 0]
        mine = mine[able[mine]]
        alone = mine[own[mine]]
        choice = alone if len(alone) else mine
        if len(choice):
            draw = np.random.default_rng((seed, number))
            drawn[number] = choice[int(draw.integers(len(choice)))]
    return drawn


def link_limit(shortest: float, tolerance: float, measure: Measure, edge_length: float) -> float:
    """Return the limit of a link, given the shortest way in the mesh.

    Parameters
    ----------
    shortest
        Length of the shortest way: hops where these are the measure, else mesh edge lengths.
    tolerance
        By how much the way may be longer: hops ("hops", as in the paper), metres ("metres"),
        or a share of the shortest way ("share", 0.2 for a fifth more).
    measure
        Which of these.
    edge_length
        The mesh's edge length, metres.

    Raises
    ------
    InputError
        If the tolerance is negative or not finite.
    """
    if not (tolerance >= 0 and math.isfinite(tolerance)):
        raise InputError(
            f"A tolerance of {tolerance:g} for links is not possible.", "Give 0 or more."
        )
    if measure == "share":
        return shortest * (1.0 + tolerance)
    return shortest + (tolerance if measure == "hops" else tolerance / edge_length)


def point_to_point(
    problem: NetworkProblem,
    patch: IntArray,
    *,
    tolerance: float = 2.0,
    measure: Measure = "hops",
    penalty: float = math.inf,
    seed: int = 1,
) -> list[Link]:
    """Ask for short ways between adjacent patches (CND section 4.2 L1, equations 7-8).

    One vertex is drawn in each patch (`sample_vertices`); for every two patches that share an
    edge their vertices are to be linked by a way that is longer than the shortest one in the
    mesh by no more than the tolerance.

    Parameters
    ----------
    problem
        The problem: its candidate and existing edges are where ways can run.
    patch
        Shape (m,). Patch of each face, from 0; faces with a negative number belong to none.
    tolerance, measure
        See `link_limit`. The paper's tolerance is 2 hops.
    penalty
        Cost of each link that is not there; infinite forbids.
    seed
        Seed of the draw.

    Returns
    -------
    list of Link
        In the order of the pairs of patches. Patches where no street can be have no links,
        and neither have two patches between which the mesh has no way at all.

    Raises
    ------
    InputError
        If the numbers of patches do not fit the mesh, or the tolerance is negative.
    """
    mesh = problem.mesh
    if patch.shape != (len(mesh.faces),):
        raise InputError(
            f"The partition has {len(patch)} faces, the mesh has {len(mesh.faces)}.",
            "Make the partition with the same mesh.",
        )
    index = structure(problem)
    drawn = sample_vertices(mesh, patch, streets_possible(index), seed=seed)
    hops = measure == "hops"
    ways = _ways(index, hops=hops)
    pairs = [(int(drawn[a]), int(drawn[b])) for a, b in adjacent_patches(mesh, patch)]
    pairs = [(a, b) for a, b in pairs if a >= 0 and b >= 0 and a != b]
    links = []
    for a in dict.fromkeys(a for a, _ in pairs):
        far = dijkstra(ways, indices=a)
        for b in (b for first, b in pairs if first == a):
            if math.isfinite(far[b]):
                limit = link_limit(float(far[b]), tolerance, measure, mesh.edge_length)
                links.append(Link(a, b, limit, hops=hops, penalty=penalty))
    return links


def streets_possible(index: Structure) -> BoolArray:
    """Return where a street is or can be; shape (n,)."""
    return np.array([s or bool(mine) for s, mine in zip(index.street, index.incident)], dtype=bool)


def through_route(
    problem: NetworkProblem,
    start: int,
    end: int,
    *,
    tolerance: float = 0.0,
    measure: Measure = "hops",
    penalty: float = math.inf,
) -> Link:
    """Ask for a route for through traffic: short and without branches (CND figure 6d).

    Parameters
    ----------
    problem
        The problem.
    start, end
        Vertices, mostly access points. The route is all new and touches existing streets at
        its ends only.
    tolerance, measure
        By how much it may be longer than the shortest such route; see `link_limit`. The
        paper asks for a shortest one.
    penalty
        Cost if there is no such route; infinite forbids.

    Returns
    -------
    Link

    Raises
    ------
    InputError
        If there is no way for such a route, or the two vertices are the same.
    """
    index = structure(problem)
    hops = measure == "hops"
    ways = _ways(index, hops=hops, inner=~np.array(index.street), ends=(start, end))
    far = float(dijkstra(ways, indices=start)[end])
    if not math.isfinite(far):
        raise InputError(
            f"No route for through traffic is possible from vertex {start} to vertex {end} of "
            "the mesh: new streets that meet no existing street on the way do not get there.",
            "Choose access points with open ground between them, or ask for the parts of the "
            "route before and after the existing street one by one.",
        )
    limit = link_limit(far, tolerance, measure, problem.mesh.edge_length)
    return Link(start, end, limit, hops=hops, private=True, penalty=penalty)


def _ways(
    index: Structure,
    *,
    hops: bool,
    inner: Optional[BoolArray] = None,
    ends: tuple[int, ...] = (),
) -> csr_matrix:
    """Return the graph of usable and existing edges, or of usable ones between inner vertices."""
    problem = index.problem
    able = np.array(index.usable)
    if inner is None:
        able |= problem.existing
    else:
        inner = inner.copy()
        inner[list(ends)] = True
        able &= inner[problem.mesh.edges].all(axis=1)
    u, v = problem.mesh.edges[able].T
    lengths = step_lengths(problem, hops=hops)[able]
    both = (np.concatenate([u, v]), np.concatenate([v, u]))
    size = len(problem.mesh.vertices)
    return csr_matrix((np.tile(lengths, 2), both), shape=(size, size))
