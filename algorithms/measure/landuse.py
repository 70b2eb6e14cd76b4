"""What the ground of a layout is used for, its blocks and its streets (UP section 7)."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from ..progress import Progress, Silent
from ..site.repair import NO_AREA
from ..site.watch import ask
from .layers import read_streets
from .parcels import GAP
from .plan import EDGE_GAP, SLIVER, THINNEST
from .polygons import PolygonLayer, closed, read_polygons, united
from .uses import USES, Use, read_uses, use_field

Floats = npt.NDArray[np.float64]

#: Gaps up to this width are no street: what lies on both sides is one block (metres).
SEAM = 1.0
#: Streets this near to the edge of the site still belong to it (metres).
TOUCH = 1.0
#: Polygons overlap where their areas add up to so much more than their union (share).
OVERLAP = 1e-3
#: What ground is where polygons of several uses overlap: the first of these.
ORDER: tuple[Use, ...] = ("streets", "parks", "other", "parcels")


@dataclass(frozen=True)
class LandUseFigures:
    """Figures of a layout (UP section 7); NaN where there is nothing to measure.

    Attributes
    ----------
    ground_ha
        The ground: the site or, without one, the polygons with the gaps between them up to 40 m.
    streets_pct, parcels_pct, parks_pct, other_pct
        Shares of the ground in % (UP: ls, lr, lp, lo). Ground that no polygon covers is street
        space.
    blocks, blocks_km2
        Number of blocks, and per square kilometre (UP: bn).
    block_max, block_mean, block_min
        Outer boundary length of the blocks, metres (UP: bmax, bavg, bmin).
    street_km_km2
        Length of the streets on the ground, kilometres per square kilometre (UP: sl).
    intersections, intersections_km2
        Places on the ground where three or more streets meet (UP: si).
    dead_ends, dead_ends_km2
        Places where one street ends, further than 10 m from the edge of the ground (UP: sd).
    parcels, parcels_km2
        Number of parcels (UP: pn).
    """

    ground_ha: float
    streets_pct: float
    parcels_pct: float
    parks_pct: float
    other_pct: float
    blocks: int
    blocks_km2: float
    block_max: float
    block_mean: float
    block_min: float
    street_km_km2: float
    intersections: float
    intersections_km2: float
    dead_ends: float
    dead_ends_km2: float
    parcels: int
    parcels_km2: float

    def as_dict(self) -> dict[str, float]:
        """Give the figures by name, in the order of the class."""
        return asdict(self)


@dataclass(frozen=True, eq=False)
class LandUseReport:
    """What was found about the land use of a layer.

    Attributes
    ----------
    figures
        See `LandUseFigures`.
    table
        One row for each use and one for all, without geometry: land_use, polygons, area_m2,
        share_pct.
    problems
        What was left out, repaired or not understood, in the CRS of the layer.
    use_field
        The field that told the use; empty where all polygons are parcels.
    """

    figures: LandUseFigures
    table: gpd.GeoDataFrame
    problems: gpd.GeoDataFrame
    use_field: str


def measure_land_use(
    land: gpd.GeoDataFrame,
    *,
    streets: gpd.GeoDataFrame | None = None,
    blocks: gpd.GeoDataFrame | None = None,
    site: gpd.GeoDataFrame | None = None,
    field: str = "",
    land_layer: str = "Land use",
    street_layer: str = "Streets",
    block_layer: str = "Blocks",
    site_layer: str = "Site",
    progress: Progress | None = None,
) -> LandUseReport:
    """Measure shares of land use, blocks, streets and parcels of a layout.

    Parameters
    ----------
    land
        Polygons in any CRS with their use; see `uses`. Where they overlap, ground counts once:
        as street before park, park before other, other before parcel. Not changed.
    streets
        Centre lines; None: nothing is told of their length and junctions.
    blocks
        Polygons; None: land that is no street, joined where less than 1 m is between, in pieces
        of at least 50 m2 that are somewhere 10 m wide.
    site
        Polygons; None: see `LandUseFigures.ground_ha`. What lies outside does not count.
    field
        Field with the use; empty: `uses.use_field` finds it, and without one all are parcels.
    land_layer, street_layer, block_layer, site_layer
        Names of the layers, for messages.
    progress
        Told of stages and asked for cancellation, or None.

    Raises
    ------
    InputError
        If a layer has no CRS or geometries of another kind.
    CancelledError
        If the caller cancels.

    Examples
    --------
    >>> x = 500_000
    >>> lots = [shapely.box(x, 0, x + 36, 30), shapely.box(x, 45, x + 36, 75)]
    >>> land = gpd.GeoDataFrame({"land_use": ["parcel", "park"]}, geometry=lots, crs=32633)
    >>> found = measure_land_use(land).figures
    >>> round(found.streets_pct), round(found.parks_pct), found.blocks, round(found.block_max)
    (20, 40, 2, 132)
    """
    told = progress or Silent()
    told.stage("Reading the land use", 0.0)
    layer = read_polygons(land, land_layer, None, progress)
    use = field or use_field(land)
    uses, unknown = read_uses(land, use, land_layer)
    for word, count in unknown.items():
        text = f"use '{word}' is not known" if word else "no use"
        what = f"{count} polygons: {text}"
        layer.problems.add(land_layer, "", what, "counted as other", "warning", None, layer.crs)
    told.stage("Joining polygons", 0.2)
    site_ground = None if site is None else _site(site, site_layer, layer.crs, progress)
    shapes, uses = _cut(layer.shapes[layer.usable], uses[layer.usable], site_ground)
    land = united(shapes[uses != "streets"], progress)
    covered = shapely.union(land, united(shapes[uses == "streets"], progress))
    ground = site_ground
    if ground is None:
        ground = shapely.union(covered, closed(covered, GAP))
    areas = _areas(shapes, uses, covered, layer, progress)
    areas["streets"] += max(float(ground.area) - float(covered.area), 0.0)
    told.stage("Measuring blocks", 0.6)
    found = _blocks(land if blocks is None else _given(blocks, block_layer, layer.crs, ground))
    told.stage("Measuring streets", 0.8)
    told_of_streets = _street_figures(streets, ground, layer.crs, street_layer)
    counts = {use: int((uses == use).sum()) for use in USES}
    return LandUseReport(
        figures=_figures(areas, counts["parcels"], ground, found, told_of_streets),
        table=_table(areas, counts, layer.source_crs),
        problems=layer.problems.to_frame(layer.source_crs),
        use_field=use,
    )


def _site(
    site: gpd.GeoDataFrame, name: str, crs: CRS, progress: Progress | None
) -> shapely.Geometry:
    """Give the polygons of a site as one."""
    ground = united(read_polygons(site, name, crs, progress).shapes)
    shapely.prepare(ground)
    return ground


def _cut(
    shapes: npt.NDArray[Any], uses: Any, ground: shapely.Geometry | None
) -> tuple[npt.NDArray[Any], Any]:
    """Cut polygons to the ground; those outside are left out, with their uses."""
    if ground is None:
        return shapes, uses
    shapes = shapes.copy()
    inside = shapely.intersects(ground, shapes)
    across = inside & ~shapely.covers(ground, shapes)
    shapes[across] = shapely.intersection(shapes[across], ground)
    inside &= shapely.area(shapes) > NO_AREA
    return shapes[inside], uses[inside]


def _areas(
    shapes: npt.NDArray[Any],
    uses: Any,
    covered: shapely.Geometry,
    layer: PolygonLayer,
    progress: Progress | None,
) -> dict[Use, float]:
    """Give the area of each use in square metres, ground that is covered twice counted once."""
    plain = shapely.area(shapes)
    areas = {use: float(plain[uses == use].sum()) for use in USES}
    whole = float(plain.sum())
    twice = whole - float(covered.area)
    if twice > OVERLAP * whole:
        text = f"polygons overlap on {twice:.0f} m2"
        done = "ground counted once: as street before park, other and parcel"
        layer.problems.add(layer.name, "", text, done, "warning", None, layer.crs)
        taken: shapely.Geometry = shapely.Polygon()
        for use in ORDER:
            ask(progress)
            own = united(shapes[uses == use], progress)
            areas[use] = float(shapely.difference(own, taken).area)
            taken = shapely.union(taken, own)
    return areas


def _given(
    blocks: gpd.GeoDataFrame, name: str, crs: CRS, ground: shapely.Geometry
) -> npt.NDArray[Any]:
    """Read blocks, cut to the ground."""
    shapes = read_polygons(blocks, name, crs).shapes
    return np.asarray(shapely.intersection(shapes[~shapely.is_missing(shapes)], ground))


def _blocks(land: shapely.Geometry | npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Take land apart into blocks: what is not too small or thin; joined, if it is one."""
    joined = closed(land, SEAM) if isinstance(land, shapely.Geometry) else land
    parts = shapely.get_parts(joined)
    parts = parts[shapely.area(parts) >= SLIVER]
    return np.asarray(parts[~shapely.is_empty(shapely.buffer(parts, -THINNEST / 2))])


