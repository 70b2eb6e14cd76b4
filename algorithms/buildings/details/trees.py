"""Trees along streets and paths, and in larger greens."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import cKDTree
from shapely.geometry import Polygon

from ..layout import PathPlan
from ..rules import LayoutRules
from ..types import Floats
from ..zone import Zone
from .bays import Row
from .taken import Taken, shapes, street_sides

#: Trees stand so far inside the edge of street space, metres,
INSIDE = 1.5
#: so far from the edge of a path (beside it, and at least),
BESIDE, FROM_PATH = 1.5, 0.7
#: so far from façades (beside streets and paths, and in greens), and from parking bays.
FROM_FACADE, LIGHT, FROM_BAY = 3.0, 5.0, 0.6
#: Trees are no nearer to each other than this share of their spacing.
NEAR = 0.6
#: In greens their spacing is so many times that along streets, and they keep from the edge, metres.
LOOSE, RIM = 1.6, 2.5
#: Part of their spacing by which trees in greens are moved at random.
JITTER = 0.3


def plant_trees(
    zone: Zone,
    rules: LayoutRules,
    plan: PathPlan,
    taken: Taken,
    rows: Sequence[Row],
    green: Sequence[Polygon],
) -> tuple[Floats, tuple[str, ...]]:
    """Plant trees along streets, then along paths, then in greens.

    Parameters
    ----------
    zone, rules, plan
        Streets and paths, and the spacing of trees along them.
    taken
        Ground of buildings and paths.
    rows
        Parking; trees stand between rows.
    green
        Plots of green.

    Returns
    -------
    trees : numpy.ndarray
        Shape (n, 2), metres: inside patches, off buildings, paths and parking.
    of : tuple of str
        "corridor", "path" or "green" for each.
    """
    spacing = rules.tree_spacing_m
    asked = [
        ("corridor", _between(rows), FROM_FACADE),
        ("corridor", _along_streets(zone, taken, spacing), FROM_FACADE),
        ("path", _along_paths(plan, rules.path_m, spacing), FROM_FACADE),
        ("green", _in_greens(green, LOOSE * spacing, rules.seed), LIGHT),
    ]
    trees = np.zeros((0, 2))
    of: list[str] = []
    parking = shapes([row.polygon for row in rows])
    for kind, points, light in asked:
        points = points[_free(points, taken, parking, light)]
        gap = spacing if kind == "green" else NEAR * spacing
        points = points[_apart(trees, points, gap)]
        trees = np.vstack([trees, points])
        of += [kind] * len(points)
    return trees, tuple(of)


def _between(rows: Sequence[Row]) -> Floats:
    """Places at the ends of rows of bays."""
    ends = [row.ends(row.kind.along / 2, min(INSIDE, row.kind.deep / 2)) for row in rows]
    return np.concatenate([np.zeros((0, 2)), *ends])


def _along_streets(zone: Zone, taken: Taken, spacing: float) -> Floats:
    """Places just inside the patches along streets."""
    found = [np.zeros((0, 2))]
    for patch, ground in zip(zone.patches, taken.ground):
        for line in street_sides(patch.access):
            at, way = _steps(line, spacing)
            left = np.column_stack([-way[:, 1], way[:, 0]]) * INSIDE
            inside = shapely.contains_xy(ground, at[:, 0] + left[:, 0], at[:, 1] + left[:, 1])
            trees = at + np.where(inside[:, None], left, -left)
            # in a corner another side is nearer
            clear = shapely.distance(shapely.points(trees), patch.access) > 0.95 * INSIDE
            found.append(trees[clear])
    return np.concatenate(found)


def _along_paths(plan: PathPlan, width: float, spacing: float) -> Floats:
    """Places on both sides of paths."""
    found = [np.zeros((0, 2))]
    for path in plan.paths:
        at, way = _steps(shapely.get_coordinates(path.line), spacing)
        left = np.column_stack([-way[:, 1], way[:, 0]]) * (width / 2 + BESIDE)
        found += [at + left, at - left]
    return np.concatenate(found)


def _in_greens(green: Sequence[Polygon], spacing: float, seed: int) -> Floats:
    """Places in greens, away from their edges: a triangular grid, shaken."""
    inner = shapely.buffer(shapes(green), -RIM, quad_segs=2)
    inner = inner[~shapely.is_empty(inner)]
    if not len(inner):
        return np.zeros((0, 2))
    x0, y0, x1, y1 = shapely.total_bounds(inner)
    rise = spacing * np.sqrt(3) / 2
    row, column = np.meshgrid(
        np.arange(int((y1 - y0) / rise) + 2), np.arange(int((x1 - x0) / spacing) + 2), indexing="ij"
    )
    grid = np.column_stack(
        [x0 + spacing * (column + 0.5 * (row % 2)).ravel(), y0 + rise * row.ravel()]
    )
    grid += np.random.default_rng(seed).uniform(-JITTER, JITTER, grid.shape) * spacing
    hit = shapely.STRtree(inner).query(shapely.points(grid), predicate="within")[0]
    return np.asarray(grid[np.unique(hit)])


def _steps(line: Floats, spacing: float) -> tuple[Floats, Floats]:
    """Give places along a line and its direction there, each of shape (n, 2)."""
    step = np.diff(line, axis=0)
    length = np.hypot(step[:, 0], step[:, 1])
    step, length, start = step[length > 0], length[length > 0], line[:-1][length > 0]
    if not len(step):
        return np.zeros((0, 2)), np.zeros((0, 2))
    until = np.cumsum(length)
    count = int(until[-1] / spacing + 0.5)
    at = (np.arange(count) + 0.5) * until[-1] / max(count, 1)
    piece = np.minimum(np.searchsorted(until, at), len(step) - 1)
    way = (step / length[:, None])[piece]
    return start[piece] + way * (at - until[piece] + length[piece])[:, None], way


def _free(
    points: Floats, taken: Taken, parking: npt.NDArray[np.object_], light: float
) -> npt.NDArray[np.bool_]:
    """Tell where there is room for a tree, shape (n,)."""
    places = shapely.points(points)
    inside = np.zeros(len(points), dtype=bool)
    inside[shapely.STRtree(taken.ground).query(places, predicate="within")[0]] = True
    for what, distance in (
        (taken.buildings, light),
        (taken.paths, taken.path_m / 2 + FROM_PATH),
        (parking, FROM_BAY),
    ):
        near = shapely.STRtree(what).query(places, predicate="dwithin", distance=distance)
        inside[near[0]] = False
    return inside


def _apart(trees: Floats, points: Floats, gap: float) -> npt.NDArray[np.bool_]:
    """Tell which of new trees are not too near to another, the first come first, shape (n,)."""
    keep = np.ones(len(points), dtype=bool)
    if not len(points):
        return keep
    if len(trees):
        keep &= cKDTree(trees).query(points)[0] >= gap
    for one, other in sorted(cKDTree(points).query_pairs(gap * (1 - 1e-9))):
        if keep[one] and keep[other]:
            keep[other] = False
    return keep
