"""Large-neighbourhood search: improve a design window by window."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Optional

import numpy as np

from .cpsat import CpOptions
from .evaluate import Evaluator
from .problem import BoolArray
from .windows import Windows, solve_window


@dataclass(eq=False)
class WindowSearch:
    """An anytime search from a valid design.

    Windows are balls of edges around random vertices; they grow while nothing improves and
    shrink when they take too long. Results as good as the present one are taken, too, so that
    the search moves along plateaus.

    Attributes
    ----------
    windows
        The problem.
    evaluator
        Judges designs.
    active
        Shape (e,). Present design.
    seed
        Seed of all choices: the same seed makes the same steps.
    radius, largest
        First and largest radius of windows, in edges.
    effort
        Limit of one window, in CP-SAT's deterministic units (about seconds).
    """

    windows: Windows
    evaluator: Evaluator
    active: BoolArray
    seed: int = 1
    radius: int = 5
    largest: int = 12
    effort: float = 0.15
    value: float = field(init=False)
    steps: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        """Prepare the random choices."""
        self.value = self.evaluator.objective(self.active)
        self._rng = np.random.default_rng(self.seed)
        self._centres = [v for v, mine in enumerate(self.windows.index.incident) if mine]
        self._failures = 0

    def step(self, time_limit: float, stop: Optional[Callable[[], bool]] = None) -> bool:
        """Solve one window; return whether the design became better."""
        self.steps += 1
        centre = self._centres[int(self._rng.integers(len(self._centres)))]
        free = self.windows.around(centre, self.radius)
        if not free:
            return False
        options = CpOptions(
            time_limit=time_limit,
            effort=self.effort,
            seed=int(self._rng.integers(2**31)),
            linearization=1,
            probing=0,
            symmetry=0,
        )
        found, effort = solve_window(self.windows, free, self.active, options, stop)
        value = math.inf if found is None else self.evaluator.objective(found)
        better = value < self.value - 1e-9
        if found is not None and value <= self.value + 1e-9:
            self.active, self.value = found, value
        self._adapt(better, effort)
        return better

    def _adapt(self, better: bool, effort: float) -> None:
        """Let the windows grow or shrink."""
        self._failures = 0 if better else self._failures + 1
        if effort > 0.9 * self.effort and self.radius > 3:
            self.radius -= 1
            return
        # about as many windows as tile half of the mesh
        patience = max(3.0, len(self._centres) / (4.0 * self.radius**2))
        easy = effort < 0.4 * self.effort
        if easy and self._failures > patience and self.radius < self.largest:
            self.radius += 1
            self._failures = 0
