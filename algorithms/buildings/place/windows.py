"""Parts of a plan that are planned anew while the rest stands."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import shapely

from ..types import Ints
from .candidates import Maker

#: Columns that windows have; the largest are those that a relaxation is solved for within a
#: fraction of a second.
SIZES = (600, 1500, 4000)
LARGEST = 10_000
#: Of the windows, this part are lines side by side; the others lines from anywhere, so that what
#: one place loses another gains.
BESIDE = 0.7
#: Lines on which nothing stands are taken into a window with this probability.
UNUSED = 0.4
#: How far lines may change places in their order.
SHUFFLE = 6.0


class Windows:
    """Chooses sets of control lines.

    Parameters
    ----------
    maker
        Knows the lines and how many columns they have.
    step_m
        Step that is asked for, metres.
    """

    def __init__(self, maker: Maker, step_m: float) -> None:
        self.step_m = step_m
        self.weight = maker.weights()
        self.lines = np.flatnonzero(self.weight > 0)
        made = [shapely.LineString([maker.lines[n].start, maker.lines[n].end]) for n in self.lines]
        shapes = np.array(made, dtype=object)
        self._apart = shapely.distance(shapes[:, None], shapes[None, :])
        self._order = np.array([maker.lines[n].order for n in self.lines])
        self._mirror = {n: line.mirror for n, line in enumerate(maker.lines) if line.mirror >= 0}

    def whole(self, rng: np.random.Generator, used: Ints, size: float) -> tuple[list[int], float]:
        """Choose lines of the whole zone and a step: those in use, then about in their order."""
        step = 2.0 * self.step_m
        shuffled = self._order + rng.random(len(self.lines)) * SHUFFLE
        ranked = np.lexsort([shuffled, ~np.isin(self.lines, used)])
        chosen = self._filled(self.lines[ranked], step, size)
        return chosen, self._step(chosen, size, step)

    def choose(self, rng: np.random.Generator, used: Ints) -> tuple[list[int], float]:
        """Choose lines and a step for them.

        Parameters
        ----------
        rng
            Source of randomness.
        used
            Lines on which something stands.
        """
        size = float(rng.choice(SIZES))
        step = self.step_m * float(rng.choice([0.5, 1.0, 2.0]))
        first = int(rng.integers(len(self.lines)))
        if rng.random() < BESIDE:
            # a little noise: lines at the same distance take turns
            order = np.argsort(self._apart[first] + rng.random(len(self.lines)))
        else:
            order = rng.permutation(len(self.lines))
            order = np.concatenate([[first], order[order != first]])
        lines = self.lines[order]
        taken = np.isin(lines, used) | (rng.random(len(lines)) < UNUSED)
        taken[0] = True
        chosen = self._filled(lines[taken], step, size)
        return chosen, self._step(chosen, size, step)

    def _filled(self, lines: Iterable[int], step: float, size: float) -> list[int]:
        """Take lines, with their mirrors, until a window has its size; one at least."""
        chosen: list[int] = []
        for n in lines:
            more = {int(n), self._mirror.get(int(n), int(n))} - set(chosen)
            if chosen and self._size([*chosen, *more], step) > size:
                break
            chosen += sorted(more)
        return chosen

    def _size(self, lines: list[int], step: float) -> float:
        """Reckon how many columns lines have."""
        return float(self.weight[lines].sum()) / step

    def _step(self, lines: list[int], size: float, least: float) -> float:
        """Return a step with which lines have about so many columns, never less than `least`."""
        return max(least, self._size(lines, 1.0) / size)
