"""Cross streets that the mesh did not offer: through long blocks, and on from arriving streets.

The program chooses among mesh lines. Where an arm of the site is narrower than half a block the
mesh has none, at an oblique edge a row of cells may be longer than asked, and an existing street
may arrive in the middle of a cell. The planner would then draw one straight line across the
block; so does this.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon

from ..network.problem import FloatArray
from ..network.specification import Specification
from ..progress import Progress, Silent
from ..site.types import AccessPoint
from .blocks import SCRAP, Block, block_size, block_sizes
from .chords import Chords, Joint, chords
from .fitting import GOOD_FROM, TOO_THIN, TOO_WIDE

#: Blocks are cut from this many times the wished length on.
TOO_LONG = 1.0
#: A block narrower than this share of the wished width is not cut: no house fits beside a street.
LEAST_WIDTH = 0.25
#: New streets keep this far from obstacles (metres).
OBSTACLE_CLEARANCE = 4.0
#: Pieces of street shorter than this are none (metres).
SHORT = 0.5
#: What each further cut that a piece needs counts, and what a junction shortly beside another.
FURTHER_CUT, STAGGER = 1.0, 0.4
#: What going on into another street is worth, and into an existing one that asks for it.
JOINED, CONTINUED = 0.35, 0.5
#: Junctions nearer than this share of the block width are staggered.
STAGGERED = 0.5


@dataclass(frozen=True)
class CrossStreet:
    """A straight street across a block, or into it.

    Attributes
    ----------
    line
        Its course, metres, from street to street.
    arrival
        The existing street that it continues from its start, if any.
    blind
        Whether it ends blind, as a cul-de-sac; its start is at a street.
    """

    line: LineString
    arrival: AccessPoint | None = None
    blind: bool = False


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What cross streets have to know besides the blocks.

    Attributes
    ----------
    streets
        Lines of all streets, and the parts of the site's edge that act as one.
    ends
        Shape (k, 2). Where designed streets end at others or at the edge, metres.
    arrivals
        Existing streets that arrive and are not continued.
    blocked
        Where no street may run; may be empty.
    """

    streets: shapely.Geometry
    ends: FloatArray
    arrivals: Sequence[AccessPoint]
    blocked: shapely.Geometry


def cross_streets(
    blocks: Sequence[Block],
    spec: Specification,
    around: Surroundings,
    progress: Progress | None = None,
) -> list[CrossStreet]:
    """Find the cross streets of a plan.

    First existing streets are continued through the blocks at which they arrive, where no block
    becomes worse by it; then blocks longer than asked are cut, with as few streets as possible.

    Parameters
    ----------
    blocks
        The blocks of the plan so far.
    spec
        Wished block size; with a weight of 0 for continuing, nothing is continued.
    around
        Streets, arriving streets and obstacles.
    progress
        Asked for cancellation before each block; what is found by then is returned.
    """
    progress = progress or Silent()
    cutter = _Cutter(spec, around)
    pieces = [block.polygon for block in sorted(blocks, key=lambda b: -b.length)]
    if spec.weight_continue != 0 and around.arrivals:
        near = [shapely.Point(point.xy).buffer(1.0) for point in around.arrivals]
        asked = shapely.intersects(
            np.array(pieces, dtype=object), shapely.union_all(np.array(near, dtype=object))
        )
        through: list[Polygon] = []
        for piece, asks in zip(pieces, asked.tolist()):
            wanted = asks and not progress.cancelled()
            through += cutter.continue_through(piece) if wanted else [piece]
        pieces = through
    for piece in pieces:
        if progress.cancelled():
            break
        cutter.shorten(piece)
    return cutter.found


