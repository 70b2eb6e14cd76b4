"""A zone that was laid out by hand: rows of buildings on both sides of a winding street."""

from __future__ import annotations

import math

import numpy as np
import shapely
from platwright.buildings.details import lay_details
from platwright.buildings.layout import Finding, Layout, Path, PathPlan, Score
from platwright.buildings.rules import LayoutRules, SunRule
from platwright.buildings.shape import entrances, facing_vectors, footprints
from platwright.buildings.types import BuildingType, Placements
from platwright.buildings.zone import Corridor, Patch, Zone
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, Point

UTM = CRS.from_epsg(32633)
TYPES = (
    BuildingType("slab", 24.0, 12.0, 18.0, 6, dwellings=24, parking=0.5, share=0.7),
    BuildingType("tower", 16.0, 16.0, 33.0, 11, dwellings=44, parking=0.5),
    BuildingType("shop", 30.0, 14.0, 6.0, 2, use="facility", entrance="same", parking=1.0),
)
RULES = LayoutRules(sun=SunRule(coefficient=1.0))
#: South-west corner of the zone, metres.
ORIGIN = (460_000.0, 5_550_000.0)
SIZE = (320.0, 220.0)
WIDTH = 12.0


def winding(x: float, bend: float = 15.0) -> LineString:
    """A street from south to north."""
    t = np.linspace(0.0, 1.0, 41)
    xy = np.column_stack([x + bend * np.sin(2 * np.pi * t), t * SIZE[1]])
    return LineString(xy + ORIGIN)


def make_zone(
    *, source: CRS = UTM, level: int = 3, bend: float = 15.0, obstacles=(), site_id: int = 1
) -> Zone:
    """Two patches beside a street, with another street along the southern edge."""
    x0, y0 = ORIGIN
    polygon = shapely.box(x0, y0, x0 + SIZE[0], y0 + SIZE[1])
    street = winding(SIZE[0] / 2, bend)
    edge = LineString([(x0, y0 - 6.0), (x0 + SIZE[0], y0 - 6.0)])
    space = shapely.union_all([street.buffer(WIDTH / 2), *obstacles])
    patches = []
    for ground in shapely.get_parts(polygon.difference(space)):
        along = [
            ground.exterior.intersection(street.buffer(WIDTH / 2 + 0.01)),
            ground.exterior.intersection(edge.buffer(6.01, cap_style="flat")),
        ]
        lines = [
            part
            for part in shapely.get_parts(shapely.get_parts(along))
            if part.geom_type == "LineString" and part.length > 0.1
        ]
        patches.append(Patch(ground, MultiLineString(lines), facilities=0, feature="7"))
    return Zone(
        name="Zones",
        feature="1",
        polygon=polygon,
        crs=UTM,
        source_crs=source,
        latitude=50.1,
        longitude=14.4,
        convergence_deg=-0.4,
        corridors=(
            Corridor(street, WIDTH, level, "Mill Street"),
            Corridor(edge, 12.0, 2, "", edge=True),
        ),
        patches=tuple(patches),
        obstacles=tuple(obstacles),
        site_id=site_id,
    )


def make_placements(zone: Zone) -> Placements:
    """Rows of slabs, every second pair of them touching, a row of towers and two shops."""
    x0, y0 = ORIGIN
    rows = []
    for row, y in enumerate((20.0, 62.0, 104.0, 146.0, 188.0)):
        kind = 1 if row == 3 else 0
        for at, x in enumerate((20.0, 44.0, 78.0, 102.0, 206.0, 230.0, 264.0, 288.0)):
            place = 2 if row == 0 and at in (2, 6) else kind
            shift = 3.0 if place == 2 else 0.0
            if row == 0 and at in (3, 7):
                continue
            rows.append((place, x0 + x + shift, y0 + y, 180.0, int(x > 160)))
    table = np.array(rows)
    patch = [
        next(k for k, p in enumerate(zone.patches) if p.polygon.contains(Point(r[1:3])))
        for r in rows
    ]
    return Placements(
        table[:, 0].astype(np.int64), table[:, 1:3], table[:, 3], np.array(patch, dtype=np.int64),
        np.zeros(len(rows), dtype=np.int64),
    )  # fmt: skip


