"""Several layouts of the same site, the best first."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt
from shapely.geometry import LineString

from ...errors import CancelledError
from ...progress import Progress, Share, Silent
from ..roadmesh import Ground
from ..rules import ParcelRules
from .layout import Layout, lay_out
from .rules import SplitRules

Floats = npt.NDArray[np.float64]
Arriving = Sequence[tuple[Floats, Floats]]


class Executor(Protocol):
    """Whatever maps a function over jobs, such as `concurrent.futures.ProcessPoolExecutor`."""

    def map(self, function: Callable[[Job], Layout], jobs: Iterable[Job], /) -> Iterable[Layout]:
        """Apply the function to every job, in order."""
        ...


@dataclass(frozen=True)
class Job:
    """One variation of one site; it can be sent to another process."""

    ground: Ground
    rules: ParcelRules
    split: SplitRules
    arriving: Arriving
    guides: Sequence[LineString]
    seed: int

    def __call__(self, progress: Progress | None = None) -> Layout:
        """Make the layout."""
        return lay_out(
            self.ground, self.rules, self.split,
            arriving=self.arriving, guides=self.guides, seed=self.seed, progress=progress,
        )  # fmt: skip


class Numbered(Share):
    """A part of the work that says which one of several like it is being done.

    Parameters
    ----------
    progress
        Told of the whole.
    begin, end
        Fractions of the whole at which the part begins and ends.
    what
        What there are several of, such as "Variation".
    k, count
        Which one it is, from 0, and how many there are; a single one is not named.
    """

    def __init__(
        self, progress: Progress, begin: float, end: float, what: str, k: int, count: int
    ) -> None:
        super().__init__(progress, begin, end)
        self._name = f"{what} {k + 1} of {count}: " if count > 1 else ""

    def stage(self, text: str, fraction: float) -> None:
        """Tell the stage with the number of the part."""
        super().stage(self._name + (text[0].lower() + text[1:] if self._name else text), fraction)


def run(job: Job) -> Layout:
    """Make the layout of a job, where it has nobody to tell."""
    return job()


def vary(
    ground: Ground,
    rules: ParcelRules,
    split: SplitRules,
    *,
    count: int = 1,
    seed: int = 0,
    arriving: Arriving = (),
    guides: Sequence[LineString] = (),
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> list[Layout]:
    """Lay a site out several times, and bring the layouts in order.

    The first takes the best street everywhere; the others choose at random by quality, with
    weights of the scores that differ from those asked for, so that they are of different kinds.

    Parameters
    ----------
    ground, rules, split
        See `lay_out`.
    count
        Number of layouts.
    seed
        Of the random choices; the first layout does not depend on it.
    arriving
        Places and directions of existing streets at the edge of the site.
    guides
        Drawn lines that a guided field follows, metres.
    executor
        Makes them side by side; without one they are made one after the other.
    progress
        Told of the work; where the caller cancels, what is there is returned.

    Returns
    -------
    list of Layout
        The best first.

    Raises
    ------
    CancelledError
        If the caller cancels before there is one.
    """
    told = progress or Silent()
    first = Job(ground, rules, split, arriving, guides, 0)
    jobs = [first, *(_changed(first, seed, k) for k in range(1, count))]
    if executor is not None:
        return ranked(executor.map(run, jobs))
    found: list[Layout] = []
    for k, job in enumerate(jobs):
        try:
            own = Numbered(told, k / count, (k + 1) / count, "Variation", k, count)
            found.append(job(own))
        except CancelledError:
            if not found:
                raise
            told.warn(f"Cancelled: {len(found)} of {count} variations were made.")
            break
    return ranked(found)


def ranked(layouts: Iterable[Layout]) -> list[Layout]:
    """Bring layouts in the order of their score, those that are alike left out.

    Parameters
    ----------
    layouts
        Of the same site.
    """
    found: list[Layout] = []
    seen: set[tuple[float, ...]] = set()
    for layout in sorted(layouts, key=lambda own: (own.score.value, own.seed)):
        key = (round(layout.score.value, 6), layout.score.parcels, len(layout.mesh.edges))
        if key not in seen:
            seen.add(key)
            found.append(layout)
    return found


def _changed(job: Job, seed: int, k: int) -> Job:
    """Describe variation k of a job."""
    rng = np.random.default_rng([seed, k])
    own = job.split.weights
    factors = rng.choice([0.3, 1.0, 1.0, 3.0], size=4)
    weights = replace(
        own,
        div=own.div * factors[0],
        db=own.db * factors[1],
        ds=own.ds * factors[2],
        ct=own.ct * factors[3],
    )
    split = replace(job.split, weights=weights)
    return replace(job, split=split, seed=int(rng.integers(1, 2**31)))
