"""From real layers to the ground that streets grow into."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS
from shapely.geometry import LineString, Polygon

from ...errors import InputError
from ...levels import COLLECTOR
from ...progress import Progress, Silent
from ...site.crs import is_metric
from ...site.repair import Problems
from ...site.types import Site
from ..grammar import Grammar
from ..types import Ground, Start, Strip
from .arrivals import Vector, arrivals_of
from .barriers import barriers, beside_sites
from .domain import Edge, Land, domain_of, joined_edges, whole_of, with_notches, with_rim
from .findstarts import Wish, ask, spacing_of, starts_everywhere, starts_in
from .given import GivenNetwork, GivenStreet, levels_of, network, read_roads
from .inner import led_to_streets
from .starts import state_of

__all__ = ["GivenStreet", "RealGround", "ground_of_roads", "ground_of_sites", "open_ground"]


@dataclass(frozen=True, eq=False)
class RealGround:
    """The ground that streets grow into, and what the planner knows of it.

    Attributes
    ----------
    ground
        The ground, in metres. Its domain reaches 0.1 m beyond the streets along its edge, so that
        new streets meet the street before they meet the edge.
    crs
        Working CRS.
    source_crs
        CRS of the planner's layer, to which outputs return.
    streets
        The streets that are there, and new ones along the edge where the planner asked for them;
        `ground.street` are positions in them.
    problems
        One row per finding, as of `prepare_sites`, in `source_crs`.
    outline
        The domain with its obstacles: only over the outer edge of this streets lead out. None
        where that is the domain's, and without a domain.
    """

    ground: Ground
    crs: CRS
    source_crs: CRS
    streets: tuple[GivenStreet, ...]
    problems: gpd.GeoDataFrame
    outline: shapely.Geometry | None = None


def ground_of_sites(
    sites: Sequence[Site],
    grammar: Grammar,
    *,
    points: gpd.GeoDataFrame | None = None,
    roads: gpd.GeoDataFrame | None = None,
    obstacles: gpd.GeoDataFrame | None = None,
    edge: Edge = "stop",
    obstacle_edge: Edge = "stop",
    direction: float | None = None,
    scale: float = 100.0,
    spacing: float | None = None,
    point_layer: str = "Starts",
    road_layer: str = "Roads",
    obstacle_layer: str = "Obstacles",
    progress: Progress | None = None,
) -> RealGround:
    """Make one ground of prepared sites.

    The domain is the sites without their obstacles, extended to the centre lines of the streets
    along their edges. Growth begins at the points given; without points where roads from outside
    arrive, at loose ends of streets inside, and at junctions that leave a wide sector free. A part
    of the domain without any of these is entered from the street nearest to its middle, and a part
    without a street from the middle itself.

    Parameters
    ----------
    sites
        Prepared sites, at least one; those in other working CRSs are brought to that of the first.
    grammar
        Gives the states of the starts.
    points
        Where growth begins, or None. The field direction, degrees clockwise from north, says in
        which direction the first street leaves.
    roads
        The road layer, or None. Its motorways and railways, which are no streets, hold new streets
        back like obstacles, but for those in tunnels.
    obstacles
        The obstacle layer, or None. The sites have what of it lies inside them; it holds streets
        back between the sites and the streets along their edges, too.
    edge
        "stop": new streets end at the outer edge where no street runs; "join": a new street runs
        along it there, and they join it.
    obstacle_edge
        The same for holes and obstacles.
    direction
        Of starts that nothing else gives one, degrees clockwise from north; None for that of the
        ground's longest axis.
    scale
        Metres per unit of the grammar.
    spacing
        Starts nearer than this are one, metres; 0.4 units of the grammar if None.
    point_layer, road_layer, obstacle_layer
        Names of the layers, for messages.
    progress
        Told of stages and asked for cancellation.

    Raises
    ------
    InputError
        If there is no site, no part of the ground is wide enough for a street, or no point lies in
        it.
    CancelledError
        If the caller cancels.
    """
    progress = progress or Silent()
    if not sites:
        raise InputError("No site is given.", "Choose a layer with polygons.")
    _check_edges(edge, obstacle_edge)
    crs, source = sites[0].crs, sites[0].source_crs
    problems = Problems()
    ask(progress, "Reading the ground", 0.0)
    lands, streets = _lands(sites, crs)
    ask(progress, "Joining sites and streets", 0.2)
    inner = shapely.union_all([land.polygon for land in lands])
    whole = whole_of(lands)
    if obstacles is not None:
        beside = beside_sites(obstacles, obstacle_layer, shapely.difference(whole, inner), crs)
        lands[0] = _with_obstacles(lands[0], beside)
    if roads is not None:
        lands[0] = _with_obstacles(lands[0], barriers(roads, road_layer, whole, crs, problems))
    domain = domain_of(whole, inner, lands)
    if domain.is_empty:
        raise InputError(
            f"no part of {sites[0].name if len(sites) == 1 else 'the sites'} is wide enough for a "
            "street: what is left without the obstacles is less than 4 m wide.",
            "Choose another polygon, or leave obstacles out.",
        )
    new = joined_edges(domain, lands, outer=edge == "join", obstacles=obstacle_edge == "join")
    streets += [GivenStreet(line, "", "", True, COLLECTOR) for line in new]
    lines = [street.line for street in streets]
    domain = with_rim(with_notches(domain, lands, lines), lines)
    net = network(streets, [""] * len(streets), road_layer, crs, problems)
    ask(progress, "Looking for places where streets begin", 0.6)
    reach = max(site.snap_distance for site in sites)
    wish = Wish(
        grammar, points, point_layer, direction, scale, spacing_of(spacing, scale), reach, progress
    )
    arrived = [arrival for site in sites for arrival in arrivals_of(site, crs)]
    # streets along the edge end there only because the edge does
    cut = shapely.get_coordinates([line.boundary for land in lands for line in land.streets])
    starts, net = starts_in(domain, net, arrived, cut, wish, crs, problems)
    real = _real(starts, domain, net, crs, source, problems)
    strip = Strip(inner, shapely.union_all(lines)) if lines else None
    ground = replace(real.ground, strip=strip)
    return replace(real, ground=ground, outline=shapely.union_all([whole, domain]))


def ground_of_roads(
    roads: gpd.GeoDataFrame,
    grammar: Grammar,
    *,
    points: gpd.GeoDataFrame | None = None,
    direction: float | None = None,
    scale: float = 100.0,
    spacing: float | None = None,
    snap_distance: float = 30.0,
    point_layer: str = "Starts",
    road_layer: str = "Roads",
    progress: Progress | None = None,
) -> RealGround:
    """Make a ground without a domain of a road layer.

    Growth begins at the points given; without points at loose ends and at junctions that leave a
    wide sector free, where these lead to open land, not into a block (up to 20 ha).

    Parameters
    ----------
    roads
        Lines in any CRS. Nothing of them moves.
    grammar
        Gives the states of the starts.
    points, direction, scale, spacing, point_layer, road_layer, progress
        As of `ground_of_sites`; without a direction starts that nothing else gives one look north.
    snap_distance
        Points this near to a road are on it, metres.

    Raises
    ------
    InputError
        If the layer has no CRS, or neither a road nor a point can be used.
    CancelledError
        If the caller cancels.
    """
    progress = progress or Silent()
    problems = Problems()
    ask(progress, "Reading the roads", 0.0)
    streets, features, crs = read_roads(roads, road_layer, problems, progress)
    barriers(roads, road_layer, None, crs, problems)
    if not streets:
        raise InputError(
            "has no road that streets could grow from.",
            "See whether the right layer is chosen and holds roads for cars, or leave it out: "
            "growth then begins at a point or at the origin.",
            layer=road_layer,
        )
    ask(progress, "Joining roads", 0.2)
    net = network(streets, features, road_layer, crs, problems)
    ask(progress, "Looking for places where streets begin", 0.6)
    wish = Wish(
        grammar, points, point_layer, direction, scale, spacing_of(spacing, scale), snap_distance,
        progress,
    )  # fmt: skip
    starts, net = starts_everywhere(net, wish, crs, problems)
    return _real(starts, None, net, crs, CRS.from_user_input(roads.crs), problems)


def open_ground(
    grammar: Grammar, crs: object, *, xy: Vector = (0.0, 0.0), direction: Vector = (0.0, 1.0)
) -> RealGround:
    """Give ground with nothing on it at all, such as CitySprout's.

    Parameters
    ----------
    grammar
        Gives the state of the start.
    crs
        Projected CRS in metres, anything that pyproj takes.
    xy
        Where growth begins.
    direction
        In which direction it looks; any length but 0.

    Raises
    ------
    InputError
        If the CRS is not in metres, or a number is not finite.
    """
    own = CRS.from_user_input(crs)
    if not is_metric(own):
        unit_name = own.axis_info[0].unit_name if own.axis_info else "an unknown unit"
        raise InputError(
            f"Streets grow in metres, but the coordinate reference system {own.name} is in "
            f"{unit_name}.",
            "Choose a projected one in metres, such as the UTM zone of the place, or give a site "
            "or roads: these are projected by themselves.",
        )
    size = float(np.hypot(*direction))
    if not (np.isfinite(xy).all() and np.isfinite(size) and size > 0):
        raise InputError(
            f"The start {xy} with the direction {direction} is none.",
            "Give finite numbers, and a direction that is not 0.",
        )
    way = (float(direction[0]) / size, float(direction[1]) / size)
    start = Start((float(xy[0]), float(xy[1])), way, state_of(grammar, 0))
    return RealGround(Ground((start,)), own, own, (), Problems().to_frame(own))


def _lands(sites: Sequence[Site], crs: CRS) -> tuple[list[Land], list[GivenStreet]]:
    """Bring all sites to the working CRS, with the levels of their streets."""
    found = [_land(site, crs) for site in sites]
    streets = [street for _, own in found for street in own]
    levels = levels_of([street.kind for street in streets])
    leveled = [replace(street, level=level) for street, level in zip(streets, levels)]
    return [land for land, _ in found], leveled


def _land(site: Site, crs: CRS) -> tuple[Land, list[GivenStreet]]:
    """Bring what a site has to the working CRS; levels of streets come later."""
    edge = [(s.line, s.name, s.kind) for s in site.boundary_streets]
    inner = [(s.line, s.name, s.kind) for s in site.inner_streets]
    shapes = [site.polygon, *site.obstacles, *(line for line, _, _ in (*edge, *inner))]
    if site.crs != crs:
        shapes = list(gpd.GeoSeries(shapes, crs=site.crs).to_crs(crs))
    polygon, rest = shapes[0], shapes[1:]
    barred, lines = rest[: len(site.obstacles)], rest[len(site.obstacles) :]
    along, inside = lines[: len(edge)], lines[len(edge) :]
    if not polygon.is_valid:
        polygon = max(shapely.get_parts(shapely.make_valid(polygon)), key=shapely.area)
    inside = led_to_streets(inside, along, polygon, site.snap_distance)
    known = [(name, kind) for _, name, kind in (*edge, *inner)]
    streets = [
        GivenStreet(LineString(line.coords), name, kind, False, COLLECTOR)
        for line, (name, kind) in zip([*along, *inside], known)
        if line.length > 0
    ]
    land = Land(
        Polygon(polygon),
        [line for line in along if line.length > 0],
        [shape for shape in barred if not shape.is_empty],
        site.snap_distance,
    )
    return land, streets


def _with_obstacles(land: Land, more: Sequence[shapely.Geometry]) -> Land:
    return replace(land, obstacles=[*land.obstacles, *more])


def _real(
    starts: tuple[Start, ...],
    domain: shapely.Geometry | None,
    net: GivenNetwork,
    crs: CRS,
    source: CRS,
    problems: Problems,
) -> RealGround:
    ground = Ground(starts, domain, net.nodes, net.ends, net.street, net.bends)
    return RealGround(ground, crs, source, net.streets, problems.to_frame(source))


def _check_edges(*choices: str) -> None:
    for choice in choices:
        if choice not in ("stop", "join"):
            raise InputError(f"The edge cannot be '{choice}'.", "Give 'stop' or 'join'.")
