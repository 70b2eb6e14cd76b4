"""What the checks read: layers of any kind turned into one street graph in metres."""

from __future__ import annotations

from dataclasses import dataclass, field

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS
from shapely.geometry import LineString

from ..errors import InputError
from ..site.crs import layer_crs, working_crs
from .graph import BoolArray, Chain, FloatArray, StreetGraph, build_graph, chains

#: Nodes closer than this to a street of the surroundings lie on it (metres).
TOUCH = 1.0


@dataclass(frozen=True, eq=False)
class StreetLayer:
    """A street layer as a graph, with what its fields say.

    Attributes
    ----------
    graph
        The streets in the working CRS.
    names
        Feature id of each line that went into the graph.
    existing
        Shape (e,). Edges that were streets already; exempt from the rules.
    connector
        Shape (e,). Edges that carry a street on to the road outside.
    level
        Shape (e,). Street level, 0 where unknown.
    recorded
        Shape (e,). The field `dist_to_sink_m` of each edge's street, NaN where unknown.
    crs, source_crs
        Working CRS, and that of the layer.
    unusable
        Feature ids without a usable line.
    """

    graph: StreetGraph
    names: tuple[str, ...]
    existing: BoolArray
    connector: BoolArray
    level: FloatArray
    recorded: FloatArray
    crs: CRS
    source_crs: CRS
    unusable: tuple[str, ...] = field(default=())

    @property
    def designed(self) -> BoolArray:
        """Shape (e,). Edges that the rules apply to."""
        return ~(self.existing | self.connector)

    def name(self, edge: int) -> str:
        """Feature id of the street that an edge belongs to."""
        return self.names[int(self.graph.street[edge])]

    def names_of(self, edges: tuple[int, ...] | list[int]) -> tuple[str, ...]:
        """Feature ids of the streets that edges belong to, each once, in order."""
        return tuple(dict.fromkeys(self.name(e) for e in edges))

    def designed_chains(self, sinks: BoolArray) -> list[Chain]:
        """Designed streets between junctions, sinks and other kinds of street."""
        return chains(self.graph, self.designed, sinks)


def read_streets(frame: gpd.GeoDataFrame, layer: str) -> StreetLayer:
    """Build the graph of a street layer.

    Lines of several parts are taken apart, heights dropped. The fields `status` (existing,
    connector, else new), `level` and `dist_to_sink_m` are used where present.

    Parameters
    ----------
    frame
        Lines in any CRS; the index holds the feature ids.
    layer
        Name of the layer, for messages.

    Raises
    ------
    InputError
        If the layer has no CRS or holds other geometry than lines.
    """
    source = layer_crs(frame, layer)
    geometry = frame.geometry.array
    usable = ~(geometry.isna() | shapely.is_empty(np.asarray(geometry)))
    _only_lines(frame, np.asarray(usable), layer)
    crs = working_crs(source, frame.total_bounds, layer) if usable.any() else source
    planar = frame.geometry[usable].to_crs(crs) if usable.any() else frame.geometry[usable]
    lines: list[LineString] = []
    row: list[int] = []
    for position, shape in zip(np.flatnonzero(usable).tolist(), planar):
        for part in shapely.get_parts(shapely.force_2d(shape)):
            if part.length > 0:
                lines.append(part)
                row.append(position)
    graph = build_graph(lines)
    rows = np.array(row, dtype=np.int64)[graph.street]
    labels = [str(label) for label in frame.index]
    used = set(row)
    status = _texts(frame, "status")[rows]
    return StreetLayer(
        graph=graph,
        names=tuple(labels[k] for k in row),
        existing=np.asarray(status == "existing"),
        connector=np.asarray(status == "connector"),
        level=np.nan_to_num(_numbers(frame, "level")[rows]),
        recorded=_numbers(frame, "dist_to_sink_m")[rows],
        crs=crs,
        source_crs=source,
        unusable=tuple(labels[k] for k in range(len(frame)) if k not in used),
    )


def read_union(
    frame: gpd.GeoDataFrame | gpd.GeoSeries | None, crs: CRS, layer: str
) -> shapely.Geometry:
    """Unite a layer's geometry in the working CRS; empty where there is none.

    Parameters
    ----------
    frame
        Any layer, or None.
    crs
        Working CRS.
    layer
        Name of the layer, for messages.

    Raises
    ------
    InputError
        If the layer has no CRS.
    """
    if frame is None or not len(frame):
        return shapely.GeometryCollection()
    layer_crs(frame, layer)
    shapes = frame.geometry[~frame.geometry.isna()].to_crs(crs)
    return shapely.union_all(shapely.make_valid(shapely.force_2d(np.asarray(shapes))))


def _only_lines(frame: gpd.GeoDataFrame, usable: BoolArray, layer: str) -> None:
    kinds = frame.geometry.geom_type.to_numpy()
    wrong = usable & ~np.isin(kinds, ["LineString", "MultiLineString", "LinearRing"])
    if wrong.any():
        k = int(np.flatnonzero(wrong)[0])
        raise InputError(
            f"is a {kinds[k]}, not a line.",
            "Give a layer of street lines.",
            layer=layer,
            feature=str(frame.index[k]),
        )


def _numbers(frame: gpd.GeoDataFrame, name: str) -> FloatArray:
    """Give a field as numbers, NaN where it is absent, empty or text."""
    if name not in frame.columns:
        return np.full(len(frame), np.nan)
    values = np.full(len(frame), np.nan)
    for k, value in enumerate(frame[name].tolist()):
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            values[k] = float(value)
    return values


def _texts(frame: gpd.GeoDataFrame, name: str) -> np.ndarray[tuple[int], np.dtype[np.object_]]:
    """Give a field as lower-case text, empty where it is absent."""
    if name not in frame.columns:
        return np.full(len(frame), "", dtype=object)
    return np.array([str(value).lower() for value in frame[name]], dtype=object)
