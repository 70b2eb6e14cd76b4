"""Figures of a street network, by which cities and designs are compared."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from ..progress import Progress
from ..site.repair import GRID
from ..site.watch import aside, in_chunks
from .centrality import Centrality
from .circuity import mean_circuity
from .density import TOUCH, RoadDensity, road_density
from .graph import BoolArray, FloatArray, IntArray, StreetGraph
from .junction_kinds import JunctionKinds
from .living import living_structure
from .natural import NaturalLines
from .orientation import orientation_entropy, orientation_order
from .plan import EDGE_GAP, SLIVER, THINNEST
from .segments import Segments

#: What goes on here, for those who cancel it.
_WORK = "the streets were measured"


@dataclass(frozen=True)
class StreetFigures:
    """Figures of a street network; NaN where there is nothing to measure.

    A segment is a street between junctions or dead ends. With a site, segments, and what belongs
    to them, count where their middle lies in it, and nodes and blocks where they do; junctions
    have the streets that they have in the whole layer, and centrality is that in the whole layer.

    Attributes
    ----------
    area_km2
        The site; without one the alpha shape of all nodes (see `density.alpha_shape`), which is
        the convex hull of a small network and leaves out open country between large ones.
    length_km, street_km_km2
        Length of the streets, with a site clipped to it (what runs along its edge within 1 m counts
        in full), and per square kilometre.
    segments, segment_mean
        Number of segments and their mean length (m).
    intersections, intersections_km2
        Places where three or more streets meet.
    three_way, four_way, five_way
        Of these, those of three, of four, and of five or more streets.
    t_pct, y_pct, x_pct
        Shares of intersections by kind, %; see `junction_kinds.JunctionKinds`.
    dead_ends, dead_ends_km2, dead_ends_pct
        Ends of streets, with a site those farther than 10 m from its edge; their share of
        intersections and dead ends together, %.
    blocks, block_mean_ha, block_median_ha, block_max_ha
        Faces between streets of at least 50 m2 that are somewhere 10 m wide; their areas.
    entropy, order, entropy_length, order_length
        Entropy of the directions of segments and their order, each segment counted once and by
        its length (Boeing 2019); see `orientation`.
    sinuosity
        Length of segments / straight distance of their ends, sums; `circuity_avg` of OSMnx.
    circuity
        Mean of network distance / straight distance between nodes; see `circuity.mean_circuity`.
    roads_pct
        Share of the area that street space takes up, %; see `density.road_density`.
    natural_count, natural_max, ht_index, livability
        Number of natural streets, the longest one (m), the levels of the hierarchy of their
        connectivity, and livability S x H (see `living`).
    betweenness_mean, betweenness_max, closeness_mean
        Of nodes; see `centrality.Centrality`. Closeness per km.
    components, largest_pct
        Connected parts, and the share of the length in the longest one, %.
    meshedness, beta, gamma
        Indices of e segments, v nodes and p parts (Kansky 1963; meshedness, the alpha index, also
        Buhl et al. 2006): (e - v + p) / (2 v - 5), e / v, e / (3 (v - 2)).
    crossings
        Places where streets cross without a junction: bridges, or mistakes.
    """

    area_km2: float
    length_km: float
    street_km_km2: float
    segments: int
    segment_mean: float
    intersections: int
    intersections_km2: float
    three_way: int
    four_way: int
    five_way: int
    t_pct: float
    y_pct: float
    x_pct: float
    dead_ends: int
    dead_ends_km2: float
    dead_ends_pct: float
    blocks: int
    block_mean_ha: float
    block_median_ha: float
    block_max_ha: float
    entropy: float
    order: float
    entropy_length: float
    order_length: float
    sinuosity: float
    circuity: float
    roads_pct: float
    natural_count: int
    natural_max: float
    ht_index: int
    livability: int
    betweenness_mean: float
    betweenness_max: float
    closeness_mean: float
    components: int
    largest_pct: float
    meshedness: float
    beta: float
    gamma: float
    crossings: int

    def as_dict(self) -> dict[str, float]:
        """Give the figures by name, in the order of the class."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class Network:
    """All that figures are made of.

    Attributes
    ----------
    graph, segments, kinds, natural
        The streets, their segments, their nodes, their natural streets.
    label
        Shape (e,). Position in `natural` of each edge's natural street.
    bearing
        Shape (s,). Axis of each segment, degrees, NaN for rings.
    centrality
        Of the nodes of `segments.nodes` and of the segments; None where not measured.
    widths
        Shape (e,). Metres.
    site
        Polygons, metres; None for no site.
    """

    graph: StreetGraph
    segments: Segments
    kinds: JunctionKinds
    natural: NaturalLines
    label: IntArray
    bearing: FloatArray
    centrality: Centrality | None
    widths: FloatArray
    site: shapely.Geometry | None


