"""The staged heuristic of RZ Table 1: the baseline that the program has to beat.

Beyond the paper: where a building would make its group too long the walk goes on with a gap, which
is where the tail of the group would be moved to; a walk for a type goes on where its last one
ended; and where lines mirror each other, so do buildings wherever both have room.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...progress import Deadline, Progress, SearchState, Silent
from ..rules import LayoutRules
from ..shape import facing_vectors
from ..types import RESIDENCE, BuildingType, Floats, Ints, Placements
from ..zone import ControlLine, Zone
from .board import Board
from .groups import groups_of
from .queue import building_queue, one_a_patch
from .score import TO_THE_SUN, score

#: Moves that gain less are none.
LEAST = 1e-9
#: What mirrors each other lies equally far along its line, by this, metres.
SAME = 0.01
#: Most generations (G of RZ Table 1), and most times that what has no place is tried again.
GENERATIONS, AGAIN = 12, 3
#: Buildings are strewn this far off their places at most, metres, and tried so often.
STREWN_M, TRIES = 4.0, 4


def place_staged(
    zone: Zone,
    types: Sequence[BuildingType],
    rules: LayoutRules,
    lines: Sequence[ControlLine],
    progress: Progress | None = None,
    *,
    strewn: bool = False,
) -> Placements:
    """Place buildings one by one along control lines, then move them (RZ Table 1).

    Parameters
    ----------
    zone, types, rules, lines
        What is asked, and where buildings may stand. With `rules.iterations`, the number of
        generations, no clock decides.
    progress
        Told of the objective as it falls, and asked for cancellation; what stands by then is
        returned.
    strewn
        Turn and move residences that stand alone a little at random (step 7 of RZ Table 1), by
        `rules.seed`; else no choice is random and all stay parallel.

    Returns
    -------
    Placements
        Valid by `checks.fits`, with a way out for each building.
    """
    listener = progress if progress is not None else Silent()
    search = _Staged(Board(zone, types, rules, lines), listener)
    for at in range(AGAIN):
        before = len(search.board.placed)
        listener.stage("Placing buildings" if at == 0 else "Placing more buildings", at / AGAIN)
        search.place()
        if len(search.board.placed) == before or search.over():
            break
        listener.stage("Moving buildings together", (at + 0.7) / AGAIN)
        search.descend()
        if search.over():
            break
    if strewn:
        search.strew()
    return search.board.placed


class _Staged:
    """A board, the walk along its lines, and the time that is left."""

    def __init__(self, board: Board, progress: Progress) -> None:
        self.board, self.progress = board, progress
        rules = board.rules
        limit = rules.time_limit if rules.iterations is None else 1e9
        self.deadline = Deadline(limit, progress)
        # the first rows of all patches before the second ones
        leaves = [at for at, line in enumerate(board.lines) if line.leaf]
        self._lines = sorted(leaves, key=lambda at: (board.lines[at].order, at))

    def over(self) -> bool:
        """Tell whether time is up or the planner has cancelled."""
        return self.deadline.passed()

    def value(self) -> float:
        """Return the objective of what stands, ways as the crow flies."""
        board = self.board
        return score(board.zone, board.types, board.rules, board.placed, None).total

    def tell(self) -> None:
        """Tell how good what stands is."""
        self.progress.search(SearchState(self.value(), None, self.deadline.elapsed))

    def place(self) -> None:
        """Place what is not built yet (steps 3, 4 and 6 of RZ Table 1)."""
        board = self.board
        walked: dict[tuple[int, int], float] = {}
        stand = np.bincount(board.placed.type, minlength=len(board.types))
        full: set[int] = set()
        for kind in building_queue(board.zone, board.types, board.rules):
            if self.over():
                break
            if stand[kind] > 0:
                stand[kind] -= 1
            elif kind not in full:
                found = self._find(kind, walked) if board.room_for(kind) else 0
                if found:
                    stand[kind] += found - 1
                else:
                    full.add(kind)
        self.tell()

    def _find(self, kind: int, walked: dict[tuple[int, int], float]) -> int:
        """Walk the lines until a building of a type fits; return how many were put down."""
        board = self.board
        served = self._served() if one_a_patch(board.types[kind]) else set()
        length = board.types[kind].length_m
        for line in self._lines:
            own = board.lines[line]
            if own.use != board.types[kind].use or own.patch in served:
                continue
            # where façades lie along the line its end is a wall, else only centres are on it
            room = min(length / 2 if own.along else 0.0, own.length / 2)
            start = walked.get((kind, line), room)
            steps = int(np.floor((own.length - room - start + 1e-9) / board.rules.step_m)) + 1
            t = start + board.rules.step_m * np.arange(max(0, steps))
            for place in t[board.possible(board.at(kind, line, t))]:
                if self.over():
                    return 0
                one = board.at(kind, line, np.array([place]))
                if board.fits(one):
                    board.put(one)
                    walked[kind, line] = float(place) + length
                    return 1 + self._mirror(kind, own.mirror, float(place))
            walked[kind, line] = own.length
        return 0

    def _mirror(self, kind: int, line: int, t: float) -> bool:
        """Put a building at the place that mirrors another one's, if it has room there."""
        board = self.board
        if line < 0 or t > board.lines[line].length or not board.room_for(kind):
            return False
        one = board.at(kind, line, np.array([t]))
        if not board.fits(one):
            return False
        board.put(one)
        return True

    def _twin(self, at: int) -> int:
        """Return the building that mirrors one, -1 for none."""
        board, placed = self.board, self.board.placed
        own = board.lines[placed.line[at]]
        if own.mirror < 0:
            return -1
        t = float(np.hypot(*(placed.xy[at] - own.start)))
        other = np.flatnonzero((placed.line == own.mirror) & (placed.type == placed.type[at]))
        away = np.hypot(*(placed.xy[other] - board.lines[own.mirror].start).T)
        same = other[np.abs(away - t) < SAME]
        return int(same[0]) if len(same) else -1

    def _served(self) -> set[int]:
        """Return the patches that have a facility of which no number was given."""
        placed = self.board.placed
        free = np.array([one_a_patch(kind) for kind in self.board.types])[placed.type]
        return set(placed.patch[free].tolist())

    def descend(self) -> None:
        """Move buildings that stand alone to border upon a neighbour (step 5 of RZ Table 1)."""
        most = GENERATIONS if self.board.rules.iterations is None else self.board.rules.iterations
        for _ in range(most):
            # the last ones first: they stand furthest along their lines
            places = self.board.placed.xy[self._alone()][::-1]
            moved = sum(self._join(xy) for xy in places)
            if not moved or self.over():
                return
            self.tell()

    def _alone(self) -> Ints:
        """Return the buildings that border upon no other."""
        group = groups_of(self.board.types, self.board.placed)
        return np.flatnonzero(np.bincount(group, minlength=1)[group] == 1)

    def _join(self, xy: Floats) -> bool:
        """Move a building along its line to its left or right neighbour, where that is better.

        What mirrors it moves with it.
        """
        board = self.board
        found = np.flatnonzero((board.placed.xy == xy).all(axis=1))
        if not len(found) or self.over():  # it has moved with what it mirrors
            return False
        at = int(found[0])
        kind, line = int(board.placed.type[at]), int(board.placed.line[at])
        own = board.lines[line]
        if not own.along or own.spacing_m > 0:
            return False
        places, twin, before = self._beside(at), self._twin(at), self.value()
        lifted = [board.lift(i) for i in sorted({at, twin} - {-1}, reverse=True)]
        for place in places:
            one = board.at(kind, line, np.array([place]))
            if not 0 <= place <= own.length or not board.fits(one):
                continue
            board.put(one)
            whole = twin < 0 or self._mirror(kind, own.mirror, place)
            if whole and self.value() < before - LEAST:
                return True
            for _ in range(len(lifted) if whole else 1):
                board.lift(len(board.placed) - 1)
        for one in lifted:
            board.put(one)
        return False

    def _beside(self, at: int) -> list[float]:
        """Return where a building would border upon its neighbours on its line, nearest first."""
        placed, own = self.board.placed, self.board.lines[self.board.placed.line[at]]
        t = (placed.xy - own.start) @ (np.asarray(own.end) - own.start) / own.length
        length = np.array([kind.length_m for kind in self.board.types])[placed.type]
        places = []
        for side in (-1.0, 1.0):
            there = np.flatnonzero((placed.line == placed.line[at]) & (side * (t - t[at]) > 0))
            if len(there):
                mate = there[np.argmin(np.abs(t[there] - t[at]))]
                places.append(float(t[mate] - side * (length[at] + length[mate]) / 2))
        return sorted(places, key=lambda place: abs(place - float(t[at])))

    def strew(self) -> None:
        """Turn and move residences that stand alone (step 7 of RZ Table 1)."""
        board, rng = self.board, np.random.default_rng(self.board.rules.seed)
        for at in reversed(self._alone()):
            if self.over() or board.types[board.placed.type[at]].use != RESIDENCE:
                continue
            one = board.lift(int(at))
            for _ in range(TRIES):
                turn, off = rng.uniform(-TO_THE_SUN, TO_THE_SUN), rng.uniform(0.0, STREWN_M)
                shift = off * facing_vectors(rng.uniform(0.0, 360.0, 1))
                facing = (one.facing + turn) % 360.0
                moved = Placements(one.type, one.xy + shift, facing, one.patch, one.line)
                if board.fits(moved):
                    one = moved
                    break
            board.put(one)
