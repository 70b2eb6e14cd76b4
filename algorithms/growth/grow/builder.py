"""What both ways of building a street share: numbers, roads, and nodes that begin to live."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from math import hypot

from ..rules import GrowthRules
from .choose import Chooser, Draw
from .columns import Columns
from .walls import Walls

#: Nodes nearer than this are one, metres; what lies this near to a street lies on it.
TOLERANCE = 1e-3

#: Why a street was not built; `THERE` means that nothing is missing.
THERE, CROWDED, ANGLE, SHORT, OUTSIDE = "there", "crowded", "angle", "short", "outside"
BESIDE, ASTRAY = "beside", "astray"


class Builder(ABC):
    """Builds streets, one after the other.

    Parameters
    ----------
    rules
        What is asked.
    columns
        What has grown; it is changed.
    walls
        Where streets end.
    chooser
        Told of new states.

    Attributes
    ----------
    radius, tolerance
        Within which nodes are joined, and within which they are one, metres.
    fresh
        Nodes that got a state since the caller emptied this list.
    left
        How many streets were not built, by reason.
    """

    def __init__(
        self, rules: GrowthRules, columns: Columns, walls: Walls, chooser: Chooser
    ) -> None:
        self.columns, self.walls, self.chooser = columns, walls, chooser
        self.tolerance = tolerance_of(rules)
        self.radius = max(rules.radius, self.tolerance)
        self.fresh: list[int] = []
        self.left: Counter[str] = Counter()
        self._begun: dict[int, int] = {}

    @abstractmethod
    def build(self, node: int, draw: Draw, end: tuple[float, float], step: int) -> bool:
        """Build a street, or count why not.

        Parameters
        ----------
        node
            Where it begins.
        draw
            What it is.
        end
            Where it would end in free ground, metres.
        step
            Number of the iteration.
        """

    def live(self, node: int, state: int, way: tuple[float, float], road: int) -> None:
        """Give a node without state one, as reached by a street."""
        self.chooser.change(node, self.columns.state[node], state)
        self.columns.way_in[node] = way
        self.columns.road_in[node] = road
        self.fresh.append(node)

    def connect(self, node: int, end: int, draw: Draw, state: int, step: int) -> None:
        """Add the edge from a node to another, which gets a state if it is new (-1: keeps it)."""
        columns = self.columns
        dx, dy = columns.x[end] - columns.x[node], columns.y[end] - columns.y[node]
        length = hypot(dx, dy)
        road = self.road(node, new=draw.new_road)
        columns.add_edge(node, end, road, draw.road, step)
        if state >= 0:
            self.live(end, state, (dx / length, dy / length), road)

    def road(self, node: int, *, new: bool) -> int:
        """Return the road number of a street: a new one, or that which leads to its node.

        The streets of a start that go on with "its" road share one.
        """
        columns = self.columns
        road = 0 if new else columns.road_in[node] or self._begun.get(node, 0)
        if not road:
            columns.roads += 1
            road = columns.roads
            if not new:
                self._begun[node] = road
        return road


def tolerance_of(rules: GrowthRules) -> float:
    """Return below which distance nodes are one, metres: less than 1 mm in tiny grammars."""
    return min(TOLERANCE, 1e-4 * rules.scale)
