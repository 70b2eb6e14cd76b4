"""The parcels that a layout had before it is improved, and what it is measured by."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any, cast

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from pyproj import CRS
from shapely.geometry import MultiLineString, Polygon

from ...errors import InputError
from ...site.crs import layer_crs, working_crs
from ...site.types import Site
from ..layers import COLUMNS
from ..types import Plot, PlotUse
from .chosen import valid_polygons
from .layout import Score
from .rows import column

#: Uses of plots that parcels are cut of; land of any other use stays.
LAND = ("", "parcel", "green", "court", "lane", "street")
#: Numbers of features.
IDS = ("parcel_id", "block_id")


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


class OldParcels:
    """The parcels that were given, or none.

    Parameters
    ----------
    frame
        Polygons in any CRS, or None.
    layer
        Its name, for messages.

    Raises
    ------
    InputError
        If the layer has no CRS or no polygon, or holds several variations.
    """

    def __init__(self, frame: gpd.GeoDataFrame | None, layer: str) -> None:
        self.frame = frame
        self.plots: Any = np.array([], dtype=object)
        self.labels: list[Hashable] = []
        self.uses: list[str] = []
        self.crs: CRS | None = None
        if frame is None:
            return
        source = layer_crs(frame, layer)
        one_variation(frame, layer)
        shapes = valid_polygons(frame.geometry)
        some = np.flatnonzero(shapely.area(shapes) > 0)
        if not len(some):
            raise InputError("It has no polygon.", "Choose a layer of parcels.", layer=layer)
        self.crs = working_crs(source, shapely.total_bounds(shapes[some]), layer)
        self.plots = gpd.GeoSeries(shapes[some], crs=source).to_crs(self.crs).to_numpy()
        self.labels = [frame.index[k] for k in some]
        uses = column(frame, "land_use")
        self.uses = [
            "" if uses is None or pd.isna(uses.iloc[k]) else str(uses.iloc[k]) for k in some
        ]

    def is_land(self, label: Hashable) -> bool:
        """Tell whether a feature is land that parcels may be cut of."""
        return self.uses[self.labels.index(label)] in LAND

    def inside(self, site: Site) -> tuple[list[Polygon], list[Plot], list[Hashable]]:
        """Give what lies in a site: areas of other use, plots, and the labels of both.

        Parameters
        ----------
        site
            The site.
        """
        if self.crs is None:
            return [], [], []
        shapes = gpd.GeoSeries(self.plots, crs=self.crs).to_crs(site.crs).to_numpy()
        inner = shapely.point_on_surface(shapes)
        here = np.flatnonzero(shapely.intersects(site.polygon, inner)).tolist()
        areas, plots = [], []
        for k in here:
            for part in shapely.get_parts(shapes[k]):
                if self.uses[k] in LAND:
                    plots.append(Plot(part, cast(PlotUse, self.uses[k] or "parcel")))
                else:
                    areas.append(part)
        return areas, plots, [self.labels[k] for k in here]

    def as_given(self, labels: Sequence[Hashable], crs: CRS) -> gpd.GeoDataFrame:
        """Give some of the features as they are.

        Parameters
        ----------
        labels
            Which.
        crs
            CRS of the layer.
        """
        if self.frame is None or not labels:
            return gpd.GeoDataFrame({name: [] for name in COLUMNS["parcels"]}, geometry=[], crs=crs)
        found = self.frame.loc[list(labels)].set_geometry(self.frame.geometry.loc[list(labels)])
        own = {name: column(found, name) for name in COLUMNS["parcels"]}
        data = {name: values.astype(object) for name, values in own.items() if values is not None}
        frame = gpd.GeoDataFrame(
            pd.DataFrame(data, index=found.index), geometry=found.geometry, crs=found.crs
        )
        return frame if frame.crs == crs else frame.to_crs(crs)


def one_variation(frame: gpd.GeoDataFrame, layer: str) -> None:
    """Refuse a layer in which several variations lie on each other.

    Parameters
    ----------
    frame
        The layer.
    layer
        Its name.

    Raises
    ------
    InputError
        If there are several.
    """
    own = column(frame, "variation")
    if own is not None and own.nunique() > 1:
        raise InputError(
            f"It holds {own.nunique()} variations, which lie on each other.",
            "Set a filter for one of them, such as variation = 1.",
            layer=layer,
        )


def numbered(
    made: Sequence[gpd.GeoDataFrame], stayed: Sequence[gpd.GeoDataFrame], old: OldParcels, crs: CRS
) -> gpd.GeoDataFrame:
    """Give new parcels and those that stayed as one layer, with numbers and labels of their own.

    Parameters
    ----------
    made
        New parcels; they get labels above those of the old layer.
    stayed
        Features of the old layer under its labels.
    old
        The old layer.
    crs
        CRS of all.
    """
    kept = [frame for frame in stayed if len(frame)]
    fresh = [frame for frame in made if len(frame)]
    if not kept and not fresh:
        return old.as_given([], crs)
    label = 1 + max([-1, *(int(cast(int, own)) for own in old.labels)])
    numbers = [pd.to_numeric(frame["parcel_id"]).max() for frame in kept if "parcel_id" in frame]
    number = 1 + max([0, *(int(own) for own in numbers if own == own)])
    parts = []
    for frame in [*kept, *fresh]:
        own = frame.astype(dict.fromkeys(frame.columns.drop("geometry"), object))
        if any(frame is one for one in fresh):
            own.index = pd.RangeIndex(label, label + len(own))
            own["parcel_id"] = list(range(number, number + len(own)))
            label, number = label + len(own), number + len(own)
        parts.append(own)
    return gpd.GeoDataFrame(pd.concat(parts), geometry="geometry", crs=crs)


def as_lines(geometry: shapely.Geometry) -> MultiLineString:
    """Give the lines of a geometry.

    Parameters
    ----------
    geometry
        Of any kind.
    """
    parts = shapely.get_parts(shapely.get_parts(geometry))
    return MultiLineString([p for p in parts if p.geom_type in ("LineString", "LinearRing")])


def together(scores: Sequence[tuple[Score, float]]) -> Score:
    """Give the score of several sites together.

    Parameters
    ----------
    scores
        Score and area of each, square metres.
    """
    parcels = np.array([score.parcels for score, _ in scores], dtype=float)
    area = np.array([own for _, own in scores])

    def mean(name: str, weight: Any) -> float:
        values = np.array([getattr(score, name) for score, _ in scores])
        return float((values * weight).sum() / max(float(weight.sum()), 1e-9))

    return Score(
        parcels=int(parcels.sum()),
        p_angle=mean("p_angle", parcels),
        p_area=mean("p_area", parcels) if parcels.sum() else 1.0,
        undesirable=mean("undesirable", parcels),
        green=mean("green", area),
        street=mean("street", area),
    )
