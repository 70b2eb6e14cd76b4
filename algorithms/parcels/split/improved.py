"""Layouts in layers improved: streets moved, parcels cut anew, the better one kept (UP 6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from shapely.geometry import MultiLineString

from ...errors import CancelledError, InputError
from ...progress import Progress, Share, Silent
from ...site.crs import layer_crs
from ...site.prepare import prepare_sites
from ...site.repair import Problems
from ...site.roads import CLASS_COLUMNS
from ...site.types import Site
from ..blocks import blocks_from_streets
from ..fill import fill_blocks
from ..land import Edge, edge_frontage
from ..layers import block_problems, parcel_layers
from ..roadmesh import Ground
from ..rules import ParcelRules
from ..streetlayer import Quiet, StreetLayer
from ..streetspace import StreetWidths, read_streets, widths_of
from .borders import improve_borders
from .existing import SLACK, joined
from .layout import Score, judge
from .moved import MovedStreets, move_streets
from .old import Improved, OldParcels, as_lines, numbered, one_variation, together, usual_size
from .rows import column

__all__ = ["Given", "Improved", "improve_layout", "usual_size"]

#: What the field `status` says of streets that stay.
STAYING = ("existing", "given", "connector")
#: A layout must be better by so much (see `Score.value`).
GAIN = 1e-6
#: Less of the edge of a site than this is not along streets that the layer happens to have (share).
ALONG = 0.1
#: What roads are among streets with classes.
USUAL_CLASS = "residential"
#: Roads this near to land may run along its edge (metres).
SNAP = 5.0
#: Less land than this may get parcels though it was free before (square metres).
FREE = 100.0
#: Free land that is narrower comes of streets that moved (metres).
THIN = 6.0


@dataclass(frozen=True)
class Given:
    """The layers of a layout; parcels or streets must be there.

    Attributes
    ----------
    streets, parcels
        Centre lines, and polygons with `land_use`; None where there is none.
    site, roads, obstacles
        Site polygons (None: what the parcels cover), existing roads around, and polygons that
        stay free of streets and parcels, or None.
    widths
        Widths of streets without a field `width_m`.
    edge, snap_distance
        Where the edge of the site has access, see `blocks_from_streets`; "streets" means "open"
        where no street or road runs along it.
    street_layer, parcel_layer, site_layer, road_layer, obstacle_layer
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
    obstacles: gpd.GeoDataFrame | None = None
    obstacle_layer: str = "Obstacles"


