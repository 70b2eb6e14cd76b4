"""Whether turned rectangles overlap, many with many at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..shape import frames, sizes
from ..types import BuildingType, Placements


def overlapping(
    types: Sequence[BuildingType], some: Placements, others: Placements, depth_m: float
) -> npt.NDArray[np.bool_]:
    """Tell which footprints overlap, by separating axes: exact for rectangles.

    Parameters
    ----------
    types
        Kinds of buildings.
    some, others
        Buildings, n and m of them.
    depth_m
        An overlap no deeper than this, metres, is none.

    Returns
    -------
    numpy.ndarray
        Shape (n, m).
    """
    axes = [np.stack(frames(placed), axis=1) for placed in (some, others)]  # (n, 2, 2)
    half = [sizes(types, placed)[:, :2] / 2 for placed in (some, others)]
    apart = others.xy[None, :] - some.xy[:, None]
    met = np.ones(apart.shape[:2], dtype=bool)
    # cosines between the axes of both: how far one reaches along an axis of the other
    turned = np.abs(np.einsum("nac,mbc->nmab", axes[0], axes[1]))
    for a in (0, 1):
        off = np.abs(np.einsum("nmc,nc->nm", apart, axes[0][:, a]))
        reach = np.einsum("nmb,mb->nm", turned[:, :, a], half[1])
        met &= off < half[0][:, None, a] + reach - depth_m
        off = np.abs(np.einsum("nmc,mc->nm", apart, axes[1][:, a]))
        reach = np.einsum("nmb,nb->nm", turned[:, :, :, a], half[0])
        met &= off < half[1][None, :, a] + reach - depth_m
    return met