def make_paths(zone: Zone, placed: Placements) -> PathPlan:
    """A path along the entrances of every row to the winding street, one of each building to it."""
    points, outward = entrances(TYPES, placed)
    stops = points + outward * 4.0
    street = zone.corridors[0].line
    paths, length = [], np.zeros(len(placed))
    for patch in np.unique(placed.patch):
        for y in np.unique(stops[placed.patch == patch, 1]):
            own = np.flatnonzero((placed.patch == patch) & (stops[:, 1] == y))
            x = stops[own, 0]
            way = LineString([(x.min(), y), (x.max(), y)])
            far = way.interpolate(way.project(Point(*street.centroid.coords[0])))
            start = x.min() if far.x > x.mean() else x.max()
            end = ORIGIN[0] + SIZE[0] / 2
            line = LineString([(start, y), (end, y)]).intersection(zone.patches[patch].polygon)
            exit_ = Point(min(line.coords, key=lambda c: abs(c[0] - end)))
            paths.append(Path(line, "shared", tuple(own.tolist()), exit_, 0, int(patch)))
            length[own] = np.abs(x - exit_.x) + 4.0
    for k, (here, stop) in enumerate(zip(points, stops)):
        paths.append(
            Path(LineString([here, stop]), "entrance", (k,), None, 0, int(placed.patch[k]))
        )
    n = len(placed)
    return PathPlan(
        tuple(paths), np.ones(n, dtype=bool), length, np.ones(n), np.zeros(n), np.full(n, 0.2)
    )


def make_layout(*, source: CRS = UTM, rules: LayoutRules = RULES, findings=(), **options) -> Layout:
    """The zone with its buildings, paths and details; sun and score are made up."""
    zone = make_zone(source=source, **options)
    placed = make_placements(zone)
    plan = make_paths(zone, placed)
    return Layout(
        zone=zone,
        types=TYPES,
        placements=placed,
        group=make_groups(placed),
        sun_hours=np.linspace(1.0, 6.0, len(placed)),
        shadows=tuple(shadow(k, placed) for k in range(len(placed))),
        paths=plan,
        details=lay_details(zone, TYPES, rules, placed, plan),
        score=Score(0.1, 0.8, 0.4, 0.0, 0.2),
        method="staged",
        seed=rules.seed,
        seconds=1.5,
        findings=tuple(findings),
    )


def make_groups(placed: Placements) -> np.ndarray:
    """Numbers of buildings that touch."""
    shapes = footprints(TYPES, placed)
    group = np.arange(len(placed))
    for i in range(len(placed)):
        for j in range(i):
            if shapes[i].distance(shapes[j]) < 0.01:
                group[group == group[i]] = group[j]
    return np.unique(group, return_inverse=True)[1]


def shadow(k: int, placed: Placements) -> shapely.Geometry:
    """The rectangle behind a building, as deep as it is high."""
    kind = TYPES[int(placed.type[k])]
    out = facing_vectors(placed.facing[k : k + 1])[0]
    x, y = placed.xy[k] - out * (kind.width_m + kind.height_m) / 2
    angle = -float(placed.facing[k])
    box = shapely.box(-kind.length_m / 2, -kind.height_m / 2, kind.length_m / 2, kind.height_m / 2)
    turned = shapely.affinity.rotate(box, angle, origin=(0, 0))
    return shapely.affinity.translate(turned, float(x), float(y))


def finding(zone: Zone) -> Finding:
    """Something to tell."""
    return Finding("A corner is steep.", "Look at it.", "warning", zone.patches[0].polygon)


def ground_of(layout: Layout) -> float:
    """Area of the zone, square metres."""
    return math.prod(SIZE)
