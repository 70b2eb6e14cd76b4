"""How a run proceeds with a mixed-integer solver alone."""

from __future__ import annotations

import time

import numpy as np

from ...mip.solvers import solve_mip
from ..bounds.by_mip import mip_bound
from ..incumbent import Incumbent
from ..mip.model import flow_model
from ..structure import Structure
from .chords import LONGEST, chord_start
from .windows import Windows

#: Radii of windows, in edges, and how the search goes from one to the next.
RADII = (4, 5, 6, 8)
#: Seconds for one window.
WINDOW_SECONDS = 5.0
#: Up to this many usable edges the whole problem is solved without windows beside it.
TINY = 60


def straight_start(run: Incumbent, index: Structure) -> None:
    """Take a design of straight mesh lines if there is a valid one."""
    if any(index.root[v] and mine for v, mine in enumerate(index.incident)):
        active = chord_start(index, min(LONGEST, run.deadline.left))
        if active is not None:
            run.take(active)


def solve_by_mip(run: Incumbent, index: Structure, seed: int, solver: str) -> bool:
    """Run a mixed-integer solver on the whole problem, and on windows of it beside that.

    Returns
    -------
    bool
        False if there is no valid design.
    """
    if run.best is None:
        straight_start(run, index)
    status = ["unknown"]

    def whole() -> None:
        status[0] = mip_bound(run, index, solver)
        run.proven |= status[0] == "optimal"
        if status[0] in ("optimal", "infeasible"):
            run.finished.set()

    with run.beside(whole) as companion:
        while run.best is None and companion.alive and not run.enough():
            time.sleep(0.05)
        if run.best is not None and len(index.edges) > TINY:
            _improve(run, index, seed, solver)
        while companion.alive and not run.enough():
            time.sleep(0.05)
    return status[0] != "infeasible"


def _improve(run: Incumbent, index: Structure, seed: int, solver: str) -> None:
    """Solve windows of the best design until the run is to stop."""
    rng = np.random.default_rng(seed)
    windows = Windows(index, run.wanted())
    centres = [v for v, mine in enumerate(index.incident) if mine]
    size, failures = 0, 0
    while run.best is not None and not run.enough():
        best = run.best
        centre = centres[int(rng.integers(len(centres)))]
        free = set(windows.around(centre, RADII[size]))
        fixed = {e: bool(best[e]) for e in index.edges if e not in free}
        model = flow_model(index, fixed=fixed, check=run.wanted())
        result = solve_mip(
            model.linear,
            time_limit=min(WINDOW_SECONDS, run.deadline.left),
            solver=solver,
            cancelled=run.enough,
        )
        better = result.values is not None and run.take(model.chosen(result.values))
        failures = 0 if better else failures + 1
        if result.status != "optimal" and not better:
            size = max(0, size - 1)
        elif failures > len(centres) / (4.0 * RADII[size] ** 2) + 2:
            size, failures = min(len(RADII) - 1, size + 1), 0
