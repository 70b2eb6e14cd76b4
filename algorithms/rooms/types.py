"""What rooms are made of: templates, their placements on a mesh, the problem and its plans."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..network.problem import NetworkProblem

BoolArray = npt.NDArray[np.bool_]
FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
#: A floor plan has corridors between rooms, a game level a route through its blocks.
Kind = Literal["floor", "level"]
#: Shape of a template: squares (column, row), counted from its lower left corner.
Cells = frozenset[tuple[int, int]]


@dataclass(frozen=True)
class Template:
    """An admissible shape of rooms or blocks (CND Fig. 9a).

    Attributes
    ----------
    name
        What it is called in layers and messages; unique in a set.
    cells
        Its squares, connected by their sides; the least column and the least row are 0.
    rotations
        Allowed quarter turns counter-clockwise from how it is drawn, of 0, 1, 2, 3.
    mirror
        Whether it may also be mirrored.
    least, most
        Smallest and largest number of rooms; None for no limit.
    least_share, most_share
        Smallest and largest share of the area of all rooms, 0 to 1; None for no limit.
    colour
        "#rrggbb".
    use
        What the room is for, such as "ward"; free text, "" where it is not said.
    """

    name: str
    cells: Cells
    rotations: tuple[int, ...] = (0, 1, 2, 3)
    mirror: bool = True
    least: int = 0
    most: int | None = None
    least_share: float = 0.0
    most_share: float | None = None
    colour: str = "#c8c8c8"
    use: str = ""


@dataclass(frozen=True, eq=False)
class Placements:
    """Where rooms may lie on a mesh; r placements, none twice for a template.

    Attributes
    ----------
    template
        Shape (r,). Index of the template of each.
    faces
        For each, its faces, ascending.
    inner
        For each, the edges between two of its faces, ascending (CND eq. 16).
    rim
        For each, the edges of one of its faces only, ascending (CND eq. 17).
    """

    template: IntArray
    faces: tuple[tuple[int, ...], ...]
    inner: tuple[tuple[int, ...], ...]
    rim: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, eq=False)
class CountRule:
    """A limit of a sum over the rooms of a plan.

    Attributes
    ----------
    text
        What is asked, for messages, such as "at least 4 of 'ward'".
    weight
        Shape (r,). What each placement adds.
    least, most
        The sum lies between them; infinite for no limit.
    """

    text: str
    weight: FloatArray
    least: float
    most: float


@dataclass(frozen=True)
class Treasures:
    """How many blocks of a level are dead ends: blocks with one passage, away from some places.

    A passage is a vertex where the route gets from one block into another. CND-x 5.3 asks "whether
    branches or deadends are allowed" in the graph of the blocks; this counts them.

    Attributes
    ----------
    least, most
        Their number lies between them.
    apart
        Vertices, start and goal above all; blocks in which the route touches one do not count.
    """

    least: int
    most: int
    apart: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class RoomProblem:
    """Rooms that tile a mesh, and corridors that reach them or a route that runs through them.

    Attributes
    ----------
    kind
        "floor" (CND eq. 15-17) or "level" (CND-x eq. 19-20).
    network
        Corridors or route: mesh, sinks, candidate edges, weights and rules. Its coverage is
        empty: the rooms say where corridors are needed.
    templates
        The templates.
    placements
        Where rooms may lie, none on faces that are not to be tiled.
    floor
        Shape (m,). Faces to be tiled; the others are obstacles.
    counts
        Limits of numbers and areas.
    treasures
        Number of dead ends of a level; None for any.
    """

    kind: Kind
    network: NetworkProblem
    templates: tuple[Template, ...]
    placements: Placements
    floor: BoolArray
    counts: tuple[CountRule, ...] = ()
    treasures: Treasures | None = None


@dataclass(frozen=True, eq=False)
class RoomPlan:
    """A floor plan or a level.

    Attributes
    ----------
    rooms
        Chosen placements, ascending.
    active
        Shape (e,). Edges of corridors or of the route.
    objective, bound
        Value of the network's objective (CND eq. 7) and its proven lower bound.
    seconds
        Wall time of the search.
    stopped
        One of `network.problem.STOPS`.
    distance
        Shape (n,). Network distance to a sink in units of `NetworkProblem.length`, infinite where
        a vertex is not on the network.
    history
        (seconds, objective) of every improvement.
    """

    rooms: tuple[int, ...]
    active: BoolArray
    objective: float
    bound: float
    seconds: float
    stopped: str
    distance: FloatArray
    history: tuple[tuple[float, float], ...] = ()

    @property
    def gap(self) -> float:
        """Relative gap (objective - bound) / objective."""
        if self.objective <= 0:
            return 0.0
        return max(0.0, (self.objective - self.bound) / self.objective)
