"""Large-neighbourhood search: improve a design window by window, several windows at once."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Optional

import numpy as np

from ..cp.sat import CpOptions
from ..evaluate import Evaluator
from ..incumbent import slight
from ..problem import BoolArray
from .windows import Distances, Windows

#: Least radius of a window.
SMALLEST = 3
#: Share of windows that follow a mesh line.
STRIPS = 0.3
#: How far strips reach to either side of their line, in edges.
STRIP_WIDTH = 2
#: Draws of a window until one is apart from those that are being solved.
DRAWS = 6
#: Distances that make up less than this part of the objective are left out of all windows.
FAINT = 0.01
#: Share of windows in which a vertex costs its least distance in the mesh instead of its own: they
#: need no labels and are solved several times as fast.
LEAST = 0.8


@dataclass(frozen=True, eq=False)
class Job:
    """A window to be solved.

    Attributes
    ----------
    number
        Position in the order of all windows of the search.
    free
        Edges of the window.
    base
        Shape (e,). The design that the window is cut from.
    options
        How CP-SAT works on it.
    distances
        How distances count; see `windows.solve_window`.
    strip, size
        Whether the window follows a mesh line; its radius or how far it reaches along the line.
    """

    number: int
    free: list[int]
    base: BoolArray
    options: CpOptions
    distances: Distances
    strip: bool
    size: int

    @property
    def kind(self) -> tuple[bool, bool]:
        """What its size is judged by."""
        return self.strip, self.distances == "exact"

    @property
    def options_effort(self) -> float:
        """Limit of the effort."""
        return self.options.effort or 1.0


@dataclass(eq=False)
class WindowSearch:
    """An anytime search from a valid design.

    Windows are balls of edges around random vertices and strips along mesh lines; they grow
    while nothing improves and shrink when they take too long. Results as good as the present
    design are taken, too, so that the search moves along plateaus. `draw` and `apply` are called
    in a fixed order, so that the same seed makes the same steps, however many threads solve the
    windows.

    Attributes
    ----------
    windows
        The problem.
    evaluator
        Judges designs.
    active
        Shape (e,). Present design.
    seed
        Seed of all choices.
    radius, largest
        First and largest radius of windows, in edges.
    effort, most_effort
        First and greatest limit of one window, in CP-SAT's deterministic units (about seconds).
    """

    windows: Windows
    evaluator: Evaluator
    active: BoolArray
    seed: int = 1
    radius: int = 4
    largest: int = 12
    effort: float = 0.03
    most_effort: float = 0.5
    value: float = field(init=False)
    steps: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        """Prepare the random choices."""
        self._rng = np.random.default_rng(self.seed)
        self._centres = [v for v, mine in enumerate(self.windows.index.incident) if mine]
        self._order: list[int] = []
        self._failures = self._idle = 0
        kinds = [(strip, exact) for strip in (False, True) for exact in (False, True)]
        self._size = {kind: self.radius * (1 + kind[0]) for kind in kinds}
        self._linear = 0 if self.windows.index.with_distance else 1
        found = self.evaluator.evaluate(self.active)
        self.value = found.objective
        self._faint = 0 < found.distance_sum < FAINT * found.objective
        self._flying: list[set[int]] = []

    def draw(self, time_limit: float) -> Job:
        """Return the next window, apart from those that are drawn and not yet applied."""
        distances = self._distances()
        strip, free = False, [0]
        for _ in range(DRAWS):
            strip, free = self._window(distances == "exact")
            mine = set(free)
            if free and not any(mine & other for other in self._flying):
                break
        self._flying.append(set(free))
        self.steps += 1
        options = CpOptions(
            time_limit=time_limit,
            effort=self.effort,
            seed=int(self._rng.integers(2**31)),
            linearization=self._linear,
            probing=0,
            symmetry=0,
        )
        size = self._size[strip, distances == "exact"]
        return Job(self.steps, free, self.active, options, distances, strip, size)

    def _distances(self) -> Distances:
        """Return how distances count in the next window."""
        if self._faint or not self.windows.index.with_distance:
            return "none"
        return "least" if self._rng.random() < LEAST else "exact"

    def _window(self, exact: bool) -> tuple[bool, list[int]]:
        """Return the edges of a random window, and whether it is a strip."""
        if not self._order:
            # every vertex is a centre once before any is one again
            self._order = self._rng.permutation(len(self._centres)).tolist()
        centre = self._centres[self._order.pop()]
        if self._rng.random() < STRIPS:
            mine = self.windows.index.incident[centre]
            edge = mine[int(self._rng.integers(len(mine)))]
            return True, self.windows.along(edge, STRIP_WIDTH, self._size[True, exact])
        return False, self.windows.around(centre, self._size[False, exact])

    def apply(self, job: Job, found: Optional[BoolArray], effort: float) -> bool:
        """Take the result of the oldest drawn window; return whether the design is better."""
        self._flying.pop(0)
        better = False
        if found is not None:
            merged = self.active.copy()
            merged[job.free] = found[job.free]
            value = self.evaluator.objective(merged)
            better = value < self.value - slight(value)
            if value <= self.value + slight(value):
                self.active, self.value = merged, value
        self._adapt(job, better, effort)
        return better

    def _adapt(self, job: Job, better: bool, effort: float) -> None:
        """Let the windows grow or shrink, and give them more effort once that does not help."""
        self._failures = 0 if better else self._failures + 1
        self._idle = 0 if better else self._idle + 1
        size, kind = self._size, job.kind
        if job.size != size[kind]:
            return
        if effort > 0.9 * job.options_effort:
            size[kind] = max(SMALLEST, size[kind] - 1 - 2 * job.strip)
            return
        # about as many windows as tile half of the mesh
        patience = max(3.0, len(self._centres) / (4.0 * size[False, kind[1]] ** 2))
        if self._failures <= patience:
            return
        self._failures = 0
        if effort < 0.4 * job.options_effort:
            size[False, kind[1]] = min(size[False, kind[1]] + 1, self.largest)
            size[True, kind[1]] = min(size[True, kind[1]] + 2, 4 * self.largest)
        else:
            self.effort = min(2 * self.effort, self.most_effort)

    @property
    def exhausted(self) -> bool:
        """Whether windows have failed for so long that another search may do better."""
        return self._idle > max(30.0, len(self._centres) / 8)
