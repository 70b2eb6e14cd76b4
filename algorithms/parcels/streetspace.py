"""Street space: what streets take of the land, from their centre lines and widths."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import pandas as pd
import shapely
from pyproj import CRS

from ..errors import InputError
from ..progress import Progress
from ..site import osmlines
from ..site.crs import layer_crs
from ..site.repair import Problems
from ..site.roads import CLASS_COLUMNS, HIDDEN_COLUMNS, NAME_COLUMNS, NOT_STREETS
from ..site.watch import aside

Floats = npt.NDArray[np.float64]

#: What goes on here, for those who cancel it.
_WORK = "the street space was drawn"
#: Side of the grid on which lines are noded (metres).
GRID = 1e-3
#: Vertices of centre lines nearer than this to the line of their neighbours do not count (metres).
STRAIGHT = 0.05
#: Corners of street space reach no further from the junction than so many half widths.
MITRE = 2.5
#: Over how much of a street its direction at a junction is measured (metres).
ARM = 2.0
#: Pieces at junctions reach this far into the streets, so that no slit stays between (metres).
OVERLAP = 0.5
#: Streets that turn by less than this go straight on (radians).
_STRAIGHT_ON = math.radians(2.0)

#: Road classes that take land but give no access to it.
NO_ACCESS = frozenset({"motorway", "motorway_link", "type autoroutier", "autoroute"})
#: Road classes (OpenStreetMap and common local ones) by the level of a street.
_LEVELS: Mapping[str, int] = {
    **dict.fromkeys((*NO_ACCESS, "trunk", "primary", "secondary", "major"), 1),
    **dict.fromkeys(("tertiary", "collector"), 2),
    **dict.fromkeys(("living_street", "service", "cul-de-sac"), 4),
}
_LOCAL = 3


@dataclass(frozen=True)
class StreetWidths:
    """How wide streets are from property line to property line, metres.

    Attributes
    ----------
    major, collector, local, cul_de_sac
        By level, where a street has no width of its own.
    every
        One width for all streets whatever they say, or None.

    Raises
    ------
    InputError
        If a width is not greater than 0.
    """

    major: float = 20.0
    collector: float = 16.0
    local: float = 12.0
    cul_de_sac: float = 10.0
    every: float | None = None

    def __post_init__(self) -> None:
        for own in fields(self):
            value = getattr(self, own.name)
            if value is not None and not (math.isfinite(value) and value > 0):
                name = "streets" if own.name == "every" else f"{own.name.replace('_', '-')} streets"
                raise InputError(f"The width of {name} is {value:g} m.", "Give more than 0 m.")

    @property
    def by_level(self) -> Floats:
        """Widths of the levels 1 to 4, shape (4,)."""
        return np.array([self.major, self.collector, self.local, self.cul_de_sac])


@dataclass(frozen=True)
class StreetLines:
    """Centre lines with what parcels ask of them.

    Attributes
    ----------
    lines
        Single lines, shape (n,), metres.
    half
        Half of their width, shape (n,), metres.
    turning
        Radius of the turning circle at a blind end, 0 for none, shape (n,), metres.
    access
        Whether parcels may have access from it, shape (n,).
    """

    lines: npt.NDArray[Any]
    half: Floats
    turning: Floats
    access: npt.NDArray[np.bool_]

    def take(self, which: Any) -> StreetLines:
        """Return some of the lines, by a mask or by indices."""
        return StreetLines(
            self.lines[which], self.half[which], self.turning[which], self.access[which]
        )

    def with_lines(self, lines: npt.NDArray[Any], origin: Any) -> StreetLines:
        """Return other lines, each made of the one that `origin` names."""
        return StreetLines(lines, self.half[origin], self.turning[origin], self.access[origin])


def levels_of(frame: gpd.GeoDataFrame) -> npt.NDArray[np.int64]:
    """Levels of streets, 1 to 4, shape (n,): their field level, else by their road class.

    Parameters
    ----------
    frame
        The streets, n of them.

    Examples
    --------
    >>> levels_of(gpd.GeoDataFrame({"level": [2, None], "highway": ["", "primary"]}))
    array([2, 1])
    """
    level = _numbers(frame, "level")
    kinds = np.char.lower(_texts(frame, CLASS_COLUMNS).astype(str))
    by_class = [_LEVELS.get(kind.removesuffix("_link"), _LOCAL) for kind in kinds.tolist()]
    return np.where(np.isin(level, (1, 2, 3, 4)), level, by_class).astype(np.int64)


def widths_of(frame: gpd.GeoDataFrame, widths: StreetWidths, given: Floats | None = None) -> Floats:
    """Widths of streets, shape (n,), metres.

    The first that there is: the given one, the one for all, the field width_m, the one of its
    level, the one of its road class, the one of local streets.

    Parameters
    ----------
    frame
        The streets, n of them.
    widths
        See `StreetWidths`.
    given
        Width of each street, nan for none, shape (n,), metres; None for none at all.

    Examples
    --------
    >>> widths_of(gpd.GeoDataFrame({"level": [1, 3], "width_m": [None, 9.0]}), StreetWidths())
    array([20.,  9.])
    """
    found = widths.by_level[levels_of(frame) - 1]
    own = _numbers(frame, "width_m")
    found = np.where(own > 0, own, found)
    if widths.every is not None:
        found = np.full(len(frame), widths.every)
    if given is not None:
        found = np.where(given > 0, given, found)
    return np.asarray(found, dtype=float)


def read_streets(
    frame: gpd.GeoDataFrame,
    widths: StreetWidths,
    crs: CRS,
    layer: str,
    problems: Problems,
    *,
    given: Floats | None = None,
) -> StreetLines:
    """Read a street layer of any make.

    Parameters
    ----------
    frame
        The streets in any CRS; parts of multi-part lines become lines.
    widths, given
        See `widths_of`.
    crs
        Working CRS, in metres.
    layer
        Name of the layer.
    problems
        Takes what could not be used.

    Returns
    -------
    StreetLines
        In the working CRS. Paths and tunnels, which part no land, are left out.

    Raises
    ------
    InputError
        If the layer has no CRS.
    """
    source = layer_crs(frame, layer)
    shapes = shapely.force_2d(np.asarray(frame.geometry.array, dtype=object))
    kinds = np.char.lower(_texts(frame, CLASS_COLUMNS).astype(str))
    hidden = np.char.lower(_texts(frame, HIDDEN_COLUMNS).astype(str))
    missing = shapely.is_missing(shapes) | shapely.is_empty(shapes)
    line = np.isin(shapely.get_type_id(shapes), (1, 2, 5, 7))
    finite = np.isfinite(shapely.bounds(shapes).reshape(-1, 4)).all(axis=1)
    for at in np.flatnonzero(missing | ~line | ~finite):
        what = "geometry is NULL or EMPTY" if missing[at] else "coordinates are not finite"
        if not missing[at] and not line[at]:
            what = f"geometry is a {shapes[at].geom_type}, not a line"
        problems.add(layer, frame.index[at], what, "skipped", "error", None, source)
    path = np.isin(kinds, list(NOT_STREETS - NO_ACCESS))
    tunnel = ~np.isin(hidden, ["", "no", "0", "false", "f", "n"])
    if osmlines.is_osm(frame):
        tunnel |= osmlines.in_tunnel(frame)
        path |= osmlines.no_street(frame) & ~np.isin(kinds, list(NO_ACCESS))
    use = np.flatnonzero(~missing & line & finite & ~path & ~tunnel)
    parts, origin = shapely.get_parts(shapes[use], return_index=True)
    parts, again = shapely.get_parts(parts, return_index=True)  # collections hold multiparts
    origin = use[origin[again]]
    keep = np.isin(shapely.get_type_id(parts), (1, 2)) & (shapely.length(parts) > 0)
    parts, origin = parts[keep], origin[keep]
    if source != crs and len(parts):
        parts = gpd.GeoSeries(parts, crs=source).to_crs(crs).to_numpy()
    turning = np.nan_to_num(np.maximum(_numbers(frame, "turning_m"), 0.0))
    access = ~np.isin(kinds, list(NO_ACCESS))
    half = widths_of(frame, widths, given) / 2
    good = np.isfinite(shapely.bounds(parts).reshape(-1, 4)).all(axis=1)
    every = StreetLines(parts, half[origin], turning[origin], access[origin])
    return every.take(good)


def noded(streets: StreetLines, progress: Progress | None = None) -> StreetLines:
    """Cut streets where they meet; where they lie on each other the widest counts.

    Parameters
    ----------
    streets
        Any lines.
    progress
        Asked for cancellation.

    Returns
    -------
    StreetLines
        From junction to junction, on a grid of a millimetre.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    if len(streets.lines) == 0:
        return streets
    whole = shapely.simplify(streets.lines, STRAIGHT)
    net = aside(lambda lines: shapely.union_all(lines, grid_size=GRID), whole, progress, work=_WORK)
    pieces = shapely.get_parts(net)
    pieces = pieces[shapely.get_type_id(pieces) == shapely.GeometryType.LINESTRING]
    middles = shapely.line_interpolate_point(pieces, 0.5, normalized=True)
    piece, own = shapely.STRtree(whole).query(middles, predicate="dwithin", distance=0.02)
    half, turning = np.zeros(len(pieces)), np.zeros(len(pieces))
    access = np.zeros(len(pieces), dtype=bool)
    np.maximum.at(half, piece, streets.half[own])
    np.maximum.at(turning, piece, streets.turning[own])
    np.logical_or.at(access, piece, streets.access[own])
    return StreetLines(pieces, half, turning, access).take(half > 0)


