"""A whole city designed: every sub-region a task of its own, wherever it is run."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from .. import tasks as tasks_room
from ..errors import CancelledError, InputError
from ..network.specification import Specification
from ..progress import Progress, Share, Silent
from .agreement import Agreement, settle
from .region import RegionTask, design_region, task_of
from .store import CityFile
from .types import DESIGN, City

#: Designs one sub-region; a function of a module that workers can import.
Design = Callable[[RegionTask, Progress], str]
#: States of a sub-region after a run.
DONE, FAILED, LEFT, WAITING = "done", "failed", "left", "not reached"


@dataclass(frozen=True)
class Outcome:
    """What came of a sub-region.

    Attributes
    ----------
    state
        "done", "failed", "left" (nothing was to be designed), or "not reached".
    reason
        Why it failed or was left, empty otherwise.
    key
        Of its task, empty where it is left.
    result
        What `region.design_region` gave, or None.
    attempts
        How often it was tried in this run; 0 where it was taken from the file.
    """

    state: str
    reason: str = ""
    key: str = ""
    result: Mapping[str, Any] | None = None
    attempts: int = 0


@dataclass(frozen=True, eq=False)
class CityPlan:
    """A designed city.

    Attributes
    ----------
    city
        How it is divided.
    outcomes
        Number of a sub-region -> what came of it; all of them.
    specification
        What was asked.
    seconds
        Wall time of the run.
    cancelled
        Whether it was cancelled; then some are not reached.
    """

    city: City
    outcomes: Mapping[int, Outcome]
    specification: Specification
    seconds: float
    cancelled: bool = False

    @cached_property
    def agreement(self) -> Agreement:
        """How the streets of neighbouring sub-regions meet."""
        return settle(self.city, {
            number: outcome.result["streets"]
            for number, outcome in self.outcomes.items()
            if outcome.result is not None
        })  # fmt: skip

    def count(self, state: str) -> int:
        """Return how many sub-regions have a state."""
        return sum(outcome.state == state for outcome in self.outcomes.values())

    @property
    def resumed(self) -> int:
        """How many sub-regions were taken from the file."""
        return sum(o.state == DONE and not o.attempts for o in self.outcomes.values())

    @property
    def computing(self) -> float:
        """Seconds of all workers together, also of what was taken from the file."""
        return float(sum(o.result["seconds"] for o in self.outcomes.values() if o.result))

    @property
    def digest(self) -> str:
        """A hash of all results but their seconds: the same for the same city, wherever run."""
        told = {
            str(number): [o.state, o.key, {k: v for k, v in o.result.items() if k != "seconds"}]
            for number, o in sorted(self.outcomes.items())
            if o.result is not None
        }
        return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:32]

    @property
    def numbers(self) -> dict[str, float]:
        """Figures of the whole run."""
        done = [o.result["numbers"] for o in self.outcomes.values() if o.result is not None]
        length = sum(n["total_length"] for n in done)
        collectors = sum(road.line.length for road in self.city.roads if road.new)
        objective, bound = sum(n["objective"] for n in done), sum(n["bound"] for n in done)
        way = sum(n["mean_distance"] * n["total_length"] for n in done)
        agreed = self.agreement
        return {
            "SUB_REGIONS": float(len(self.outcomes)),
            "DONE": float(self.count(DONE)),
            "FAILED": float(self.count(FAILED)),
            "RESUMED": float(self.resumed),
            "TOTAL_LENGTH": length + float(collectors),
            "MEAN_DISTANCE": way / length if length else math.nan,
            "OBJECTIVE": objective,
            "BOUND": bound,
            "ACHIEVED_GAP": max(0.0, (objective - bound) / objective) if objective > 0 else 0.0,
            "AGREEMENT": 100.0 * agreed.share,
            "CROSSINGS": float(agreed.count("crossing")),
            "STAGGERED": float(agreed.count("staggered")),
            "COMPUTING": self.computing,
            "SECONDS": self.seconds,
        }


def design_city(
    city: City,
    specification: Specification | None = None,
    *,
    executor: tasks_room.Executor | None = None,
    store: CityFile | None = None,
    progress: Progress | None = None,
    design: Design = design_region,
) -> CityPlan:
    """Design every sub-region of a city, independently of the others.

    Parameters
    ----------
    city
        A divided city.
    specification
        What the streets should do; None for the usual. Searches end by their work, so that the
        result is the same on one worker, on several and on a cluster.
    executor
        Where to run, see `tasks`; None for one after the other in this process.
    store
        File that keeps finished sub-regions; what it has already is not computed again.
    progress
        Told of every finished sub-region; asked for cancellation.
    design
        Designs one sub-region; a function of a module that workers can import.

    Returns
    -------
    CityPlan
        Every sub-region that failed was tried once more, with looser rules where these were why;
        those that failed again have no streets and say why. A cancelled run keeps what is
        finished.

    Raises
    ------
    InputError
        If no sub-region can be or was designed, or the file cannot be used.
    CancelledError
        If the run was cancelled before any sub-region was finished.
    """
    progress, begun = progress or Silent(), time.monotonic()
    spec = specification or Specification()
    tasks = {r.number: task_of(city, r, spec) for r in city.to_design}
    if not tasks:
        raise InputError(
            "No sub-region can be designed.",
            "The layer of problems says why; allow smaller sub-regions, or other road classes.",
            layer=city.name,
        )
    keys = {number: task.key for number, task in tasks.items()}
    outcomes: dict[int, Outcome] = {
        r.number: Outcome(LEFT, r.reason) for r in city.regions if r.state != DESIGN
    }
    known: Mapping[str, str] = {}
    if store is not None:
        store.open()
        known = store.finished()
    for number, key in keys.items():
        if key in known:
            outcomes[number] = Outcome(DONE, key=key, result=json.loads(known[key]))
    # the largest first, so that no worker is left with one at the end
    left = sorted(
        (n for n in tasks if n not in outcomes), key=lambda n: (-tasks[n].site.polygon.area, n)
    )

    def take(number: int, outcome: tasks_room.Outcome) -> None:
        """Keep a finished sub-region at once, whatever happens next."""
        if outcome.done and store is not None:
            store.add(keys[number], outcome.value)
        outcomes[number] = _outcome(outcome, keys[number])

    _run(left, tasks, design, executor, Share(progress, 0.0, 0.95), take)
    # what the library refuses with a sentence it refuses again, unless less is asked
    again = [n for n in left if outcomes[n].state == FAILED and outcomes[n].attempts < 2]
    if again and not progress.cancelled():
        looser = {n: dataclasses.replace(tasks[n], looser=True) for n in again}
        first = {n: outcomes[n] for n in again}
        _run(again, looser, design, executor, Share(progress, 0.95, 1.0), take)
        for n in again:
            outcomes[n] = dataclasses.replace(outcomes[n], attempts=2)
            if outcomes[n].state == WAITING:
                outcomes[n] = first[n]
    cancelled = any(o.state == WAITING for o in outcomes.values())
    _check_some(city, outcomes, cancelled)
    in_order = {r.number: outcomes[r.number] for r in city.regions}
    return CityPlan(city, in_order, spec, time.monotonic() - begun, cancelled)


def _check_some(city: City, outcomes: Mapping[int, Outcome], cancelled: bool) -> None:
    """Raise an error where nothing was designed: that is no perfect city."""
    if any(o.state == DONE for o in outcomes.values()):
        return
    if cancelled:
        raise CancelledError("Cancelled before any sub-region was finished.")
    failed = {number: o.reason for number, o in outcomes.items() if o.state == FAILED}
    number = min(failed)
    raise InputError(
        f"None of the {len(failed)} sub-regions could be designed. Sub-region {number}: "
        f"{failed[number]}",
        "Ask for less, such as a wider tolerance or another kind of neighbourhood.",
        layer=city.name,
    )


def _run(
    numbers: Sequence[int],
    tasks: Mapping[int, RegionTask],
    design: Design,
    executor: tasks_room.Executor | None,
    progress: Progress,
    take: Callable[[int, tasks_room.Outcome], None],
) -> None:
    """Design sub-regions wherever that is done, and hand every outcome over at once."""
    found = tasks_room.run_tasks(
        design,
        [tasks[n] for n in numbers],
        executor,
        progress,
        labels=[f"Sub-region {n}" for n in numbers],
        settled=lambda at, outcome: take(numbers[at], outcome),
    )
    for number, outcome in zip(numbers, found):
        # what the run did not reach was never settled
        if not outcome.done and outcome.state != "failed":
            take(number, outcome)


def _outcome(found: tasks_room.Outcome, key: str) -> Outcome:
    """Return what became of the task of a sub-region."""
    if found.done:
        return Outcome(DONE, "", key, json.loads(found.value), found.attempts)
    state = FAILED if found.state == "failed" else WAITING
    return Outcome(state, found.reason, key, None, found.attempts)
