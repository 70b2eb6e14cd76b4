"""Checks of a street network against its site: coverage, obstacles, the edge, wished lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString

from .graph import BoolArray
from .layers import TOUCH, StreetLayer
from .problems import Problem

#: Polygon, range in metres, and how messages name it.
Area = tuple[shapely.Geometry, float, str]

#: A street may graze an obstacle or leave the site over this length (metres).
GRAZE = 1.0
#: Half the width of the ground that belongs to an existing street (metres).
RIGHT_OF_WAY = 15.0
#: Narrowest and widest distance of the sample points of the coverage check (metres).
SAMPLE_RANGE = (2.0, 20.0)


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What lies around a network, each united, in the working CRS; empty where unknown.

    Attributes
    ----------
    site
        The polygons to design.
    boundary_streets
        Centre lines of existing streets along the edge.
    obstacles
        Polygons that must stay free.
    required, forbidden
        Lines that must be streets, or that no street may meet.
    snap_distance
        The edge of the site lies on an existing street that is at most this far, in metres.
    """

    site: shapely.Geometry
    boundary_streets: shapely.Geometry
    obstacles: shapely.Geometry
    required: shapely.Geometry
    forbidden: shapely.Geometry
    snap_distance: float

    @property
    def frontage(self) -> shapely.Geometry:
        """The parts of the site's edge that run along an existing street."""
        if self.site.is_empty or self.boundary_streets.is_empty:
            return shapely.GeometryCollection()
        return self.site.boundary.intersection(self.boundary_streets.buffer(self.snap_distance))

    @property
    def has_exits(self) -> bool:
        """Tell whether it is known where traffic may leave the site."""
        return not (self.boundary_streets.is_empty and self.site.is_empty)

    def sink_nodes(self, streets: StreetLayer) -> BoolArray:
        """Tell which nodes lie where traffic leaves, shape (n,).

        That is on existing streets: of the layer itself, along the edge, or the frontage
        that stands for them. Where no street along the edge is given, the whole edge counts.
        """
        graph = streets.graph
        sinks = np.zeros(len(graph.nodes), dtype=bool)
        sinks[graph.ends[streets.existing].ravel()] = True
        if not self.boundary_streets.is_empty:
            sinks |= graph.near(self.boundary_streets, TOUCH) | graph.near(self.frontage, TOUCH)
        elif not self.site.is_empty:
            sinks |= graph.near(self.site.boundary, TOUCH)
        return sinks


def coverage_gaps(
    streets: StreetLayer, around: Surroundings, reach: float, part: Area | None = None
) -> tuple[list[Problem], float]:
    """Find ground further than a distance from every street and from the frontage.

    Sample points stand on a grid inside the site, outside obstacles.

    Parameters
    ----------
    streets
        The streets; existing ones give coverage too.
    around
        The site and its surroundings.
    reach
        Largest distance in metres, straight.
    part
        Part of the site to look at, with its name, in place of all; its range is not read.

    Returns
    -------
    list, float
        One problem per connected gap, and the area of all gaps in square metres.
    """
    step = float(np.clip(reach / 6, *SAMPLE_RANGE))
    ground = around.site.difference(around.obstacles)
    whose = "" if part is None else f" of {part[2]}"
    points = _grid(ground if part is None else ground.intersection(part[0]), step)
    lines = list(streets.graph.lines)
    front = around.frontage
    sources = np.array(lines + list(shapely.get_parts(front)), dtype=object)
    if not len(points):
        return [], 0.0
    if len(sources):
        tree = shapely.STRtree(sources)
        (index, _), far = tree.query_nearest(points, return_distance=True, all_matches=False)
        distance = np.full(len(points), math.inf)
        distance[index] = far
    else:
        distance = np.full(len(points), math.inf)
    bare = points[distance > reach]
    if not len(bare):
        return [], 0.0
    xy = shapely.get_coordinates(bare)
    half = step / 2 * 1.001
    cells = shapely.box(xy[:, 0] - half, xy[:, 1] - half, xy[:, 0] + half, xy[:, 1] + half)
    gaps = shapely.get_parts(shapely.union_all(cells))
    found = [
        Problem(
            "coverage",
            f"{gap.area / 1e4:.2f} ha{whose} lie further than {reach:g} m from every street.",
            gap,
        )
        for gap in gaps
    ]
    return found, float(len(bare) * step**2)