def street_space(
    streets: StreetLines, ends_free: npt.NDArray[np.bool_]
) -> tuple[npt.NDArray[Any], npt.NDArray[np.bool_]]:
    """Give the areas that streets take: one for each line, then those at junctions and ends.

    Parameters
    ----------
    streets
        Noded lines, n of them.
    ends_free
        Whether a turning circle may be at the start and at the end of each line, shape (n, 2).

    Returns
    -------
    areas : ndarray
        Polygons that overlap, shape (m,), metres; their union is the street space. Corners at
        junctions are pointed, blind ends are cut straight or round where there is a circle.
    access : ndarray of bool
        Whether each gives access to what lies along it, shape (m,).
    """
    strips = shapely.buffer(
        streets.lines, streets.half, cap_style="flat", join_style="mitre", mitre_limit=MITRE
    )
    length = shapely.length(streets.lines)
    reach = np.minimum(ARM, length)
    meeting: dict[tuple[int, int], list[tuple[float, float]]] = {}
    blind: dict[tuple[int, int], float] = {}
    serves: dict[tuple[int, int], bool] = {}
    for last in (0, 1):
        xy = shapely.get_coordinates(shapely.get_point(streets.lines, -last))
        on = shapely.line_interpolate_point(streets.lines, length - reach if last else reach)
        way = shapely.get_coordinates(on) - xy
        angle = np.arctan2(way[:, 1], way[:, 0])
        for at, node in enumerate(map(tuple, np.round(xy / GRID).astype(int).tolist())):
            meeting.setdefault(node, []).append((float(angle[at]), float(streets.half[at])))
            blind[node] = float(streets.turning[at]) if ends_free[at, last] else 0.0
            serves[node] = serves.get(node, True) and bool(streets.access[at])
    more = [(node, piece) for node, arms in meeting.items() for piece in _corners(node, arms)]
    more += [
        (node, shapely.Point(node[0] * GRID, node[1] * GRID).buffer(radius))
        for node, radius in blind.items()
        if radius > 0 and len(meeting[node]) == 1
    ]
    every = np.empty(len(strips) + len(more), dtype=object)
    every[:] = [*strips, *(piece for _, piece in more)]
    return every, np.array([*streets.access.tolist(), *(serves[node] for node, _ in more)])


