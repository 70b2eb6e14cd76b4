"""Streets as CitySprout builds them, for comparison: planar in most places, not in all."""

from __future__ import annotations

from math import hypot

from .builder import CROWDED, OUTSIDE, THERE, Builder
from .cells import corridor
from .choose import Draw


class PublishedBuilder(Builder):
    """Builds streets by checks 1 and 2 of CS section 1. Parameters as for `Builder`.

    A crossed street is not split, and a street to a near node is not checked for crossings. What
    the supplement leaves open is as agrees best with the counts of nodes, roads, iterations and
    dead ends that CitySprout gives: the node that is nearest counts in check 2, also the growing
    node itself (then nothing is built); a street that is there already gets the road number and
    type of the new one, as its graph library does; and a rule that draws nothing leaves the type
    of its node as it is (see `grow.Gardener.iterate`).
    """

    def build(self, node: int, draw: Draw, end: tuple[float, float], step: int) -> bool:
        """Build a street, or count why not."""
        columns = self.columns
        x, y, wall = self.cut(node, end)
        reached = columns.nearest(x, y, self.radius, but=-1, bends=True)
        if reached == node:
            self.left[CROWDED] += 1
            return False
        there = columns.edge_between(node, reached) if reached >= 0 else -1
        if there >= 0:
            columns.road[there] = self.road(node, new=draw.new_road)
            columns.kind[there] = draw.road
            self.left[THERE] += 1
            return False
        if hypot(x - columns.x[node], y - columns.y[node]) < self.tolerance:
            self.left[OUTSIDE] += 1
            return False
        state = draw.edge_state if wall else draw.state
        if reached >= 0:
            state = -1
        else:
            reached = columns.add_node(x, y, step)
        self.connect(node, reached, draw, state, step)
        return True

    def cut(self, node: int, end: tuple[float, float]) -> tuple[float, float, bool]:
        """Return where a street ends after check 1, and whether that is at a wall."""
        columns, tolerance = self.columns, self.tolerance
        x0, y0 = columns.x[node], columns.y[node]
        line = (x0, y0, *end)
        dx, dy = end[0] - x0, end[1] - y0
        find, segments = columns.lines.cells.get, columns.segment
        starts, ends = columns.a, columns.b
        best, place = 1.0, end
        for key in corridor(line, tolerance, columns.lines.per):
            for edge in find(key, ()):
                ax, ay, bx, by = segments[edge]
                sa = dx * (ay - y0) - dy * (ax - x0)
                sb = dx * (by - y0) - dy * (bx - x0)
                if (sa > 0 and sb > 0) or (sa < 0 and sb < 0) or sa == sb:
                    continue
                if starts[edge] == node or ends[edge] == node:
                    continue
                share = sa / (sa - sb)
                x, y = ax + share * (bx - ax), ay + share * (by - ay)
                at = (x - x0) / dx if abs(dx) > abs(dy) else (y - y0) / dy
                if 1e-9 < at < best:
                    best, place = at, (x, y)
        if self.walls.any:
            length = hypot(dx, dy)
            wall = self.walls.hit(line)
            if wall is not None and wall < best * length:
                return x0 + dx / length * wall, y0 + dy / length * wall, True
        return (*place, False)
