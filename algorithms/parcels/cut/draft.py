"""One way to cut a block: rows, cuts, pieces."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon

from ..rules import ParcelRules
from .core import DEEP, VERY_DEEP, core_lines, core_of_rows
from .corners import TURN, Lines, Style, settle
from .line import Floats
from .outline import Side
from .rear import PUSH, Chain, middle_lines, samples
from .rows import Row

#: What a piece is.
PARCEL, GREEN, COURT, LOOSE = 0, 1, 2, 3
#: Distance between points along a front that tell which faces lie along it (metres).
BESIDE = 2.5
#: Fronts that keep less of their length than that many widths are given up.
SHORT = 1.1


@dataclass
class Draft:
    """Pieces that tile a block.

    Attributes
    ----------
    pieces
        Polygons, shape (n,), that share their vertices.
    kind
        PARCEL, GREEN (a pointed end), COURT or LOOSE (land of no row), shape (n,).
    """

    pieces: npt.NDArray[np.object_]
    kind: npt.NDArray[np.int64]


class Ground:
    """A block, and what does not change between the ways to cut it.

    Parameters
    ----------
    polygon, outline
        The block and its sides.
    radius
        Of its largest circle, metres.
    rules
        What is asked of parcels.
    """

    def __init__(
        self, polygon: Polygon, outline: list[Side], radius: float, rules: ParcelRules
    ) -> None:
        self.polygon, self.outline, self.radius, self.rules = polygon, outline, radius, rules
        self.boundary = polygon.boundary
        #: drafts that were made, told by their lines
        self.made: set[bytes] = set()
        self._between: dict[tuple[int, ...], tuple[list[Chain], float]] = {}
        self._core: dict[tuple[int, ...], shapely.Geometry] = {}
        self._beside: dict[int, Floats] = {}
        self._rows: dict[tuple[tuple[int, ...], Style], Rows] = {}
        shapely.prepare(polygon)

    def between(self, fronts: tuple[int, ...]) -> tuple[list[Chain], float]:
        """Return the lines between rows, to be changed at will, and the depth of the land."""
        if len(fronts) == 1:
            return [], 2 * self.radius
        if fronts not in self._between:
            self._between[fronts] = middle_lines(self.polygon, *samples(self.outline, fronts))
        chains, deep = self._between[fronts]
        return [Chain(x.pair, x.xy.copy()) for x in chains], deep

    def core(self, fronts: tuple[int, ...]) -> shapely.Geometry:
        """Return what rows along some sides leave in the middle, maybe empty."""
        if fronts not in self._core:
            self._core[fronts] = core_of_rows(self.polygon, self.outline, fronts, self.rules)
        return self._core[fronts]

    def beside(self, front: int) -> Floats:
        """Return points just inside along a side, shape (n, 2)."""
        if front not in self._beside:
            line = self.outline[front].line
            count = max(4, round(line.length / BESIDE))
            place = (np.arange(count) + 0.5) / count * line.length
            self._beside[front] = line.at(place) + 0.6 * line.normals(place)
        return self._beside[front]

    def rows(self, fronts: tuple[int, ...], style: Style) -> Rows:
        """Return the rows along some sides; how wide parcels are makes no difference to them."""
        key = fronts, replace(style, wide=0.0, spare=0.0)
        if key not in self._rows:
            self._rows[key] = Rows(self, fronts, style)
        return self._rows[key]


class Rows:
    """A block divided into rows of parcels.

    Parameters
    ----------
    ground
        The block.
    fronts
        Which of its sides have rows.
    style
        How corners are treated.
    """

    def __init__(self, ground: Ground, fronts: tuple[int, ...], style: Style) -> None:
        polygon, outline, rules = ground.polygon, ground.outline, ground.rules
        chains, deep = ground.between(fronts)
        core: shapely.Geometry = Polygon()
        if deep > (DEEP if style.court else VERY_DEEP) * rules.depth:
            core = ground.core(fronts)
        lines = Lines(_outside(chains, core))
        settle(lines, outline, polygon, core, rules, style)
        edges = [
            ground.boundary,
            *_strings([x for x in lines.all() if len(x) > 1]),
            *(_through(x, ground.boundary) for x in core_lines(core, polygon)),
        ]
        self.noded = shapely.union_all(edges)
        self.faces = faces_of(self.noded, polygon)
        self.front, kept = _fronts(self.faces, ground, fronts)
        #: fronts of which nothing is left between the corners that others took
        self.short = {k for k in fronts if kept[k] < SHORT * rules.width}
        self.court = _court(self.faces, core, lines.court, rules.depth**2 / 2)
        self.rows: list[Row] = []
        if self.short and len(self.short) < len(fronts):
            return
        for face, k, inner in zip(self.faces, self.front.tolist(), self.court.tolist()):
            if k >= 0 and not inner:
                side = outline[k]
                ends = (_is_corner(outline, side.before, k), _is_corner(outline, k, side.after))
                ring = shapely.get_coordinates(face.exterior)
                self.rows.append(Row(side.line, ring, rules, ends))


def draft(ground: Ground, fronts: tuple[int, ...], style: Style) -> tuple[bytes, Draft | None]:
    """Cut a block into rows along some of its sides, and those into parcels.

    Parameters
    ----------
    ground
        The block.
    fronts
        Which of its sides have rows.
    style
        How corners are treated.

    Returns
    -------
    bytes
        Told apart by it: the lines of the draft.
    Draft or None
        None if the same draft was made before.
    """
    found = ground.rows(fronts, style)
    if found.short and len(found.short) < len(fronts):
        return draft(ground, tuple(k for k in fronts if k not in found.short), style)
    cuts: list[Floats] = []
    greens: list[Floats] = []
    for row in found.rows:
        more = row.cuts(style.wide, style.spare)
        cuts += more.lines
        greens += more.greens
    told = [shapely.get_coordinates(found.noded), found.front, found.court, *cuts, *greens]
    key = b"".join(x.tobytes() for x in told)
    if key in ground.made:
        return key, None
    ground.made.add(key)
    pieces = found.faces
    if cuts:
        pieces = faces_of(shapely.union_all([found.noded, *_strings(cuts)]), ground.polygon)
    return key, Draft(pieces, _kinds(pieces, found.faces, found.front, found.court, greens))


def _strings(lines: list[Floats]) -> list[shapely.Geometry]:
    """Return lines as geometries."""
    if not lines:
        return []
    index = np.repeat(np.arange(len(lines)), [len(x) for x in lines])
    return list(shapely.linestrings(np.concatenate(lines), indices=index))


def _outside(chains: list[Chain], core: shapely.Geometry) -> list[Chain]:
    """Return what of some lines lies outside the court, ends at it pushed in a little."""
    if core.is_empty:
        return chains
    found = []
    for chain in chains:
        rest = shapely.difference(shapely.linestrings(chain.xy), core)
        for part in shapely.get_parts(rest):
            if part.length > 0.5:
                xy = shapely.get_coordinates(part)
                for end in (0, -1):
                    if shapely.distance(core, shapely.points(xy[end])) < 0.01:
                        way = xy[end] - xy[1 if end == 0 else -2]
                        xy[end] += way / max(float(np.hypot(*way)), 1e-9) * 0.05
                found.append(Chain(chain.pair, xy))
    return found


def _through(line: shapely.Geometry, boundary: shapely.Geometry) -> shapely.Geometry:
    """Push the ends of a line of the court that lie near the edge of the block through it."""
    xy = shapely.get_coordinates(line)
    near = shapely.distance(shapely.points(xy[[0, -1]]), boundary) < 0.3
    for end, inner, reaches in ((0, 1, near[0]), (-1, -2, near[1])):
        if reaches and not np.array_equal(xy[0], xy[-1]):
            way = xy[end] - xy[inner]
            xy[end] = xy[end] + way / max(float(np.hypot(*way)), 1e-9) * PUSH
    return shapely.linestrings(xy)


def faces_of(noded: shapely.Geometry, polygon: Polygon) -> npt.NDArray[np.object_]:
    """Return the polygons between noded lines, inside a block."""
    found = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    if len(found) == 1:
        return np.asarray(found, dtype=object)
    inner = shapely.get_coordinates(shapely.point_on_surface(found))
    return np.asarray(found[shapely.contains_xy(polygon, inner)], dtype=object)


def _fronts(
    faces: npt.NDArray[np.object_], ground: Ground, fronts: tuple[int, ...]
) -> tuple[npt.NDArray[np.int64], dict[int, float]]:
    """Return the front along which each face lies most, -1 for none, and what fronts keep."""
    points = [ground.beside(k) for k in fronts]
    sizes = [len(x) for x in points]
    x, y = np.concatenate(points).T
    if len(faces) > 1:
        shapely.prepare(faces)
    inside = shapely.contains_xy(faces[:, None], x, y)
    begin = np.cumsum([0, *sizes[:-1]])
    # how many points of each front lie in each face
    counts = np.add.reduceat(inside, begin, axis=1, dtype=np.int64)
    most = counts.argmax(axis=1)
    many = counts[np.arange(len(faces)), most]
    found = np.where(many > 0, np.array(fronts)[most], -1)
    kept = dict.fromkeys(fronts, 0.0)
    for k, i, n in zip(found.tolist(), most.tolist(), many.tolist()):
        if k >= 0:
            kept[k] = max(kept[k], n / sizes[i] * ground.outline[k].length)
    return found, kept


def _court(
    faces: npt.NDArray[np.object_], core: shapely.Geometry, more: list[Floats], small: float
) -> npt.NDArray[np.bool_]:
    found = np.zeros(len(faces), dtype=bool)
    if not core.is_empty:
        found |= shapely.contains(core, shapely.point_on_surface(faces))
    for point in more:
        found |= shapely.contains_xy(faces, *point) & (shapely.area(faces) < small)
    return found


def _is_corner(outline: list[Side], first: int, second: int) -> bool:
    """Tell whether two neighbouring sides make a convex corner of two streets."""
    return outline[first].open and outline[second].open and outline[first].turn > TURN


def _kinds(
    pieces: npt.NDArray[np.object_],
    faces: npt.NDArray[np.object_],
    row: npt.NDArray[np.int64],
    court: npt.NDArray[np.bool_],
    greens: list[Floats],
) -> npt.NDArray[np.int64]:
    inner = shapely.get_coordinates(shapely.point_on_surface(pieces))
    within = shapely.contains_xy(faces[:, None], inner[:, 0], inner[:, 1])
    of_face = np.where(court, COURT, np.where(row >= 0, PARCEL, LOOSE))
    kind = np.where(within.any(axis=0), of_face[within.argmax(axis=0)], LOOSE)
    for point in greens:
        found = shapely.contains_xy(pieces, *point) & (kind == PARCEL)
        kind[found] = GREEN
    return kind
