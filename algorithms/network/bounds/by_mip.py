"""A bound by a mixed-integer solver on the whole problem."""

from __future__ import annotations

from ...mip.solvers import solve_mip
from ..incumbent import Incumbent
from ..mip.model import flow_model
from ..structure import Structure
from .relaxation import Relaxation, raise_by_rounds

#: Above this many usable edges the linear relaxation gives a first bound.
LARGE = 200


def mip_bound(run: Incumbent, index: Structure, solver: str = "highs") -> str:
    """Solve the whole problem by a mixed-integer solver until the run is finished.

    Parameters
    ----------
    run
        Told bounds and designs.
    index
        The problem.
    solver
        Name of the solver.

    Returns
    -------
    str
        Status of the solver.
    """

    def enough() -> bool:
        return run.finished.is_set() or run.deadline.passed()

    if solver == "highs" and len(index.edges) > LARGE:
        relaxation = Relaxation(index, run.wanted_beside())
        if not raise_by_rounds(relaxation, run.raise_bound, enough):
            return "infeasible"
    model = flow_model(index, check=run.wanted_beside())

    def take(values: dict[str, float]) -> None:
        run.take(model.chosen(values))

    result = solve_mip(
        model.linear,
        time_limit=run.deadline.left,
        solver=solver,
        on_incumbent=take,
        on_bound=run.raise_bound,
        cancelled=enough,
    )
    if result.values is not None:
        take(result.values)
    run.raise_bound(result.bound)
    return result.status
