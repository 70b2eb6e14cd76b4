"""Pieces become plots: who touches whom, what has access, what is merged into a neighbour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from ...measure.parcel_shape import (
    BAD_ANGLE,
    BAD_AREA,
    corner_deviation,
    rectangle_ratio,
    undesirable,
)
from ..rules import ParcelRules
from ..types import Block, Plot, PlotUse
from .draft import COURT, GREEN, LOOSE, PARCEL, Draft
from .line import Floats
from .outline import NEAR

#: Neighbours share at least that much of their outlines (metres).
COMMON = 0.5
#: A parcel takes a piece well if the rectangle around both is at most this much larger.
WELL = 1.2
#: Pieces smaller than this go to a neighbour whatever becomes of its shape (square metres).
SLIVER = 20.0
#: Pieces smaller than this do so along edges of any length (square metres).
SPECK = 1.0
#: A green that could be a parcel is none if it is larger than that many of them.
LARGE_GREEN = 1.15
#: Where more than this share of the parcels are pointed, they stay parcels.
MANY = 0.2
#: An undesirable parcel and its neighbour may become one of that many times the area wished for.
JOINED = 1.9
#: The court takes land without access that shares that much with it (metres).
COURT_SIDE = 3.0


@dataclass
class Touching:
    """Who touches whom.

    Attributes
    ----------
    common
        For each piece, length of outline shared with each neighbour, metres.
    street
        Length of each piece's outline along a street, shape (n,), metres.
    """

    common: list[dict[int, float]]
    street: Floats


def touching(pieces: npt.NDArray[np.object_], block: Block) -> Touching:
    """Find shared edges of pieces that share their vertices.

    Parameters
    ----------
    pieces
        Polygons, shape (n,).
    block
        The block that they tile.
    """
    rings, owner = shapely.get_rings(pieces, return_index=True)
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    same = ring[1:] == ring[:-1]
    number = np.unique(xy[:, 0] + 1j * xy[:, 1], return_inverse=True)[1].ravel()
    low = np.minimum(number[:-1], number[1:])[same].astype(np.int64)
    high = np.maximum(number[:-1], number[1:])[same].astype(np.int64)
    step = xy[1:] - xy[:-1]
    length = np.sqrt(step[:, 0] ** 2 + step[:, 1] ** 2)[same]
    middle = ((xy[1:] + xy[:-1]) / 2)[same]
    who = owner[ring[:-1][same]]
    key = low * (int(number.max()) + 1) + high
    order = np.argsort(key, kind="stable")
    key, who, length, middle = key[order], who[order], length[order], middle[order]
    twin = np.flatnonzero(key[1:] == key[:-1])
    common: list[dict[int, float]] = [{} for _ in pieces]
    for a, b, d in zip(who[twin].tolist(), who[twin + 1].tolist(), length[twin].tolist()):
        if a != b:
            common[a][b] = common[a].get(b, 0.0) + d
            common[b][a] = common[b].get(a, 0.0) + d
    alone = np.ones(len(key), dtype=bool)
    alone[twin] = alone[twin + 1] = False
    if not block.closed.is_empty:
        alone[alone] = shapely.distance(shapely.points(middle[alone]), block.closed) > NEAR
    street = np.bincount(who[alone], weights=length[alone], minlength=len(pieces))
    return Touching(common, np.asarray(street, dtype=np.float64))


class Pieces:
    """The pieces of a block while small ones are merged.

    Parameters
    ----------
    made
        How the block was cut.
    block
        The block.
    rules
        What is asked of parcels.
    corners
        The convex corners of the block, shape (k, 2).
    angle, ratio
        `corner_deviation` and `rectangle_ratio` of each piece, shape (n,).
    """

    def __init__(
        self,
        made: Draft,
        block: Block,
        rules: ParcelRules,
        corners: Floats,
        angle: Floats,
        ratio: Floats,
    ) -> None:
        found = touching(made.pieces, block)
        self.shape = list(made.pieces)
        self.kind = made.kind.tolist()
        self.area = shapely.area(made.pieces).tolist()
        self.common, self.street = found.common, found.street.tolist()
        self.note = ["pointed corner" if k == GREEN else "" for k in self.kind]
        self.alive = [True] * len(self.shape)
        self.angle, self.ratio = angle, ratio
        #: pieces that took others since they were measured
        self.stale: set[int] = set()
        self.rules = rules
        self.corners = shapely.multipoints(corners)

    def merge_small(self) -> None:
        """Merge what is too small or has no access; what nobody takes well becomes green."""
        while True:
            poor = [k for k in range(len(self.shape)) if self.alive[k] and self._is_poor(k)]
            if not poor:
                break
            self._place(min(poor, key=lambda k: (self.area[k], k)))
        self._large_greens()
        self._mend()
        self._join_greens()

    def _large_greens(self) -> None:
        """Turn greens that would do as parcels, or are too large for a corner, into parcels."""
        rules = self.rules
        for k, kind in enumerate(self.kind):
            if not self.alive[k] or kind != GREEN or self.street[k] < rules.min_frontage:
                continue
            if not rules.least_area <= self.area[k] <= rules.largest_area:
                continue
            self._measure()
            poor = undesirable(self.angle[k], self.ratio[k])
            if not poor or self.area[k] > LARGE_GREEN * rules.area:
                self.kind[k], self.note[k] = PARCEL, ""

    def _measure(self) -> None:
        """Measure the pieces that took others."""
        if self.stale:
            mine = sorted(self.stale)
            shapes = np.array([self.shape[k] for k in mine])
            self.angle[mine], self.ratio[mine] = corner_deviation(shapes), rectangle_ratio(shapes)
            self.stale = set()

    def _mend(self) -> None:
        """Join undesirable parcels with a neighbour, or make the worst small ones greens."""
        rules = self.rules
        lots = [k for k in range(len(self.shape)) if self.alive[k] and self.kind[k] == PARCEL]
        if not lots:
            return
        self._measure()
        angle, ratio = self.angle[lots], self.ratio[lots]
        poor = undesirable(angle, ratio)
        bad = {lots[i] for i in np.flatnonzero(poor)}
        pointed = {lots[i] for i in np.flatnonzero((angle > BAD_ANGLE) & (ratio > BAD_AREA))}
        if len(pointed) > MANY * len(lots):
            pointed = set()  # it is how the block is, not a corner
        for k in sorted(bad):
            if not self.alive[k]:
                continue
            found = None
            for j in sorted(self.common[k]):
                if self.kind[j] != PARCEL or self.common[k][j] < COMMON:
                    continue
                if self.area[k] + self.area[j] > min(rules.largest_area, JOINED * rules.area):
                    continue
                both = shapely.union(self.shape[k], self.shape[j])
                if both.geom_type != "Polygon":
                    continue
                shape = np.array([both])
                size = float(rectangle_ratio(shape)[0])
                if size > BAD_AREA or corner_deviation(shape)[0] > BAD_ANGLE:
                    continue
                if found is None or (j not in bad, size) < found[:2]:
                    found = (j not in bad, size, j, both)
            if found is not None:
                self._merge(k, found[2], found[3])
            elif (
                k in pointed
                and rules.greens
                and self.area[k] < LARGE_GREEN * rules.area
                and shapely.distance(self.shape[k], self.corners) < 1.0
            ):
                self.kind[k], self.note[k] = GREEN, "pointed corner"

    def _is_poor(self, k: int) -> bool:
        if self.kind[k] == GREEN:
            unwanted = self.area[k] < SLIVER or not self.rules.greens
            return unwanted and self.note[k] != "kept"
        if self.kind[k] == COURT:
            return False
        return bool(
            self.kind[k] == LOOSE
            or self.area[k] < self.rules.least_area
            or self.street[k] < self.rules.min_frontage
        )

    def _place(self, k: int) -> None:
        """Find a place for one piece: a neighbour, the court, or a green of its own."""
        rules = self.rules
        reached = self.street[k] >= rules.min_frontage
        if self.kind[k] == LOOSE and reached and self.area[k] >= rules.least_area:
            self.kind[k] = PARCEL
            return
        options = []
        enough = 0.0 if self.area[k] < SPECK else COMMON
        for j, shared in self.common[k].items():
            if shared < enough or self.kind[j] not in (PARCEL, GREEN):
                continue
            if self.kind[j] == GREEN and self.kind[k] != GREEN and not self.area[k] < SLIVER:
                continue
            both = shapely.union(self.shape[k], self.shape[j])
            if both.geom_type == "Polygon":
                ratio = float(rectangle_ratio(np.array([both]))[0])
                options.append((ratio + 0.3 * both.area / rules.area, ratio, j, both))
        best = min(options, key=lambda x: x[0], default=None)
        fits = best is not None and (
            (best[1] <= WELL and best[3].area <= rules.largest_area) or self.area[k] < SLIVER
        )
        if fits and best is not None:
            self._merge(k, best[2], best[3])
            return
        if not reached or self.kind[k] == LOOSE:
            courts = [j for j, d in self.common[k].items() if self.kind[j] == COURT and d > 3.0]
            if courts:
                j = max(courts, key=lambda j: self.common[k][j])
                both = shapely.union(self.shape[k], self.shape[j])
                if both.geom_type == "Polygon":
                    self._merge(k, j, both)
                    return
        if best is not None and not rules.greens:
            self._merge(k, best[2], best[3])
            return
        was_pointed = self.kind[k] == GREEN
        self.kind[k] = GREEN
        self.note[k] = "kept" if was_pointed else "too small" if reached else "no street access"

    def _merge(self, k: int, j: int, both: shapely.Geometry) -> None:
        """Let piece j take piece k."""
        self.shape[j], self.area[j] = both, both.area
        self.stale.discard(k)
        self.stale.add(j)
        self.street[j] += self.street[k]
        for other, shared in self.common[k].items():
            del self.common[other][k]
            if other != j:
                self.common[j][other] = self.common[j].get(other, 0.0) + shared
                self.common[other][j] = self.common[j][other]
        self.common[k] = {}
        self.alive[k] = False

    def _join_greens(self) -> None:
        """Join greens that touch."""
        for k in range(len(self.shape)):
            if not self.alive[k] or self.kind[k] != GREEN:
                continue
            for j, shared in list(self.common[k].items()):
                if self.kind[j] == GREEN and shared > COMMON:
                    both = shapely.union(self.shape[k], self.shape[j])
                    if both.geom_type == "Polygon":
                        self._merge(k, j, both)
                        break

    def areas(self) -> Floats:
        """Return the areas of the plots, square metres."""
        return np.array(self.area)[self.alive]

    def plots(self) -> list[Plot]:
        """Return the plots."""
        uses: dict[int, PlotUse] = {PARCEL: "parcel", GREEN: "green", COURT: "court"}
        return [
            Plot(self.shape[k], uses[self.kind[k]], self.note[k].replace("kept", "pointed corner"))
            for k in range(len(self.shape))
            if self.alive[k]
        ]