def improve_layout(
    given: Given,
    rules: ParcelRules,
    *,
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
    seed
        Of whatever is random.
    progress
        Told of the work; where the caller cancels, the sites that are not done are left out.

    Raises
    ------
    InputError
        If there are neither streets nor parcels, streets without a site or parcels, or a layer
        cannot be used.
    CancelledError
        If the caller cancels before a site is done.
    """
    told = progress or Silent()
    if given.streets is None:
        if given.parcels is None:
            raise InputError("There is nothing to improve.", "Give streets, parcels or both.")
        return improve_borders(given.parcels, rules, layer=given.parcel_layer, progress=told)
    if given.site is None and given.parcels is None:
        raise InputError(
            "Nobody knows how far the land of the streets reaches.", "Give the site, or parcels."
        )
    return _Run(given, given.streets, rules, seed).done(told)


@dataclass(frozen=True)
class _Cut:
    """One way to cut a site into parcels; without a layer the one that was given."""

    score: Score
    parcels: gpd.GeoDataFrame | None = None
    problems: gpd.GeoDataFrame | None = None


class _Run:
    """Streets and parcels of all sites improved."""

    def __init__(
        self, given: Given, streets: gpd.GeoDataFrame, rules: ParcelRules, seed: int
    ) -> None:
        self.given, self.rules, self.seed = given, rules, seed
        self.streets = streets
        self.source = layer_crs(streets, given.street_layer)
        one_variation(streets, given.street_layer)
        self.old = OldParcels(given.parcels, given.parcel_layer)
        self.move = np.zeros(len(streets))
        self.lines = streets.geometry.to_numpy().copy()
        self.problems = Problems()
        self.more: list[gpd.GeoDataFrame] = []
        self.made: list[gpd.GeoDataFrame] = []
        self.stayed: list[gpd.GeoDataFrame] = []
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
                if not self.scores:
                    raise
                progress.warn(f"Cancelled: {k} of {len(sites)} sites are improved.")
                break
        shapes = gpd.GeoSeries(self.lines, index=self.streets.index, crs=self.source)
        streets = self.streets.set_geometry(shapes)
        streets["moved_m"] = self.move
        length = column(streets, "length_m")
        if length is not None:
            values = pd.to_numeric(length, errors="coerce").to_numpy(dtype=float).copy()
            changed = self.move > 0
            crs = sites[0].crs
            values[changed] = shapely.length(shapes[changed].to_crs(crs).to_numpy())
            streets[length.name] = values
        return Improved(
            streets,
            numbered(self.made, self.stayed, self.old, self.source),
            gpd.GeoDataFrame(
                pd.concat([self.problems.to_frame(self.source), *self.more], ignore_index=True),
                crs=self.source,
            ),
            together([(before, area) for before, _, area in self.scores]),
            together([(after, area) for _, after, area in self.scores]),
            float(self.move.max(initial=0.0)),
            self.better,
        )

    def _sites(self, progress: Progress) -> Sequence[Site]:
        """Read the sites, or make them of the parcels."""
        given = self.given
        site, name = given.site, given.site_layer
        if site is None:
            site = gpd.GeoDataFrame(
                geometry=[joined(list(self.old.plots), self._half())], crs=self.old.crs
            )
            name = given.parcel_layer
        return prepare_sites(
            site,
            obstacles=given.obstacles,
            polygon_layer=name,
            obstacle_layer=given.obstacle_layer,
            progress=Quiet(progress),
        ).sites

    def _half(self) -> float:
        """Half the width of the widest street, and a little more."""
        return float(widths_of(self.streets, self.given.widths).max(initial=10.0)) / 2 + SLACK

    def _site(self, site: Site, progress: Progress) -> None:
        """Improve a site."""
        given = self.given
        own = self.streets.to_crs(site.crs)
        edge, frontage = self._frontage(site, own, progress)
        areas, plots, labels = self.old.inside(site)
        held = replace(site, obstacles=[*site.obstacles, *areas])
        choices = [self._cut(held, own, edge, Share(progress, 0.0, 0.25))]
        if plots:
            choices.insert(0, _Cut(judge(Ground(site.polygon), [plots])))
        moved = self._moved(held, own, frontage, Share(progress, 0.25, 0.75))
        if moved.move.any():
            after = own.set_geometry(gpd.GeoSeries(moved.lines, index=own.index, crs=site.crs))
            choices.append(self._cut(held, after, edge, Share(progress, 0.75, 1.0)))
        values = [choice.score.value for choice in choices]
        best = min(range(len(choices)), key=lambda k: (round(values[k] / GAIN), k))
        self.better += best > 0
        self.scores.append((choices[0].score, choices[best].score, float(site.polygon.area)))
        for place, text in moved.problems:
            self.problems.add(given.street_layer, "", text, "it stays", "warning", place, site.crs)
        if moved.move.any() and best == len(choices) - 1:
            changed = np.flatnonzero(moved.move > 0)
            back = gpd.GeoSeries([moved.lines[k] for k in changed], crs=site.crs)
            self.lines[changed] = back.to_crs(self.source).to_numpy()
            self.move[changed] = moved.move[changed]
        chosen = choices[best]
        if chosen.problems is not None:
            self.more.append(chosen.problems.to_crs(self.source))
        if chosen.parcels is None:
            self.stayed.append(self.old.as_given(labels, self.source))
        else:
            kept = [label for label in labels if not self.old.is_land(label)]
            self.stayed.append(self.old.as_given(kept, self.source))
            self.made.append(chosen.parcels)
            if plots:
                self._say_what_was_free(site, [*areas, *(p.polygon for p in plots)], chosen.parcels)

    def _say_what_was_free(
        self, site: Site, before: Sequence[shapely.Geometry], parcels: gpd.GeoDataFrame
    ) -> None:
        """Warn of parcels where the layout that was given had neither land nor street."""
        new = shapely.union_all(parcels.geometry.to_crs(site.crs).to_numpy())
        free = shapely.difference(new, joined(before, self._half()))
        free = shapely.buffer(shapely.buffer(free, -THIN / 2), THIN / 2)
        if free.area > FREE:
            self.problems.add(
                self.given.parcel_layer, "",
                f"the parcels now cover {free.area:.0f} m2 that were free before",
                "give what stands there as Obstacles, or take it off the site, and run again",
                "warning", free.representative_point(), site.crs,
            )  # fmt: skip

    def _frontage(
        self, site: Site, own: gpd.GeoDataFrame, progress: Progress
    ) -> tuple[Edge, MultiLineString]:
        """Find where the edge of the site has a street."""
        given, edge = self.given, self.given.edge
        every = self._with_roads(own, site)
        reader = StreetLayer(every, given.widths, None, None, given.street_layer, Problems())
        lines = reader.lines(site.crs, progress)
        found = MultiLineString()
        if lines is not None:
            found = as_lines(edge_frontage(site.polygon, lines, edge, given.snap_distance))
        # ends of streets that bend along the edge are no street along it
        least = 0.0 if given.roads is not None else ALONG * float(site.polygon.exterior.length)
        if edge == "streets" and found.length <= least:
            return "open", as_lines(shapely.boundary(site.polygon))
        return edge, found

    def _with_roads(self, own: gpd.GeoDataFrame, site: Site) -> gpd.GeoDataFrame:
        """Put the existing roads to the streets, those that are among them left out."""
        roads = self.given.roads
        if roads is None or not len(roads):
            return own
        found = read_streets(roads, self.given.widths, site.crs, self.given.road_layer, Problems())
        there = shapely.buffer(shapely.union_all(own.geometry.dropna().to_numpy()), 1.0)
        share = shapely.length(shapely.intersection(found.lines, there))
        new = found.access & (share < 0.5 * shapely.length(found.lines))
        # words of the streets that roads lack: none, and for their class one that is a street
        words: dict[Any, str] = {
            name: USUAL_CLASS if str(name).lower() in CLASS_COLUMNS else ""
            for name in own.columns.drop(own.geometry.name)
            if own[name].dtype == object
        }
        if not new.any():
            return own
        data: dict[Any, list[Any]] = {name: [word] * int(new.sum()) for name, word in words.items()}
        data["width_m"] = (2 * found.half[new]).tolist()
        data[own.geometry.name] = found.lines[new].tolist()
        more = gpd.GeoDataFrame(data, geometry=own.geometry.name, crs=site.crs)
        return gpd.GeoDataFrame(pd.concat([own, more], ignore_index=True), crs=site.crs)

    def _moved(
        self,
        site: Site,
        own: gpd.GeoDataFrame,
        frontage: MultiLineString,
        progress: Progress,
    ) -> MovedStreets:
        """Move the streets of a site."""
        status = column(own, "status")
        fixed = np.zeros(len(own), dtype=bool)
        if status is not None:
            fixed = status.astype(str).str.lower().isin(STAYING).to_numpy()
        land = shapely.difference(site.polygon, shapely.union_all(list(site.obstacles)))
        roads = self.given.roads
        centres = None
        if roads is not None:
            near = roads.geometry.to_crs(site.crs).dropna().to_numpy()
            centres = as_lines(shapely.union_all(near[shapely.dwithin(near, land, SNAP)]))
        return move_streets(
            land,
            shapely.force_2d(own.geometry.to_numpy()),
            widths_of(own, self.given.widths),
            self.rules,
            frontage=frontage,
            centre_lines=centres,
            fixed=fixed,
            seed=self.seed,
            progress=progress,
        )

    def _cut(self, site: Site, streets: gpd.GeoDataFrame, edge: Edge, progress: Progress) -> _Cut:
        """Cut a site into parcels along streets."""
        given = self.given
        prepared = blocks_from_streets(
            [site], self._with_roads(streets, site), given.widths, edge=edge,
            snap_distance=given.snap_distance, street_layer=given.street_layer,
            site_layer=given.site_layer, progress=Share(progress, 0.0, 0.2),
        )  # fmt: skip
        filled = fill_blocks(
            prepared.blocks, self.rules, seed=self.seed, progress=Share(progress, 0.2, 1.0)
        )
        plots = prepared.with_thin(filled.plots)
        layer = parcel_layers(prepared.all_blocks, plots, prepared.all_places, self.source)
        told = block_problems(
            filled.problems, prepared.blocks, prepared.places, given.site_layer, site.crs
        )
        problems = pd.concat([prepared.problems.to_crs(site.crs), told], ignore_index=True)
        score = judge(Ground(site.polygon), plots)
        return _Cut(score, layer["parcels"], gpd.GeoDataFrame(problems, crs=site.crs))
