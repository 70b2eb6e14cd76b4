"""Snakes: streets that straighten themselves like elastic bands, all at once.

After the appendix of CND (active contours, Kass et al. 1988). A network is taken apart into
snakes, sequences of edges that run straight on through junctions; where a leg ends at another
snake it is pulled square to it. Each step solves a sparse linear system for all points
("semi-implicit"). With evenly spaced points v_i it lowers

    alpha |v_i - v_(i-1)|^2 + beta |v_(i-1) - 2 v_i + v_(i+1)|^2 + stay |v_i - start_i|^2

where gamma |v - previous v|^2 keeps the step short. A leg that should leave its junction in
the direction n is bent as if it went on to a point beyond it: its first term of bending is
|v_1 - v_0 - d n|^2. Corners, where a street really turns, keep their shape.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

from ..network.problem import BoolArray, FloatArray
from .angles import leg_directions, partners
from .smooth_anchors import Anchors
from .smooth_graph import StreetNet
from .smooth_points import Points
from .snake_terms import find_bends, find_legs

#: Weight of legs being square, against 1 for bending; and where bends are made few, which cost
#: less there.
SQUARE_WEIGHT, SQUARE_WEIGHT_FEW = 4.0, 8.0
#: Weight of corners keeping their shape, against 1 for bending.
CORNER_WEIGHT = 2.0
#: Least distance of points in the terms of bending, as a share of the spacing.
CLOSEST = 1 / 3
#: Turns under this count as straight when bends are made few (degrees).
STRAIGHT_TURN = 1.0
#: When no point moves further than this in a step the shape is found (metres).
SETTLED = 0.02
#: The system is set up anew after so many steps.
RENEW = 4


@dataclass(frozen=True)
class Elasticity:
    """How stiff the streets are.

    Attributes
    ----------
    spacing
        Distance of points, metres.
    alpha, beta, gamma
        Weights of tension, bending and inertia (CND appendix). Tension rounds junctions off.
    length
        Bends shorter than about six times this are smoothed out, metres: it is the length L
        at which the pull back to the start, stay = beta (spacing / L)^4, is as strong as bending.
    few_bends
        Whether bends should be few rather than gentle: the weight of a bend is divided by its
        turn, step by step, so that the sum of turns is lowered instead of that of squares.
    corner
        A corner stays one where a street turns from what it is over this length before to what
        it is over this length after, metres; the steps of a staircase do not. 0 for no corners.
    """

    spacing: float
    alpha: float = 0.0
    beta: float = 3.0
    gamma: float = 0.1
    length: float = 50.0
    few_bends: bool = False
    corner: float = 60.0


class Snakes:
    """The points of a network in motion.

    Parameters
    ----------
    net
        The streets.
    points
        Points along them.
    anchors
        What holds them.
    elasticity
        How stiff they are.
    square
        Whether junction angles are drawn towards 90 degrees.

    Attributes
    ----------
    at
        Shape (N, 2). Where the points are, metres.
    """

    def __init__(
        self,
        net: StreetNet,
        points: Points,
        anchors: Anchors,
        elasticity: Elasticity,
        *,
        square: bool = True,
    ) -> None:
        self.points, self.elasticity = points, elasticity
        self.at = points.start.copy()
        self.rails = sorted(anchors.rails.items())
        away = leg_directions(net.lines)
        partner = partners(net, away)
        self.bends = find_bends(net, points, partner, elasticity.corner)
        self.legs = find_legs(
            net, points, partner, away, anchors, elasticity.spacing, square=square
        )
        self._stay = self._staying()
        self._stiff = np.ones(len(points.start))

    def relax(self, limit: FloatArray, steps: int, active: BoolArray | None = None) -> float:
        """Take a few steps with one system.

        Parameters
        ----------
        limit
            Shape (N,). How far each point may be from its start, metres.
        steps
            How many.
        active
            Shape (N,). Points that may move; None for all that are not fixed.

        Returns
        -------
        float
            The furthest that a point moved in the last step, metres.
        """
        free = ~self.points.fixed if active is None else ~self.points.fixed & active
        if not free.any():
            return 0.0
        gamma = self.elasticity.gamma
        bend, rest = self._bending(free)
        pull, root = self._pulls(free)
        matrix = bend.T @ bend + pull.T @ pull
        if self.elasticity.alpha > 0:
            matrix = matrix + self._tension()
        hold = self._stay * self._stiff
        matrix = (matrix + sparse.diags(hold + gamma)).tocsr()[free]
        solve = _solver(matrix[:, free])
        edge = matrix[:, ~free] @ self.at[~free] - bend.T[free] @ rest
        moved = 0.0
        for _ in range(steps):
            before = self.at
            push = pull.T[free] @ (root[:, None] * self._targets())
            right = hold[free, None] * self.points.start[free] + gamma * before[free]
            now = before.copy()
            now[free] = solve(right + push - edge)
            self._slide(now)
            self.at = now
            moved = float(np.hypot(*(now - before).T).max(initial=0.0))
            if moved < SETTLED:
                break
        # What goes too far is pulled back harder: a limit that is felt from afar makes no kinks.
        over = np.hypot(*(self.at - self.points.start).T) / np.maximum(limit, 1e-6)
        self._stiff = np.clip(self._stiff * np.minimum(over, 10.0) ** 1.5, 1.0, 1e9)
        return moved

    def excess(self, limit: FloatArray) -> float:
        """By how much of its limit a point is beyond it at most; 0 where none is."""
        some = limit > 0.1
        gone = np.hypot(*(self.at - self.points.start).T)
        return float((gone[some] / limit[some] - 1).max(initial=0.0))

    def within(self, limit: FloatArray) -> FloatArray:
        """Where the points are, none further from its start than its limit, shape (N, 2)."""
        moved = self.at - self.points.start
        size = np.hypot(*moved.T)
        scale = np.minimum(1.0, limit / np.maximum(size, 1e-12))
        return np.asarray(self.points.start + moved * scale[:, None])

    def _slide(self, at: FloatArray) -> None:
        """Put ends that slide back onto their rails."""
        for node, (a, b) in self.rails:
            start, along = self.points.start[node], b - a
            here = float((start - a) @ along / (along @ along))
            there = float((at[node] - a) @ along / (along @ along))
            # An end that starts beyond the end of its rail goes no further.
            share = min(max(there, min(0.0, here)), max(1.0, here))
            at[node] = start + (share - here) * along

    def _bending(self, free: BoolArray) -> tuple[Any, FloatArray]:
        """Rows of bending with a free point, by the square roots of their weights.

        And what they should be, shape (t, 2): not nothing where there is a corner.
        """
        bends, e, n = self.bends, self.elasticity, len(self.at)
        some = free[bends.triples].any(axis=1)
        triples = bends.triples[some]
        a, b, c = (self.at[triples[:, k]] for k in range(3))
        least = CLOSEST * e.spacing
        d1 = np.maximum(np.hypot(*(b - a).T), least)
        d2 = np.maximum(np.hypot(*(c - b).T), least)
        mean = 0.5 * (d1 + d2)
        values = np.column_stack([d2 / mean, np.full(len(d1), -2.0), d1 / mean])
        rows = np.repeat(np.arange(len(d1)), 3)
        matrix = sparse.csr_matrix((values.ravel(), (rows, triples.ravel())), shape=(len(d1), n))
        h = e.spacing
        if e.few_bends:
            turn = np.hypot(*(matrix @ self.at).T) / mean
            # The sum of turns, in the units of the sum of their squares at a turn of 10 degrees.
            turn = np.maximum(turn, math.radians(STRAIGHT_TURN))
            weight = math.radians(10.0) / turn * (h / mean) ** 2
        else:
            weight = mean / h * (h * h / (d1 * d2)) ** 2
        corner = bends.corner[some]
        weight[corner] = CORNER_WEIGHT
        bend = sparse.diags(np.sqrt(e.beta * bends.factor[some] * weight)) @ matrix
        rest = np.zeros((len(d1), 2))
        rest[corner] = bend[corner] @ self.points.start
        return bend, rest

    def _pulls(self, free: BoolArray) -> tuple[Any, FloatArray]:
        """Rows of directions, by the square roots of their weights; and these."""
        legs, e, n = self.legs, self.elasticity, len(self.at)
        size = np.hypot(*(self.points.start[legs.point] - self.points.start[legs.node]).T)
        scale = e.spacing / np.maximum(size, CLOSEST * e.spacing)
        square = SQUARE_WEIGHT_FEW if e.few_bends else SQUARE_WEIGHT
        weight = np.sqrt(e.beta * square * legs.weight) * scale
        weight *= free[legs.point] | free[legs.node]
        rows = np.tile(np.arange(len(legs.node)), 2)
        columns = np.concatenate([legs.point, legs.node])
        values = np.concatenate([weight, -weight])
        return sparse.csr_matrix((values, (rows, columns)), shape=(len(legs.node), n)), weight

    def _targets(self) -> FloatArray:
        """Where points further on should be as seen from their nodes, shape (k, 2)."""
        legs = self.legs
        along = self.at[legs.ahead] - self.at[legs.back]
        square = _unit(legs.side[:, None] * np.column_stack([-along[:, 1], along[:, 0]]))
        leg = self.at[legs.point] - self.at[legs.node]
        share = legs.share[:, None]
        wanted = _unit(share * square + (1 - share) * _unit(leg))
        wanted[legs.share == 0] = legs.direction[legs.share == 0]
        return np.asarray(wanted * np.hypot(*leg.T)[:, None])

    def _tension(self) -> Any:
        """Set up the terms of tension."""
        s, links = self.points.sequence, self.points.links
        rows = np.tile(np.arange(len(links)), 2)
        values = np.repeat([1.0, -1.0], len(links))
        columns = np.concatenate([s[links], s[links + 1]])
        matrix = sparse.csr_matrix((values, (rows, columns)), shape=(len(links), len(self.at)))
        return self.elasticity.alpha * (matrix.T @ matrix)

    def _staying(self) -> FloatArray:
        """Weights of the pull back to the start, shape (N,), by the length that a point has."""
        e = self.elasticity
        s, links = self.points.sequence, self.points.links
        half = 0.5 * self.points.lengths / e.spacing
        share = np.bincount(s[links], half, len(self.at))
        share += np.bincount(s[links + 1], half, len(self.at))
        stay: FloatArray = e.beta * (e.spacing / e.length) ** 4 * np.clip(share, 0.25, 2.0)
        return stay


def _unit(vectors: FloatArray) -> FloatArray:
    """Vectors at length 1, shape (k, 2)."""
    return np.asarray(vectors / np.maximum(np.hypot(*vectors.T), 1e-12)[:, None])


def _solver(matrix: Any) -> Any:
    """Factorise a symmetric positive definite system; the result solves it."""
    return splu(
        matrix.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    ).solve
