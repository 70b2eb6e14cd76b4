"""How a run proceeds with a mixed-integer solver alone."""

from __future__ import annotations

import time

import numpy as np

from ...mip.solvers import solve_mip
from ...network.incumbent import Incumbent
from ...network.mip.model import flow_model
from ...network.structure import Structure
from ..program.index import RoomIndex
from ..program.linear import LinearRooms
from ..program.parts import PartCut, part_cuts
from .windows import RoomSearch, RoomWindows

#: Seconds for one window, and faces in one.
WINDOW_SECONDS, FACES = 5.0, (16, 24, 36)


def solve_by_mip(
    run: Incumbent, index: Structure, rooms: RoomIndex, seed: int, solver: str
) -> bool:
    """Run a mixed-integer solver on the whole plan, and on windows of it beside that.

    Returns
    -------
    bool
        False if there is no valid plan.
    """
    status = ["unknown"]
    cuts: list[PartCut] = []
    best = [-1.0]

    def whole() -> None:
        while attempt():
            pass
        # what breaks a rule that no row says is no proof
        run.proven |= status[0] == "optimal" and run.value <= best[0] * (1 + 1e-6) + 1e-6
        if status[0] in ("optimal", "infeasible"):
            run.finished.set()

    def attempt() -> bool:
        """Solve the whole plan; return whether its optimum is forbidden from now on."""
        further = LinearRooms(rooms, cuts=cuts)
        model = flow_model(index, cuts=False, further=further.add, check=run.wanted_beside())

        def take(values: dict[str, float]) -> None:
            run.take(further.design(model, values))

        result = solve_mip(
            model.linear,
            time_limit=run.deadline.left,
            solver=solver,
            on_incumbent=take,
            on_bound=run.raise_bound,
            cancelled=lambda: run.finished.is_set() or run.deadline.passed(),
        )
        run.raise_bound(result.bound)
        status[0] = result.status
        if result.values is None:
            return False
        take(result.values)
        best[0] = max(result.bound, 0.0)
        design = further.design(model, result.values)
        found = []
        if rooms.problem.kind == "level":
            found = list(part_cuts(rooms, design, rooms.rooms_of(design)))
        cuts.extend(found)
        return bool(found) and result.status == "optimal"

    with run.beside(whole) as companion:
        while run.best is None and companion.alive and not run.enough():
            time.sleep(0.05)
        if run.best is not None:
            _improve(run, index, rooms, seed, solver)
        while companion.alive and not run.enough():
            time.sleep(0.05)
    return status[0] != "infeasible"


def _improve(run: Incumbent, index: Structure, rooms: RoomIndex, seed: int, solver: str) -> None:
    """Solve windows of the best plan until the run is to stop."""
    rng = np.random.default_rng(seed)
    windows = RoomWindows(index, rooms, run.wanted())
    floor = np.flatnonzero(rooms.problem.floor).tolist()
    size = idle = 0
    while run.best is not None and not run.enough():
        best = run.best
        search = RoomSearch(windows, run.evaluator, best, seed=seed)
        faces = search.faces_around(floor[int(rng.integers(len(floor)))], FACES[size])
        free = set(search.free(faces))
        edges = {e: bool(best[e]) for e in index.edges if e not in free}
        count = rooms.edges
        kept = {r: bool(best[count + r]) for r in range(len(best) - count) if count + r not in free}
        further = LinearRooms(rooms, kept)
        model = flow_model(index, cuts=False, fixed=edges, further=further.add, check=run.wanted())
        result = solve_mip(
            model.linear,
            time_limit=min(WINDOW_SECONDS, run.deadline.left),
            solver=solver,
            cancelled=run.enough,
        )
        better = result.values is not None and run.take(further.design(model, result.values))
        idle = 0 if better else idle + 1
        if result.status != "optimal" and not better:
            size = max(0, size - 1)
        elif idle > len(floor) / FACES[size]:
            size, idle = min(len(FACES) - 1, size + 1), 0
