"""The roads near a site are cut out of a road layer."""

from __future__ import annotations

from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from ..progress import Progress
from . import osmlines
from .crs import layer_crs, transformer
from .roadnetwork import RoadNetwork, build_network

REACH = 250.0
"""Roads further than this from a site do not matter to it, metres."""

CLASS_COLUMNS = ("highway", "kind", "class", "fclass", "nature", "road_class", "majorroad")
NAME_COLUMNS = ("name", "street_name", "streetname", "nom_voie_g", "nom_voie", "fullname", "street")
HIDDEN_COLUMNS = ("tunnel",)
PLACE_COLUMNS = ("place",)
INSIDE = "inside"
"""In a layer of boundary streets the place of streets that are kept inside a site."""

NOT_STREETS = frozenset({
    # OpenStreetMap's highway
    "footway", "path", "steps", "cycleway", "track", "pedestrian", "corridor", "platform",
    "bridleway", "construction", "proposed", "trail", "elevator", "raceway", "busway",
    # nobody enters a site from a motorway
    "motorway", "motorway_link",
    # BD TOPO's NATURE
    "sentier", "escalier", "chemin", "piste cyclable", "type autoroutier", "autoroute",
})  # fmt: skip
"""Road classes that serve no site: ways for walking and riding, and motorways."""


class RoadLayer:
    """A road layer, read once, from which the roads near each site are cut.

    Parameters
    ----------
    frame
        Lines; other geometries are passed over.
    layer
        Its name, for messages.
    progress
        Takes the remark about what is passed over.

    Raises
    ------
    InputError
        If the layer has no CRS.
    """

    def __init__(self, frame: gpd.GeoDataFrame, layer: str, progress: Progress) -> None:
        self.crs = layer_crs(frame, layer)
        geometry = np.asarray(frame.geometry.array, dtype=object)
        names = _column(frame, NAME_COLUMNS)
        kinds = _column(frame, CLASS_COLUMNS)
        hidden = _column(frame, HIDDEN_COLUMNS)
        walk = np.isin(np.char.lower(kinds.astype(str)), list(NOT_STREETS))
        tunnel = ~np.isin(np.char.lower(hidden.astype(str)), ["", "no", "0", "false", "f", "n"])
        line = np.isin(shapely.get_type_id(geometry), (1, 2, 5, 7)) & ~shapely.is_empty(geometry)
        none = ~line
        if osmlines.is_osm(frame):
            other = osmlines.no_street(frame) & ~walk
            tunnel |= osmlines.in_tunnel(frame)
            if np.any(line & other):
                progress.info(
                    f"Layer '{layer}': {int(np.sum(line & other))} lines of OpenStreetMap that "
                    "are no streets, such as tracks, streams and outlines, are passed over."
                )
            line &= ~other
        use = line & ~walk & ~tunnel
        if np.any(line & ~use):
            progress.info(
                f"Layer '{layer}': {int(np.sum(line & walk))} paths, motorways and "
                f"the like and {int(np.sum(line & tunnel & ~walk))} tunnels are not counted as "
                "streets."
            )
        if np.any(none):
            progress.info(
                f"Layer '{layer}': {int(np.sum(none))} features without a line are passed over."
            )
        parts, origin = shapely.get_parts(shapely.force_2d(geometry[use]), return_index=True)
        lines = np.isin(shapely.get_type_id(parts), (1, 2)) & (shapely.length(parts) > 0)
        self._lines = parts[lines]
        self._names = names[use][origin[lines]]
        self._kinds = kinds[use][origin[lines]]
        self._rows = np.flatnonzero(use)[origin[lines]]
        inside = np.char.lower(_column(frame, PLACE_COLUMNS).astype(str)) == INSIDE
        self._inside = inside[use][origin[lines]]
        self._bounds = shapely.bounds(self._lines).reshape(-1, 4)

    def everywhere(
        self, crs: CRS
    ) -> tuple[npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[np.intp]]:
        """Give all lines as they are, neither noded nor merged.

        Parameters
        ----------
        crs
            Working CRS.

        Returns
        -------
        tuple of ndarray
            Lines in `crs`, their names, their classes and the rows of the layer that they are
            parts of; each of shape (n,).
        """
        lines = self._lines
        if self.crs != crs and len(lines) > 0:
            lines = gpd.GeoSeries(lines, crs=self.crs).to_crs(crs).to_numpy()
        finite = np.all(np.isfinite(shapely.bounds(lines).reshape(-1, 4)), axis=1)
        return lines[finite], self._names[finite], self._kinds[finite], self._rows[finite]

    def near(self, polygon: shapely.Geometry, crs: CRS, reach: float = REACH) -> RoadNetwork:
        """Cut out and node the roads near a site.

        Parameters
        ----------
        polygon
            The site, metres in `crs`.
        crs
            Working CRS.
        reach
            Distance from the site up to which roads matter, metres.

        Returns
        -------
        RoadNetwork
            Lines in `crs`, perhaps none.
        """
        x0, y0, x1, y1 = shapely.bounds(polygon) + np.array([-reach, -reach, reach, reach])
        if self.crs != crs:
            window = transformer(crs, self.crs).transform_bounds(x0, y0, x1, y1)
        else:
            window = (x0, y0, x1, y1)
        b = self._bounds
        hit = (b[:, 0] <= window[2]) & (b[:, 2] >= window[0])
        hit &= (b[:, 1] <= window[3]) & (b[:, 3] >= window[1])
        lines = self._lines[hit]
        if self.crs != crs and len(lines) > 0:
            lines = gpd.GeoSeries(lines, crs=self.crs).to_crs(crs).to_numpy()
        close = shapely.is_valid(lines) & (shapely.distance(lines, polygon) <= reach)
        names, kinds, inside = self._names[hit], self._kinds[hit], self._inside[hit]
        return build_network(lines[close], names[close], kinds[close], inside[close])


def _column(frame: gpd.GeoDataFrame, candidates: tuple[str, ...]) -> npt.NDArray[Any]:
    """Texts of the first column, whatever its case, that is among the candidates."""
    by_lower = {str(c).lower(): c for c in reversed(list(frame.columns))}
    for name in candidates:
        if name in by_lower:
            column = frame[by_lower[name]]
            texts = column.astype(object).where(column.notna(), "").to_numpy()
            return np.array([str(t).strip() for t in texts], dtype=object).reshape(-1)
    return np.full(len(frame), "", dtype=object)
