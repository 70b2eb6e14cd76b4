"""Blocks to be cut into parcels, from block polygons or from streets of any make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, get_args

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import pandas as pd
import shapely
from pyproj import CRS
from shapely.geometry import MultiLineString

from ..errors import InputError
from ..progress import Progress, Silent
from ..site.crs import DISTORTION, distortion, layer_crs, working_crs
from ..site.prepare import prepare_sites
from ..site.repair import POLYGON_TYPE, Problems, overlay, repair_polygons, rounded
from ..site.types import PreparedSites, Site
from ..site.watch import ask
from .blocklines import NEAR, THIN
from .land import CRUMB, Edge, Land, Parted, Place, edge_frontage, no_street_along, part_land
from .streetlayer import Quiet, StreetLayer
from .streetspace import Floats, StreetLines, StreetWidths
from .types import Block, Plot

#: Two polygons that share more of their edges have no street between them (metres).
SHARED = 1.0
#: Less common ground of two polygons is rounding (square metres).
COMMON = 0.01
#: Smaller lands that streets enclose are none (square metres).
SMALLEST = 50.0
NOTE_THIN = f"narrower than {THIN:g} m"


@dataclass(frozen=True)
class PreparedBlocks:
    """Blocks, and what is left of their land.

    Attributes
    ----------
    blocks
        Numbered from 1.
    places
        Where each is from.
    thin
        Land too narrow for parcels, with numbers after those of the blocks.
    thin_places
        Where each of these is from.
    space
        Street space by the land that it is taken of, each with where it is from. Blocks, thin
        land, obstacles and street space tile the land.
    source_crs
        CRS of the planner's layer.
    problems
        One row per repair or finding, as in `site.PreparedSites`.
    layer
        Name of the layer that the land is from.
    """

    blocks: tuple[Block, ...]
    places: tuple[Place, ...]
    thin: tuple[Block, ...]
    thin_places: tuple[Place, ...]
    space: tuple[tuple[shapely.Geometry, Place], ...]
    source_crs: CRS
    problems: gpd.GeoDataFrame
    layer: str = "Blocks"

    @property
    def all_blocks(self) -> list[Block]:
        """Blocks, then thin land."""
        return [*self.blocks, *self.thin]

    @property
    def all_places(self) -> list[Place]:
        """Where each of them is from."""
        return [*self.places, *self.thin_places]

    def with_thin(self, plots: Sequence[Sequence[Plot]]) -> list[list[Plot]]:
        """Return the plots of `all_blocks`: those of the blocks, and thin land as greens.

        Parameters
        ----------
        plots
            Plots of each of `blocks`.
        """
        greens = [[Plot(own.polygon, "green", NOTE_THIN)] for own in self.thin]
        return [*(list(own) for own in plots), *greens]


def blocks_from_polygons(
    polygons: gpd.GeoDataFrame,
    streets: gpd.GeoDataFrame | None = None,
    widths: StreetWidths | None = None,
    *,
    closed_lines: gpd.GeoDataFrame | None = None,
    edge: Edge = "streets",
    snap_distance: float = 30.0,
    given_widths: Floats | None = None,
    polygon_layer: str = "Blocks",
    street_layer: str = "Streets",
    progress: Progress | None = None,
) -> PreparedBlocks:
    """Take block polygons as they are.

    Each polygon stays by itself. Where streets are given, half their width is taken off the
    polygons whose edges are centre lines, and edges without a street are closed; without streets
    every edge has access but those that two polygons share.

    Parameters
    ----------
    polygons
        Block polygons in any CRS and state. Feature ids are the index.
    streets
        Centre lines, or None.
    widths
        See `StreetWidths`.
    closed_lines
        Lines beside which there is no access, such as railways, or None.
    edge
        See `Edge`; without streets "streets" means "open".
    snap_distance
        Largest distance of a centre line from a property line along it, metres.
    given_widths
        Width of each street, nan for none, shape (n,), metres.
    polygon_layer, street_layer
        Names of the layers, for messages.
    progress
        Takes remarks and is asked for cancellation.

    Returns
    -------
    PreparedBlocks
        Blocks in the order of the features.

    Raises
    ------
    InputError
        If a layer has no CRS, no polygon is usable, or a parameter is out of bounds.
    CancelledError
        If the caller cancels.
    """
    progress = progress or Silent()
    _check(edge, snap_distance)
    source = layer_crs(polygons, polygon_layer)
    found = Parted(polygon_layer, Problems())
    shapes, ids, crs = _repaired(polygons, source, polygon_layer, found.problems, progress)
    shapes, ids, beside = _apart(shapes, ids, polygon_layer, crs, found.problems)
    reader = StreetLayer(streets, widths, given_widths, closed_lines, street_layer, found.problems)
    if streets is None and beside and edge == "streets":
        progress.warn(
            f"Layer '{polygon_layer}': blocks adjoin each other, and along the edges that they "
            "share there is no access. Where these are streets give the layer of streets, too: "
            "half their width is taken off."
        )
    true_everywhere = distortion(crs, shapely.total_bounds(shapes)) < DISTORTION
    for at, (shape, feature) in enumerate(zip(shapes, ids.tolist())):
        ask(progress)
        progress.stage(f"Preparing block {at + 1} of {len(shapes)}", at / len(shapes))
        along = MultiLineString() if edge == "closed" else shapely.boundary(shape)
        if at in beside and edge == "streets":
            along = overlay(shapely.difference, along, shapely.buffer(beside[at], 2 * NEAR))
        own = crs if true_everywhere else working_crs(crs, shape.bounds, polygon_layer)
        if own != crs:
            shape, along = gpd.GeoSeries([shape, along], crs=crs).to_crs(own)
        lines = reader.lines(own, progress)
        if lines is not None:
            along = edge_frontage(shape, lines, edge, snap_distance)
        land = Land(shape, Place(own, 0, str(feature)), along)
        part_land(land, lines, reader.drawn(own), found, progress)
    return _numbered(found, source)


def blocks_from_streets(
    site: gpd.GeoDataFrame | PreparedSites | Sequence[Site] | None,
    streets: gpd.GeoDataFrame,
    widths: StreetWidths | None = None,
    *,
    obstacles: gpd.GeoDataFrame | None = None,
    closed_lines: gpd.GeoDataFrame | None = None,
    edge: Edge = "streets",
    snap_distance: float = 30.0,
    given_widths: Floats | None = None,
    site_layer: str = "Site",
    street_layer: str = "Streets",
    obstacle_layer: str = "Obstacles",
    progress: Progress | None = None,
) -> PreparedBlocks:
    """Part a site into blocks by its streets.

    Blocks are the site less street space and obstacles. Where the edge of the site is the
    centre line of a street half its width is taken off; where it is the property line along one
    nothing is, and the edge has access; elsewhere the edge is closed, and so are obstacles.

    Parameters
    ----------
    site
        Site polygons in any CRS and state, or prepared sites; None: all land that the streets
        enclose.
    streets
        Centre lines in any CRS: designed, drawn, or of a map; those around the site among them.
    obstacles
        Polygons that no parcel may cover, or None; prepared sites have their own.
    site_layer, obstacle_layer
        Names of the layers, for messages.
    widths, closed_lines, edge, snap_distance, given_widths, street_layer, progress
        See `blocks_from_polygons`.

    Returns
    -------
    PreparedBlocks
        Blocks site by site, from north to south.

    Raises
    ------
    InputError
        If a layer has no CRS, no site or street is usable, or a parameter is out of bounds.
    CancelledError
        If the caller cancels.
    """
    progress = progress or Silent()
    _check(edge, snap_distance)
    found = Parted(site_layer if site is not None else street_layer, Problems())
    reader = StreetLayer(streets, widths, given_widths, closed_lines, street_layer, found.problems)
    before = None
    if site is None:
        sites: Sequence[Site] = _enclosed(streets, reader, street_layer, progress)
        edge = "closed"  # there is no edge but centre lines
    elif isinstance(site, (gpd.GeoDataFrame, PreparedSites)):
        if isinstance(site, gpd.GeoDataFrame):
            site = prepare_sites(
                site,
                None,
                obstacles,
                polygon_layer=site_layer,
                obstacle_layer=obstacle_layer,
                progress=Quiet(progress),
            )
        before, sites = site.problems, site.sites
    else:
        sites = site
    if not sites:
        raise InputError("There is no site.", "Give at least one.", layer=site_layer)
    for at, own in enumerate(sites):
        ask(progress)
        progress.stage(f"Parting site {at + 1} of {len(sites)}", at / len(sites))
        lines = reader.lines(own.crs, progress)
        if lines is None:
            continue
        along = edge_frontage(own.polygon, lines, edge, snap_distance)
        _tell_of_streets(own, lines, along, edge, street_layer, found)
        place = Place(own.crs, own.site_id, str(own.feature))
        land = Land(own.polygon, place, along, own.obstacles)
        part_land(land, lines, reader.drawn(own.crs), found, progress)
    return _numbered(found, sites[0].source_crs, before)


def _tell_of_streets(
    site: Site,
    lines: StreetLines,
    along: shapely.Geometry,
    edge: Edge,
    layer: str,
    found: Parted,
) -> None:
    """Note where no street lies in a site, or none along its edge."""
    if not shapely.intersects(site.polygon, lines.lines).any():
        what = f"no street of layer '{layer}' lies in the site"
        todo = "taken as one block: see whether the right layers are chosen"
    elif edge == "streets" and no_street_along(site.polygon, lines, along):
        what = f"no street of layer '{layer}' runs along its edge"
        todo = (
            "parcels have access from inner streets alone; if there are streets that the layer "
            "lacks, let there be access everywhere along the edge"
        )
    else:
        return
    found.problems.add(found.layer, site.feature, what, todo, "warning", site.polygon, site.crs)


def _check(edge: str, snap_distance: float) -> None:
    if edge not in get_args(Edge):
        raise InputError(
            f"'{edge}' is no choice for the edge.", f"Choose one of {', '.join(get_args(Edge))}."
        )
    if not snap_distance > 0:
        raise InputError(
            f"The snap distance is {snap_distance:g} m.", "Give a distance greater than 0 m."
        )


def _repaired(
    polygons: gpd.GeoDataFrame, source: CRS, layer: str, problems: Problems, progress: Progress
) -> tuple[npt.NDArray[Any], npt.NDArray[Any], CRS]:
    """Give valid polygons in a working CRS, with the ids of their features."""
    geometry = np.asarray(polygons.geometry.array, dtype=object).copy()
    bounds = shapely.bounds(geometry).reshape(-1, 4)
    finite = bounds[np.isfinite(bounds).all(axis=1)]
    nothing = InputError(
        "none of its geometries is a block.", "Choose a layer with polygons.", layer=layer
    )
    if len(finite) == 0:
        raise nothing
    total = np.concatenate([finite[:, :2].min(axis=0), finite[:, 2:].max(axis=0)])
    crs = working_crs(source, total, layer)
    if crs != source:
        geometry = gpd.GeoSeries(geometry, crs=source).to_crs(crs).to_numpy()
    ids = polygons.index.to_numpy()
    shapes, ids = repair_polygons(geometry, ids, layer, crs, problems, progress)
    large = shapely.area(shapes) > CRUMB
    for shape, feature in zip(shapes[~large], ids[~large]):
        what = f"covers {shape.area:.2f} m2"
        problems.add(layer, feature, what, "left out as too small", "info", shape, crs)
    if not large.any():
        raise nothing
    return shapes[large], ids[large], crs


def _apart(
    shapes: npt.NDArray[Any], ids: npt.NDArray[Any], layer: str, crs: CRS, problems: Problems
) -> tuple[npt.NDArray[Any], npt.NDArray[Any], Mapping[int, shapely.Geometry]]:
    """Take common ground off the later of two polygons; find what adjoins each."""
    a, b = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    pairs = sorted((int(j), int(i)) for i, j in zip(a, b) if i < j)
    shapes = shapes.copy()
    for later, first in pairs:
        common = overlay(shapely.intersection, shapes[later], shapes[first])
        if shapely.area(common) > COMMON:
            what = f"shares {common.area:.1f} m2 with feature {ids[first]}"
            problems.add(layer, ids[later], what, "taken off", "warning", common, crs)
            shapes[later] = rounded(overlay(shapely.difference, shapes[later], shapes[first]))
    parts, origin = shapely.get_parts(shapes, return_index=True)
    keep = (shapely.get_type_id(parts) == POLYGON_TYPE) & (shapely.area(parts) > CRUMB)
    shapes, ids = parts[keep], ids[origin[keep]]
    a, b = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    a, b = a[a != b], b[a != b]
    rings = shapely.boundary(shapes)
    shared = shapely.intersection(rings[a], shapely.buffer(rings, NEAR, quad_segs=2)[b])
    beside: dict[int, list[Any]] = {}
    for i, j in zip(*(own[shapely.length(shared) > SHARED].tolist() for own in (a, b))):
        beside.setdefault(i, []).append(rings[j])
    return shapes, ids, {at: shapely.union_all(own) for at, own in beside.items()}


def _enclosed(
    streets: gpd.GeoDataFrame, reader: StreetLayer, layer: str, progress: Progress
) -> list[Site]:
    """Land that streets enclose, as sites whose edges are centre lines."""
    source = layer_crs(streets, layer)
    bounds = np.asarray(streets.total_bounds, dtype=float)
    if not np.isfinite(bounds).all():
        bounds = np.zeros(4)
    crs = working_crs(source, bounds, layer)
    lines = reader.lines(crs, progress)
    faces = shapely.get_parts(shapely.polygonize([] if lines is None else lines.lines))
    lands = shapely.get_parts(shapely.union_all(faces))
    lands = lands[shapely.area(lands) > SMALLEST]
    if len(lands) == 0:
        raise InputError(
            "its streets enclose no land.", "Give a site as well, whose edge closes it.",
            layer=layer,
        )  # fmt: skip
    return [
        Site(f"Land {at}", "", land, crs, source, site_id=at)
        for at, land in enumerate(rounded(lands), 1)
    ]


def _numbered(found: Parted, source: CRS, before: gpd.GeoDataFrame | None = None) -> PreparedBlocks:
    """Give everything its number."""
    first = len(found.blocks) + 1
    rows = found.problems.to_frame(source)
    frames = [own for own in (before, rows) if own is not None and len(own)]
    joined = gpd.GeoDataFrame(pd.concat(frames, ignore_index=True)) if frames else rows
    return PreparedBlocks(
        tuple(replace(own, block_id=at) for at, (own, _) in enumerate(found.blocks, 1)),
        tuple(place for _, place in found.blocks),
        tuple(Block(own, block_id=at) for at, (own, _) in enumerate(found.thin, first)),
        tuple(place for _, place in found.thin),
        tuple(found.space),
        source,
        joined,
        found.layer,
    )
