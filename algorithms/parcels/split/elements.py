"""Key elements: what the planner fixes before the streets are laid (UP section 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, MultiLineString, Polygon

from ...site.types import Site
from ..roadmesh import GivenStreet, Ground
from .layout import Remark

#: Land that is smaller is left over between key elements (square metres).
SCRAP = 50.0
#: Edges whose middle is this near to the frontage are part of it (metres).
ON_FRONTAGE = 0.05


@dataclass(frozen=True)
class KeyArea:
    """Land whose use the planner fixes.

    Attributes
    ----------
    polygon
        Metres.
    use
        What it is: park, water, school, commercial, or any other word.
    around
        Whether a new street runs around it, outside its edge. Else parcels back on to it.
    """

    polygon: Polygon
    use: str
    around: bool = False


@dataclass(frozen=True)
class Prepared:
    """A site made ready to be laid out.

    Attributes
    ----------
    grounds
        The land to lay out; several where key elements cut the site apart.
    areas
        The key areas as far as they lie in the site.
    remarks
        What a planner should know.
    """

    grounds: Sequence[Ground]
    areas: Sequence[KeyArea]
    remarks: Sequence[Remark]


def prepare_ground(
    site: Site,
    *,
    street_width: float,
    streets: Sequence[GivenStreet] = (),
    areas: Sequence[KeyArea] = (),
) -> Prepared:
    """Take key areas and obstacles off a site.

    Parameters
    ----------
    site
        The site, with its frontage and obstacles.
    street_width
        Of new streets around areas, and of the existing ones along the edge, metres.
    streets
        Main roads that split the site first.
    areas
        Areas whose use is fixed. Where two overlap, the land belongs to the first.
    """
    remarks: list[Remark] = []
    kept: list[KeyArea] = []
    taken: shapely.Geometry = shapely.union_all(
        [shapely.intersection(o, site.polygon) for o in site.obstacles]
    )
    given = [*streets, *(GivenStreet(s.line, street_width, s.name) for s in site.inner_streets)]
    for area in areas:
        shape = shapely.difference(shapely.intersection(area.polygon, site.polygon), taken)
        parts = [p for p in shapely.get_parts(shape) if p.geom_type == "Polygon" and p.area > 1.0]
        if not parts:
            remarks.append(
                Remark(
                    area.polygon.representative_point(),
                    f"this {area.use} lies outside the site, or under what comes before it",
                    "it is left out",
                    "warning",
                )
            )
        elif (lost := area.polygon.area - sum(part.area for part in parts)) > SCRAP:
            remarks.append(
                Remark(
                    parts[0].representative_point(),
                    f"{lost:.0f} m2 of this {area.use} lie outside the site, or under what comes "
                    "before it",
                    "they are left out",
                )
            )
        for part in parts:
            kept.append(KeyArea(part, area.use, area.around))
            if area.around:
                given += _streets_around(part, site, street_width)
            taken = shapely.union_all([taken, part])
    land = shapely.difference(site.polygon, taken) if not taken.is_empty else site.polygon
    grounds = []
    for part in shapely.get_parts(land):
        if part.geom_type != "Polygon" or part.area < SCRAP:
            continue
        edges = _frontage(part, site)
        centres = MultiLineString([s.line for s in site.boundary_streets])
        grounds.append(Ground(part, edges, centres, street_width, tuple(given)))
    return Prepared(grounds, kept, remarks)


def _streets_around(part: Polygon, site: Site, width: float) -> list[GivenStreet]:
    """Streets along the edge of an area, but not along the edge of the site."""
    ring = shapely.buffer(part, width / 2, join_style="mitre").exterior
    inside = shapely.intersection(ring, shapely.buffer(site.polygon, -width))
    merged = shapely.line_merge(inside) if inside.geom_type == "MultiLineString" else inside
    return [
        GivenStreet(LineString(line.coords), width)
        for line in shapely.get_parts(merged)
        if line.geom_type in ("LineString", "LinearRing") and line.length > width
    ]


def _frontage(part: Polygon, site: Site) -> MultiLineString:
    """Edges of a piece of the site that lie on its frontage."""
    if site.street_frontage.is_empty:
        return MultiLineString()
    kept: list[npt.NDArray[np.float64]] = []
    for ring in (part.exterior, *part.interiors):
        xy = shapely.get_coordinates(ring)
        middles = shapely.points((xy[1:] + xy[:-1]) / 2)
        on = np.flatnonzero(shapely.distance(middles, site.street_frontage) < ON_FRONTAGE)
        kept += [xy[k : k + 2] for k in on]
    return MultiLineString(kept)
