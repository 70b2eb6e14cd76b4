"""Junctions that pass a vertex of the edge that they slide along."""

from __future__ import annotations

import numpy as np

from .mesh import Region, Ring, StreetMesh


def next_along(mesh: StreetMesh, v: int, b: int) -> int | None:
    """Return the vertex after b on the edge that a junction v slides along.

    None if b is itself a junction, or if another kind of edge begins there.
    """
    beside = [w for w in mesh.neighbours(b) if w != v]
    if len(beside) != 1 or mesh.edge(b, beside[0]) != mesh.edge(v, b):
        return None
    return beside[0]


def pass_by(mesh: StreetMesh, v: int, b: int, far: float) -> bool:
    """Let a junction and the next vertex of the edge of the site (or of a street) swap places.

    The row a, v, b, c of vertices becomes a, b, v, c; b keeps its place, so the edge that they
    lie on stays as it is. The corner at b goes to the region on the other side of v.

    Parameters
    ----------
    mesh
        The mesh, which changes.
    v
        The junction.
    b
        The vertex that it passes.
    far
        How far from b the junction is then; at most half-way to the vertex after b; metres.

    Returns
    -------
    bool
        Whether it was done; not if there is no `next_along`, or if a region would have fewer
        than three vertices left.
    """
    c = next_along(mesh, v, b)
    edge = mesh.edge(v, b)
    along = [w for w in mesh.neighbours(v) if w != b and mesh.edge(w, v) == edge]
    if c is None or len(along) != 1 or along[0] == c:
        return False
    a = along[0]
    changes: list[tuple[Ring, Ring]] = []
    for p, q, r, s in ((a, v, b, c), (c, b, v, a)):
        # where no street is on this side of v, one region has all four in its ring
        if _region_with(mesh, (p, q, r, s)) is not None:
            changes.append(((p, q, r, s), (p, r, q, s)))
        elif q == v:
            changes += [((a, v), (a, b, v)), ((v, b, c), (v, c))]
        else:
            changes += [((c, b, v), (c, v)), ((v, a), (v, b, a))]
    if any(len(old) > len(new) and _size(mesh, old) < 4 for old, new in changes):
        return False
    _apply(mesh, changes)
    for one, other in ((a, v), (v, b), (b, c)):
        mesh.drop_edge(one, other)
    for one, other in ((a, b), (b, v), (v, c)):
        mesh.set_edge(one, other, edge)
    way = mesh.xy[c] - mesh.xy[b]
    length = float(np.hypot(*way))
    mesh.xy[v] = mesh.xy[b] + way * min(far / length, 0.5)
    return True


def _region_with(mesh: StreetMesh, row: Ring) -> tuple[int, int, int] | None:
    """Region, ring and place in it where a row of vertices stands, or None."""
    number = mesh.left_of(row[0], row[1])
    if number is None:
        return None
    for k, ring in enumerate(mesh.regions[number].rings):
        if row[0] not in ring:
            continue
        at = ring.index(row[0])
        if all(ring[(at + i) % len(ring)] == w for i, w in enumerate(row)):
            return number, k, at
    return None


def _size(mesh: StreetMesh, row: Ring) -> int:
    """Vertices of the ring in which a row stands; many where there is none."""
    found = _region_with(mesh, row)
    return 99 if found is None else len(mesh.regions[found[0]].rings[found[1]])


def _apply(mesh: StreetMesh, changes: list[tuple[Ring, Ring]]) -> None:
    """Replace rows in rings, all half-edges taken out before the new ones go in."""
    gone: list[tuple[int, int]] = []
    come: dict[tuple[int, int], int] = {}
    for old, new in changes:
        found = _region_with(mesh, old)
        if found is None:
            continue
        number, k, at = found
        rings = list(mesh.regions[number].rings)
        turned = (*rings[k][at:], *rings[k][:at])
        rings[k] = (*new, *turned[len(old) :])
        mesh.regions[number] = Region(tuple(rings))
        gone += zip(old[:-1], old[1:])
        come.update(dict.fromkeys(zip(new[:-1], new[1:]), number))
    mesh.move_halves(gone, come)