def inside_obstacles(streets: StreetLayer, around: Surroundings) -> list[Problem]:
    """List streets that run through obstacles for more than a metre."""
    return [
        Problem(
            "obstacle",
            f"Street {name} runs {part.length:.0f} m through an obstacle.",
            part,
            (name,),
        )
        for name, part in _parts(streets, streets.designed, around.obstacles, inside=True)
        if part.length > GRAZE
    ]


def outside_site(streets: StreetLayer, around: Surroundings) -> list[Problem]:
    """List streets that leave the site by more than a metre.

    Connectors may, and ground within `RIGHT_OF_WAY` of an existing street is no foreign
    ground: parcels are often drawn with slots for the streets that end among them.
    """
    if around.site.is_empty:
        return []
    existing = [line for line, own in zip(streets.graph.lines, streets.designed) if not own]
    ways = shapely.union_all(existing).buffer(RIGHT_OF_WAY)
    ground = shapely.union(around.site.buffer(GRAZE), ways)
    return [
        Problem(
            "outside", f"Street {name} runs {part.length:.0f} m outside the site.", part, (name,)
        )
        for name, part in _parts(streets, streets.designed, ground, inside=False)
        if part.length > 0.01
    ]


def forbidden_lines(streets: StreetLayer, around: Surroundings) -> list[Problem]:
    """List designed streets that meet a forbidden line."""
    return [
        Problem(
            "forbidden", f"Street {name} meets a line where streets are forbidden.", part, (name,)
        )
        for name, part in _parts(streets, streets.designed, around.forbidden, inside=True)
    ]


def required_lines(streets: StreetLayer, around: Surroundings, reach: float) -> list[Problem]:
    """List stretches of required lines without a street within a distance in metres."""
    if around.required.is_empty:
        return []
    built = shapely.union_all(list(streets.graph.lines)).buffer(reach)
    return [
        Problem("required", f"{part.length:.0f} m of a required line have no street.", part)
        for part in _lines(shapely.line_merge(around.required.difference(built)))
        if part.length > GRAZE
    ]


def _parts(
    streets: StreetLayer, use: BoolArray, area: shapely.Geometry, *, inside: bool
) -> list[tuple[str, shapely.Geometry]]:
    """Give for each street the part of it inside (or outside) an area, where there is one."""
    graph = streets.graph
    if area.is_empty:
        return []
    shapely.prepare(area)
    lines = np.array(graph.lines, dtype=object)
    hit = shapely.intersects(lines, area) if inside else ~shapely.covered_by(lines, area)
    found: dict[str, list[shapely.Geometry]] = {}
    for e in np.flatnonzero(use & hit).tolist():
        part = lines[e].intersection(area) if inside else lines[e].difference(area)
        if not part.is_empty:
            found.setdefault(streets.name(e), []).append(part)
    return [(name, shapely.union_all(parts)) for name, parts in found.items()]


def _lines(shape: shapely.Geometry) -> Sequence[LineString]:
    return [part for part in shapely.get_parts(shape) if isinstance(part, LineString)]


def _grid(area: shapely.Geometry, step: float) -> np.ndarray[tuple[int], np.dtype[np.object_]]:
    """Points on a grid inside an area."""
    if area.is_empty:
        return np.zeros(0, dtype=object)
    x0, y0, x1, y1 = area.bounds
    x, y = np.meshgrid(np.arange(x0 + step / 2, x1, step), np.arange(y0 + step / 2, y1, step))
    shapely.prepare(area)
    inside = shapely.contains_xy(area, x.ravel(), y.ravel())
    return np.asarray(shapely.points(x.ravel()[inside], y.ravel()[inside]), dtype=object)
