"""Buildings are placed by programs over parts of a zone, each better than the plan before."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...progress import Deadline, Progress, SearchState, Silent
from ..rules import LayoutRules
from ..types import BuildingType, Placements
from ..zone import ControlLine, Zone
from .bound import lower_bound
from .candidates import Raster
from .program import Effort
from .search import Search
from .windows import LARGEST, Windows

#: Seconds, nodes and columns of programs of the whole zone and of windows.
WHOLE, PART = (2.0, 60, 1000), (0.8, 30, 500)
#: The whole zone is planned anew every so many rounds.
EVERY = 3


def place_optimised(
    zone: Zone,
    types: Sequence[BuildingType],
    rules: LayoutRules,
    lines: Sequence[ControlLine],
    start: Placements,
    progress: Progress | None = None,
) -> Placements:
    """Place buildings by 0-1 programs, beginning with a plan (RZ section 3.1).

    Columns are places of groups on control lines, cliques of them exclude each other (too close,
    in the shade), and the objective is a sum over columns but for the remainder S, which two more
    variables hold. First the whole zone is planned on a coarse raster, then windows of it on finer
    ones. The linear relaxation tells whether a window can be better at all, and which columns may
    belong to something better; a solver chooses among these. Paths are planned for what it
    chooses, and only what is better with these is kept.

    Parameters
    ----------
    zone, types, rules, lines
        What is asked and where buildings may stand. `rules.time_limit` ends the search, or, where
        `rules.iterations` is set, that number of rounds does, whatever time they take: then the
        same seed gives the same plan.
    start
        A valid plan, such as the staged one; the result is never worse under `score`. Groups
        that are too long and shares of types that are off already may stay as they are.
    progress
        Told of better plans and of a lower bound, asked for cancellation; a cancelled run returns
        the best plan so far.

    Returns
    -------
    Placements
        Buildings with a way out, by patches and lines.
    """
    listener = progress if progress is not None else Silent()
    seconds = rules.time_limit if rules.iterations is None else math.inf
    deadline = Deadline(seconds, listener)
    listener.stage("Placing buildings", 0.0)
    search = Search(zone, types, rules, lines, start, deadline)
    windows = Windows(search.maker, rules.step_m)
    if not len(windows.lines):
        return start
    bound = min(lower_bound(zone, types, rules, lines, search.maker), search.value)
    listener.search(SearchState(search.value, bound, deadline.elapsed))
    rng = np.random.default_rng(rules.seed)
    rounds = 0
    while not deadline.passed() and (rules.iterations is None or rounds < rules.iterations):
        better = _round(search, windows, rng, rounds)
        rounds += 1
        done = deadline.elapsed / seconds if rules.iterations is None else rounds / rules.iterations
        listener.stage("Placing buildings", min(1.0, done))
        if better:
            listener.search(SearchState(search.value, bound, deadline.elapsed))
    return search.placed()


def _round(search: Search, windows: Windows, rng: np.random.Generator, number: int) -> bool:
    """Plan one part of the zone anew; tell whether the plan became better."""
    used = np.unique(search.now.line)
    seconds, nodes, most = PART
    if number == 0:
        # a quick look, so that there is something even if time is short
        lines, step = windows.whole(rng, used, LARGEST / 4)
    elif number % EVERY == 1:
        lines, step = windows.whole(rng, used, LARGEST)
        seconds, nodes, most = WHOLE
    else:
        lines, step = windows.choose(rng, used)
    left = search.deadline.left
    effort = Effort(min(seconds, left)) if math.isfinite(left) else Effort(left, nodes)
    return search.plan_anew(lines, Raster(step, float(rng.uniform(0, step))), effort, most)
