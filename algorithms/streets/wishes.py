"""Places that a planner names on top of a site, and how they lie on its mesh."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import networkx as nx
import numpy as np
import shapely
from shapely.geometry import LineString, Point

from ..errors import InputError
from ..mesh import QuadMesh
from ..network.problem import BoolArray, FloatArray, IntArray
from ..site.types import Site
from .preferences import Preferences

#: Wishes further than this from a site belong to another one, if there is any (metres).
FAR = 10_000.0
#: Level of edges that need not be streets.
NEVER = 9
#: Overlap of a required street with an obstacle that is let pass (metres).
TOUCH = 1.0


@dataclass(frozen=True, eq=False)
class Whole:
    """What a sub-region has to know of the site that it is a part of.

    Attributes
    ----------
    edge
        Outline of the whole site, metres.
    exits
        How many of the exits of the site the sub-region may have; None for any.
    """

    edge: shapely.Geometry
    exits: int | None = None


@dataclass(frozen=True)
class Wishes:
    """Places that a planner names on top of the site, in the working CRS (metres).

    Attributes
    ----------
    sinks
        Points where traffic leaves (sink mode "points"), shape (n, 2).
    required, required_levels
        Lines along which a street must run, and of which level it is: 2 collector, 3 local, 4
        cul-de-sac; 0, or none given, for the first level that is designed.
    forbidden
        Lines or polygons that no street may cross or follow.
    preferences
        Where streets are wanted more or less, patches and through routes.
    start, start_layer
        Streets of an earlier design by their level (0 where it is not known), with which the
        search begins, and the name of their layer.
    given
        Streets that are given instead of designed, by their level (1 major, 2 collector, 3
        local, 4 cul-de-sac).
    given_ids, given_layers
        Their feature ids and layer names by level, for messages.
    sink_ids, required_ids, sink_layer, required_layer
        Feature ids and layer names of the sinks and required lines, for messages.
    whole
        The site of which a sub-region is designed; None where it is all of it.
    """

    sinks: Sequence[tuple[float, float]] = ()
    required: Sequence[LineString] = ()
    forbidden: Sequence[shapely.Geometry] = ()
    sink_ids: Sequence[int | str] = ()
    required_ids: Sequence[int | str] = ()
    required_levels: Sequence[int] = ()
    preferences: Preferences = field(default_factory=Preferences)
    start: Mapping[int, Sequence[LineString]] = field(default_factory=dict)
    start_layer: str = "Earlier design"
    sink_layer: str = "Sinks"
    required_layer: str = "Required streets"
    given: Mapping[int, Sequence[LineString]] = field(default_factory=dict)
    given_ids: Mapping[int, Sequence[int | str]] = field(default_factory=dict)
    given_layers: Mapping[int, str] = field(default_factory=dict)
    whole: Whole | None = None

    def sink_id(self, i: int) -> int | str:
        """Feature id of a sink, its number where none is given."""
        return self.sink_ids[i] if i < len(self.sink_ids) else i

    def required_id(self, i: int) -> int | str:
        """Feature id of a required line, its number where none is given."""
        return self.required_ids[i] if i < len(self.required_ids) else i

    def required_level(self, i: int) -> int:
        """Level of a required line, 0 for the first that is designed."""
        return self.required_levels[i] if i < len(self.required_levels) else 0

    def given_id(self, level: int, i: int) -> int | str:
        """Feature id of a given street, its number where none is given."""
        ids = self.given_ids.get(level, ())
        return ids[i] if i < len(ids) else i

    def given_layer(self, level: int) -> str:
        """Name of the layer of the given streets of a level."""
        return self.given_layers.get(level, f"Given streets of level {level}")

    def of_site(self, site: Site, sites: Sequence[Site]) -> Wishes:
        """Keep the sinks and required lines that belong to one of several sites.

        Each belongs to the site nearest to it, so that none is lost without a word.
        """
        if len(sites) < 2:
            return self

        near = [s for s in sites if s.crs == site.crs]

        def own(shape: shapely.Geometry) -> bool:
            gaps = [shape.distance(s.polygon) for s in near]
            mine = gaps[near.index(site)]
            # sites so far apart that they have a CRS of their own do not share wishes
            return bool(
                mine == 0 or (mine == min(gaps) and (len(near) == len(sites) or mine < FAR))
            )

        sinks = [i for i, xy in enumerate(self.sinks) if own(Point(xy))]
        lines = [i for i, line in enumerate(self.required) if own(line)]
        given = {n: [i for i, line in enumerate(s) if own(line)] for n, s in self.given.items()}
        return Wishes(
            sinks=[self.sinks[i] for i in sinks],
            required=[self.required[i] for i in lines],
            forbidden=self.forbidden,
            preferences=dataclasses.replace(
                self.preferences,
                routes=[route for route in self.preferences.routes if own(route[0])],
            ),
            start={k: [line for line in v if own(line)] for k, v in self.start.items()},
            start_layer=self.start_layer,
            sink_ids=[self.sink_id(i) for i in sinks],
            required_ids=[self.required_id(i) for i in lines],
            required_levels=[self.required_level(i) for i in lines],
            sink_layer=self.sink_layer,
            required_layer=self.required_layer,
            given={n: [self.given[n][i] for i in places] for n, places in given.items()},
            given_ids={n: [self.given_id(n, i) for i in places] for n, places in given.items()},
            given_layers=self.given_layers,
        )


def required_edges(site: Site, mesh: QuadMesh, barred: BoolArray, wishes: Wishes) -> IntArray:
    """Lay each required line on the mesh as the path that stays nearest to it.

    Returns
    -------
    IntArray
        Shape (e,). The level by which each edge must be a street, `NEVER` where it need not.
    """
    mark = np.full(len(mesh.edges), NEVER, dtype=np.int64)
    if not wishes.required:
        return mark
    inside = shapely.buffer(site.polygon, 1.0)
    graph = nx.Graph()
    for i, line in enumerate(wishes.required):
        wished = shapely.intersection(line, inside)
        if shapely.length(wished) < 0.25 * mesh.edge_length:
            raise InputError(
                "The required street does not lie in the site.",
                "Move it into the site or leave it out.",
                layer=wishes.required_layer,
                feature=wishes.required_id(i),
            )
        if shapely.length(shapely.intersection(wished, site.obstacle_union)) > TOUCH:
            raise InputError(
                "The required street runs through an obstacle.",
                "Move the street, or take the obstacle out of the obstacle layer.",
                layer=wishes.required_layer,
                feature=wishes.required_id(i),
            )
        away = shapely.distance(shapely.linestrings(mesh.vertices[mesh.edges]), wished)
        middle = shapely.distance(shapely.points(mesh.vertices[mesh.edges].mean(axis=1)), wished)
        cost = mesh.lengths * (1.0 + ((away + middle) / (0.15 * mesh.edge_length)) ** 2)
        graph.clear()
        for e in np.flatnonzero(~barred).tolist():
            graph.add_edge(*mesh.edges[e].tolist(), weight=float(cost[e]), edge=e)
        ends = [nearest_vertex(mesh, graph.nodes, c) for c in (line.coords[0], line.coords[-1])]
        try:
            path = nx.shortest_path(graph, *ends, weight="weight")
        except nx.NetworkXNoPath:
            raise InputError(
                "The required street cannot be laid on the candidate mesh: obstacles or "
                "forbidden places cut it.",
                "Move the street or the obstacles.",
                layer=wishes.required_layer,
                feature=wishes.required_id(i),
            ) from None
        for u, v in zip(path, path[1:]):
            edge = graph[u][v]["edge"]
            mark[edge] = min(mark[edge], wishes.required_level(i))
    return mark


def nearest_vertex(mesh: QuadMesh, vertices: Sequence[int], xy: tuple[float, ...]) -> int:
    """Find the vertex among some that lies nearest to a position."""
    among = np.array(sorted(vertices))
    gaps: FloatArray = np.hypot(*(mesh.vertices[among] - np.asarray(xy[:2])).T)
    return int(among[gaps.argmin()])


def sink_vertex(site: Site, mesh: QuadMesh, xy: tuple[float, float], wishes: Wishes, i: int) -> int:
    """Find the mesh vertex of a given sink; refuse sinks outside or on obstacles."""
    point = Point(xy)
    if site.polygon.distance(point) > 0.5 * mesh.edge_length:
        raise InputError(
            f"The sink lies {site.polygon.distance(point):.0f} m outside the site.",
            "Move it into the site or to its edge.",
            layer=wishes.sink_layer,
            feature=wishes.sink_id(i),
        )
    if any(obstacle.contains(point) for obstacle in site.obstacles):
        raise InputError(
            "The sink lies on an obstacle.",
            "Move it, or take the obstacle out of the obstacle layer.",
            layer=wishes.sink_layer,
            feature=wishes.sink_id(i),
        )
    return nearest_vertex(mesh, range(len(mesh.vertices)), xy)
