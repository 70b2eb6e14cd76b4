"""How good a design is known to be: its price, the proven bound, the gap between them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from .figures import Figure


@dataclass(frozen=True)
class SolverFacts:
    """What a solver said.

    Attributes
    ----------
    objective
        Price of the design.
    bound
        Proven lower bound of the price, or None.
    gap
        (objective - bound) / objective, 0 to 1, or None where it is not known.
    seconds
        Time of the run, s, or None.
    """

    objective: float
    bound: float | None
    gap: float | None
    seconds: float | None

    @property
    def proven(self) -> bool:
        """Whether no better design exists, to the last digits of the solver."""
        return self.gap is not None and self.gap < 1e-6

    @property
    def sentence(self) -> str:
        """The same in words."""
        if self.gap is None:
            return "No bound of the price is known."
        if self.proven:
            return "Proven: no design costs less under these wishes, program by program."
        return (
            f"A design that costs up to {100 * self.gap:.1f} % less may exist; none costs less "
            "than that."
        )


def solver_facts(figures: Iterable[Figure]) -> SolverFacts | None:
    """Return what a solver said, from the figures of a run, or None where none was at work.

    The gap is that of the two numbers, not the one that was told, which may be a share or in
    percent; only where there is no bound the told one counts.
    """
    values = {figure.key: figure.value for figure in figures}
    objective, bound = values.get("OBJECTIVE"), values.get("BOUND")
    if objective is None or not {"BOUND", "ACHIEVED_GAP", "GAP"} & set(values):
        return None
    gap: float | None = values.get("ACHIEVED_GAP")
    if gap is None and values.get("GAP") is not None:
        gap = (values["GAP"] or 0.0) / 100.0
    if bound is not None and objective > 0:
        gap = max(0.0, (objective - bound) / objective)
    elif bound is not None:
        gap = 0.0 if bound >= objective else None
    return SolverFacts(objective, bound, gap, values.get("SECONDS"))
