"""Layouts in layers improved: streets moved, parcels cut anew, the better one kept (UP 6)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import pandas as pd
import shapely
from shapely.geometry import MultiLineString, Polygon
from shapely.geometry.polygon import orient

from ...errors import CancelledError, InputError
from ...progress import Progress, Share, Silent
from ...site.crs import layer_crs, working_crs
from ...site.prepare import prepare_sites
from ...site.repair import Problems
from ...site.types import Site
from ..blocks import blocks_from_streets
from ..fill import fill_blocks
from ..land import Edge, Place, edge_frontage
from ..layers import parcel_layers
from ..refine import refine_blocks
from ..roadmesh import Ground
from ..rules import ParcelRules
from ..streetlayer import Quiet, StreetLayer
from ..streetspace import StreetWidths, widths_of
from ..types import Block, Plot
from .again import joined
from .chosen import valid_polygons
from .layout import Score, judge
from .moved import move_streets
from .rows import column

#: Uses of plots that parcels are cut of; land of any other use stays.
LAND = ("", "parcel", "green", "court", "lane", "street")
#: What the field `status` says of streets that stay.
STAYING = ("existing", "given", "connector")
#: A layout must be better by so much (see `Score.value`).
GAIN = 1e-6


@dataclass(frozen=True)
class Given:
    """The layers of a layout; parcels or streets must be there.

    Attributes
    ----------
    streets, parcels
        Centre lines, and polygons with `land_use`; None where there is none.
    site, roads
        Site polygons (None: what the parcels cover) and existing roads around, or None.
    widths
        Widths of streets without a field `width_m`.
    edge, snap_distance
        Where the edge of the site has access, see `blocks_from_streets`; "streets" means "open"
        where no street or road runs along it.
    street_layer, parcel_layer, site_layer, road_layer
        Names of the layers, for messages.
    """

    streets: gpd.GeoDataFrame | None = None
    parcels: gpd.GeoDataFrame | None = None
    site: gpd.GeoDataFrame | None = None
    roads: gpd.GeoDataFrame | None = None
    widths: StreetWidths = StreetWidths()  # noqa: RUF009
    edge: Edge = "streets"
    snap_distance: float = 30.0
    street_layer: str = "Streets"
    parcel_layer: str = "Parcels"
    site_layer: str = "Site"
    road_layer: str = "Roads"


@dataclass(frozen=True)
class Improved:
    """A layout and how much better it is.

    Attributes
    ----------
    streets
        All streets with their index and values, `moved_m` (metres) and, where it was there,
        `length_m` anew; None where no streets were given.
    parcels
        As `parcel_layers` gives them; those that are only moved keep their index.
    problems
        What a planner should know.
    before, after
        How good it was and is; the parcels given, else those that the streets given make.
    largest_move
        Of a vertex of a street, metres.
    better
        Number of sites (or blocks) that are better now.
    """

    streets: gpd.GeoDataFrame | None
    parcels: gpd.GeoDataFrame
    problems: gpd.GeoDataFrame
    before: Score
    after: Score
    largest_move: float
    better: int


def usual_size(parcels: gpd.GeoDataFrame | None) -> tuple[float, float] | None:
    """Median width and depth of the parcels of a layer, metres; None where there is none.

    Parameters
    ----------
    parcels
        Polygons in any CRS. The columns `width_m` and `depth_m` count where they are there, else
        the sides of the smallest rectangle around, the longer one as the depth.

    Raises
    ------
    InputError
        If the layer has no CRS.
    """
    if parcels is None or not len(parcels):
        return None
    uses = column(parcels, "land_use")
    own = parcels if uses is None else parcels[uses.fillna("parcel").isin(["parcel", ""])]
    told = [column(own, name) for name in ("width_m", "depth_m")]
    if all(one is not None for one in told):
        found = [pd.to_numeric(one, errors="coerce").median() for one in told]
        if all(value > 0 for value in found):
            return float(found[0]), float(found[1])
    shapes = valid_polygons(own.geometry)
    shapes = shapes[shapely.area(shapes) > 0]
    if not len(shapes):
        return None
    source = layer_crs(parcels, "Parcels")
    crs = working_crs(source, shapely.total_bounds(shapes), "Parcels")
    moved = gpd.GeoSeries(shapes, crs=source).to_crs(crs).to_numpy()
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(moved)).reshape(-1, 5, 2)
    sides = np.hypot(*np.moveaxis(corners[:, 1:3] - corners[:, 0:2], -1, 0))
    return float(np.median(sides.min(axis=1))), float(np.median(sides.max(axis=1)))


def improve_layout(
    given: Given,
    rules: ParcelRules,
    *,
    iterations: int = 10,
    seed: int = 0,
    progress: Progress | None = None,
) -> Improved:
    """Move streets so that rows of parcels fit better, and cut the parcels anew.

    Of each site the best is kept: the parcels given, those that the streets given make, or those
    that the moved streets make. Land of other uses stays. Without streets the borders between
    the parcels are improved, and the outlines of their blocks stay.

    Parameters
    ----------
    given
        The layout.
    rules
        What is asked of parcels.
    iterations
        Of the streets, at most.
    seed
        Of whatever is random.
    progress
        Told of the work; where the caller cancels, the sites that are not done stay.

    Raises
    ------
    InputError
        If there are neither streets nor parcels, streets without a site or parcels, or a layer
        cannot be used.
    CancelledError
        If the caller cancels before anything is improved.
    """
    told = progress or Silent()
    if given.streets is None:
        if given.parcels is None:
            raise InputError("There is nothing to improve.", "Give streets, parcels or both.")
        return _borders(given.parcels, given.parcel_layer, rules, told)
    if given.site is None and given.parcels is None:
        raise InputError(
            "Nobody knows how far the land of the streets reaches.", "Give the site, or parcels."
        )
    return _Run(given, rules, iterations, seed).done(told)


class _Run:
    """Streets and parcels of all sites improved."""

    def __init__(self, given: Given, rules: ParcelRules, iterations: int, seed: int) -> None:
        self.given, self.rules, self.iterations, self.seed = given, rules, iterations, seed
        self.streets = gpd.GeoDataFrame(given.streets)
        self.source = layer_crs(self.streets, given.street_layer)
        self.problems = Problems()
        self.move = np.zeros(len(self.streets))
        self.lines = self.streets.geometry.to_numpy().copy()
        self.parcels: list[gpd.GeoDataFrame] = []
        self.scores: list[tuple[Score, Score, float]] = []
        self.better = 0

    def done(self, progress: Progress) -> Improved:
        """Improve one site after the other."""
        sites = self._sites(progress)
        for k, site in enumerate(sites):
            share = Share(progress, k / len(sites), (k + 1) / len(sites))
            try:
                self._site(site, share)
            except CancelledError:
                if not self.parcels:
                    raise
                progress.warn(f"Cancelled: {k} of {len(sites)} sites are improved.")
                break
        full = [own for own in self.parcels if len(own)] or self.parcels[:1]
        parcels = gpd.GeoDataFrame(pd.concat(full), geometry="geometry", crs=full[0].crs)
        streets = self.streets.copy()
        streets = streets.set_geometry(gpd.GeoSeries(self.lines, index=streets.index, crs=self.source))
        streets["moved_m"] = self.move
        return Improved(
            streets,
            parcels,
            self.problems.to_frame(self.source),
            _together([(before, area) for before, _, area in self.scores]),
            _together([(after, area) for _, after, area in self.scores]),
            float(self.move.max(initial=0.0)),
            self.better,
        )

    def _sites(self, progress: Progress) -> Sequence[Site]:
        """Read the sites, or make them of the parcels."""
        given = self.given
        polygons, layer = given.site, given.site_layer
        if polygons is None:
            parcels = gpd.GeoDataFrame(given.parcels)
            shapes = valid_polygons(parcels.geometry)
            source = layer_crs(parcels, given.parcel_layer)
            crs = working_crs(source, shapely.total_bounds(shapes), given.parcel_layer)
            widest = float(widths_of(self.streets, given.widths).max(initial=10.0))
            own = gpd.GeoSeries(shapes, crs=source).to_crs(crs).to_numpy()
            whole = joined(list(own), widest / 2 + 0.2)
            polygons, layer = gpd.GeoDataFrame(geometry=[whole], crs=crs), given.parcel_layer
        found = prepare_sites(polygons, polygon_layer=layer, progress=Quiet(progress))
        return found.sites

    def _site(self, site: Site, progress: Progress) -> None:
        """Improve a site."""
        given = self.given
        own = self.streets.to_crs(site.crs)
        roads = None if given.roads is None else given.roads.to_crs(site.crs)
        everything = _with_roads(own, roads, given.widths)
        reader = StreetLayer(everything, given.widths, None, None, given.street_layer, Problems())
        lines = reader.lines(site.crs, progress)
        edge = given.edge
        frontage = MultiLineString()
        if lines is not None:
            frontage = _lines(edge_frontage(site.polygon, lines, edge, given.snap_distance))
        if frontage.is_empty and edge == "streets":
            edge, frontage = "open", _lines(shapely.boundary(site.polygon))
        areas, plots, labels = self._parcels_of(site)
        held = replace(site, obstacles=[*site.obstacles, *areas])
        first = self._cut(held, own, roads, edge, Share(progress, 0.0, 0.3))
        choices = [first]
        if plots:
            choices.insert(0, _Cut(judge(Ground(site.polygon), [plots]), None))
        moved = self._moved(held, own, roads, frontage, Share(progress, 0.3, 0.6))
        after = own.set_geometry(gpd.GeoSeries(moved.lines, index=own.index, crs=site.crs))
        choices.append(self._cut(held, after, roads, edge, Share(progress, 0.6, 1.0)))
        scores = [choice.score.value for choice in choices]
        best = min(range(len(choices)), key=lambda k: (round(scores[k] / GAIN), k))
        self.better += best > 0
        self.scores.append((choices[0].score, choices[best].score, float(site.polygon.area)))
        for place, text in moved.problems:
            self.problems.add(given.street_layer, "", text, "it stays", "warning", place, site.crs)
        if best == len(choices) - 1:
            changed = np.flatnonzero(moved.move > 0)
            back = gpd.GeoSeries([moved.lines[k] for k in changed], crs=site.crs)
            self.lines[changed] = back.to_crs(self.source).to_numpy()
            self.move[changed] = moved.move[changed]
        kept = given.parcels if given.parcels is not None else own.iloc[:0]
        if choices[best].parcels is None:
            self.parcels.append(_as_given(kept.loc[labels]))
        else:
            fixed = [k for k in labels if str(kept.loc[k].get("land_use")) not in LAND]
            self._add(choices[best].parcels, _as_given(kept.loc[fixed]) if fixed else None, kept)

    def _add(
        self, layer: gpd.GeoDataFrame, fixed: gpd.GeoDataFrame | None, given: gpd.GeoDataFrame
    ) -> None:
        """Add the parcels of a site, with labels that no other has."""
        top = max([-1, *map(int, given.index), *(int(own.index.max()) for own in self.parcels if len(own))])
        layer.index = range(top + 1, top + 1 + len(layer))
        if fixed is not None:
            layer = gpd.GeoDataFrame(
                pd.concat([fixed.astype(object), layer.astype(object)]),
                geometry=[*fixed.geometry, *layer.geometry], crs=layer.crs,
            )  # fmt: skip
        self.parcels.append(layer)
''' if False else ''
