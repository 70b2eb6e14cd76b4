"""What the checks read: layers of any kind turned into one street graph in metres."""

from __future__ import annotations

from dataclasses import dataclass, field

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS
from shapely.geometry import LineString

from ..errors import InputError
from ..progress import Progress
from ..site.crs import layer_crs, working_crs
from ..site.watch import aside
from .graph import BoolArray, Chain, FloatArray, IntArray, StreetGraph, build_graph, chains

#: What goes on here, for those who cancel it.
_WORK = "the streets were read"
#: What the field `status` says of streets that are not designed: they were there, or a level of
#: streets was given.
EXISTING = ("existing", "given")
#: What the field `oneway` says of streets with traffic along the line only, and against it only,
#: here and in OpenStreetMap.
ALONG = ("true", "yes", "1", "1.0")
AGAINST = ("-1", "-1.0", "reverse")
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
    direction
        Shape (e,). 1 where traffic runs from start to end of an edge only, -1 where from end to
        start, 0 for both. Streets that were there already count as two-way.
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
    direction: IntArray
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


def read_streets(
    frame: gpd.GeoDataFrame, layer: str, progress: Progress | None = None
) -> StreetLayer:
    """Build the graph of a street layer.

    Lines of several parts are taken apart, heights dropped. The fields `status` (existing or
    given, connector, else new), `level`, `dist_to_sink_m` and `oneway` (true, yes or 1; -1
    against the line) are used where present.

    Parameters
    ----------
    frame
        Lines in any CRS; the index holds the feature ids.
    layer
        Name of the layer, for messages.
    progress
        Asked for cancellation, or None.

    Raises
    ------
    InputError
        If the layer has no CRS or holds other geometry than lines.
    CancelledError
        If the caller cancels.
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
    shapes = np.array(lines, dtype=object)
    graph = aside(lambda own: build_graph(own.tolist()), shapes, progress, work=_WORK)
    rows = np.array(row, dtype=np.int64)[graph.street]
    labels = [str(label) for label in frame.index]
    used = set(row)
    status = _texts(frame, "status")[rows]
    old = np.isin(status, (*EXISTING, "connector"))
    return StreetLayer(
        graph=graph,
        names=tuple(labels[k] for k in row),
        existing=np.isin(status, EXISTING),
        connector=np.asarray(status == "connector"),
        level=np.nan_to_num(_numbers(frame, "level")[rows]),
        recorded=_numbers(frame, "dist_to_sink_m")[rows],
        direction=np.where(old, 0, _one_way(frame)[rows] * _sense(graph, lines)),
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


def read_features(
    frame: gpd.GeoDataFrame | None, crs: CRS, layer: str
) -> list[tuple[str, shapely.Geometry]]:
    """Give id and geometry of every feature of a layer in the working CRS.

    Parameters
    ----------
    frame, crs, layer
        See `read_union`.

    Raises
    ------
    InputError
        If the layer has no CRS.
    """
    if frame is None or not len(frame):
        return []
    layer_crs(frame, layer)
    shapes = frame.geometry.to_crs(crs)
    return [
        (str(label), shapely.make_valid(shapely.force_2d(shape)))
        for label, shape in zip(frame.index, shapes)
        if shape is not None and not shape.is_empty
    ]


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


def _one_way(frame: gpd.GeoDataFrame) -> IntArray:
    """Read the field `oneway`: 1 along the line, -1 against it, 0 for both or where absent."""
    said = _texts(frame, "oneway")
    found = np.zeros(len(frame), dtype=np.int64)
    found[np.isin(said, ALONG)] = 1
    found[np.isin(said, AGAINST)] = -1
    return found


def _sense(graph: StreetGraph, lines: list[LineString]) -> IntArray:
    """Tell which edges run along (1) or against (-1) the line that they are a piece of.

    Only pieces of lines that meet themselves may be turned.
    """
    found = np.ones(len(graph.lines), dtype=np.int64)
    for e, own in enumerate(graph.street.tolist()):
        if not lines[own].is_simple:
            piece = graph.lines[e]
            near = [piece.interpolate(share, normalized=True) for share in (0.4, 0.6)]
            if lines[own].project(near[0]) > lines[own].project(near[1]):
                found[e] = -1
    return found


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