class _Cutter:
    """Cuts blocks, and remembers the streets along which it did."""

    def __init__(self, spec: Specification, around: Surroundings) -> None:
        self.spec, self.around = spec, around
        self.joints = [Joint((float(x), float(y))) for x, y in around.ends]
        self.asking = {len(self.joints) + i: point for i, point in enumerate(around.arrivals)}
        self.joints += [Joint(point.xy, point.direction) for point in around.arrivals]
        self.found: list[CrossStreet] = []

    def continue_through(self, polygon: Polygon) -> list[Polygon]:
        """Cut a block along the existing streets that arrive at it, where it is good for it."""
        ways = self._ways(polygon)
        ways = ways.take(ways.arrival >= 0)
        before = self._misfit(polygon)
        best: tuple[float, int, list[Polygon]] | None = None
        halves = cut_each(polygon, ways.start, ways.end)
        for k, parts in enumerate(halves):
            if len(parts) != 2:
                continue
            after = [self._misfit(part) for part in parts]
            if max(after) > max(before, 0.5) or sum(after) > before + 0.5:
                continue
            price = sum(after) + self._oddness(ways, k)
            if best is None or price < best[0] - 1e-9:
                best = price, k, parts
        if best is None:
            return [polygon]
        self._keep(polygon, ways, best[1])
        return [part for piece in best[2] for part in self.continue_through(piece)]

    def shorten(self, polygon: Polygon) -> None:
        """Cut a block until no piece is longer than asked, where there is a way across it."""
        width, length = block_size(polygon)
        limit = TOO_LONG * self.spec.block_length
        if length <= limit or width < LEAST_WIDTH * self.spec.block_width:
            return
        ways = self._ways(polygon)
        best: tuple[float, int, list[Polygon]] | None = None
        halves = cut_each(polygon, ways.start, ways.end)
        size_of = iter(block_sizes([part for parts in halves for part in parts]))
        for k, parts in enumerate(halves):
            sizes = [next(size_of) for _ in parts]
            if len(parts) != 2:
                continue
            # where blocks are to be hardly longer than wide, halves may be worse than the whole
            if sum(self._strain(*size) for size in sizes) / 2 >= self._strain(width, length):
                continue
            if max(size[1] for size in sizes) > 0.9 * length:
                continue
            least = TOO_THIN * min(self.spec.block_width, width)
            if min(min(size) for size in sizes) < least:
                continue
            price = self._price(sizes) + self._oddness(ways, k)
            if best is None or price < best[0] - 1e-9:
                best = price, k, parts
        if best is None:
            return
        self._keep(polygon, ways, best[1])
        for part in best[2]:
            self.shorten(part)

    def _price(self, sizes: Sequence[tuple[float, float]]) -> float:
        """How far pieces are from what was asked, and how uneven."""
        limit = TOO_LONG * self.spec.block_length
        needed = [max(1, math.ceil(length / limit)) for _, length in sizes]
        each = [length / n for (_, length), n in zip(sizes, needed)]
        off = sum(self._width_misfit(width) for width, _ in sizes)
        return FURTHER_CUT * sum(needed) + off + (max(each) - min(each)) / limit

    def _oddness(self, ways: Chords, k: int) -> float:
        """Give what a way costs for its angles and junctions, less what it is worth."""
        price = (float(ways.skew[k]) / 20) ** 2 / 2 - JOINED * float(ways.joined[k].sum())
        if ways.arrival[k] >= 0:
            price -= CONTINUED
        near = STAGGERED * self.spec.block_width
        places = np.array([joint.xy for joint in self.joints]).reshape(-1, 2)
        for xy, joined in zip((ways.start[k], ways.end[k]), ways.joined[k]):
            if not joined and len(places) and np.hypot(*(places - xy).T).min() < near:
                price += STAGGER
        return price

    def _misfit(self, polygon: Polygon) -> float:
        """How far a block is from the wished size: 0 good, 0.5 off, 1 or more bad."""
        width, length = block_size(polygon)
        return self._width_misfit(width) + 0.5 * (length > TOO_LONG * self.spec.block_length)

    def _strain(self, width: float, length: float) -> float:
        """How many times too narrow, too wide or too long a block is, as logarithms."""
        over = max(0.0, math.log(length / (TOO_LONG * self.spec.block_length)))
        return abs(math.log(max(width, 1.0) / self.spec.block_width)) + over

    def _width_misfit(self, width: float) -> float:
        """0 where a block is as wide as asked, 0.5 where it is off, 1 where it is too thin."""
        share = width / self.spec.block_width
        if share < TOO_THIN or share > TOO_WIDE + 0.3:
            return 1.0
        return 0.0 if GOOD_FROM <= share <= TOO_WIDE else 0.5

    def _ways(self, polygon: Polygon) -> Chords:
        """Ways across a block that no obstacle blocks."""
        ways = chords(polygon, self.around.streets, self.joints)
        if not len(ways) or self.around.blocked.is_empty:
            return ways
        lines = shapely.linestrings(np.stack([ways.start, ways.end], axis=1))
        return ways.take(shapely.distance(lines, self.around.blocked) >= OBSTACLE_CLEARANCE)

    def _keep(self, polygon: Polygon, ways: Chords, k: int) -> None:
        """Build a street; others may go on from its ends, and it is a street to them.

        Across a hole with a street at its edge it becomes two, one on each side.
        """
        whole = ways.line(k)
        lines = [whole]
        if polygon.interiors:
            ground = Polygon(polygon.exterior).difference(shapely.union_all(_holes(polygon)))
            lines = [p for p in shapely.get_parts(whole.intersection(ground)) if p.length > SHORT]
        arrival = self.asking.get(int(ways.arrival[k]))
        for line in lines:
            first = math.dist(line.coords[0], whole.coords[0]) < SHORT
            self.found.append(CrossStreet(line, arrival if first else None))
            self.joints += [Joint((float(x), float(y))) for x, y in line.coords]
        streets = shapely.union_all([self.around.streets, *lines])
        self.around = dataclasses.replace(self.around, streets=streets)


def _holes(polygon: Polygon) -> list[Polygon]:
    return [Polygon(ring) for ring in polygon.interiors]


def cut(polygon: Polygon, line: LineString) -> list[Polygon]:
    """Cut a block along a line that runs right across it; scraps are left out."""
    ends = np.array(line.coords)[[0, -1]]
    return cut_each(polygon, ends[:1], ends[1:])[0]


def cut_each(polygon: Polygon, start: FloatArray, end: FloatArray) -> list[list[Polygon]]:
    """Cut a block along each of k straight ways that run right across it.

    Parameters
    ----------
    polygon
        The block.
    start, end
        Shape (k, 2). Ends of the ways, metres.

    Returns
    -------
    list of list of Polygon
        What each way alone makes of the block; scraps are left out.
    """
    size = shapely.length(shapely.linestrings(np.stack([start, end], axis=1)))[:, None]
    beyond = (end - start) / np.where(size > 0, size, 1.0) * 0.2
    longer = shapely.linestrings(np.stack([start - beyond, end + beyond], axis=1))
    noded = shapely.union(polygon.boundary, longer)
    parts, way = shapely.get_parts(shapely.polygonize(noded[:, None]), return_index=True)
    # what is enclosed may be a hole of the block
    shapely.prepare(polygon)
    good = shapely.contains(polygon, shapely.point_on_surface(parts))
    good &= shapely.area(parts) > SCRAP
    pieces: list[list[Polygon]] = [[] for _ in range(len(start))]
    for k, part in zip(way[good].tolist(), parts[good]):
        pieces[k].append(part)
    return pieces
