"""Figures of a street plan: how much street, how straight, and what blocks it leaves."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import geopandas as gpd
import numpy as np
import shapely
from shapely.geometry import LineString, Polygon

from .graph import FloatArray, chains
from .layers import StreetLayer, read_streets, read_union
from .turns import bends, leaving

#: A block is as wide as asked between these shares of the asked width (55-80 m at 72 m).
WIDTH_BAND = (0.76, 1.11)
#: A block narrower than this share of the asked width is too thin (45 m at 72 m).
THIN = 0.62
#: A turn sharper than this counts as a bend (degrees).
BEND = 20.0
#: Smaller pieces of ground are no blocks (square metres).
SLIVER = 50.0
#: A piece that is nowhere wider than this is street space (metres).
THINNEST = 10.0
#: Streets that end this near to the edge of the site reach it (metres).
EDGE_GAP = 10.0
#: An existing street is continued by a designed one that turns from it by less (degrees).
CONTINUES = 30.0


@dataclass(frozen=True)
class PlanMetrics:
    """Figures of a plan; lengths and widths in metres, areas in hectares.

    Attributes
    ----------
    area, length, length_per_hectare
        Site area (ha), length of the designed streets (m) and their quotient (m/ha).
    bends, t_junctions, crossings
        Turns over 20 degrees between junctions; inner junctions of three, and of four or
        more, designed streets.
    blocks, block_area
        Number of blocks and their median area (ha).
    block_width, share_wide_enough, share_too_thin
        Median block width (area by the longer side of the smallest rectangle around it) and
        the shares of blocks with 76-111 %, and with less than 62 %, of the asked width.
    block_length
        Longest block side.
    rectangularity
        Mean share of a block in the smallest rectangle around it.
    continued, arriving
        Existing streets that go on into the site, of those that arrive at its edge.
    """

    area: float
    length: float
    length_per_hectare: float
    bends: int
    t_junctions: int
    crossings: int
    blocks: int
    block_area: float
    block_width: float
    share_wide_enough: float
    share_too_thin: float
    block_length: float
    rectangularity: float
    continued: int
    arriving: int

    def as_dict(self) -> dict[str, float]:
        """Give the figures by name, in the order of the class."""
        return asdict(self)


def measure_plan(
    streets: gpd.GeoDataFrame,
    site: gpd.GeoDataFrame,
    *,
    block_width: float = 72.0,
    access_points: gpd.GeoDataFrame | None = None,
    obstacles: gpd.GeoDataFrame | None = None,
) -> PlanMetrics:
    """Measure a street plan.

    Parameters
    ----------
    streets
        Lines in any CRS; with a field `status` the existing and connecting streets are told
        from the designed ones.
    site
        Polygons of the site.
    block_width
        Asked width of the blocks in metres.
    access_points
        Points where existing streets arrive, with the field `bearing_deg` (degrees clockwise
        from grid north of the working CRS, into the site); a street that starts within half
        a block width and turns by less than 30 degrees continues the existing one. Without
        the field any direction will do.
    obstacles
        Pieces of ground that are more than half obstacle are no blocks.

    Raises
    ------
    InputError
        If a layer has no CRS or the streets are no lines.

    Examples
    --------
    >>> import geopandas as gpd
    >>> from shapely.geometry import LineString, box
    >>> site = gpd.GeoDataFrame(geometry=[box(0, 0, 144, 150)], crs=32633)
    >>> spine = gpd.GeoDataFrame(geometry=[LineString([(72, 0), (72, 150)])], crs=32633)
    >>> plan = measure_plan(spine, site)
    >>> plan.blocks, round(plan.block_width), plan.share_wide_enough
    (2, 72, 1.0)
    """
    layer = read_streets(streets, "Streets")
    ground = read_union(site, layer.crs, "Site")
    kept = read_union(obstacles, layer.crs, "Obstacles")
    found = blocks(layer, ground, kept)
    area = float(ground.area) / 1e4
    length = float(layer.graph.lengths[layer.designed].sum())
    bent, tees, crossings = _junction_figures(layer, ground, block_width)
    continued, arriving = _continued(layer, access_points, block_width)
    width, side, filled = block_sides(found)
    band = (width >= WIDTH_BAND[0] * block_width) & (width <= WIDTH_BAND[1] * block_width)
    return PlanMetrics(
        area=area,
        length=length,
        length_per_hectare=length / area if area else 0.0,
        bends=bent,
        t_junctions=tees,
        crossings=crossings,
        blocks=len(found),
        block_area=_median(np.array([b.area for b in found]) / 1e4),
        block_width=_median(width),
        share_wide_enough=float(band.mean()) if len(width) else 0.0,
        share_too_thin=float((width < THIN * block_width).mean()) if len(width) else 0.0,
        block_length=float(side.max()) if len(side) else 0.0,
        rectangularity=float(filled.mean()) if len(filled) else 0.0,
        continued=continued,
        arriving=arriving,
    )


def blocks(
    streets: StreetLayer, site: shapely.Geometry, obstacles: shapely.Geometry
) -> list[Polygon]:
    """Cut a site along its streets, in the working CRS.

    Parameters
    ----------
    streets
        The streets.
    site
        Polygon or polygons.
    obstacles
        Pieces that lie in it by more than half are left out; may be empty.

    Returns
    -------
    list of Polygon
        Pieces of at least 50 m² that are somewhere 10 m wide, with their holes.
    """
    lines = [line for line in streets.graph.lines if line.intersects(site)]
    lines += _to_the_edge(streets.graph.nodes, site)
    noded = shapely.union_all([site.boundary, *lines], grid_size=0.01)
    pieces = shapely.get_parts(shapely.polygonize([noded]))
    reach = site.buffer(0.1)
    return [
        piece
        for piece in pieces
        if piece.area >= SLIVER
        and reach.contains(piece.representative_point())
        and not piece.buffer(-THINNEST / 2).is_empty
        and (obstacles.is_empty or piece.intersection(obstacles).area < piece.area / 2)
    ]


def _to_the_edge(nodes: FloatArray, site: shapely.Geometry) -> list[LineString]:
    """Take streets that end just inside the edge of the site across the strip that is left.

    Where an existing street runs a few metres inside the edge, the ground between is street
    space: it must not join the blocks on both sides of a street that ends there.
    """
    places = shapely.points(nodes.reshape(-1, 2))
    edge = site.boundary
    gap = shapely.distance(places, edge)
    near = places[(gap > 0) & (gap <= EDGE_GAP)]
    return list(shapely.shortest_line(near, edge))


def block_sides(found: list[Polygon]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Width, longer side and share of the smallest rectangle around each block.

    Parameters
    ----------
    found
        Blocks in metres.

    Returns
    -------
    width, side, filled
        Shape (k,). Area / longer side; longer side of the smallest rectangle (by area)
        around the block, in metres; area / area of that rectangle.
    """
    shapes = np.array(found, dtype=object)
    if not len(shapes):
        return np.zeros(0), np.zeros(0), np.zeros(0)
    around = shapely.oriented_envelope(shapes)
    corners = np.array([shapely.get_coordinates(r)[:3] for r in around])
    sides = np.hypot(*np.moveaxis(np.diff(corners, axis=1), 2, 0))
    side = sides.max(axis=1)
    area = shapely.area(shapes)
    return area / side, side, area / sides.prod(axis=1)


