"""Cut a strip along a street into parcels of equal area, at right angles to the street."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..rules import ParcelRules
from .mosaic import Mosaic
from .rings import pairs

Floats = npt.NDArray[np.float64]
#: Distance of the rays that measure the depth of a strip, and most of them per strip.
STEP = 1.0
MOST = 400
#: The street's direction at a place is that of the chord between places so far off (metres).
CHORD = 8.0
#: Parcels may be this many times as narrow and as wide as wished for.
NARROW, WIDE = 0.62, 1.6


def cut_across(mosaic: Mosaic, face: int, chain: Sequence[int], rules: ParcelRules) -> list[int]:
    """Cut a strip into parcels.

    Parameters
    ----------
    mosaic, face
        Which face of which mosaic.
    chain
        Vertices of the street side, land on its left.
    rules
        What is asked of parcels.

    Returns
    -------
    list of int
        Faces, in the order of the side as far as cuts succeeded.
    """
    path = own_path(mosaic, face, chain)
    if len(path) < 2:
        return [face]
    xy = np.array([mosaic.xy[v] for v in path])
    size = np.r_[0.0, np.cumsum(np.hypot(*np.diff(xy, axis=0).T))]
    length = float(size[-1])
    wish = round(mosaic.area(face) / rules.area)
    least = max(NARROW * rules.width, rules.min_frontage)
    count = max(min(wish, int(length / least)), math.ceil(length / (WIDE * rules.width)), 1)
    count = min(count, max(1, int(mosaic.area(face) / rules.least_area)))
    if count == 1:
        return [face]
    steps = int(min(MOST, max(8, length / STEP)))
    at = (np.arange(steps) + 0.5) * length / steps
    places, normals = stations(xy, size, at)
    depth = ray_depths(mosaic, face, places, normals)
    total = np.r_[0.0, np.cumsum(np.maximum(depth, 0.05))]
    where = np.interp(
        np.arange(1, count) / count * total[-1], total, np.linspace(0, length, steps + 1)
    )
    places, normals = stations(xy, size, where)
    found, rest = [], face
    for place, normal in zip(places.tolist(), normals.tolist()):
        parts = mosaic.cut(rest, (place[0], place[1]), (normal[0], normal[1]), only_at=True)
        ahead = [part for part in parts if path[-1] in mosaic.refine(part)[0]]
        if len(parts) != 2 or len(ahead) != 1:
            continue
        rest = ahead[0]
        found += [part for part in parts if part != rest]
    return [*found, rest]


def own_path(mosaic: Mosaic, face: int, chain: Sequence[int]) -> list[int]:
    """Return the vertices of the part of a side along which a face lies.

    Parameters
    ----------
    mosaic, face, chain
        See `cut_across`.
    """
    along = set(chain)
    xy = [mosaic.xy[v] for v in chain]
    ring = mosaic.refine(face)[0]
    front = [mosaic.is_front(edge) for edge in pairs(ring)]
    # vertices that cuts have put on the side count too
    on = [
        v in along or ((front[i] or front[i - 1]) and _near(mosaic.xy[v], xy))
        for i, v in enumerate(ring)
    ]
    edges = [front[i] and on[i] and on[(i + 1) % len(ring)] for i in range(len(ring))]
    if not any(edges) or all(edges):
        return []
    best: list[int] = []
    for i in range(len(ring)):
        if edges[i] and not edges[i - 1]:
            run = [ring[i]]
            j = i
            while edges[j % len(ring)]:
                j += 1
                run.append(ring[j % len(ring)])
            if mosaic.length(zip(run, run[1:])) > mosaic.length(zip(best, best[1:])):
                best = run
    return best


def _near(place: tuple[float, float], chain: Sequence[tuple[float, float]]) -> bool:
    xy = np.array(chain)
    way = np.diff(xy, axis=0)
    size = np.maximum((way**2).sum(axis=1), 1e-18)
    t = np.clip(((np.array(place) - xy[:-1]) * way).sum(axis=1) / size, 0, 1)
    off = xy[:-1] + t[:, None] * way - place
    return bool((off**2).sum(axis=1).min() < 1e-6)


def stations(xy: Floats, size: Floats, at: Floats) -> tuple[Floats, Floats]:
    """Return places on a line and the directions to its left there.

    Parameters
    ----------
    xy, size
        Vertices of the line, shape (n, 2), and their distances from its start, shape (n,).
    at
        Distances from its start, shape (m,), metres.
    """

    def place(where: Floats) -> Floats:
        return np.stack(
            [np.interp(where, size, xy[:, 0]), np.interp(where, size, xy[:, 1])], axis=1
        )

    # a chord that is shorter near the ends stays symmetrical
    reach = np.clip(np.minimum(at, size[-1] - at), 0.05, CHORD)
    way = place(at + reach) - place(at - reach)
    way /= np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-12)[:, None]
    return place(at), np.stack([-way[:, 1], way[:, 0]], axis=1)


def ray_depths(mosaic: Mosaic, face: int, places: Floats, ways: Floats) -> Floats:
    """Return how far rays go inside a face, shape (n,), metres; 0 if they leave at once.

    Parameters
    ----------
    mosaic, face
        Which face of which mosaic.
    places, ways
        Where rays begin, on the outline, and their directions; shapes (n, 2).
    """
    ends = np.array([(mosaic.xy[a], mosaic.xy[b]) for a, b in mosaic.edges(face)])
    start, way = ends[:, 0], ends[:, 1] - ends[:, 0]
    off = start[None] - places[:, None]
    turn = ways[:, None, 0] * way[None, :, 1] - ways[:, None, 1] * way[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (off[..., 0] * way[None, :, 1] - off[..., 1] * way[None, :, 0]) / turn
        part = (off[..., 0] * ways[:, None, 1] - off[..., 1] * ways[:, None, 0]) / turn
    hit = (part >= 0) & (part <= 1) & (far > 0.01)
    depth = np.where(hit, far, np.inf).min(axis=1)
    return np.where(np.isfinite(depth), depth, 0.0)
