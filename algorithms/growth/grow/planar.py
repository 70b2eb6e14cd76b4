"""Streets that stay planar: checks 1 and 2 of CS, with the streets they lead to split there.

CS section 1 moves the end of a new street to the nearest crossing (check 1), then to a node
nearer than the intersect radius (check 2). Here the street is checked again whenever its end has
moved, ends on the inside of a street split it, and what would look poor on the ground is not
built: needle angles, stubs, and streets that pass a junction or end beside a street so closely
that no block fits between.
"""

from __future__ import annotations

from math import cos, hypot, radians
from typing import NamedTuple

from ..rules import GrowthRules
from ..types import GROWN
from .builder import ANGLE, ASTRAY, BESIDE, CROWDED, OUTSIDE, SHORT, THERE, Builder
from .cells import corridor
from .choose import NO_STATE, Chooser, Draw
from .columns import Columns
from .crossing import Crossing
from .walls import Walls

#: Least angle in all cases, degrees: below, streets run along each other.
LEAST_ANGLE = 1.0
#: How near a bend a street must come to be led to it: metres, and share of the radius.
BEND, BEND_SHARE = 2.0, 0.1
#: Streets nearer than this lie beside each other, as a share of the clearance; it is asked of
#: streets at least so many times as long, which at right angles soon are further away.
BESIDE_SHARE, LONG = 0.5, 4.0
#: How often the end of a street may move.
ROUNDS = 6


class Target(NamedTuple):
    """Where a street ends: a node, a place on an edge, a wall, or free ground (-1 for none)."""

    x: float
    y: float
    node: int = -1
    edge: int = -1
    wall: bool = False


