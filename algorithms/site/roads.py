"""A road layer becomes a network: noded lines between junctions, with names and classes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS

from ..progress import Progress
from .crs import layer_crs, transformer

REACH = 250.0
"""Roads further than this from a site do not matter to it, metres."""

ROAD_GRID = 0.01
"""Road ends closer than about this meet, metres."""

CLASS_COLUMNS = ("highway", "kind", "class", "fclass", "nature", "road_class", "majorroad")
NAME_COLUMNS = ("name", "street_name", "streetname", "nom_voie_g", "nom_voie", "fullname", "street")
HIDDEN_COLUMNS = ("tunnel",)

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


@dataclass(frozen=True)
class RoadNetwork:
    """Roads near a site, cut at junctions.

    Attributes
    ----------
    lines
        Centre lines from junction to junction, shape (n,), metres.
    names, kinds
        Name and class of each line, shape (n,), empty where unknown.
    ends
        Node at the start and at the end of each line, shape (n, 2).
    nodes
        Positions of the nodes, shape (k, 2).
    degree
        Number of line ends at each node, shape (k,).
    """

    lines: npt.NDArray[Any]
    names: npt.NDArray[Any]
    kinds: npt.NDArray[Any]
    ends: npt.NDArray[np.intp]
    nodes: npt.NDArray[np.float64]
    degree: npt.NDArray[np.intp]


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
        use = line & ~walk & ~tunnel
        if np.any(line & ~use):
            progress.info(
                f"Layer '{layer}': {int(np.sum(line & walk))} paths, motorways and "
                f"the like and {int(np.sum(line & tunnel & ~walk))} tunnels are not counted as "
                "streets."
            )
        if np.any(~line):
            progress.info(
                f"Layer '{layer}': {int(np.sum(~line))} features without a line are passed over."
            )
        parts, origin = shapely.get_parts(shapely.force_2d(geometry[use]), return_index=True)
        lines = np.isin(shapely.get_type_id(parts), (1, 2)) & (shapely.length(parts) > 0)
        self._lines = parts[lines]
        self._names = names[use][origin[lines]]
        self._kinds = kinds[use][origin[lines]]
        self._bounds = shapely.bounds(self._lines).reshape(-1, 4)

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
        return build_network(lines[close], self._names[hit][close], self._kinds[hit][close])


def build_network(
    lines: npt.NDArray[Any], names: npt.NDArray[Any], kinds: npt.NDArray[Any]
) -> RoadNetwork:
    """Node lines, merge them between junctions and name the results.

    Parameters
    ----------
    lines
        Shape (n,), metres.
    names, kinds
        Name and class of each, shape (n,).

    Returns
    -------
    RoadNetwork
        The lines cut where they meet; each takes name and class of the line that lies
        under its middle.
    """
    merged = np.empty(0, dtype=object)
    if len(lines) > 0:
        noded = shapely.union_all(lines, grid_size=ROAD_GRID)
        merged = shapely.get_parts(shapely.line_merge(noded))
        merged = merged[shapely.get_type_id(merged) == 1]
        merged = shapely.normalize(merged)  # directions and order that do not hang on the input's
        merged = merged[np.lexsort([shapely.length(merged), *shapely.bounds(merged).T])]
    if len(merged) == 0:
        none = np.empty(0, dtype=object)
        nodes = np.empty((0, 2))
        return RoadNetwork(
            none, none, none, np.empty((0, 2), dtype=np.intp), nodes, np.empty(0, dtype=np.intp)
        )
    middle = shapely.line_interpolate_point(merged, 0.5, normalized=True)
    asked, found = shapely.STRtree(lines).query_nearest(middle, all_matches=False)
    source = np.zeros(len(merged), dtype=np.intp)
    source[asked] = found
    tips = np.stack([shapely.get_point(merged, 0), shapely.get_point(merged, -1)], axis=1)
    xy = np.round(shapely.get_coordinates(tips.ravel()), 3)
    nodes, inverse = np.unique(xy, axis=0, return_inverse=True)
    ends = inverse.reshape(-1, 2).astype(np.intp)
    degree = np.bincount(ends.ravel(), minlength=len(nodes)).astype(np.intp)
    return RoadNetwork(merged, names[source], kinds[source], ends, nodes, degree)


def _column(frame: gpd.GeoDataFrame, candidates: tuple[str, ...]) -> npt.NDArray[Any]:
    """Texts of the first column, whatever its case, that is among the candidates."""
    by_lower = {str(c).lower(): c for c in reversed(list(frame.columns))}
    for name in candidates:
        if name in by_lower:
            column = frame[by_lower[name]]
            texts = column.astype(object).where(column.notna(), "").to_numpy()
            return np.array([str(t).strip() for t in texts], dtype=object).reshape(-1)
    return np.full(len(frame), "", dtype=object)
