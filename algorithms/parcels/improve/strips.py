"""Strips between two parallel curves, fitted to regions with four sides (UP section 6, Fig. 9)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from ..edges import EdgeKind
from ..roadmesh import StreetMesh
from ..rules import ParcelRules
from .corners import four_sides

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
#: Samples along each side.
SAMPLES = 25
#: Directions at the ends of a strip are measured over so many samples.
END = 4
#: How stiff the middle line of a strip is, so that kinks of its sides are not copied.
STIFF = 50.0
#: A strip gets the depth that its rows ask for if it is within this share of it.
LIKE = 0.3
#: A strip's width goes so far from the mean of the distances to that depth: parallel sides are
#: worth more to parcels than a certain depth.
PULL = 0.5
#: Strips whose width has this standard deviation (of its mean) count half as much as even ones.
UNEVEN = 0.1
#: The pair of sides that is so many times as long is where the rows are, however uneven.
LONG = 1.15
#: Strips whose width differs by more from end to end are left alone (of their mean width).
WEDGE = 0.9


@dataclass(frozen=True)
class Strips:
    """Regions with four sides.

    Attributes
    ----------
    vertex
        Vertices of their rings, side by side; the corner between two sides is in both. Shape (k,).
    side
        Number of the side of each, 4 per region, shape (k,).
    region
        Numbers of the regions, shape (r,).
    corner
        Vertices at their corners, in the order of the ring, shape (r, 4).
    pair
        The two sides between which the rows are: 0 for sides 0 and 2, 1 for 1 and 3; shape (r,).
    width
        Distance that rows of parcels ask for between these, shape (r,), metres; NaN where they
        ask for another than they can get, and the mean distance is as good as any.
    weight
        How much the wish of each region counts beside that of its neighbours (eq. 4), shape (r,):
        less where its sides are far from parallel, as often nothing can be done about that.
    """

    vertex: Ints
    side: Ints
    region: Ints
    corner: Ints
    pair: Ints
    width: Floats
    weight: Floats

    def targets(self, xy: Floats) -> tuple[Floats, Floats]:
        """Fit a strip to each region.

        Parameters
        ----------
        xy
            Places of the vertices, shape (n, 2), metres.

        Returns
        -------
        targets
            Mean of the places that the strips around a vertex want it at (eq. 4), shape (n, 2).
        count
            Sum of the weights of these strips, shape (n,); where it is 0 the target is the place
            itself. A corner counts twice, as it is in two sides.
        """
        own = self.weight[self.side // 4]
        found = np.bincount(self.vertex, weights=own, minlength=len(xy))
        count: Floats = np.asarray(found, dtype=float)
        if not len(self.side):
            return xy.copy(), count
        t = _shares(xy, self.vertex, self.side)
        samples = _samples(xy, self.vertex, self.side, t)
        middle, normal, across = _strips(samples)
        row = np.arange(len(self.pair))
        mean = across[row, self.pair].mean(axis=-1)
        width = np.where(np.isnan(self.width), mean, mean + PULL * (self.width - mean))
        half = normal[row, self.pair] * width[:, None, None] / 2
        middle = middle[row, self.pair]
        place = self._places(np.stack([middle + half, middle - half], axis=1), t)
        total = np.column_stack(
            [np.bincount(self.vertex, weights=own * p, minlength=len(xy)) for p in place.T]
        )
        known = count > 0
        targets = xy.copy()
        targets[known] = total[known] / count[known, None]
        return targets, count

    def again(self, mesh: StreetMesh) -> Strips | None:
        """Return the same strips after rings have changed; None if a corner is not there now.

        Parameters
        ----------
        mesh
            The mesh, with the same regions.
        """
        runs: list[list[int]] = []
        for number, corners in zip(self.region.tolist(), self.corner.tolist()):
            ring = list(mesh.regions[number].rings[0])
            if not set(corners) <= set(ring):
                return None
            at = [ring.index(v) for v in corners]
            for start, stop in zip(at, (*at[1:], at[0])):
                stop += len(ring) if stop < start else 0
                runs.append([ring[k % len(ring)] for k in range(start, stop + 1)])
        flat = _flat(runs)
        return replace(self, vertex=flat["vertex"], side=flat["side"])

    def _places(self, strip: Floats, t: Floats) -> Floats:
        """Places of the vertices on the outlines of the strips, shape (k, 2)."""
        region, side = self.side // 4, self.side % 4
        turned = (side - self.pair[region]) % 4
        # sides 0 and 2 (from the pair's first) are the curves, 1 and 3 the lines between them
        flat = np.arange(2 * len(self.pair))[:, None] * 2.0 + np.linspace(0.0, 1.0, SAMPLES)
        along = np.where(turned == 2, 1.0 - t, t)
        curve = 2.0 * (2 * region + (turned == 2)) + along
        on = np.stack(
            [np.interp(curve, flat.ravel(), strip[..., k].ravel()) for k in (0, 1)], axis=-1
        )
        last = (turned == 1).astype(int) * (SAMPLES - 1)
        first, second = strip[region, 0, last], strip[region, 1, last]
        share = np.where(turned == 1, t, 1.0 - t)[:, None]
        cap = first + (second - first) * share
        return np.where((turned % 2 == 0)[:, None], on, cap)


def strips_of(mesh: StreetMesh, rules: ParcelRules, regions: Sequence[int]) -> Strips:
    """Find the regions with four sides.

    Parameters
    ----------
    mesh
        The mesh.
    rules
        Say how deep parcels should be.
    regions
        Numbers of the regions to look at.
    """
    runs: list[list[int]] = []
    wished: list[list[list[float]]] = []
    found: list[int] = []
    for number in regions:
        rings = mesh.regions[number].rings
        sides = four_sides(mesh.xy[list(rings[0])]) if len(rings) == 1 else None
        if sides is None:
            continue
        own = [[rings[0][k] for k in run] for run in sides]
        space = [_space(mesh, run) for run in own]
        wished.append([_wished(space[k], space[k + 2], rules.depth) for k in (0, 1)])
        runs += own
        found.append(number)
    if not runs:
        none = np.zeros(0, dtype=np.int64)
        return Strips(none, none, none, none.reshape(0, 4), none, np.zeros(0), np.zeros(0))
    pair, width, weight = _choose(mesh.xy, **_flat(runs), wished=np.array(wished))
    good = weight > 0
    runs = [run for k, run in enumerate(runs) if good[k // 4]]
    corner = np.array([run[0] for run in runs], dtype=np.int64).reshape(-1, 4)
    return Strips(
        **_flat(runs),
        region=np.array(found, dtype=np.int64)[good],
        corner=corner,
        pair=pair[good],
        width=width[good],
        weight=weight[good],
    )


def _flat(runs: Sequence[Sequence[int]]) -> dict[str, Ints]:
    """Vertices of sides one after the other, and the numbers of their sides."""
    return {
        "vertex": np.array([v for run in runs for v in run], dtype=np.int64),
        "side": np.repeat(np.arange(len(runs)), [len(run) for run in runs]),
    }


def _choose(xy: Floats, vertex: Ints, side: Ints, wished: Floats) -> tuple[Ints, Floats, Floats]:
    """Choose where the rows are, how wide their strip, and its weight: 0 for what suits none."""
    middle, _, across = _strips(_samples(xy, vertex, side, _shares(xy, vertex, side)))
    spread = across.std(axis=-1)
    length = np.hypot(*np.moveaxis(np.diff(middle, axis=2), -1, 0)).sum(axis=-1)
    pair = np.where(spread[:, 0] <= spread[:, 1], 0, 1)
    pair = np.where(length[:, 0] > LONG * length[:, 1], 0, pair)
    pair = np.where(length[:, 1] > LONG * length[:, 0], 1, pair)
    row = np.arange(len(pair))
    own = across[row, pair]
    mean, rows = own.mean(axis=-1), wished[row, pair]
    off = np.abs(mean[:, None] / rows - 1.0)
    off = np.where(np.isfinite(off), off, np.inf)
    best = off.argmin(axis=1)
    width = np.where(off[row, best] < LIKE, rows[row, best], np.nan)
    good = (mean > 0) & (np.ptp(own, axis=-1) < WEDGE * mean)
    uneven = own.std(axis=-1) / np.maximum(mean, 1e-9)
    return pair, width, np.where(good, 1.0 / (1.0 + (uneven / UNEVEN) ** 2), 0.0)


def _shares(xy: Floats, vertex: Ints, side: Ints) -> Floats:
    """Share of its side that lies before each vertex, 0 to 1, shape (k,)."""
    step = np.hypot(*np.diff(xy[vertex], axis=0, prepend=xy[vertex[:1]]).T)
    first = np.r_[True, np.diff(side) != 0]
    step[first] = 0.0
    gone = np.cumsum(step)
    starts = np.flatnonzero(first)
    lengths = np.add.reduceat(step, starts)
    return np.asarray((gone - gone[starts][side]) / np.maximum(lengths, 1e-9)[side])


def _samples(xy: Floats, vertex: Ints, side: Ints, t: Floats) -> Floats:
    """Places evenly along the sides, shape (regions, 4, samples, 2)."""
    at = np.arange(int(side[-1]) + 1)[:, None] * 2.0 + np.linspace(0.0, 1.0, SAMPLES)
    own = side * 2.0 + t
    found = np.stack([np.interp(at, own, c) for c in xy[vertex].T], axis=-1)
    return np.asarray(found.reshape(-1, 4, SAMPLES, 2))


def _strips(samples: Floats) -> tuple[Floats, Floats, Floats]:
    """Middle lines between opposite sides, their normals, and the distances between the sides.

    Shapes (regions, 2, samples, 2), the same, and (regions, 2, samples); the first of two
    opposite sides lies in the direction of the normal.
    """
    sides = np.stack([samples[:, :2], samples[:, 2:, ::-1]], axis=2)
    middle = _SMOOTH @ sides.mean(axis=2)
    normal = _normals(middle)
    across = ((sides[:, :, 0] - sides[:, :, 1]) * normal).sum(axis=-1)
    return middle, normal, across


def _space(mesh: StreetMesh, run: Sequence[int]) -> float:
    """Street space along a side, metres (half the width); NaN where it gives no access."""
    total = reached = taken = 0.0
    for a, b in zip(run[:-1], run[1:]):
        edge = mesh.edge(a, b)
        length = float(np.hypot(*(mesh.xy[b] - mesh.xy[a])))
        total += length
        if edge.kind != EdgeKind.CLOSED:
            reached += length
        if edge.kind == EdgeKind.STREET:
            taken += length * edge.width / 2
    return taken / total if total > 0 and reached >= 0.5 * total else float("nan")


def _wished(first: float, second: float, depth: float) -> list[float]:
    """Distance of two sides for one row of parcels between them, and for two."""
    if np.isnan(first) and np.isnan(second):
        return [float("nan")] * 2
    space = float(np.nansum([first, second]))
    return [depth + space, 2 * depth + space if not np.isnan(first + second) else float("nan")]


def _smoother() -> Floats:
    """Matrix that smooths lines of samples (Whittaker): near to them, small second differences."""
    second = np.diff(np.eye(SAMPLES), n=2, axis=0)
    return np.asarray(np.linalg.inv(np.eye(SAMPLES) + STIFF * second.T @ second))


_SMOOTH = _smoother()


def _normals(middle: Floats) -> Floats:
    """Return unit vectors to the right of lines of samples, shape as the lines."""
    way = np.gradient(middle, axis=-2)
    # the ends turn with a piece of the line, not with its last vertex
    way[..., 0, :] = middle[..., END, :] - middle[..., 0, :]
    way[..., -1, :] = middle[..., -1, :] - middle[..., -1 - END, :]
    length = np.maximum(np.hypot(way[..., 0], way[..., 1]), 1e-9)[..., None]
    return np.asarray(np.stack([way[..., 1], -way[..., 0]], axis=-1) / length)
