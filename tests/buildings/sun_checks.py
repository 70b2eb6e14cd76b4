"""Ground for tests of the sun, and the sun by other means than the library's."""

from __future__ import annotations

import datetime
import math

import numpy as np
import shapely
from platwright.buildings.rules import SunRule
from platwright.buildings.sun import sun_track
from platwright.buildings.types import BuildingType, Placements
from platwright.buildings.zone import Patch, Zone
from pyproj import CRS
from shapely import affinity
from shapely.geometry import LineString, MultiLineString, Point, Polygon, box

UTM = CRS.from_epsg(25833)
#: A house, a tower and a low facility.
KINDS = (
    BuildingType("house", 20.0, 12.0, 18.0, 6),
    BuildingType("tower", 14.0, 14.0, 45.0, 15),
    BuildingType("shop", 30.0, 10.0, 4.0, 1, use="facility"),
)


def zone_at(
    latitude: float, longitude: float = 15.0, convergence: float = 0.0, facing: float | None = None
) -> Zone:
    """Return an empty square zone somewhere on the earth."""
    polygon = box(0, 0, 300, 300)
    patch = Patch(polygon, MultiLineString([polygon.exterior.coords]), facing_deg=facing)
    return Zone(
        "zone", 1, polygon, UTM, UTM, latitude, longitude, convergence, (), (patch,)
    )  # fmt: skip


def placed(*buildings: tuple[int, float, float, float]) -> Placements:
    """Return buildings from (type, x, y, facing)."""
    table = np.array(buildings, dtype=float).reshape(-1, 4)
    none = np.zeros(len(table), dtype=np.int64)
    return Placements(table[:, 0].astype(np.int64), table[:, 1:3], table[:, 3], none, none)


def scattered(count: int, seed: int, width: float = 300.0, faces: tuple[float, ...] = (180.0,)):
    """Return buildings of `KINDS` at random; they may overlap."""
    rng = np.random.default_rng(seed)
    none = np.zeros(count, dtype=np.int64)
    return Placements(
        rng.integers(0, len(KINDS), count), rng.uniform(0, width, (count, 2)),
        rng.choice(faces, count), none, none,
    )  # fmt: skip


def turned(buildings: Placements, degrees: float) -> Placements:
    """Return buildings turned clockwise about the origin."""
    a = math.radians(degrees)
    x, y = buildings.xy.T
    xy = np.column_stack([x * math.cos(a) + y * math.sin(a), y * math.cos(a) - x * math.sin(a)])
    facing = (buildings.facing + degrees) % 360
    return Placements(buildings.type, xy, facing, buildings.patch, buildings.line)


def outline(kinds, buildings: Placements, at: int) -> Polygon:
    """Return a footprint, by shapely's own turning."""
    kind = kinds[buildings.type[at]]
    flat = box(-kind.length_m / 2, -kind.width_m / 2, kind.length_m / 2, kind.width_m / 2)
    # At facing 180 the façade looks to -y; shapely turns counter-clockwise.
    turn = affinity.rotate(flat, 180.0 - buildings.facing[at], origin=(0, 0))
    return affinity.translate(turn, *buildings.xy[at])


def noaa_sun(latitude: float, longitude: float, rule: SunRule, hour: float):
    """Return azimuth and altitude at a true solar time in 2024, by NOAA's solar calculator.

    Declination and spherical triangle of the calculator's spreadsheet (Meeus, Astronomical
    Algorithms, chapter 25, low precision), good to about 0.01 degrees.
    """
    day = datetime.datetime(2024, rule.month, rule.day, tzinfo=datetime.timezone.utc)
    epoch = datetime.datetime(2000, 1, 1, 12, tzinfo=datetime.timezone.utc)
    days = (day - epoch).total_seconds() / 86400 + (hour - longitude / 15) / 24
    century = days / 36525
    mean_long = (280.46646 + century * (36000.76983 + century * 0.0003032)) % 360
    anomaly = math.radians(357.52911 + century * (35999.05029 - 0.0001537 * century))
    centre = (
        math.sin(anomaly) * (1.914602 - century * (0.004817 + 0.000014 * century))
        + math.sin(2 * anomaly) * (0.019993 - 0.000101 * century)
        + math.sin(3 * anomaly) * 0.000289
    )
    node = math.radians(125.04 - 1934.136 * century)
    apparent = math.radians(mean_long + centre - 0.00569 - 0.00478 * math.sin(node))
    obliquity = math.radians(
        23 + (26 + 21.448 / 60) / 60 - 0.0130042 * century + 0.00256 * math.cos(node)
    )
    declination = math.asin(math.sin(obliquity) * math.sin(apparent))
    angle, phi = math.radians(15 * (hour - 12)), math.radians(latitude)
    altitude = math.asin(
        math.sin(phi) * math.sin(declination)
        + math.cos(phi) * math.cos(declination) * math.cos(angle)
    )
    azimuth = math.atan2(
        -math.cos(declination) * math.sin(angle),
        math.cos(phi) * math.sin(declination)
        - math.sin(phi) * math.cos(declination) * math.cos(angle),
    )
    return math.degrees(azimuth) % 360, math.degrees(altitude)


def hidden(spot: Point, azimuth: float, altitude: float, height: float, others) -> bool:
    """Tell whether a prism hides the sun from a spot.

    Parameters
    ----------
    spot, height
        Where, and how high above the ground (metres).
    azimuth, altitude
        Of the sun, degrees, on the grid.
    others
        Pairs of a footprint and its height, metres.
    """
    a = math.radians(azimuth)
    for footprint, top in others:
        reach = (top - height) / math.tan(math.radians(altitude))
        if reach <= 0:
            continue
        end = (spot.x + reach * math.sin(a), spot.y + reach * math.cos(a))
        if shapely.intersects(LineString([spot, end]), footprint):
            return True
    return False


def slow_hours(zone: Zone, kinds, buildings: Placements, rule: SunRule) -> list[float]:
    """Return hours of sun at façades, ray by ray with shapely.

    The sun is the library's, of which test_sun_track tells that it is right: two suns that differ
    in the last digit would differ about rays that just pass a corner.
    """
    track = sun_track(zone.latitude, zone.longitude, rule)
    count = len(track.hours) - 1
    weights = np.full(count + 1, (rule.end - rule.start) / count)
    weights[[0, -1]] /= 2
    suns = list(zip(track.azimuth_deg, track.altitude_deg))
    outlines = [outline(kinds, buildings, at) for at in range(len(buildings))]
    tops = [kinds[t].height_m for t in buildings.type]
    result = []
    for at in range(len(buildings)):
        kind, facing = kinds[buildings.type[at]], math.radians(buildings.facing[at])
        out = np.array([math.sin(facing), math.cos(facing)])
        along = np.array([-out[1], out[0]])
        front = buildings.xy[at] + out * (kind.width_m / 2 + 0.01)
        spots = [Point(front + along * kind.length_m * t) for t in (-0.25, 0.0, 0.25)]
        others = [(o, t) for k, (o, t) in enumerate(zip(outlines, tops)) if k != at]
        total = 0.0
        for (azimuth, altitude), weight in zip(suns, weights):
            grid = azimuth - zone.convergence_deg
            sun = np.array([math.sin(math.radians(grid)), math.cos(math.radians(grid))])
            if altitude < 3 or sun @ out <= 0.01:
                continue
            seen = sum(not hidden(s, grid, altitude, rule.sill_m, others) for s in spots)
            total += weight * (seen >= 2)
        result.append(total)
    return result
