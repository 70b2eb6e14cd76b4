"""A first plan under a tight limit of length: search without the limit until it is kept.

The solver alone finds plans of any length soon, and short ones seldom. Windows make any plan
shorter, since length is what they minimise.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Optional

from ...network.incumbent import Incumbent
from ...network.problem import BoolArray
from ...network.requirements.budget import LengthBudget
from ...network.structure import Structure, structure
from ...progress import Deadline
from ..program.evaluate import RoomEvaluator
from ..program.index import RoomIndex

#: Share of the time that is left in which a plan should come to keep the limit.
SHARE = 0.7

#: Finds any plan for a run; false if there is none.
First = Callable[[Incumbent, Structure, RoomIndex, int], bool]
#: Improves the plan of a run until that is to stop.
Improve = Callable[[Incumbent, Structure, RoomIndex, int], None]


@dataclass(eq=False)
class _Loose(Incumbent):
    """A run without the limit that ends with the first plan of another run, which has it.

    Attributes
    ----------
    strict
        The other run.
    """

    strict: Optional[Incumbent] = None

    def take(self, active: BoolArray) -> bool:
        """Keep a design if it is valid and better, and offer it to the other run."""
        taken = super().take(active)
        if taken and self.strict is not None and self.strict.take(active):
            self.finished.set()
        return taken


def limited(rooms: RoomIndex) -> bool:
    """Tell whether a problem has a greatest length."""
    return any(_is_limit(own) for own in rooms.problem.network.requirements)


def descend(run: Incumbent, rooms: RoomIndex, seed: int, first: First, improve: Improve) -> bool:
    """Look for a plan that keeps its greatest length, for most of the time that is left.

    Parameters
    ----------
    run, rooms
        The run, which gets the plan, and its problem.
    seed
        Seed of every random choice.
    first, improve
        How a run finds a plan and makes it better.

    Returns
    -------
    bool
        False if there is no plan, however long.
    """
    network = rooms.problem.network
    rest = tuple(own for own in network.requirements if not _is_limit(own))
    free = dataclasses.replace(network, requirements=rest)
    index, loose = structure(free), RoomIndex(dataclasses.replace(rooms.problem, network=free))
    deadline = Deadline(SHARE * run.deadline.left, run.deadline.progress)
    evaluator: Any = RoomEvaluator(loose)
    search = _Loose(evaluator, deadline, strict=run)
    if not first(search, index, loose, seed):
        return False
    if run.best is None:
        improve(search, index, loose, seed)
    search.finished.set()
    return True


def _is_limit(requirement: object) -> bool:
    """Tell whether a requirement is a hard greatest length."""
    return isinstance(requirement, LengthBudget) and requirement.hard
