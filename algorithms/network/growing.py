"""Balanced, compact, connected patches of mesh faces: k-means with weights, then repair."""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Sequence

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..mesh.quadmesh import QuadMesh
from .problem import FloatArray, IntArray

#: Rounds of k-means.
ROUNDS = 40
#: Beginnings that are tried, fewer where there are many faces; the best partition is taken.
TRIES = 6
#: Faces of all tries together.
MOST_FACES = 30_000
#: Sweeps of single faces from larger to smaller patches.
SWEEPS = 12

Neighbours = list[list[int]]


def grow_patches(
    mesh: QuadMesh, size: float, weight: FloatArray, rng: np.random.Generator
) -> IntArray:
    """Divide the faces of a mesh into connected patches of about a size.

    Parameters
    ----------
    mesh
        The mesh with m faces.
    size
        Wished sum of weights of a patch.
    weight
        Shape (m,). Not negative.
    rng
        Source of the random choices.

    Returns
    -------
    IntArray
        Shape (m,). Patch of each face.
    """
    count = len(mesh.faces)
    f, g = mesh.edge_faces[~mesh.boundary_edges].T
    matrix = csr_matrix((np.ones(len(f)), (f, g)), shape=(count, count))
    _, part = connected_components(matrix, directed=False)
    around: Neighbours = [[] for _ in range(count)]
    for a, b in zip(f.tolist(), g.tolist()):
        around[a].append(b)
        around[b].append(a)
    centres = mesh.vertices[mesh.faces].mean(axis=1)
    labels = np.zeros(count, dtype=np.int64)
    used = 0
    for number in range(int(part.max()) + 1):
        own = np.flatnonzero(part == number)
        k = min(len(own), max(1, round(float(weight[own].sum()) / size)))
        labels[own] = used + _divide(own, k, centres, weight, around, rng)
        used += k
    return labels


