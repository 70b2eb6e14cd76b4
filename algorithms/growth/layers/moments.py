"""Iterations of a growth as moments, so that the temporal controller of QGIS plays it.

Iteration k appears k days after `FIRST_MOMENT`; what was there before is iteration 0. All of it
stays until the end of the day of the last iteration. The days are no forecast: they only give
the player a clock.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

#: Moment of iteration 0, in ISO form and without a time zone.
FIRST_MOMENT = "2000-01-01T00:00:00"
#: Days from one iteration to the next.
STEP_DAYS = 1

#: GeoPackage keeps milliseconds.
_UNIT = "datetime64[ms]"

Moments = npt.NDArray[np.datetime64]


def moments(iterations: npt.NDArray[np.int64]) -> Moments:
    """Tell the moment in which each iteration appears.

    Parameters
    ----------
    iterations
        Shape (n,). Numbers of iterations, at least 0.

    Returns
    -------
    ndarray
        Shape (n,). Moments to the millisecond, without a time zone.

    Examples
    --------
    >>> moments(np.array([0, 31])).astype(str).tolist()
    ['2000-01-01T00:00:00.000', '2000-02-01T00:00:00.000']
    """
    days = np.asarray(iterations, dtype=np.int64) * STEP_DAYS
    return np.asarray(np.datetime64(FIRST_MOMENT, "ms") + days.astype("timedelta64[D]"), _UNIT)


def last_moment(iterations: int) -> np.datetime64:
    """Tell the moment at which a growth of so many iterations has been played.

    Parameters
    ----------
    iterations
        Number of the last iteration, at least 0.
    """
    return np.datetime64(moments(np.array([iterations + 1]))[0])
