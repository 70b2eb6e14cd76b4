"""Windows of a plan: some rooms are taken away and laid again with their corridors."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Optional

import numpy as np

from ...network.cp.connect import add_ranks
from ...network.cp.model import CpNetwork
from ...network.problem import BoolArray
from ...network.search.window_search import WindowSearch
from ...network.search.windows import Windows
from ...network.structure import Structure
from ..program.cp import add_rooms
from ..program.index import RoomIndex
from ..program.parts import cut_parts


class RoomWindows(Windows):
    """What windows of a plan need.

    Parameters
    ----------
    structure
        The network problem.
    rooms
        The rooms.
    check
        Called often while models are built; may raise an error to end that.
    """

    repairs = True

    def __init__(
        self,
        structure: Structure,
        rooms: RoomIndex,
        check: Optional[Callable[[], None]] = None,
    ) -> None:
        super().__init__(structure, check)
        self.rooms = rooms

    def network(self, free: list[int], active: BoolArray) -> CpNetwork:
        """Build the model of a window, connected by ranks.

        `free` holds edges, and e + r for the placements that lie on the window's faces.
        """
        count = self.rooms.edges
        edges = [e for e in free if e < count]
        network = super().network(edges, active[:count])
        faces = {
            f for i in free if i >= count for f in self.rooms.problem.placements.faces[i - count]
        }
        add_rooms(network, self.rooms, sorted(faces), active[count:])
        # the least window would be a stub at each room: to forbid such islands one after the other
        # takes more rounds than a window has
        add_ranks(network)
        return network

    def cut(self, network: CpNetwork, active: BoolArray) -> bool:
        """Forbid islands, and blocks with several parts of the route."""
        islands = super().cut(network, active)
        return cut_parts(network, self.rooms, active) or islands


class RoomSearch(WindowSearch):
    """An anytime search whose windows are sets of neighbouring rooms.

    A design is an array of e + r truth values: edges first, then placements.
    """

    windows: RoomWindows

    def __post_init__(self) -> None:
        """Begin with windows of about a dozen rooms; their size is counted in faces."""
        super().__post_init__()
        rooms = self.windows.rooms
        self._centres = np.flatnonzero(rooms.problem.floor).tolist()
        self._order = []
        self._next_to = [
            [g for e in sides for g in rooms.edge_faces[e] if g != f]
            for f, sides in enumerate(rooms.face_sides)
        ]

    def _window(self, exact: bool) -> tuple[bool, list[int]]:
        """Return the edges and placements of some rooms around a random face."""
        if not self._order:
            self._order = self._rng.permutation(len(self._centres)).tolist()
        centre = self._centres[self._order.pop()]
        faces = self.faces_around(centre, 4 * self._size[False, exact] + 8)
        return False, self.free(faces)

    def faces_around(self, centre: int, count: int) -> list[int]:
        """Return the faces of whole rooms around a face, about `count` of them."""
        rooms = self.windows.rooms
        at = rooms.room_at(rooms.rooms_of(self.active))
        found: set[int] = set()
        seen, queue = {centre}, deque([centre])
        while queue and len(found) < count:
            face = queue.popleft()
            if at[face] >= 0:
                found.update(rooms.problem.placements.faces[at[face]])
            for other in self._next_to[face]:
                if other not in seen:
                    seen.add(other)
                    queue.append(other)
        return sorted(found)

    def free(self, faces: Sequence[int]) -> list[int]:
        """Return what is decided anew with some faces: edges at them, placements on them."""
        rooms, usable = self.windows.rooms, self.windows.index.usable
        inside = set(faces)
        edges = {e for f in faces for e in rooms.face_sides[f] if usable[e]}
        if rooms.problem.kind == "level":
            # the border of a block that stays is no way
            edges = {e for e in edges if inside.issuperset(rooms.edge_faces[e])}
        return [*sorted(edges), *(rooms.edges + r for r in rooms.within(faces))]
