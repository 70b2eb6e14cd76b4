"""A template made ready for warping: repeated, as a mesh, with the fixed matrices of its fits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import csr_matrix

from ..templates.mesh import (
    MERGE,
    Topology,
    TopologyError,
    ahead,
    boundary,
    corner_signs,
    signed_area,
    topology,
    turns,
)
from ..templates.repeat import SizedFace, repeated
from ..templates.types import FURNITURE, LAND, SHAPE_MEANINGS, Template
from .alignment import smoother
from .centres import centre_ties
from .meanvalue import mean_value_coordinates
from .registration import KINDS

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Points = npt.NDArray[np.complex128]
#: Weight of a vertex on a straight edge of a face, as part of that of a corner; vertices that turn
#: less than corners do have weights between.
PASSING = 0.2
FULL = 45.0
#: Length of the pieces of the outline that the initial map goes by (metres), most pieces an edge.
PIECE, PIECES = 8.0, 8
#: Reach of the moving least squares, as part of the length of the curve.
REACH = 0.2
#: Labels of faces that give access.
ACCESS = ("street", "lane")
ANY, STREET, NO_STREET = range(3)


@dataclass(frozen=True)
class Form:
    """A template with its numbers of repeats.

    Attributes
    ----------
    template
        Name of the template.
    points
        Vertices as drawn, shape (v,).
    labels
        Of the faces, length f.
    vertex, face
        Vertex and face of each corner of a face, shape (i,), one face after the other.
    local
        Ideal place of each of them in the frame of its face, shape (i,).
    sums
        Times the vertices: the sums p, s and the centre of each face, shape (3 f, v), complex.
    means
        Times the corners of faces: the weighted means at the vertices, shape (v, i), complex.
    allowed
        Columns kind, four bounds of scales, square, twist (complex), shape (f, 7).
    counted
        Which faces count in the energy, shape (f,).
    front
        Width of each face as wished, shape (f,), metres.
    size
        Area of each face as wished for, shape (f,), square metres.
    ring, side, t
        Vertices of the outline from the first corner on, their side and place on it from 0 to 1,
        shape (r,).
    signs, lengths
        Of the corners, and the lengths of the sides, shape (k,).
    meaning
        ANY, STREET or NO_STREET, of each edge of the outline, shape (r,).
    sample_side, sample_t, inside, weights
        Initial map: samples of the outline, vertices inside, weights of shape (inside, samples).
    sets
        Alignments: kind and vertices, and the matrix for smooth curves.
    pieces, piece_of_edge, place_of_edge
        Rings of what is handed out (street faces joined, repeats of regions that other templates
        fill as well), and for each edge of the outline its
        ring and its place there.
    piece_face
        A face of each piece.
    access
        Which pieces touch street space of the template, shape (pieces,).
    centres
        Centre lines: for each point weights of vertices.
    """

    template: str
    points: Points
    labels: tuple[str, ...]
    vertex: Ints
    face: Ints
    local: Points
    sums: csr_matrix
    means: csr_matrix
    allowed: npt.NDArray[np.complex128]
    counted: npt.NDArray[np.bool_]
    front: Floats
    size: Floats
    ring: Ints
    side: Ints
    t: Floats
    signs: Ints
    lengths: Floats
    meaning: Ints
    sample_side: Ints
    sample_t: Floats
    inside: Ints
    weights: Floats
    sets: tuple[tuple[str, Ints, Any], ...]
    pieces: tuple[Ints, ...]
    piece_face: Ints
    piece_of_edge: Ints
    place_of_edge: Ints
    access: npt.NDArray[np.bool_]
    centres: tuple[tuple[tuple[Ints, Floats], ...], ...]

    @property
    def area(self) -> float:
        """Area as drawn, square metres."""
        return signed_area(self.points[self.ring])


def form(template: Template, counts: Mapping[str, int]) -> Form:
    """Make a template ready.

    Parameters
    ----------
    template
        As `templates.scaled` gives it.
    counts
        How often each of its repeats is repeated.
    """
    drawn = repeated(template, counts)
    mesh = topology([face.polygon for face in drawn.faces])
    marks = [(complex(c.point.x, c.point.y), c.kind) for c in drawn.corners]
    signs = corner_signs(mesh.points[mesh.outline], marks)
    first = int(np.flatnonzero(signs)[0]) if signs.any() else 0
    mesh = replace(
        mesh,
        outline=np.roll(mesh.outline, -first),
        owner=np.roll(mesh.owner, -first),
        place=np.roll(mesh.place, -first),
    )
    signs = np.roll(signs, -first)
    side, t, lengths = _sides(mesh.points[mesh.outline], signs)
    vertex = np.concatenate(mesh.rings)
    face = np.repeat(np.arange(len(mesh.rings)), [len(ring) for ring in mesh.rings])
    local, weights, front = _ideal(drawn, mesh)
    labels = tuple(f.label for f in drawn.faces)
    inside = np.setdiff1d(np.arange(len(mesh.points)), mesh.outline)
    samples = _samples(mesh, side, t)
    matrix = mean_value_coordinates(samples[2], mesh.points[inside])
    pieces = _pieces(drawn, mesh)
    return Form(
        template=template.name, points=mesh.points, labels=labels, vertex=vertex, face=face,
        local=local, sums=_sums(vertex, face, local, weights, len(mesh.points)),
        means=_means(drawn, vertex, face, weights, len(mesh.points)),
        allowed=_allowed(drawn, face, local, weights), counted=_counted(labels), front=front,
        size=_sizes(face, local),
        ring=mesh.outline, side=side, t=t, signs=signs[signs != 0], lengths=lengths,
        meaning=_meanings(drawn, mesh), sample_side=samples[0], sample_t=samples[1],
        inside=inside, weights=matrix, sets=_sets(drawn, mesh), **pieces,
        centres=centre_ties(drawn, mesh),
    )  # fmt: skip


def _sides(z: Points, signs: Ints) -> tuple[Ints, Floats, Floats]:
    """Give side and place of the vertices of the outline, and the lengths of the sides."""
    step = np.abs(np.roll(z, -1) - z)
    at = np.concatenate([[0.0], np.cumsum(step)])
    corners = np.flatnonzero(signs) if signs.any() else np.zeros(1, np.int64)
    marks = np.append(at[corners], at[-1])
    side = np.searchsorted(corners, np.arange(len(z)), side="right") - 1
    lengths = np.diff(marks)
    return side, (at[:-1] - marks[side]) / lengths[side], lengths


def _ideal(drawn: Template, mesh: Topology) -> tuple[Points, Floats, Floats]:
    """Give the ideal shape of each face in its frame, weights of its vertices, its width."""
    local, weights, front = [], [], []
    for face, ring in zip(drawn.faces, mesh.rings):
        z = mesh.points[ring]
        own = z * np.exp(-1j * np.radians(face.axis))
        wish = face.wish if isinstance(face, SizedFace) else (1.0, 1.0)
        own = own.real * wish[0] + 1j * own.imag * wish[1]
        weight = np.clip(np.abs(turns(z)) / FULL, PASSING, 1.0)
        local.append(own - (weight * own).sum() / weight.sum())
        weights.append(weight)
        front.append(float(np.ptp(own.real)))
    return np.concatenate(local), np.concatenate(weights), np.asarray(front)


def _sizes(face: Ints, local: Points) -> Floats:
    """Measure the ideal faces."""
    starts = np.searchsorted(face, np.arange(face[-1] + 2))
    return np.array([signed_area(local[a:b]) for a, b in zip(starts[:-1], starts[1:])])


def _sums(vertex: Ints, face: Ints, local: Points, weights: Floats, count: int) -> csr_matrix:
    """Build the matrix that gives what registration needs."""
    total = np.bincount(face, weights)
    rows = np.concatenate([3 * face, 3 * face + 1, 3 * face + 2])
    values = np.concatenate([weights * local.conj(), weights * local, weights / total[face] + 0j])
    shape = (3 * len(total), count)
    return csr_matrix((values, (rows, np.tile(vertex, 3))), shape)


def _means(drawn: Template, vertex: Ints, face: Ints, weights: Floats, count: int) -> csr_matrix:
    """Build the matrix of the weighted means at the vertices, weights 1 / tolerance."""
    firm = weights / np.array([f.tolerance for f in drawn.faces])[face]
    total = np.bincount(vertex, firm, minlength=count)
    values = firm / total[vertex] + 0j
    return csr_matrix((values, (vertex, np.arange(len(vertex)))), (count, len(vertex)))


def _allowed(drawn: Template, face: Ints, local: Points, weights: Floats) -> Any:
    """Give the bounds of the faces as a table."""
    square = np.bincount(face, weights * np.abs(local) ** 2)
    twist = weights * local**2
    table = np.empty((len(drawn.faces), 7), complex)
    for row, f in enumerate(drawn.faces):
        bounds = (f.width_min, f.width_max, f.depth_min, f.depth_max)
        table[row, :5] = (KINDS[f.deform], *bounds)
    table[:, 5] = square
    table[:, 6] = np.bincount(face, twist.real) + 1j * np.bincount(face, twist.imag)
    return table


def _counted(labels: Sequence[str]) -> npt.NDArray[np.bool_]:
    """Choose the faces whose registration is the energy: parcels, else buildings, else all."""
    for wanted in ("parcel", "building", "house"):
        found = np.array([label == wanted for label in labels])
        if found.any():
            return found
    return np.ones(len(labels), bool)


def _samples(mesh: Topology, side: Ints, t: Floats) -> tuple[Ints, Floats, Points]:
    """Cut the outline into short pieces for the initial map."""
    sides, ts, points = [], [], []
    z = mesh.points[mesh.outline]
    follow = np.roll(z, -1)
    for k in range(len(z)):
        last = k + 1 == len(z) or side[k + 1] != side[k]
        to = 1.0 if last else t[k + 1]
        n = min(PIECES, max(1, int(np.ceil(abs(follow[k] - z[k]) / PIECE))))
        u = np.arange(n) / n
        sides.append(np.full(n, side[k]))
        ts.append(t[k] + (to - t[k]) * u)
        points.append(z[k] + (follow[k] - z[k]) * u)
    return np.concatenate(sides), np.concatenate(ts), np.concatenate(points)


def _meanings(drawn: Template, mesh: Topology) -> Ints:
    """Tell what lies beyond each edge of the outline."""
    z = mesh.points[mesh.outline]
    middle = (z + np.roll(z, -1)) / 2.0
    points = shapely.points(middle.real, middle.imag)
    found = np.full(len(z), ANY, np.int64)
    for edge in drawn.edges:
        if edge.meaning in ("street", "no street"):
            near = shapely.distance(points, edge.line) < 2 * MERGE
            found[near] = STREET if edge.meaning == "street" else NO_STREET
    return found


def _sets(drawn: Template, mesh: Topology) -> tuple[tuple[str, Ints, Any], ...]:
    """Collect the vertices on each alignment line, in order along it."""
    points = shapely.points(mesh.points.real, mesh.points.imag)
    found: list[tuple[str, Ints, Any]] = []
    for edge in drawn.edges:
        if edge.meaning not in SHAPE_MEANINGS:
            continue
        on = np.flatnonzero(shapely.distance(points, edge.line) < 2 * MERGE)
        along = shapely.line_locate_point(edge.line, points[on])
        order = np.argsort(along, kind="stable")
        on, along = on[order], along[order]
        if len(on) > 2:
            smooth = edge.meaning == "smooth"
            matrix = smoother(along, REACH * edge.line.length) if smooth else None
            found.append((edge.meaning, on, matrix))
    return tuple(found)


def _pieces(drawn: Template, mesh: Topology) -> dict[str, Any]:
    """Join street faces that touch and repeats of inner regions; find what has access."""
    labels = [face.label for face in drawn.faces]
    owner = {
        (a, b): f
        for f, ring in enumerate(mesh.rings)
        for a, b in zip(ring.tolist(), ahead(ring).tolist())
    }
    group = np.arange(len(labels))
    # repeats of one face that other templates fill are one region
    inner = [
        getattr(face, "origin", -1) if face.label not in (*LAND, *FURNITURE) else -1
        for face in drawn.faces
    ]
    access = np.zeros(len(labels), bool)
    for (a, b), f in owner.items():
        g = owner.get((b, a))
        if g is None:
            continue
        access[f] |= labels[g] in ACCESS
        if labels[f] == labels[g] and (labels[f] in ACCESS or inner[f] == inner[g] >= 0):
            group[group == group[g]] = group[f]
    pieces: list[Ints] = []
    faces: list[int] = []
    piece_of = np.zeros(len(labels), np.int64)
    for g in np.unique(group):
        members = np.flatnonzero(group == g)
        rings = [mesh.rings[f] for f in members]
        try:
            joined = [rings[0]] if len(rings) == 1 else [boundary(rings, mesh.points)[0]]
        except TopologyError:  # with a hole inside
            joined = rings
        for k, ring in enumerate(joined):
            piece_of[members if len(joined) == 1 else members[k]] = len(pieces)
            pieces.append(ring)
            faces.append(members[0] if len(joined) == 1 else members[k])
    place = [
        int(np.flatnonzero(pieces[piece_of[f]] == v)[0]) for v, f in zip(mesh.outline, mesh.owner)
    ]
    return {
        "pieces": tuple(pieces),
        "piece_face": np.asarray(faces, dtype=np.int64),
        "piece_of_edge": piece_of[mesh.owner],
        "place_of_edge": np.asarray(place, dtype=np.int64),
        "access": access[np.asarray(faces, dtype=np.int64)],
    }


def mirrored(template: Template) -> Template:
    """Give the mirror image of a template.

    Parameters
    ----------
    template
        The template.
    """

    def flip(xy: Floats) -> Floats:
        flipped: Floats = xy * np.array([-1.0, 1.0])
        return flipped

    faces = [
        replace(f, polygon=shapely.transform(f.polygon, flip), axis=180.0 - f.axis)
        for f in template.faces
    ]
    return replace(
        template,
        faces=tuple(faces),
        edges=tuple(replace(e, line=shapely.transform(e.line, flip)) for e in template.edges),
        corners=tuple(replace(c, point=shapely.transform(c.point, flip)) for c in template.corners),
    )
