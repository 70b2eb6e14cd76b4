"""Small towns for the tests, and ways to design their sub-regions that go wrong."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import geopandas as gpd
from shapely.geometry import LineString, box

#: A corner at which EPSG:32632 is true to scale.
X, Y = 500_000.0, 5_200_000.0
#: Where workers that fail once leave their mark.
MARK = "PLATWRIGHT_TEST_MARK"


def lines(rows, column="highway"):
    """Return lines with classes; coordinates from the corner."""
    return gpd.GeoDataFrame(
        {column: [kind for kind, _ in rows]},
        geometry=[LineString([(X + x, Y + y) for x, y in xy]) for _, xy in rows],
        crs=32632,
    )


def ground(width, height):
    """Return a rectangle as a municipality."""
    return gpd.GeoDataFrame(geometry=[box(X, Y, X + width, Y + height)], crs=32632)


def cross_town():
    """Four sub-regions of 400 by 300 m around a crossing, with two streets that meet a road."""
    roads = lines([
        ("primary", [(0, 300), (800, 300)]),
        ("secondary", [(400, 0), (400, 600)]),
        ("residential", [(210, 300), (210, 420)]),
        ("residential", [(600, 100), (600, 500)]),
    ])  # fmt: skip
    return ground(800, 600), roads


def _mark(item):
    """Return a file that says that a sub-region was begun before."""
    middle = item.site.polygon.representative_point()
    return Path(os.environ[MARK]) / f"{middle.x:.0f} {middle.y:.0f}"


def plain(item, _progress):
    """Return a result of one street, without a search."""
    x0, y0, x1, y1 = item.site.polygon.bounds
    street = {"level": 3, "status": "new", "xy": [[x0 + 60, y0 + 60], [x1 - 60, y1 - 60]]}
    missing = (
        "dist_to_sink_m", "dist_start_m", "dist_end_m", "direction", "speed_kmh", "turning_m",
        "oneway", "length_m",
    )  # fmt: skip
    numbers = dict.fromkeys(
        ("total_length", "mean_distance", "max_distance", "objective", "bound", "achieved_gap"), 1.0
    )
    made = {
        "streets": [{**dict.fromkeys(missing), **street}],
        "remarks": [],
        "numbers": numbers,
        "by_clock": False,
        "seconds": 0.1,
    }
    return json.dumps(made, sort_keys=True)


def killed_once(item, progress):
    """Be killed at the first attempt of every sub-region."""
    mark = _mark(item)
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return plain(item, progress)


def poisoned(item, progress):
    """Fail for a reason that nobody foresaw, where the largest x is."""
    if item.site.polygon.bounds[2] > X + 790 and item.site.polygon.bounds[3] > Y + 590:
        msg = "poison"
        raise ZeroDivisionError(msg)
    return plain(item, progress)


def refused(item, progress):
    """Refuse with a sentence unless less is asked."""
    from platwright.errors import InfeasibleError

    if not item.looser:
        raise InfeasibleError("No street network satisfies all rules at once.")
    return plain(item, progress)


def killed_in_the_middle(item, progress):
    """Bring the whole run down after two sub-regions."""
    folder = Path(os.environ[MARK])
    done = len(list(folder.iterdir()))
    if done == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    (folder / str(done)).touch()
    return plain(item, progress)
