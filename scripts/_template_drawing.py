"""What the drawings of templates are made of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from platwright.parcels.templates import Edge, Face, Template
from platwright.parcels.templates.mesh import topology
from shapely.geometry import LineString, Polygon

Pairs = Sequence[tuple[float, float]]
W, D = 18.0, 30.0  # a lot
STREET = 15.0  # of a cul-de-sac, fence to fence
LANE = 6.0
HEAD = 11.0  # radius of a turning head
THROAT = 10.0  # radius of the curves that lead into it
#: Fields of every template of blocks: drawn for the lot above.
LOT: dict[str, Any] = {"lot_width": W, "lot_depth": D}


def lot(shape: Pairs | Polygon, axis: float = 0.0, **more: Any) -> Face:
    """Draw a parcel; axis is the direction of its front."""
    options = {"width_min": 0.6, "width_max": 1.6, "depth_min": 0.7, "depth_max": 1.5} | more
    return Face(Polygon(shape), "parcel", "rectangle", axis=axis, **options)


def land(shape: Pairs | Polygon, label: str, **more: Any) -> Face:
    """Draw land that takes the shape that is left."""
    options = {"width_min": 0.3, "width_max": 3.0, "depth_min": 0.3, "depth_max": 3.0}
    options |= {"tolerance": 4.0} | more
    return Face(Polygon(shape), label, "affine", **options)


def street(shape: Pairs | Polygon, axis: float, label: str = "street", **more: Any) -> Face:
    """Draw a street or lane whose width is kept; axis is the direction across it."""
    options: dict[str, Any] = {"width_min": 0.95, "width_max": 1.1, "tolerance": 0.2}
    options |= {"depth_min": 0.2, "depth_max": 5.0}
    return Face(Polygon(shape), label, "rectangle", axis=axis, **(options | more))


def line(meaning: str, *points: tuple[float, float]) -> Edge:
    """Draw an edge."""
    return Edge(LineString(points), meaning)  # type: ignore[arg-type]


def outline(template: Template) -> Polygon:
    """Join the faces of a template."""
    mesh = topology([face.polygon for face in template.faces])
    z = mesh.points[mesh.outline]
    return Polygon([(p.real, p.imag) for p in z])
