"""Where the sun stands in the window of a sun rule."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ...errors import MissingDependencyError
from ..rules import SunRule
from ..shape import facing_vectors
from ..types import Floats
from ..zone import Zone

#: A lower sun counts as no sun: its light is weak, and hills and trees that no plan knows hide it.
LOW_SUN_DEG = 3.0
#: The year of the check, so that the same plan comes out every year; it has a 29 February. The
#: declination of a day differs by up to 0.2 degrees from year to year.
YEAR = 2024
#: Difference of terrestrial time and universal time in that year, seconds.
DELTA_T = 69.2
MISSING = (
    "The position of the sun needs the Python package pvlib, which is not installed. Install it "
    "(in QGIS: Settings > Options > Platwright; elsewhere: pip install pvlib) and run again."
)


@dataclass(frozen=True, eq=False)
class SunTrack:
    """The way of the sun through the window of a sun rule.

    Attributes
    ----------
    hours
        True solar time, hours, ascending, shape (k,): at 12 the sun stands in the meridian.
    azimuth_deg
        Degrees clockwise from true north, shape (k,).
    altitude_deg
        Degrees above the horizon, without refraction; negative at night, shape (k,).
    """

    hours: Floats
    azimuth_deg: Floats
    altitude_deg: Floats

    @property
    def weights(self) -> Floats:
        """Hours that each instant stands for, by the trapezoid rule; their sum is the window."""
        half = np.diff(self.hours) / 2
        both: Floats = np.append(half, 0.0) + np.append(0.0, half)
        return both


@dataclass(frozen=True, eq=False)
class SunSteps:
    """The instants of a track at which the sun counts, as seen on the grid of a zone.

    Attributes
    ----------
    hours
        True solar time, shape (k,).
    weight
        Hours that each instant stands for, shape (k,).
    towards
        Unit vectors to the sun's azimuth in the working CRS, shape (k, 2).
    tangent
        Tangent of the altitude, shape (k,): a shadow is height / tangent long.
    """

    hours: Floats
    weight: Floats
    towards: Floats
    tangent: Floats

    def __len__(self) -> int:
        return len(self.weight)


@functools.lru_cache(maxsize=64)
def sun_track(latitude: float, longitude: float, rule: SunRule) -> SunTrack:
    """Follow the sun through the window of a sun rule.

    The position is that of pvlib's solar position algorithm (Reda and Andreas 2004), good to
    0.001 degrees. True solar time depends on the longitude only by the time that passes, so the
    altitude at noon is that of the latitude alone.

    Parameters
    ----------
    latitude, longitude
        Degrees, north and east positive.
    rule
        Date, window and step.

    Returns
    -------
    SunTrack
        Its arrays cannot be written to, since they are shared by all who ask for the same.

    Raises
    ------
    MissingDependencyError
        If pvlib is not installed.

    Examples
    --------
    On 21 June the noon sun stands 23.4 degrees from the zenith at the equator, in the north.

    >>> track = sun_track(0.0, 10.0, SunRule(month=6, day=21, start=11, end=13, step_minutes=60))
    >>> track.hours
    array([11., 12., 13.])
    >>> float(track.altitude_deg[1].round(1)), bool(abs(track.azimuth_deg[1]) % 360 < 0.1)
    (66.6, True)
    """
    try:
        from pvlib import spa
    except ImportError as error:
        raise MissingDependencyError(MISSING) from error

    step = rule.step_minutes / 60
    inner = np.arange(rule.start, rule.end - 1e-6, step)
    hours = np.append(inner, rule.end)
    midnight = np.datetime64(f"{YEAR}-{rule.month:02}-{rule.day:02}", "s").astype(np.int64)

    def position(seconds: Floats) -> Floats:
        found: Floats = np.asarray(
            spa.solar_position(seconds, latitude, longitude, 0.0, 0.0, 12.0, DELTA_T, 0.0)
        )
        return found

    mean_time = midnight + (hours - longitude / 15) * 3600
    equation_min = position(mean_time)[5]
    placed = position(mean_time - equation_min * 60)
    azimuth, altitude = placed[4] % 360, placed[3]
    for array in (hours, azimuth, altitude):
        array.setflags(write=False)
    return SunTrack(hours, azimuth, altitude)


def sun_steps(zone: Zone, rule: SunRule) -> SunSteps:
    """Give the instants at which the sun stands at least `LOW_SUN_DEG` high, on the grid.

    Parameters
    ----------
    zone
        Gives the place and the convergence of its grid.
    rule
        Date, window and step.

    Returns
    -------
    SunSteps
        Without instants where the sun does not rise that high.

    Raises
    ------
    MissingDependencyError
        If pvlib is not installed.
    """
    track = sun_track(zone.latitude, zone.longitude, rule)
    up = track.altitude_deg >= LOW_SUN_DEG
    return SunSteps(
        track.hours[up],
        track.weights[up],
        facing_vectors(track.azimuth_deg[up] - zone.convergence_deg),
        np.tan(np.radians(track.altitude_deg[up])),
    )