@dataclass(frozen=True, eq=False)
class _Within:
    """What lies in the site: segments (s,), nodes (n,), and nodes where a street may end (n,)."""

    segments: BoolArray
    nodes: BoolArray
    inner: BoolArray


def street_figures(network: Network, progress: Progress | None = None) -> StreetFigures:
    """Compute the figures of a network.

    Parameters
    ----------
    network
        See there.
    progress
        Asked for cancellation, or None.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    within = _within(network)
    density = _density(network, progress)
    km2 = density.ground / 1e6 if density.ground > 0 else math.nan
    return StreetFigures(
        area_km2=density.ground / 1e6,
        length_km=density.length / 1000,
        street_km_km2=density.km_per_km2,
        **_segments(network, within),
        **_nodes(network, within, km2),
        **_blocks(network, progress),
        **_ways(network, within, progress),
        roads_pct=100 * density.share,
        **_natural(network, within),
        **_central(network, within),
        **_mesh(network, within),
        crossings=_crossings(network),
    )


def _density(network: Network, progress: Progress | None) -> RoadDensity:
    """Measure street space in a thread, since joining the strips of a city takes seconds."""

    def measure(_: npt.NDArray[Any]) -> RoadDensity:
        return road_density(network.graph, network.widths, network.site)

    return aside(measure, np.array(network.graph.lines, dtype=object), progress, work=_WORK)


def _within(network: Network) -> _Within:
    graph, site = network.graph, network.site
    real = np.zeros(len(graph.nodes), dtype=bool)
    real[network.segments.nodes] = True
    if site is None:
        return _Within(np.ones(len(network.segments.ends), dtype=bool), real, real)
    near = shapely.buffer(site, TOUCH)
    shapely.prepare(near)
    middle = shapely.line_interpolate_point(network.segments.lines, 0.5, normalized=True)
    points = shapely.points(graph.nodes.reshape(-1, 2))
    nodes = real & shapely.intersects(near, points)
    inner = nodes & (shapely.distance(points, shapely.boundary(site)) > EDGE_GAP)
    return _Within(np.asarray(shapely.intersects(near, middle), dtype=bool), nodes, inner)


def _segments(network: Network, within: _Within) -> dict[str, Any]:
    length = network.segments.length[within.segments]
    bearing = network.bearing[within.segments]
    plain, weighted = orientation_entropy(bearing), orientation_entropy(bearing, length)
    return {
        "segments": len(length),
        "segment_mean": _mean(length),
        "entropy": plain,
        "order": orientation_order(plain),
        "entropy_length": weighted,
        "order_length": orientation_order(weighted),
    }


def _nodes(network: Network, within: _Within, km2: float) -> dict[str, Any]:
    degree = network.kinds.degree[within.nodes]
    kind = network.kinds.kind[within.nodes]
    met = int((degree >= 3).sum())
    blind = int((network.kinds.degree[within.inner] == 1).sum())
    shares = {f"{k.lower()}_pct": _share(int((kind == k).sum()), met) for k in ("T", "Y", "X")}
    return {
        "intersections": met,
        "intersections_km2": met / km2,
        "three_way": int((degree == 3).sum()),
        "four_way": int((degree == 4).sum()),
        "five_way": int((degree >= 5).sum()),
        **shares,
        "dead_ends": blind,
        "dead_ends_km2": blind / km2,
        "dead_ends_pct": _share(blind, blind + met),
    }


def _blocks(network: Network, progress: Progress | None) -> dict[str, Any]:
    """Faces between streets, bridges taken for junctions: on the ground they divide it too."""
    lines = _closed_up(network.graph)
    # On a grid, since lines that nearly touch cannot be cut at each other in plain numbers.
    noded = aside(lambda own: shapely.union_all(own, grid_size=GRID), lines, progress, work=_WORK)
    pieces = shapely.get_parts(noded)
    faces = shapely.get_parts(aside(shapely.polygonize, pieces, progress, work=_WORK))
    faces = faces[shapely.area(faces) >= SLIVER]
    if network.site is not None:
        shapely.prepare(network.site)
        faces = faces[shapely.intersects(network.site, shapely.point_on_surface(faces))]
    if len(faces):
        faces = faces[in_chunks(_somewhere_wide, faces, progress, work=_WORK)]
    area = shapely.area(faces) / 1e4
    return {
        "blocks": len(faces),
        "block_mean_ha": _mean(area),
        "block_median_ha": float(np.median(area)) if len(area) else math.nan,
        "block_max_ha": float(area.max()) if len(area) else math.nan,
    }


def _closed_up(graph: StreetGraph) -> npt.NDArray[Any]:
    """Give edges that end exactly in their nodes; lines of a layer meet but nearly."""
    xy, index = shapely.get_coordinates(np.array(graph.lines, dtype=object), return_index=True)
    first = np.flatnonzero(np.append(True, np.diff(index) > 0)[: len(index)])
    last = np.flatnonzero(np.append(np.diff(index) > 0, True)[: len(index)])
    xy[first], xy[last] = graph.nodes[graph.ends[:, 0]], graph.nodes[graph.ends[:, 1]]
    return np.asarray(shapely.linestrings(xy, indices=index), dtype=object)


def _somewhere_wide(faces: npt.NDArray[Any]) -> BoolArray:
    """Tell which faces are no mere slits, as between two carriageways."""
    return np.asarray(~shapely.is_empty(shapely.buffer(faces, -THINNEST / 2)), dtype=bool)


def _ways(network: Network, within: _Within, progress: Progress | None) -> dict[str, Any]:
    own = network.segments.ends[within.segments]
    step = network.graph.nodes[own[:, 1]] - network.graph.nodes[own[:, 0]]
    straight = float(np.hypot(*step.T).sum())
    length = float(network.segments.length[within.segments].sum())
    return {
        "sinuosity": length / straight if straight > 0 else math.nan,
        "circuity": mean_circuity(network.graph, at=within.nodes, progress=progress).mean_of_ratios,
    }


def _natural(network: Network, within: _Within) -> dict[str, Any]:
    inside = np.unique(network.label[within.segments[network.segments.of_edge]])
    living = living_structure(network.natural.connectivity[inside])
    length = network.natural.length[inside]
    return {
        "natural_count": len(inside),
        "natural_max": float(length.max()) if len(inside) else math.nan,
        "ht_index": living.hierarchy,
        "livability": living.livability,
    }


def _central(network: Network, within: _Within) -> dict[str, Any]:
    found = network.centrality
    inside = within.nodes[network.segments.nodes]
    if found is None or not inside.any():
        names = ("betweenness_mean", "betweenness_max", "closeness_mean")
        return dict.fromkeys(names, math.nan)
    return {
        "betweenness_mean": float(found.nodes[inside].mean()),
        "betweenness_max": float(found.nodes[inside].max()),
        "closeness_mean": float(found.closeness[inside].mean()),
    }


def _mesh(network: Network, within: _Within) -> dict[str, Any]:
    ends = network.segments.ends[within.segments]
    length = network.segments.length[within.segments]
    # of the ravelled ends: numpy 2 gives the inverse the shape of what it is given
    nodes, local = np.unique(ends.ravel(), return_inverse=True)
    inside = StreetGraph(np.zeros((len(nodes), 2)), local.reshape(-1, 2), (), local[:0])
    part = inside.components() if len(nodes) else local[:0]
    parts = int(part.max(initial=-1)) + 1
    each = np.bincount(part[local.reshape(-1, 2)[:, 0]], length, minlength=1)
    e, v = len(ends), len(nodes)
    return {
        "components": parts,
        "largest_pct": _share(float(each.max()), float(length.sum())),
        "meshedness": (e - v + parts) / (2 * v - 5) if v > 2 else math.nan,
        "beta": e / v if v else math.nan,
        "gamma": e / (3 * (v - 2)) if v > 2 else math.nan,
    }


def _crossings(network: Network) -> int:
    found = np.array([c.geometry for c in network.graph.crossings], dtype=object)
    if network.site is None or not len(found):
        return len(found)
    return int(shapely.intersects(network.site, found).sum())


def _mean(values: npt.NDArray[np.float64]) -> float:
    return float(values.mean()) if len(values) else math.nan


def _share(some: float, whole: float) -> float:
    return 100 * some / whole if whole else math.nan
