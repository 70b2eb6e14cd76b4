"""Which pieces of a boundary face each other across the site, and how far apart they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .directions import Labels
from .quadmesh import FloatArray, IntArray
from .rings import Ring

SAMPLE = 1 / 3
"""Length of boundary for each ray, in edge lengths."""


@dataclass(frozen=True, eq=False)
class Facing:
    """Pairs of facing pieces, one row for each pair; lengths in edge lengths.

    Attributes
    ----------
    pieces
        Shape (k, 2). Indices of pieces, counted through all rings.
    fractions
        Shape (k, 2). Mean place on each piece, 0 at its start, 1 at its end.
    distance
        Shape (k,). Mean distance across the site.
    width
        Shape (k,). Length of boundary that was seen to face the other.
    """

    pieces: IntArray
    fractions: FloatArray
    distance: FloatArray
    width: FloatArray


def piece_segments(
    rings: Sequence[Ring], labels: Sequence[Labels], spacing: float
) -> tuple[FloatArray, FloatArray, IntArray, FloatArray, FloatArray]:
    """Cut all pieces into straight segments of about one spacing.

    Returns
    -------
    tuple
        Starts and ends (s, 2), piece index (s,), fractions of the piece at the start and at
        the end of each segment (s,).
    """
    starts, ends, piece, low, high = [], [], [], [], []
    number = 0
    for ring, label in zip(rings, labels):
        for a, b in zip(label.start.tolist(), label.ends(ring).tolist()):
            count = max(1, int((b - a) / spacing))
            points = ring.at(np.linspace(a, b, count + 1))
            starts.append(points[:-1])
            ends.append(points[1:])
            piece.append(np.full(count, number))
            low.append(np.arange(count) / count)
            high.append((np.arange(count) + 1) / count)
            number += 1
    return (
        np.vstack(starts),
        np.vstack(ends),
        np.concatenate(piece),
        np.concatenate(low),
        np.concatenate(high),
    )


def find_facing(rings: Sequence[Ring], labels: Sequence[Labels], h: float) -> Facing:
    """Send a ray straight into the site from every third of an edge length of boundary.

    Only pairs whose directions on the lattice are opposite count.
    """
    start, end, piece, low, high = piece_segments(rings, labels, SAMPLE * h)
    direction = np.concatenate([label.direction for label in labels])
    along = end - start
    length = np.maximum(np.hypot(*along.T), 1e-9)
    unit = along / length[:, None]
    normal = np.column_stack([-unit[:, 1], unit[:, 0]])
    middle = (start + end) / 2
    hit, distance, place = _first_hits(middle, normal, start, along, 1e-3 * h)
    seen = hit >= 0
    seen[seen] &= (unit[seen] * unit[hit[seen]]).sum(axis=1) < -0.5
    seen[seen] &= (direction[piece[seen]] + 2) % 4 == direction[piece[hit[seen]]]
    own = np.flatnonzero(seen)
    other = hit[own]
    fraction = low[other] + place[own] * (high[other] - low[other])
    pair = np.column_stack([piece[own], piece[other]])
    places = np.column_stack([(low[own] + high[own]) / 2, fraction])
    swap = pair[:, 0] > pair[:, 1]
    pair[swap] = pair[swap, ::-1]
    places[swap] = places[swap, ::-1]
    keys, group = np.unique(pair, axis=0, return_inverse=True)
    group = group.reshape(-1)
    weight = length[own] / h
    count = len(keys)
    width: FloatArray = np.bincount(group, weight, count).astype(float)
    mean: list[FloatArray] = [
        np.bincount(group, weight * x, count) / np.maximum(width, 1e-12)
        for x in (places[:, 0], places[:, 1], distance[own] / h)
    ]
    return Facing(keys.reshape(-1, 2).astype(np.int64), np.column_stack(mean[:2]), mean[2], width)


def _first_hits(
    origin: FloatArray, ray: FloatArray, start: FloatArray, along: FloatArray, least: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return for each ray the first segment it meets (or -1), the distance and the place."""
    # origin + t * ray = start + s * along, for all pairs at once
    cross = ray[:, None, 0] * along[None, :, 1] - ray[:, None, 1] * along[None, :, 0]
    gap = start[None] - origin[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (gap[..., 0] * along[None, :, 1] - gap[..., 1] * along[None, :, 0]) / cross
        s = (gap[..., 0] * ray[:, None, 1] - gap[..., 1] * ray[:, None, 0]) / cross
    meets = (t > least) & (s >= 0) & (s <= 1)
    np.fill_diagonal(meets, False)
    t = np.where(meets, t, np.inf)
    first = t.argmin(axis=1)
    rows = np.arange(len(origin))
    distance = t[rows, first]
    found = np.isfinite(distance)
    return np.where(found, first, -1), distance, np.where(found, s[rows, first], 0.0)