def _street_figures(
    streets: gpd.GeoDataFrame | None, ground: shapely.Geometry, crs: CRS, name: str
) -> tuple[float, float, float]:
    """Length in metres, intersections and dead ends on the ground; NaN without streets."""
    if streets is None:
        return math.nan, math.nan, math.nan
    graph = read_streets(streets.to_crs(crs) if streets.crs is not None else streets, name).graph
    near = shapely.buffer(ground, TOUCH)
    shapely.prepare(near)
    length = float(shapely.length(shapely.intersection(np.array(graph.lines), near)).sum())
    points = shapely.points(graph.nodes.reshape(-1, 2))
    inside = shapely.intersects(near, points)
    inner = inside & (shapely.distance(points, ground.boundary) > EDGE_GAP)
    return (
        length,
        float((inside & (graph.degrees >= 3)).sum()),
        float((inner & (graph.degrees == 1)).sum()),
    )


def _figures(
    areas: dict[Use, float],
    parcels: int,
    ground: shapely.Geometry,
    blocks: npt.NDArray[Any],
    streets: tuple[float, float, float],
) -> LandUseFigures:
    whole = float(ground.area)
    km2 = whole / 1e6
    share = {use: 100 * area / whole for use, area in areas.items()}
    around = shapely.length(shapely.get_exterior_ring(blocks))
    length, junctions, ends = streets
    return LandUseFigures(
        ground_ha=whole / 1e4,
        streets_pct=share["streets"],
        parcels_pct=share["parcels"],
        parks_pct=share["parks"],
        other_pct=share["other"],
        blocks=len(blocks),
        blocks_km2=len(blocks) / km2,
        block_max=float(around.max()) if len(around) else math.nan,
        block_mean=float(around.mean()) if len(around) else math.nan,
        block_min=float(around.min()) if len(around) else math.nan,
        street_km_km2=length / 1000 / km2,
        intersections=junctions,
        intersections_km2=junctions / km2,
        dead_ends=ends,
        dead_ends_km2=ends / km2,
        parcels=parcels,
        parcels_km2=parcels / km2,
    )


def _table(areas: dict[Use, float], counts: dict[Use, int], crs: CRS) -> gpd.GeoDataFrame:
    """Give the shares as rows."""
    whole = sum(areas.values())
    rows = [(str(use), counts[use], areas[use]) for use in USES]
    rows.append(("all", sum(counts.values()), whole))
    columns = {
        "land_use": [use for use, _, _ in rows],
        "polygons": [count for _, count, _ in rows],
        "area_m2": [area for _, _, area in rows],
        "share_pct": [100 * area / whole for _, _, area in rows],
    }
    return gpd.GeoDataFrame(columns, geometry=[None] * len(rows), crs=crs)
