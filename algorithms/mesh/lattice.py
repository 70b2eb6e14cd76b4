"""Whole numbers of steps for all boundary pieces, by a small integer program.

The rings close on the lattice, every piece has at least one step, and the squared logarithm
of cell size over the asked size, summed over the boundary edges and over the cells between
facing pieces, is as small as can be. The costs are convex in the numbers, so that their
piecewise linear form needs no binary variables.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_matrix

from .directions import Labels
from .facing import Facing
from .quadmesh import FloatArray, IntArray
from .rings import Ring

STEP = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
WEIGHT_FACING = 0.5
WEIGHT_SHEAR = 0.35
PENALTY_FACING = 6.0
PENALTY_STRETCH = 3.0
PENALTY_CUT = 15.0
SHEARS = (-4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0)
"""Where the cost of shear is exact, lattice steps."""
SIZES = (-16, -8, -4, -2, -1, 0, 1, 2, 4, 8)
"""Where the cost of sizes is exact, lattice steps from the asked one."""
NEGLIGIBLE = 1e-9
"""Cost that counts as none."""
MOST_NODES = 400
GAP = 0.002
"""Relative gap at which a program counts as solved."""
LONGEST = 3.0
"""Seconds after which a program is given up; the node limit normally ends it long before."""

Expression = dict[int, float]


@dataclass(frozen=True)
class Cut:
    """A demand that a place of one piece lies beyond a place of another on the lattice.

    `sign` * (coordinate `axis` of piece `other` at fraction `other_at` minus that of piece
    `piece` at fraction `at`) is at least 1.
    """

    piece: int
    at: float
    other: int
    other_at: float
    axis: int
    sign: int


@dataclass(frozen=True, eq=False)
class LatticeRing:
    """Lattice points (p, 2) where the pieces of a ring begin and their steps (p,)."""

    corners: IntArray
    steps: IntArray


@dataclass
class _Program:
    """Columns and rows of a mixed integer program under construction."""

    low: list[float] = field(default_factory=list)
    high: list[float] = field(default_factory=list)
    cost: list[float] = field(default_factory=list)
    whole: list[int] = field(default_factory=list)
    rows: list[Expression] = field(default_factory=list)
    row_low: list[float] = field(default_factory=list)
    row_high: list[float] = field(default_factory=list)
    constant: float = 0.0

    def column(self, low: float, high: float, cost: float = 0.0, *, whole: bool = False) -> int:
        self.low.append(low)
        self.high.append(high)
        self.cost.append(cost)
        self.whole.append(int(whole))
        return len(self.low) - 1

    def row(self, expression: Expression, low: float, high: float) -> None:
        self.rows.append(expression)
        self.row_low.append(low)
        self.row_high.append(high)

    def at_least(self, expression: Expression, bound: float, penalty: float) -> None:
        """Ask expression >= bound, at a penalty per unit missing."""
        slack = self.column(0, np.inf, penalty)
        self.row({**expression, slack: 1.0}, bound, np.inf)

    def convex(
        self, expression: Expression, line: Sequence[tuple[float, float]], shift: float = 0.0
    ) -> None:
        """Add the convex piecewise linear cost through the points (x - shift, y) of `line`.

        The line goes on beyond its ends, but nowhere below 0. The expression is the place of the
        least cost plus steps to the right minus steps to the left, one column for each piece of
        the line: that is one row for all, and bounds of columns are free.
        """
        whole = _down_to_zero(line)
        least = max(1, min(range(len(whole)), key=lambda k: whole[k][1]))
        terms = dict(expression)
        for k, ((x, y), (u, v)) in enumerate(zip(whole, whole[1:])):
            last = k in (0, len(whole) - 2)
            width = np.inf if last else u - x
            slope = (v - y) / (u - x)
            terms[self.column(0, width, abs(slope))] = 1.0 if k < least else -1.0
        place, cost = whole[least]
        self.constant += cost
        self.row(terms, place - shift, place - shift)

    def solve(self) -> tuple[FloatArray, float] | None:
        """Solve it; None if there is no solution or none was found in time."""
        counts = [len(r) for r in self.rows]
        indices = np.fromiter(chain.from_iterable(self.rows), np.int64, sum(counts))
        data = np.fromiter(chain.from_iterable(r.values() for r in self.rows), float, sum(counts))
        pointer = np.concatenate([[0], np.cumsum(counts)])
        matrix = csr_matrix((data, indices, pointer), shape=(len(self.rows), len(self.low)))
        result = milp(
            np.array(self.cost),
            constraints=LinearConstraint(matrix, self.row_low, self.row_high),
            integrality=np.array(self.whole),
            bounds=Bounds(self.low, self.high),
            # presolving such a small program takes several times as long as solving it
            options={
                "presolve": False,
                "time_limit": LONGEST,
                "node_limit": MOST_NODES,
                "mip_rel_gap": GAP,
            },
        )
        if result.x is None:
            return None
        return np.asarray(result.x), float(result.fun) + self.constant


def solve_lattice(
    rings: Sequence[Ring],
    labels: Sequence[Labels],
    h: float,
    facing: Facing,
    rows_at: Mapping[int, int] | None = None,
    steps_at: Mapping[int, int] | None = None,
    cuts: Sequence[Cut] = (),
) -> tuple[list[LatticeRing], float] | None:
    """Choose the number of steps of every piece.

    Parameters
    ----------
    rings, labels
        The rings of one part of a site and their pieces.
    h
        Edge length, metres.
    facing
        Facing pieces.
    rows_at
        Extra rows of quads that will be laid along pieces: piece -> count.
    steps_at
        Extra steps that a piece gains from rows along its neighbours: piece -> count.
    cuts
        Demands that keep the lattice from touching itself.

    Returns
    -------
    tuple or None
        Lattice rings and the cost; None where no whole numbers close the rings.
    """
    rows_at, steps_at = rows_at or {}, steps_at or {}
    program = _Program()
    length = (
        np.concatenate([label.ends(ring) - label.start for ring, label in zip(rings, labels)]) / h
    )
    pieces = _Pieces(program, labels, length)
    pieces.close_rings(program)
    for i, x in enumerate(length.tolist()):
        extra = steps_at.get(i, 0)
        program.convex({pieces.steps[i]: 1.0}, _size_cost(x, x), extra)
        program.at_least({pieces.steps[i]: 1.0}, 0.6 * x - extra, PENALTY_STRETCH)
    _add_facing(program, facing, pieces, rows_at)
    for cut in cuts:
        gap = pieces.gap((cut.piece, cut.at), (cut.other, cut.other_at), cut.axis)
        scaled = {k: v * cut.sign for k, v in gap.items()}
        if scaled:
            program.at_least(scaled, 1.0, PENALTY_CUT)
    solution = program.solve()
    return None if solution is None else (pieces.read(solution[0]), solution[1])


class _Pieces:
    """Columns of the program for all pieces of all rings, and places on the lattice."""

    def __init__(self, program: _Program, labels: Sequence[Labels], length: FloatArray) -> None:
        self.directions: IntArray = np.concatenate([label.direction for label in labels])
        self.moves: list[list[float]] = STEP[self.directions].astype(float).tolist()
        sizes = [len(label.start) for label in labels]
        self.first: list[int] = [0, *np.cumsum(sizes).tolist()]
        self.rings = len(labels)
        self.ring_of: list[int] = np.repeat(np.arange(self.rings), sizes).tolist()
        self.steps = [program.column(1, np.ceil(2.5 * x) + 2, whole=True) for x in length]
        self.base = {
            (r, d): program.column(-200, 200, whole=True)
            for r in range(1, self.rings)
            for d in (0, 1)
        }

    def close_rings(self, program: _Program) -> None:
        """Demand that every ring returns to its start."""
        for r in range(self.rings):
            for d in (0, 1):
                terms = {
                    self.steps[i]: float(STEP[self.directions[i], d])
                    for i in range(self.first[r], self.first[r + 1])
                    if STEP[self.directions[i], d]
                }
                program.row(terms, 0, 0)

    def position(self, piece: int, fraction: float, axis: int, since: int = 0) -> Expression:
        """Return a lattice coordinate of a place on a piece, as seen from piece `since`."""
        r = self.ring_of[piece]
        first = max(since, self.first[r])
        terms = {
            self.steps[i]: self.moves[i][axis] for i in range(first, piece) if self.moves[i][axis]
        }
        if first == self.first[r] and r and not since:
            terms[self.base[r, axis]] = 1.0
        last = self.moves[piece][axis] * fraction
        if last:
            terms[self.steps[piece]] = last
        return terms

    def gap(self, here: tuple[int, float], there: tuple[int, float], axis: int) -> Expression:
        """Return the lattice coordinate of one place minus that of another."""
        together = self.ring_of[here[0]] == self.ring_of[there[0]]
        # what lies before both of them is the same for both
        since = min(here[0], there[0]) if together else 0
        terms = self.position(*there, axis, since)
        for k, v in self.position(*here, axis, since).items():
            terms[k] = terms.get(k, 0.0) - v
        return {k: v for k, v in terms.items() if abs(v) > 1e-9}

    def read(self, solution: FloatArray) -> list[LatticeRing]:
        """Return the lattice rings of a solution."""
        values = np.round(solution).astype(np.int64)
        found = []
        for r in range(self.rings):
            members = slice(self.first[r], self.first[r + 1])
            count = values[self.steps[members]]
            moves = STEP[self.directions[members]] * count[:, None]
            origin = np.array([values[self.base[r, d]] if r else 0 for d in (0, 1)])
            corners = origin + np.vstack([[[0, 0]], np.cumsum(moves, axis=0)[:-1]])
            found.append(LatticeRing(corners.astype(np.int64), count))
        return found


def _add_facing(
    program: _Program, facing: Facing, pieces: _Pieces, rows_at: Mapping[int, int]
) -> None:
    """Add the costs of cells between facing pieces: their size and their shear."""
    for pair, at, distance, width in zip(
        facing.pieces.tolist(),
        facing.fractions.tolist(),
        facing.distance.tolist(),
        facing.width.tolist(),
    ):
        inward = (int(pieces.directions[pair[0]]) + 1) % 4
        axis, sign = inward % 2, 1.0 if inward < 2 else -1.0
        here, there = (pair[0], at[0]), (pair[1], at[1])
        gap = {k: v * sign for k, v in pieces.gap(here, there, axis).items()}
        extra = rows_at.get(pair[0], 0) + rows_at.get(pair[1], 0)
        program.at_least(gap, 1.0, PENALTY_FACING)
        weight = WEIGHT_FACING * width * max(distance, 0.5)
        program.convex(gap, _size_cost(distance, weight), extra)
        shear = pieces.gap(here, there, 1 - axis)
        if shear:
            weight = WEIGHT_SHEAR * width / max(distance, 1.0)
            program.convex(shear, [(x, weight * x * x) for x in SHEARS])


def _down_to_zero(line: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Make a convex line that falls toward one of its ends go on to 0, and stay there."""
    whole = list(line)
    for _ in range(2):
        (x, y), (u, v) = whole[:2]
        if y <= v:
            if NEGLIGIBLE < y < v:
                x, y = x - y * (u - x) / (v - y), 0.0
                whole.insert(0, (x, y))
            whole.insert(0, (x - math.copysign(1.0, u - x), y))
        whole.reverse()
    return whole


def _size_cost(target: float, weight: float) -> list[tuple[float, float]]:
    """Return points of weight * ln(x / target)**2 at whole numbers around the target."""
    middle = max(1, round(target))
    most = max(2.7 * target, 3)
    grid = [middle + k for k in SIZES if 1 <= middle + k <= most]
    if len(grid) < 2:
        grid = [middle, middle + 1]
    value = [weight * math.log(x / max(target, 0.3)) ** 2 for x in grid]
    line = [(float(grid[0]), value[0])]
    steepest = -math.inf
    for k in range(1, len(grid)):
        # beyond e * target the logarithm is no longer convex: go on straight
        width = grid[k] - grid[k - 1]
        steepest = max(steepest, (value[k] - value[k - 1]) / width)
        line.append((float(grid[k]), line[-1][1] + steepest * width))
    return line
