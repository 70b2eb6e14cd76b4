"""Drawings of commerce, school, park, areas, and of what stands on parcels."""

from __future__ import annotations

from typing import Any

from platwright.parcels.templates import CornerMark, Face, Template
from shapely.geometry import Point, Polygon, box

from _template_drawing import LOT, STREET, D, Pairs, land, line, street


def others() -> list[Template]:
    """Draw commerce, school and park."""
    pad = [
        land(box(0, 0, 90, 34), "parking", tolerance=1.0),
        Face(box(18, 34, 72, 60), "building", width_min=0.7, width_max=1.5, tolerance=0.5),
        land(box(0, 34, 18, 60), "green"),
        land(box(72, 34, 90, 60), "green"),
    ]
    school = [
        Face(box(20, 10, 80, 40), "building", width_min=0.8, width_max=1.3, tolerance=0.5),
        land(box(0, 0, 20, 40), "parking", tolerance=1.0),
        land(box(80, 0, 130, 40), "green"),
        land(box(20, 0, 80, 10), "court"),
        land(box(0, 40, 130, 95), "green"),
    ]
    ring = box(0, 0, 100, 100)
    marks = [CornerMark(Point(p), "regular") for p in ring.exterior.coords[:-1]]
    return [
        Template(
            "Commercial pad with parking", 2, "commercial", tuple(pad),
            (line("street", (0, 0), (90, 0)),), mirror=True,
            description="A shop with parking towards the street and green beside it.",
        ),
        Template(
            "School", 2, "school", tuple(school), (line("street", (0, 0), (130, 0)),), mirror=True,
            description="A school, its yard and parking towards the street, fields behind.",
        ),
        Template(
            "Park", 2, "park", (land(ring, "green"),), (), tuple(marks),
            description="A park of any shape.",
        ),
    ]  # fmt: skip


def areas() -> list[Template]:
    """Draw areas that are filled by blocks."""
    length, depth = 126.0, 2 * D
    free: dict[str, Any] = {"width_min": 0.5, "width_max": 2.0, "depth_min": 0.75, "depth_max": 1.3}
    top = 2 * depth + STREET

    def block(shape: Polygon, **more: Any) -> Face:
        return Face(shape, "block", **(free | more))

    two = [
        block(box(0, 0, length, depth)),
        street(box(0, depth, length, depth + STREET), 90.0),
        block(box(0, depth + STREET, length, top)),
    ]
    ladder = [
        block(box(0, 0, depth, length), axis=90.0),
        street(box(depth, 0, depth + STREET, length), 0.0, repeat="x"),
        block(box(depth + STREET, 0, 2 * depth + STREET, length), axis=90.0, repeat="x"),
    ]
    x1, x2 = depth, depth + STREET
    return [
        Template(
            "Two blocks and a street", 1, "area", tuple(two),
            (line("street", (0, depth), (0, depth + STREET)),
             line("street", (length, depth), (length, depth + STREET)),
             line("centre", (0, depth + STREET / 2), (length, depth + STREET / 2))), **LOT,
            description="A street through the middle of land two blocks deep.",
        ),
        Template(
            "Blocks side by side", 1, "area", tuple(ladder),
            (line("street", (x1, 0), (x2, 0)), line("street", (x1, length), (x2, length)),
             line("centre", ((x1 + x2) / 2, 0), ((x1 + x2) / 2, length))), **LOT,
            description="Blocks in a row with a street between each and the next.",
        ),
    ]  # fmt: skip


def parcels() -> list[Template]:
    """Draw what stands on parcels."""
    firm: dict[str, Any] = {"tolerance": 0.2, "width_min": 0.75, "width_max": 1.3}
    firm |= {"depth_min": 0.75, "depth_max": 1.3}

    def garden(shape: Pairs | Polygon) -> Face:
        return land(shape, "garden", width_min=0.1, width_max=6.0, tolerance=5.0)

    def front() -> list[Face]:
        return [
            Face(box(2, 6, 12.5, 17), "house", **firm),
            Face(box(12.5, 0, 16, 17), "driveway", **(firm | {"depth_max": 2.0})),
            garden([(0, 0), (12.5, 0), (12.5, 6), (2, 6), (2, 17), (0, 17)]),
            garden(box(16, 0, 18, 17)),
        ]

    rear = garden([(0, 17), (18, 17), (18, 30), (0, 30)])
    west = garden([(0, 17), (8, 17), (8, 21), (4, 21), (4, 25), (8, 25), (8, 30), (0, 30)])
    east = garden([(8, 17), (18, 17), (18, 30), (8, 30), (8, 25), (12, 25), (12, 21), (8, 21)])
    pool = Face(box(4, 21, 12, 25), "pool", **firm)
    row = [
        Face(box(0, 4, 6, 15), "house", **(firm | {"width_min": 0.6, "width_max": 1.5})),
        land(box(0, 0, 6, 4), "garden", tolerance=5.0),
        land(box(0, 15, 6, 27), "garden", tolerance=5.0),
    ]
    road = (line("street", (0, 0), (18, 0)),)
    return [
        Template(
            "House", 3, "parcel", (*front(), rear), road, mirror=True,
            description="A house with a driveway beside it and a garden behind.",
        ),
        Template(
            "House with pool", 3, "parcel", (*front(), west, east, pool), road, probability=0.3,
            mirror=True, description="The same with a pool in the garden.",
        ),
        Template(
            "Townhouse", 3, "parcel", tuple(row), (line("street", (0, 0), (6, 0)),),
            description="A house from side to side, a small garden in front and a long one behind.",
        ),
    ]  # fmt: skip
