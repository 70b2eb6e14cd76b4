"""How streets are oriented: bearings, and how ordered they are (Boeing 2019).

Bearings are put into bins of 10 degrees, the first of which is centred on north, in both directions
of each street. The entropy of the shares of the bins is that of G. Boeing, "Urban spatial order:
street network orientation, configuration, and entropy", Applied Network Science 4, 67 (2019),
equation 1, and the order derived from it is equation 4: 0 for streets of all directions alike, 1
for a perfect grid.
"""

from __future__ import annotations

import contextlib
import math

import numpy as np
import numpy.typing as npt
from pyproj import CRS, Geod
from pyproj.exceptions import ProjError

from ..site.crs import transformer
from .graph import FloatArray

#: Number of bins around the compass (Boeing 2019).
BINS = 36
#: Streets whose ends are nearer to each other than this have no direction (metres).
LEAST = 0.01


def bearings(start: npt.ArrayLike, end: npt.ArrayLike, crs: CRS) -> FloatArray:
    """Give the direction of straight lines as an axis, clockwise from true north.

    Parameters
    ----------
    start, end
        Shape (n, 2). Their ends, metres.
    crs
        CRS of the points.

    Returns
    -------
    array
        Shape (n,), degrees, at least 0 and below 180: 0 for north and south, 90 for east and
        west; NaN where the ends are at one place. In a CRS without degrees the north of its grid
        stands for true north.
    """
    a, b = np.asarray(start, dtype=float).reshape(-1, 2), np.asarray(end, dtype=float)
    b = b.reshape(-1, 2)
    step = b - a
    azimuth = np.degrees(np.arctan2(step[:, 0], step[:, 1]))
    # The place of an engineering CRS on the globe is not known.
    with contextlib.suppress(ProjError, ValueError):
        way = transformer(crs, CRS.from_epsg(4326))
        (lon_a, lat_a), (lon_b, lat_b) = way.transform(*a.T), way.transform(*b.T)
        true = np.asarray(Geod(ellps="WGS84").inv(lon_a, lat_a, lon_b, lat_b)[0], dtype=float)
        azimuth = np.where(np.isfinite(true), true, azimuth)
    # What rounding turns a hair to the west of north is north.
    axis = np.round(azimuth, 6) % 180.0
    return np.where(np.hypot(*step.T) < LEAST, np.nan, axis)


def orientation_shares(
    bearing: npt.ArrayLike, weights: npt.ArrayLike | None = None, bins: int = BINS
) -> FloatArray:
    """Give the share of streets in each bin of the compass, both directions of each street.

    Parameters
    ----------
    bearing
        Shape (n,). Degrees; NaN does not count.
    weights
        Shape (n,). What each street counts, such as its length; None: all alike.
    bins
        Number of bins, even; the first is centred on 0 degrees.

    Returns
    -------
    array
        Shape (bins,). They add up to 1; NaN where there is nothing to count.

    Examples
    --------
    >>> orientation_shares([0.0, 4.0, 90.0, 90.0], bins=4).tolist()
    [0.25, 0.25, 0.25, 0.25]
    """
    own = np.asarray(bearing, dtype=float).ravel()
    size = np.ones(len(own)) if weights is None else np.asarray(weights, dtype=float).ravel()
    known = np.isfinite(own)
    width = 360.0 / bins
    one = np.floor((own[known] + width / 2) / width).astype(np.int64) % bins
    count = np.bincount(one, size[known], minlength=bins)
    count = count + np.roll(count, bins // 2)
    total = float(count.sum())
    return count / total if total > 0 else np.full(bins, np.nan)


def orientation_entropy(
    bearing: npt.ArrayLike, weights: npt.ArrayLike | None = None, bins: int = BINS
) -> float:
    """Entropy of the directions of streets, in nats (Boeing 2019, equation 1).

    Parameters
    ----------
    bearing, weights, bins
        See `orientation_shares`.

    Returns
    -------
    float
        From ln 2, streets of one direction, to ln 36 = 3.584, all directions alike; ln 4 =
        1.386 for a perfect grid. NaN where there is nothing to count.

    Examples
    --------
    >>> round(orientation_entropy([0.0, 90.0]), 3)
    1.386
    """
    share = orientation_shares(bearing, weights, bins)
    if np.isnan(share).any():
        return math.nan
    some = share[share > 0]
    return float(-(some * np.log(some)).sum())


def orientation_order(entropy: float, bins: int = BINS) -> float:
    """Order of the directions of streets (Boeing 2019, equation 4).

    Parameters
    ----------
    entropy
        See `orientation_entropy`.
    bins
        Number of bins that it was counted with.

    Returns
    -------
    float
        1 for a perfect grid, 0 for all directions alike. Streets of one or two directions only
        have less entropy than a grid: their order is 1 as well.

    Examples
    --------
    >>> round(orientation_order(math.log(36)), 6), orientation_order(math.log(4))
    (0.0, 1.0)
    """
    least, most = math.log(4), math.log(bins)
    above = max(entropy - least, 0.0) if math.isfinite(entropy) else math.nan
    return 1.0 - (above / (most - least)) ** 2