def _divide(
    own: IntArray,
    k: int,
    centres: FloatArray,
    weight: FloatArray,
    around: Neighbours,
    rng: np.random.Generator,
) -> IntArray:
    """Divide connected faces into k patches; return the patch of each."""
    if k == 1:
        return np.zeros(len(own), dtype=np.int64)
    place = {face: i for i, face in enumerate(own.tolist())}
    near = [[place[g] for g in around[face]] for face in own.tolist()]
    points, sizes = centres[own], weight[own]
    best: IntArray = np.zeros(len(own), dtype=np.int64)
    least = np.inf
    for _ in range(max(1, min(TRIES, MOST_FACES // len(own)))):
        labels = _means(points, sizes, k, rng)
        labels = _connected(labels, sizes, near, k)
        _balance(labels, sizes, near)
        rated = _rating(labels, sizes, near, k)
        if rated < least:
            best, least = labels, rated
    return best


def _means(points: FloatArray, sizes: FloatArray, k: int, rng: np.random.Generator) -> IntArray:
    """Group points by k-means in which small groups get a handicap (a power diagram)."""
    share = float(sizes.sum()) / k
    spread = float(np.ptp(points, axis=0).prod()) / k
    seats = points[_apart(points, k, rng)].copy()
    credit = np.zeros(k)
    labels = np.zeros(len(points), dtype=np.int64)
    for turn in range(ROUNDS):
        # |p - s|^2 - credit is a distance in one dimension more
        lift = np.sqrt(credit.max() - credit)
        tree = cKDTree(np.column_stack([seats, lift]))
        _, nearest = tree.query(np.column_stack([points, np.zeros(len(points))]))
        labels = nearest.astype(np.int64)
        held = np.bincount(labels, weights=sizes, minlength=k)
        count = np.bincount(labels, minlength=k)
        for axis in (0, 1):
            total = np.bincount(labels, weights=points[:, axis], minlength=k)
            seats[:, axis] = np.where(count > 0, total / np.maximum(count, 1), seats[:, axis])
        pace = 0.5 * spread * (1.0 - turn / ROUNDS)
        credit += pace * np.clip((share - held) / max(share, 1e-12), -1.0, 1.0)
    return labels


def _apart(points: FloatArray, k: int, rng: np.random.Generator) -> list[int]:
    """Choose k points, each with a probability that grows with the square of its distance."""
    chosen = [int(rng.integers(len(points)))]
    near = ((points - points[chosen[0]]) ** 2).sum(axis=1)
    while len(chosen) < k:
        total = near.sum()
        chance = near / total if total > 0 else None
        chosen.append(int(rng.choice(len(points), p=chance)))
        near = np.minimum(near, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
    return chosen


def _connected(labels: IntArray, sizes: FloatArray, near: Neighbours, k: int) -> IntArray:
    """Keep the largest connected part of each group; the rest goes to neighbours.

    Groups without any face are begun in the middle of the largest.
    """
    found = np.full(len(labels), -1, dtype=np.int64)
    held = np.zeros(k)
    begun: set[int] = set()
    for part in sorted(_parts(labels, near), key=lambda p: (-sizes[p].sum(), -len(p), p[0])):
        group = int(labels[part[0]])
        if group not in begun:
            begun.add(group)
            found[part] = group
            held[group] = sizes[part].sum()
    for group in sorted(set(range(k)) - begun):
        _begin(found, group, near)
    heap = [
        (held[found[f]], f, int(found[f]))
        for f in range(len(labels))
        if any(found[g] < 0 for g in near[f])
    ]
    heapq.heapify(heap)
    while heap:
        _, f, group = heapq.heappop(heap)
        for g in near[f]:
            if found[g] < 0 <= found[f]:
                found[g] = group
                held[group] += sizes[g]
                heapq.heappush(heap, (held[group], g, group))
    return found


def _parts(labels: IntArray, near: Neighbours) -> list[IntArray]:
    """List the connected parts of all groups."""
    rows = [f for f, mine in enumerate(near) for g in mine if labels[f] == labels[g]]
    columns = [g for f, mine in enumerate(near) for g in mine if labels[f] == labels[g]]
    shape = (len(labels), len(labels))
    matrix = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=shape)
    count, part = connected_components(matrix, directed=False)
    order = np.argsort(part, kind="stable")
    return np.split(order, np.searchsorted(part[order], np.arange(1, count)))


def _begin(found: IntArray, group: int, near: Neighbours) -> None:
    """Take a face from the largest group that can spare one."""
    counts = np.bincount(found[found >= 0])
    for largest in np.argsort(-counts, kind="stable").tolist():
        for f in np.flatnonzero(found == largest).tolist():
            if counts[largest] > 1 and _spares(found.tolist(), f, near):
                found[f] = group
                return


def _spares(labels: Sequence[int], face: int, near: Neighbours) -> bool:
    """Tell whether a group hangs together without one of its faces."""
    group = labels[face]
    beside = [g for g in near[face] if labels[g] == group]
    if len(beside) <= 1:
        return bool(beside)
    missing = set(beside[1:])
    seen = {face, beside[0]}
    queue = deque([beside[0]])
    while queue and missing:
        for g in near[queue.popleft()]:
            if labels[g] == group and g not in seen:
                seen.add(g)
                missing.discard(g)
                queue.append(g)
    return not missing


def _balance(labels: IntArray, sizes: FloatArray, near: Neighbours) -> None:
    """Move faces on borders from larger to smaller patches, in place."""
    held = np.bincount(labels, weights=sizes).tolist()
    size, group = sizes.tolist(), labels.tolist()
    border = [f for f, mine in enumerate(near) if any(group[g] != group[f] for g in mine)]
    for _ in range(SWEEPS):
        moved: list[int] = []
        for f in border:
            own = group[f]
            beside = [group[g] for g in near[f]]
            others = sorted({*beside} - {own})
            if not others:
                continue
            # long borders first, so that patches stay compact
            to = min(others, key=lambda q: held[q] - size[f] * beside.count(q))
            gain = held[own] - held[to] - size[f]
            ragged = beside.count(own) - beside.count(to)
            if gain > 0.5 * size[f] * max(0, ragged) and _spares(group, f, near):
                group[f] = to
                held[own] -= size[f]
                held[to] += size[f]
                moved.append(f)
        if not moved:
            break
        border = sorted({*border, *(g for f in moved for g in near[f])})
    labels[:] = group


def _rating(labels: IntArray, sizes: FloatArray, near: Neighbours, k: int) -> float:
    """Rate a partition: unequal sizes and long borders count against it."""
    held = np.bincount(labels, weights=sizes, minlength=k)
    mean = max(float(held.mean()), 1e-12)
    border = sum(1 for f, mine in enumerate(near) for g in mine if labels[f] < labels[g])
    # squares of equal size have about this border
    ideal = 2.0 * max(1.0, np.sqrt(k) - 1.0) * np.sqrt(len(labels))
    return float(np.abs(held / mean - 1.0).max() + border / ideal)