def _corners(node: tuple[int, int], arms: list[tuple[float, float]]) -> list[Any]:
    """Fill the corner on the outer side of a junction, where strips with flat ends leave one."""
    if len(arms) == 1:
        return []
    xy = np.array(node) * GRID
    arms = sorted(arms)
    found = []
    for (first, h), (second, k) in zip(arms, [*arms[1:], arms[0]]):
        sector = (second - first) % (2 * math.pi)
        if sector < math.pi - _STRAIGHT_ON:
            continue
        if sector < math.pi + _STRAIGHT_ON:
            h = k = min(h, k)  # where the width changes, it does so at once
        a = np.array([math.cos(first), math.sin(first)])
        b = np.array([math.cos(second), math.sin(second)])
        left = xy + h * np.array([-a[1], a[0]])
        right = xy + k * np.array([b[1], -b[0]])
        points = [xy + OVERLAP * a, xy + OVERLAP * b, left, right]
        points += [left + OVERLAP * a, right + OVERLAP * b]
        # where the two outer lines meet, beyond the junction
        cross = a[0] * b[1] - a[1] * b[0]
        if abs(cross) > 1e-6:
            along = ((right - left)[0] * b[1] - (right - left)[1] * b[0]) / cross
            tip = left + along * a
            if math.hypot(*(tip - xy)) <= MITRE * max(h, k):
                points.append(tip)
        found.append(shapely.convex_hull(shapely.multipoints(np.array(points))))
    return found


def names_of(frame: gpd.GeoDataFrame) -> list[str]:
    """Names of streets, empty where unknown.

    Parameters
    ----------
    frame
        The streets, n of them.
    """
    return [str(name) for name in _texts(frame, NAME_COLUMNS)]


def _texts(frame: gpd.GeoDataFrame, candidates: tuple[str, ...]) -> npt.NDArray[Any]:
    """Texts of the first column, whatever its case, that is among the candidates."""
    by_lower = {str(c).lower(): c for c in reversed(list(frame.columns))}
    for name in candidates:
        if name in by_lower:
            column = frame[by_lower[name]]
            return np.array(["" if v is None or v != v else str(v).strip() for v in column])
    return np.full(len(frame), "")


def _numbers(frame: gpd.GeoDataFrame, name: str) -> Floats:
    """Numbers of a column, nan where there are none."""
    by_lower = {str(c).lower(): c for c in reversed(list(frame.columns))}
    if name not in by_lower:
        return np.full(len(frame), np.nan)
    column = pd.to_numeric(frame[by_lower[name]], errors="coerce").to_numpy(dtype=float)
    return np.where(np.isfinite(column), column, np.nan)
