"""Zones of one patch for control lines, and checks that know nothing of how lines are drawn."""

from __future__ import annotations

import math

import numpy as np
import shapely
from hypothesis import strategies as st
from platwright.buildings.rules import LayoutRules
from platwright.buildings.types import BuildingType
from platwright.buildings.zone import ControlLine, Corridor, Patch, Zone
from pyproj import CRS
from shapely import affinity
from shapely.geometry import LineString, MultiLineString, Point, Polygon

UTM = CRS.from_epsg(32633)
ORIGIN = (460_000.0, 5_550_000.0)
RULES = LayoutRules()
#: RZ Table 4, demo 1: length, height, width.
DEMO1 = ((10.8, 18.0, 10.2), (16.0, 24.0, 13.0), (18.8, 18.0, 15.4), (20.0, 9.0, 18.0))
FACILITIES = ((30.0, 9.0, 30.0), (15.0, 6.0, 10.0))
SLAB = ((45.0, 18.0, 12.0),)


def kinds(homes=DEMO1, others=FACILITIES, **more) -> tuple[BuildingType, ...]:
    """Building types from length, height and width."""
    return tuple(
        BuildingType(f"{use} {k}", length, width, height, max(1, round(height / 3)), use, **more)
        for use, table in (("residence", homes), ("facility", others))
        for k, (length, height, width) in enumerate(table)
    )


def one_patch(
    polygon: Polygon,
    residences: int = 1,
    facilities: int = 0,
    *,
    latitude: float = 50.0,
    convergence: float = 0.0,
    street: LineString | None = None,
    **patch,
) -> Zone:
    """A zone of one patch, moved to real coordinates; without a street its whole edge is one."""
    moved = affinity.translate(polygon, *ORIGIN)
    line = moved.exterior if street is None else affinity.translate(street, *ORIGIN)
    return Zone(
        name="Zones",
        feature="1",
        polygon=moved,
        crs=UTM,
        source_crs=UTM,
        latitude=latitude,
        longitude=15.0,
        convergence_deg=convergence,
        corridors=(Corridor(LineString(line.coords), 12.0, 2, "", edge=True),),
        patches=(
            Patch(moved, MultiLineString([line.coords]), residences, facilities, **patch),
        ),
    )  # fmt: skip


def local(line: ControlLine) -> np.ndarray:
    """Ends without the offset of the real coordinates, shape (2, 2)."""
    return np.array([line.start, line.end]) - ORIGIN


def box_of(xy, facing_deg: float, length: float, width: float) -> Polygon:
    """The outline of a building by plain trigonometry."""
    a = math.radians(facing_deg)
    out, side = np.array([math.sin(a), math.cos(a)]), np.array([math.cos(a), -math.sin(a)])
    u, v = side * length / 2, out * width / 2
    c = np.asarray(xy, dtype=float)
    return Polygon([c + u + v, c - u + v, c - u - v, c + u - v])


def ground_of(zone: Zone, rules: LayoutRules = RULES, number: int = 0):
    """What footprints may cover, to a hundredth of a millimetre."""
    shape = zone.patches[number].polygon.buffer(1e-5 - rules.setback_m, join_style="mitre")
    shapely.prepare(shape)
    return shape


def has_room(ground, line: ControlLine, types) -> bool:
    """Whether some building stands somewhere on a line."""
    a, b = np.array(line.start), np.array(line.end)
    length = float(np.hypot(*(b - a)))
    for kind in types:
        if kind.use != line.use:
            continue
        half = kind.length_m / 2
        places = {*np.linspace(0, length, max(3, int(length * 2))), half, length - half}
        for t in places:
            if 0 <= t <= length and ground.covers(
                box_of(a + (b - a) * t / length, line.facing_deg, kind.length_m, kind.width_m)
            ):
                return True
    return False


def fits_somewhere(ground, facing_deg: float, types, step: float = 2.0) -> bool:
    """Whether some residence stands on a raster of places, with a few centimetres to spare."""
    inner = ground.buffer(-0.05, join_style="mitre")
    if inner.is_empty:
        return False
    shapely.prepare(inner)
    x0, y0, x1, y1 = inner.bounds
    xs, ys = np.arange(x0, x1, step), np.arange(y0, y1, step)
    grid = np.array(np.meshgrid(xs, ys)).reshape(2, -1).T
    grid = grid[shapely.contains_xy(inner, *grid.T)]
    return any(
        inner.covers(box_of(xy, facing_deg, kind.length_m, kind.width_m))
        for kind in types
        if kind.use == "residence"
        for xy in grid
    )


def off(one: float, two: float) -> float:
    """Angle between two azimuths, degrees."""
    return abs((one - two + 180.0) % 360.0 - 180.0)


@st.composite
def grounds(draw, least: float = 12.0, most: float = 110.0) -> Polygon:
    """Random patches: stars of any shape, some with a pond."""
    n = draw(st.integers(3, 11))
    size = draw(st.floats(least, most))
    radii = draw(st.lists(st.floats(0.3, 1.0), min_size=n, max_size=n))
    turn = draw(st.floats(0.0, 2 * math.pi))
    angles = turn + np.arange(n) * 2 * math.pi / n
    shape = Polygon(
        np.column_stack([np.cos(angles), np.sin(angles)]) * size * np.array(radii)[:, None]
    )
    if draw(st.booleans()):
        pond = Point(draw(st.floats(-0.5, 0.5)) * size, draw(st.floats(-0.5, 0.5)) * size)
        cut = shape.difference(pond.buffer(draw(st.floats(1.0, 0.4 * size)), quad_segs=4))
        shape = max(shapely.get_parts(cut), key=lambda part: part.area, default=shape)
    return shape if shape.area > 1.0 else Polygon([(0, 0), (30, 0), (30, 30), (0, 30)])
