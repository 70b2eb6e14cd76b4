"""The score of a block's plots that decides what is kept."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from ...measure.parcel_shape import corner_deviation, rectangle_ratio, undesirable

Floats = npt.NDArray[np.float64]


def block_scores(polygons: npt.NDArray[Any], block: npt.NDArray[np.int64], blocks: int) -> Floats:
    """Score of the parcels of each block, less is better, shape (blocks,).

    30 x share of undesirable parcels + mean p_angle (degrees) + 50 x (mean p_area - 1) +
    8 x coefficient of variation of the area; 0 without parcels.

    Parameters
    ----------
    polygons
        Parcels, shape (n,), metres.
    block
        Block of each, shape (n,).
    blocks
        Number of blocks.

    Examples
    --------
    >>> block_scores(np.array([shapely.box(0, 0, 18, 30)]), np.array([0]), 1).tolist()
    [0.0]
    """
    return scores_and_faults(polygons, block, blocks)[0]


def scores_and_faults(
    polygons: npt.NDArray[Any], block: npt.NDArray[np.int64], blocks: int
) -> tuple[Floats, Floats]:
    """Score of each block and its share of undesirable parcels, shapes (blocks,).

    Parameters
    ----------
    polygons, block, blocks
        See `block_scores`.
    """
    angle, ratio = corner_deviation(polygons), rectangle_ratio(polygons)
    area = shapely.area(polygons)
    count = np.maximum(np.bincount(block, minlength=blocks), 1)

    def mean(values: npt.NDArray[Any]) -> Floats:
        return np.asarray(np.bincount(block, values, minlength=blocks) / count)

    size, faults = mean(area), mean(undesirable(angle, ratio))
    spread = np.sqrt(mean((area - size[block]) ** 2)) / np.maximum(size, 1e-9)
    score = 30.0 * faults + mean(angle) + 50.0 * mean(ratio - 1.0) + 8.0 * spread
    return np.asarray(score), faults
