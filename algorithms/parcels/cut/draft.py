"""One way to cut a block: rows, cuts, pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Polygon

from ..rules import ParcelRules
from .core import DEEP, VERY_DEEP, core_lines, core_of_rows
from .corners import TURN, Lines, Style, settle
from .outline import Floats, Side
from .profile import normals
from .rear import PUSH, Chain, along, middle_lines, samples
from .rows import cut_row

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
        self._between: dict[tuple[int, ...], tuple[list[Chain], float]] = {}
        self._core: dict[tuple[int, ...], shapely.Geometry] = {}

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


def draft(ground: Ground, fronts: tuple[int, ...], style: Style) -> Draft:
    """Cut a block into rows along some of its sides, and those into parcels.

    Parameters
    ----------
    ground
        The block.
    fronts
        Which of its sides have rows.
    style
        How corners are treated.
    """
    polygon, outline, rules = ground.polygon, ground.outline, ground.rules
    chains, deep = ground.between(fronts)
    core: shapely.Geometry = Polygon()
    if deep > (DEEP if style.court else VERY_DEEP) * rules.depth:
        core = ground.core(fronts)
    lines = Lines(_outside(chains, core))
    settle(lines, outline, polygon, core, rules, style)
    edges = [
        polygon.boundary,
        *(shapely.linestrings(x) for x in lines.all() if len(x) > 1),
        *(_through(x, polygon) for x in core_lines(core, polygon)),
    ]
    noded = shapely.union_all(edges)
    faces = _faces(noded, polygon)
    row, kept = _rows(faces, outline, fronts)
    short = [k for k in fronts if kept[k] < SHORT * rules.width]
    if short and len(short) < len(fronts):
        # nothing is left of them between the corners that others took
        return draft(ground, tuple(k for k in fronts if k not in short), style)
    court = _court(faces, core, lines.court, rules.depth**2 / 2)
    cuts: list[Floats] = []
    greens: list[Floats] = []
    for face, k, inner in zip(faces, row, court):
        if k < 0 or inner:
            continue
        side = outline[k]
        ends = (_is_corner(outline, side.before, k), _is_corner(outline, k, side.after))
        found = cut_row(
            side.xy, shapely.get_coordinates(face.exterior), rules, ends, style.wide, style.spare
        )
        cuts += found.lines
        greens += found.greens
    pieces = _faces(shapely.union_all([noded, *map(shapely.linestrings, cuts)]), polygon)
    return Draft(pieces, _kinds(pieces, faces, row, court, greens))


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


def _through(line: shapely.Geometry, polygon: Polygon) -> shapely.Geometry:
    """Push the ends of a line of the court that lie near the edge of the block through it."""
    xy = shapely.get_coordinates(line)
    near = shapely.distance(shapely.points(xy[[0, -1]]), polygon.boundary) < 0.3
    for end, inner, reaches in ((0, 1, near[0]), (-1, -2, near[1])):
        if reaches and not np.array_equal(xy[0], xy[-1]):
            way = xy[end] - xy[inner]
            xy[end] = xy[end] + way / max(float(np.hypot(*way)), 1e-9) * PUSH
    return shapely.linestrings(xy)


def _faces(noded: shapely.Geometry, polygon: Polygon) -> npt.NDArray[np.object_]:
    """Return the polygons between noded lines, inside a block."""
    found = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    inner = shapely.get_coordinates(shapely.point_on_surface(found))
    shapely.prepare(polygon)
    return np.asarray(found[shapely.contains_xy(polygon, inner)], dtype=object)


def _rows(
    faces: npt.NDArray[np.object_],
    outline: list[Side],
    fronts: tuple[int, ...],
) -> tuple[npt.NDArray[np.int64], dict[int, float]]:
    """Return the front along which each face lies most, -1 for none, and what fronts keep."""
    points, owner = [], []
    for k in fronts:
        length = outline[k].length
        count = max(4, round(length / BESIDE))
        place = (np.arange(count) + 0.5) / count * length
        points.append(along(outline[k].xy, place) + 0.6 * normals(outline[k].xy, length, place))
        owner += [k] * count
    inside, whose = np.vstack(points), np.array(owner)
    found = np.full(len(faces), -1)
    kept = dict.fromkeys(fronts, 0.0)
    for j, face in enumerate(faces):
        shapely.prepare(face)
        own = whose[shapely.contains_xy(face, inside)]
        if len(own):
            values, counts = np.unique(own, return_counts=True)
            most = int(np.argmax(counts))
            k = int(values[most])
            found[j] = k
            share = float(counts[most]) / owner.count(k)
            kept[k] = max(kept[k], share * outline[k].length)
    return found, kept


def _court(
    faces: npt.NDArray[np.object_], core: shapely.Geometry, more: list[Floats], small: float
) -> npt.NDArray[np.bool_]:
    inner = shapely.point_on_surface(faces)
    found = np.asarray(shapely.contains(core, inner), dtype=bool)
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
    kind = np.full(len(pieces), LOOSE)
    inner = shapely.get_coordinates(shapely.point_on_surface(pieces))
    for face, k, is_court in zip(faces, row, court):
        within = shapely.contains_xy(face, inner)
        kind[within] = COURT if is_court else (PARCEL if k >= 0 else LOOSE)
    for point in greens:
        found = shapely.contains_xy(pieces, *point) & (kind == PARCEL)
        kind[found] = GREEN
    return kind