def _junction_figures(
    streets: StreetLayer, site: shapely.Geometry, block_width: float
) -> tuple[int, int, int]:
    """Bends, T-junctions and crossings inside the site."""
    graph = streets.graph
    degrees = np.bincount(graph.ends[streets.designed].ravel(), minlength=len(graph.nodes))
    inner = ~graph.near(site.boundary, 1.0)
    inner[graph.ends[~streets.designed].ravel()] = False
    found = bends(chains(graph, streets.designed, ~inner), BEND, block_width / 3)
    return (
        len(found),
        int((inner & (degrees == 3)).sum()),
        int((inner & (degrees > 3)).sum()),
    )


def _continued(
    streets: StreetLayer, access_points: gpd.GeoDataFrame | None, block_width: float
) -> tuple[int, int]:
    """Count the existing streets that go on into the site, and those that arrive."""
    if access_points is None or not len(access_points):
        return 0, 0
    rows = access_points[~access_points.geometry.isna()].to_crs(streets.crs)
    aimed = "bearing_deg" in rows.columns
    graph = streets.graph
    use = np.flatnonzero(streets.designed)
    starts = graph.nodes[graph.ends[use].ravel()]
    away = leaving([graph.lines[e] for e in use.tolist()], 10.0).reshape(-1, 2)
    away /= np.maximum(np.hypot(*away.T), 1e-9)[:, None]
    continued = 0
    for point in range(len(rows)):
        at = shapely.get_coordinates(rows.geometry.iloc[point])[0]
        near = np.hypot(*(starts - at).T) <= block_width / 2 if len(starts) else np.zeros(0, bool)
        if aimed and near.any():
            bearing = np.radians(float(rows["bearing_deg"].iloc[point]))
            wish = np.array([np.sin(bearing), np.cos(bearing)])
            near &= away @ wish > np.cos(np.radians(CONTINUES))
        continued += bool(near.any())
    return continued, len(rows)


def _median(values: FloatArray) -> float:
    return float(np.median(values)) if len(values) else 0.0