class PlanarBuilder(Builder):
    """Builds streets that meet in nodes only. Parameters as for `Builder`.

    Attributes
    ----------
    clearance
        Ends this near to a street are joined to it, and streets that pass a node this near lead
        to it, metres.
    bend
        The same for nodes where a street only bends, metres.
    cosine
        Of the least angle between streets.
    crossing
        Leads streets over the strip beside the sites, or None.
    """

    crossing: Crossing | None = None

    def __init__(
        self, rules: GrowthRules, columns: Columns, walls: Walls, chooser: Chooser
    ) -> None:
        super().__init__(rules, columns, walls, chooser)
        self.clearance = max(rules.clearance * rules.radius, self.tolerance)
        self.bend = min(max(min(BEND, BEND_SHARE * rules.radius), self.tolerance), self.radius)
        self.cosine = cos(radians(max(rules.min_angle, LEAST_ANGLE)))

    def build(self, node: int, draw: Draw, end: tuple[float, float], step: int) -> bool:
        """Build a street, or count why not."""
        columns = self.columns
        along = self.along(node, end)
        if along >= 0:
            self.left[THERE] += 1
            return self.mark(node, along, draw, end, step)
        target, reason = self.chosen(node, end)
        if target is None or reason:
            self.left[reason] += 1
            return False
        state = draw.edge_state if target.wall else draw.state
        reached = target.node
        if reached < 0:
            reached = columns.add_node(target.x, target.y, step)
            if target.edge >= 0:
                columns.split(target.edge, reached)
        elif columns.bend[reached]:
            # a crossing of the ground's street like any other: growth goes on across
            columns.bend[reached] = False
            state = state if columns.state[reached] == NO_STATE else -1
        else:
            state = -1
        self.connect(node, reached, draw, state, step)
        return True

    def chosen(self, node: int, end: tuple[float, float]) -> tuple[Target | None, str]:
        """Return where a street ends, and why it is not built if it is not."""
        target, reason = self.tried(node, Target(*end))
        if self.crossing is None or reason != ASTRAY:
            return target, reason
        start = self.columns.x[node], self.columns.y[node]
        for place, edge in self.crossing.others(start, end):
            foot = None if edge else self.columns.foot(*place, self.tolerance, node)
            goal = Target(*place, wall=edge) if foot is None else self._on(*foot)
            other, why = self.tried(node, goal)
            if not why:
                return other, why
        return target, OUTSIDE

    def tried(self, node: int, goal: Target) -> tuple[Target | None, str]:
        """Return where a street that sets out for a goal ends, and why it is not built."""
        target = self.target(node, goal)
        if target is None:
            return None, CROWDED
        start = self.columns.x[node], self.columns.y[node]
        end = target.x, target.y
        if self.crossing is not None and start != end and not self.crossing.allowed(start, end):
            return target, ASTRAY
        return target, self.refusal(node, target)

    def along(self, node: int, end: tuple[float, float]) -> int:
        """Return the grown street on which a new one would lie from end to end, or -1."""
        columns = self.columns
        dx, dy = end[0] - columns.x[node], end[1] - columns.y[node]
        for edge in columns.at[node]:
            wx, wy = columns.way[edge]
            if columns.a[edge] != node:
                wx, wy = -wx, -wy
            if abs(wx * dy - wy * dx) < self.tolerance and columns.street[edge] == GROWN:
                ax, ay, bx, by = columns.segment[edge]
                if 0 < wx * dx + wy * dy < hypot(bx - ax, by - ay):
                    return edge
        return -1

    def mark(self, node: int, edge: int, draw: Draw, end: tuple[float, float], step: int) -> bool:
        """Put the end of a street on one that runs there already, and let it grow on from there.

        So a grammar may divide its own long streets, as CitySprout's Line does.
        """
        columns = self.columns
        if columns.nearest(*end, self.radius, but=-1, bends=True) >= 0:
            return False
        if self.crossing is not None and not self.crossing.inside(end):
            return False
        way = columns.way[edge]
        if columns.a[edge] != node:
            way = (-way[0], -way[1])
        length = hypot(end[0] - columns.x[node], end[1] - columns.y[node])
        reached = columns.add_node(
            columns.x[node] + way[0] * length, columns.y[node] + way[1] * length, step
        )
        columns.split(edge, reached)
        self.live(reached, draw.state, way, columns.road[edge])
        return True

    def target(self, node: int, target: Target) -> Target | None:
        """Return where a street ends that sets out for a target, None if it finds no place."""
        columns = self.columns
        for _ in range(ROUNDS):
            met = self.obstacle(node, target)
            if met is not None:
                target = met
                if met.node >= 0:
                    continue
                if met.wall and self._at(node, met):
                    # it would lead out of the ground: no reason to go elsewhere
                    return met
            elif target.node >= 0:
                return target
            x, y, _, edge, wall = target
            near = columns.nearest(x, y, self.radius, but=node, bends=False)
            if near >= 0:
                target = Target(columns.x[near], columns.y[near], near)
            elif edge >= 0 or wall:
                return target
            else:
                foot = columns.foot(x, y, self.clearance, node)
                if foot is None:
                    return target
                target = self._on(*foot)
        return None

    def refusal(self, node: int, target: Target) -> str:
        """Return why a street to a target is not built, empty if it is."""
        columns = self.columns
        x, y, end, edge, wall = target
        dx, dy = x - columns.x[node], y - columns.y[node]
        length = hypot(dx, dy)
        if end >= 0:
            if columns.edge_between(node, end) >= 0:
                return THERE
        elif length < self.tolerance:
            return OUTSIDE if wall else SHORT
        elif wall and length < self.clearance:
            return SHORT
        way = (dx / length, dy / length)
        if self._needle(node, *way) or (end >= 0 and self._needle(end, -way[0], -way[1])):
            return ANGLE
        if edge >= 0:
            along = columns.way[edge]
            if abs(along[0] * way[0] + along[1] * way[1]) > self.cosine:
                return ANGLE
        return BESIDE if self._beside((columns.x[node], columns.y[node]), way, length) else ""

    def obstacle(self, node: int, target: Target) -> Target | None:
        """Return what a street to a target meets first on its way, None if nothing."""
        columns = self.columns
        x0, y0 = columns.x[node], columns.y[node]
        dx, dy = target.x - x0, target.y - y0
        length = hypot(dx, dy)
        if length < self.tolerance:
            return None
        ray = (x0, y0, dx / length, dy / length)
        line = (x0, y0, target.x, target.y)
        fixed = target.node >= 0 or target.edge >= 0
        met, least = self._node_beside(node, target, ray, length)
        crossing = self._edge_across(node, target, ray, least)
        if crossing is not None:
            met, least = self._on(*crossing[:3]), crossing[3]
        if self.walls.any and not target.wall:
            # streets along the edge of the ground win against the edge
            slack = 10 * self.tolerance
            wall = self.walls.hit(line)
            if wall is not None and wall < (least - slack if fixed or met else least + slack):
                return Target(x0 + ray[2] * wall, y0 + ray[3] * wall, wall=True)
        return met

    def _node_beside(
        self, node: int, target: Target, ray: tuple[float, float, float, float], length: float
    ) -> tuple[Target | None, float]:
        """Return the first node that a street would pass too closely, and how far it is."""
        columns, clearance = self.columns, self.clearance
        x0, y0, ux, uy = ray
        xs, ys, bend, end = columns.x, columns.y, columns.bend, target.node
        find = columns.points.cells.get
        best, least = -1, length
        for key in corridor((x0, y0, target.x, target.y), clearance, columns.points.per):
            for other in find(key, ()):
                px, py = xs[other] - x0, ys[other] - y0
                side = ux * py - uy * px
                if side < 0:
                    side = -side
                if side >= clearance or other in (node, end):
                    continue
                along = ux * px + uy * py
                # what lies beside the beginning, not ahead, is in nobody's way
                if side < along < least and (not bend[other] or side < self.bend):
                    best, least = other, along
        if best < 0:
            return None, length
        return Target(xs[best], ys[best], best), least

    def _edge_across(
        self, node: int, target: Target, ray: tuple[float, float, float, float], least: float
    ) -> tuple[int, float, float, float] | None:
        """Return the first edge that a street would cross: edge, place, distance."""
        columns, tolerance = self.columns, self.tolerance
        x0, y0, ux, uy = ray
        starts, ends, segments = columns.a, columns.b, columns.segment
        find = columns.lines.cells.get
        end, anchor = target.node, target.edge
        if end < 0 and anchor < 0 and not target.wall:
            least += tolerance
        met = None
        for key in corridor((x0, y0, target.x, target.y), tolerance, columns.lines.per):
            for edge in find(key, ()):
                ax, ay, bx, by = segments[edge]
                sa = ux * (ay - y0) - uy * (ax - x0)
                sb = ux * (by - y0) - uy * (bx - x0)
                if (sa > tolerance and sb > tolerance) or (sa < -tolerance and sb < -tolerance):
                    continue
                a, b = starts[edge], ends[edge]
                if a in (node, end) or b in (node, end) or edge == anchor or sa == sb:
                    continue
                share = sa / (sa - sb)
                share = 0.0 if share < 0 else 1.0 if share > 1 else share
                x, y = ax + share * (bx - ax), ay + share * (by - ay)
                along = ux * (x - x0) + uy * (y - y0)
                if 0 < along < least:
                    met, least = (edge, x, y, along), along
        return met

    def _at(self, node: int, target: Target) -> bool:
        columns, tolerance = self.columns, self.tolerance
        return hypot(columns.x[node] - target.x, columns.y[node] - target.y) < tolerance

    def _on(self, edge: int, x: float, y: float) -> Target:
        """Return a place on an edge as a target: the bend there, or the place itself."""
        bend = self.columns.end_near(edge, x, y, self.bend)
        if bend >= 0:
            return Target(self.columns.x[bend], self.columns.y[bend], bend)
        return Target(x, y, edge=edge)

    def _beside(self, start: tuple[float, float], way: tuple[float, float], length: float) -> bool:
        """Tell whether a street lies beside another for most of its length.

        A given street that bends away and comes back makes no needle where the new one begins.
        """
        near = BESIDE_SHARE * self.clearance
        if length < LONG * near:
            return False
        foot = self.columns.foot
        return all(
            foot(start[0] + part * way[0], start[1] + part * way[1], near, but=-1) is not None
            for part in (0.3 * length, 0.5 * length, 0.7 * length)
        )

    def _needle(self, node: int, ux: float, uy: float) -> bool:
        """Tell whether a street that leaves a node lies too near to another there."""
        columns = self.columns
        for edge in columns.at[node]:
            wx, wy = columns.way[edge]
            cosine = ux * wx + uy * wy
            if (cosine if columns.a[edge] == node else -cosine) > self.cosine:
                return True
        return False
