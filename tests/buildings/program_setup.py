"""Small zones and lines of which programs can be checked by trying everything."""

from __future__ import annotations

import numpy as np
import shapely
from platwright.buildings.types import FACILITY, BuildingType
from platwright.buildings.zone import ControlLine, Corridor, Patch, Zone
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, Polygon, box

UTM = CRS.from_epsg(32650)
#: RZ Table 4, demo 1 and 2.
MULTISTOREY = (
    BuildingType("a", 10.8, 10.2, 18.0, 6),
    BuildingType("b", 16.0, 13.0, 24.0, 8),
    BuildingType("c", 18.8, 15.4, 18.0, 6),
    BuildingType("d", 20.0, 18.0, 9.0, 3),
    BuildingType("e", 30.0, 30.0, 9.0, 3, use=FACILITY, entrance="same"),
    BuildingType("f", 15.0, 10.0, 6.0, 2, use=FACILITY, entrance="same"),
)
HIGHRISE = (
    BuildingType("a", 16.3, 12.3, 60.0, 20),
    BuildingType("b", 13.9, 13.0, 36.0, 12),
    BuildingType("c", 13.8, 14.5, 60.0, 20),
    BuildingType("f", 15.0, 10.0, 6.0, 2, use=FACILITY, entrance="same"),
)


def patch_of(polygon: Polygon, streets: list[LineString], half: float, **options) -> Patch:
    """A patch with access along the streets that it touches."""
    space = shapely.union_all([street.buffer(half + 0.05, cap_style="flat") for street in streets])
    parts = shapely.get_parts(shapely.line_merge(polygon.exterior.intersection(space)))
    return Patch(
        polygon,
        MultiLineString([part for part in parts if part.geom_type == "LineString"]),
        **options,
    )


def plain_zone(polygon: Polygon, *, latitude: float = 40.0, **options) -> Zone:
    """One patch with a street along the longest side of its ring."""
    ring = np.array(polygon.exterior.coords)
    step = np.diff(ring, axis=0)
    at = int(np.argmax(np.hypot(*step.T)))
    out = np.array([step[at, 1], -step[at, 0]]) / np.hypot(*step[at])
    if polygon.contains(shapely.Point(ring[at] + step[at] / 2 + out * 0.1)):
        out = -out
    street = LineString([ring[at] + out * 6.0, ring[at + 1] + out * 6.0])
    return make_zone(polygon, [street], [patch_of(polygon, [street], 6.0, **options)], latitude)


def make_zone(
    polygon: Polygon, streets: list[LineString], patches: list[Patch], latitude: float = 40.0
) -> Zone:
    """A zone whose grid north is true north."""
    return Zone(
        name="Zones",
        feature="1",
        polygon=polygon,
        crs=UTM,
        source_crs=UTM,
        latitude=latitude,
        longitude=117.0,
        convergence_deg=0.0,
        corridors=tuple(Corridor(street, 12.0, 2, edge=True) for street in streets),
        patches=tuple(patches),
    )


def crossed_zone(width: float = 360.0, depth: float = 300.0) -> Zone:
    """A rectangle (10.8 ha by default) that two streets of 14 m cut into four patches."""
    ground = box(0, 0, width, depth)
    streets = [
        LineString([(width / 2, 0), (width / 2, depth)]),
        LineString([(0, depth / 2), (width, depth / 2)]),
        LineString([(0, -7), (width, -7)]),
    ]
    space = shapely.union_all([street.buffer(7.0, cap_style="flat") for street in streets])
    parts = shapely.get_parts(ground.difference(space))
    return make_zone(ground, streets, [patch_of(part, streets, 7.0) for part in parts])


def rows(zone: Zone, pitch: float, *, first: float = 14.0, facing: float = 180.0) -> tuple:
    """Parallel lines from west to east through every patch."""
    made = []
    for at, patch in enumerate(zone.patches):
        x0, y0, x1, y1 = patch.polygon.bounds
        made += [
            ControlLine((x0, float(y)), (x1, float(y)), facing, at, order=k)
            for k, y in enumerate(np.arange(y0 + first, y1 - 10.0, pitch))
        ]
    return tuple(made)
