"""Levenberg-Marquardt on all blocks at once, each with its own damping and its own end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from ...progress import Progress
from .bands import Bands
from .forces import Forces
from .layout import Layout, Placed, State, parts_of
from .mesh import Flags, Floats, Ints

#: Longest move of a vertex in one step (metres).
STRIDE = 2.0
#: Pull back to where a vertex came from: as if 18 m off were an error of 0.02.
HOME = (0.02 / 18.0) ** 2
#: Damping at first, its bounds, and its factors after a good and a bad step.
DAMPING, LEAST, MOST, LESS, MORE = 1e-5, 1e-6, 10.0, 0.2, 8.0
#: A block is done when a step gains less than this share.
GAIN = 1e-3
#: What is done is left out of sight when less than this share of blocks is left.
NARROW = 0.6
#: How often what would fold is held back before the step is given up.
HOLDS = 4


@dataclass(frozen=True)
class Limits:
    """What must not be given up.

    Attributes
    ----------
    before, behind
        Stops on both sides of pieces of rails, shape (q,).
    least
        Least length of these pieces, metres, shape (q,).
    closed
        For each closed part of a rail: rail, begin, end; shape (c, 3), metres.
    open_least
        Least length along streets of the pieces, metres, shape (q,).
    smallest, largest
        Bounds of the areas of faces, shape (f,), m2.
    parts
        Of greens, how many parts they have without their necks, else 0; shape (f,).
    """

    before: Ints
    behind: Ints
    least: Floats
    closed: Floats
    open_least: Floats
    smallest: Floats
    largest: Floats
    parts: Ints

    def slack(self, rail: Ints, s: Floats) -> tuple[Floats, Floats]:
        """How far both ends of pieces may move in together, shapes (q,), metres.

        If each moves by half of its own at most, no piece gets shorter than it may.
        """
        begin, end = s[self.before], s[self.behind]
        ahead = behind = np.maximum(end - begin - self.least, 0.0)
        if len(self.closed):
            spare = np.maximum(open_length(self, rail, s) - self.open_least, 0.0)
            # closed parts at the ends may go for nothing
            first, last = spare.copy(), spare.copy()
            for number, low, high in self.closed:
                here = rail[self.before] == number
                shut = np.minimum(end, high) - np.maximum(begin, low)
                first += np.where(here & (low <= begin) & (shut > 0), shut, 0.0)
                last += np.where(here & (high >= end) & (shut > 0), shut, 0.0)
            ahead, behind = np.minimum(ahead, first), np.minimum(behind, last)
        return ahead, behind


def open_length(limits: Limits, rail: Ints, s: Floats) -> Floats:
    """Length along streets of the pieces of rails, shape (q,), metres."""
    begin, end = s[limits.before], s[limits.behind]
    mine = rail[limits.before]
    found = end - begin
    for number, low, high in limits.closed:
        here = np.flatnonzero(mine == number)
        shut = np.minimum(end[here], high) - np.maximum(begin[here], low)
        found[here] -= np.maximum(shut, 0.0)
    return np.asarray(found)


class Descent:
    """The search for better shapes, for use once.

    Parameters
    ----------
    layout
        The outlines.
    forces
        The residuals.
    limits
        What must not be given up.
    moving
        Faces that move, shape (f,); the outlines of others hold still and cannot fold.
    like
        See `Bands`.
    """

    def __init__(
        self,
        layout: Layout,
        forces: Forces,
        limits: Limits,
        moving: Flags,
        like: Bands | None = None,
    ) -> None:
        self.layout, self.limits = layout, limits
        self.forces = forces
        self.bands = Bands(forces, like)
        self.free = np.flatnonzero(layout.rails.free)
        self.block_of_slider = layout.mesh.block[layout.rails.slider]
        self.moving = moving

    def run(self, iterations: int, active: Flags, progress: Progress) -> State:
        """Improve until nothing is gained, `iterations` good steps are done, or a cancel.

        Parameters
        ----------
        iterations
            Most good steps of each block.
        active
            Blocks to improve, shape (b,).
        progress
            Asked before every step whether to stop.
        """
        bands = self.bands
        begin = self.layout.begin()
        state = State(begin.xy.copy(), self.layout.snapped(begin.s))
        matrix, gradient, energy = self._assembled(self.layout.place(state))
        damping = np.full(len(energy), DAMPING)
        done = np.zeros(len(energy), int)
        active = active & (np.diff(bands.first) > 0)
        busy = active.sum()
        for _ in range(2 * iterations):
            if not active.any() or progress.cancelled():
                break
            if active.sum() < NARROW * busy:
                busy = active.sum()
                self._narrow(active)
                bands = self.bands
                matrix, gradient, _ = self._assembled(self.layout.place(state))
            off = gradient + HOME * self._away(state, begin)
            step = bands.solve(matrix, off, damping[bands.block] + HOME, active)
            trial, area, sound = self._held(state, self._moved(state, step), active)
            pull = self.forces.pull(trial, area)
            new = self.forces.energy(pull)
            better = active & sound & (new < energy)
            gain = energy - new
            self._take(state, trial.state, better)
            if better.any():
                # derivatives are found with the residuals: most steps are good
                ahead = bands.assemble(pull, bands.directions(trial))
                for old, fresh, mine in zip((matrix, gradient), ahead, bands.of_block(better)):
                    old[mine] = fresh[mine]
            done += better
            active &= done < iterations
            active &= ~better | (gain > GAIN * energy)
            active &= better | (damping < MOST)
            energy = np.where(better, new, energy)
            damping = np.where(better, np.maximum(damping * LESS, LEAST), damping * MORE)
        return state

    def _assembled(self, placed: Placed) -> tuple[Floats, Floats, Floats]:
        """Give the normal equations, see `Bands.assemble`, and the energy of each block."""
        pull = self.forces.pull(placed, self.forces.areas(placed))
        matrix, gradient = self.bands.assemble(pull, self.bands.directions(placed))
        return matrix, gradient, self.forces.energy(pull)

    def _narrow(self, active: Flags) -> None:
        """Look at the blocks that are still active only."""
        here = active[self.layout.mesh.block_of_face]
        old = self.forces
        self.forces = Forces(
            self.layout, old.parcel & here, self.moving & here, old.target, old.weights
        )
        self.bands = Bands(self.forces, self.bands)

    def _away(self, state: State, begin: State) -> Floats:
        """How far the unknowns are from where they came from, shape (count,), metres."""
        found = np.zeros(self.bands.count + 1)
        rails, unknown = self.layout.rails, self.bands.unknown
        away = state.xy - begin.xy
        found[unknown[self.free] + 1] = away[self.free]
        count = len(rails.slider)
        found[unknown[rails.slider, 0] + 1] = (state.s - begin.s)[:count]
        return found[1:]

    def _moved(self, state: State, step: Floats) -> State:
        """Make a step as far as strides, order and frontage allow."""
        rails, unknown = self.layout.rails, self.bands.unknown
        step = np.append(0.0, step)
        move = step[unknown[self.free] + 1]
        long = np.sqrt(move[:, 0] ** 2 + move[:, 1] ** 2)
        xy = state.xy.copy()
        xy[self.free] += move * np.minimum(1.0, STRIDE / np.maximum(long, 1e-9))[:, None]
        ahead, behind = self.limits.slack(rails.rail, state.s)
        down, up = np.full(len(state.s), np.inf), np.full(len(state.s), np.inf)
        down[self.limits.behind] = 0.5 * behind
        up[self.limits.before] = 0.5 * ahead
        count = len(rails.slider)
        slide = np.minimum(np.maximum(step[unknown[rails.slider, 0] + 1], -STRIDE), STRIDE)
        s = state.s.copy()
        s[:count] += np.minimum(np.maximum(slide, -down[:count]), up[:count])
        snapped = self.layout.snapped(s)
        # onto a bend only if that keeps the limits
        inside = (snapped >= state.s - down) & (snapped <= state.s + up)
        return State(xy, np.where(inside, snapped, s))

    def _held(self, state: State, trial: State, active: Flags) -> tuple[Placed, Floats, Flags]:
        """Hold back plots that would fold or leave their bounds.

        Returns
        -------
        placed
            The trial.
        area
            See `Forces.areas`, shape (f,), m2.
        sound
            Blocks where no plot does, shape (b,).
        """
        mesh, rails = self.layout.mesh, self.layout.rails
        faces = self.moving & active[mesh.block_of_face]
        for _ in range(HOLDS):
            placed = self.layout.place(trial)
            area = self.forces.areas(placed)
            wrong = self._wrong(placed, area, faces)
            if not wrong.any():
                return placed, area, np.ones(len(active), bool)
            still = np.zeros(len(mesh.xy), bool)
            still[mesh.vertex[wrong[mesh.face]]] = True
            trial.xy[still] = state.xy[still]
            back = np.flatnonzero(still[rails.slider])
            trial.s[back] = state.s[back]
        placed = self.layout.place(trial)
        area = self.forces.areas(placed)
        sound = np.ones(len(active), bool)
        sound[mesh.block_of_face[self._wrong(placed, area, faces)]] = False
        return placed, area, sound

    def _wrong(self, placed: Placed, area: Floats, faces: Flags) -> Flags:
        """Faces that fold, fall apart or whose area leaves its bounds, shape (f,)."""
        wrong = faces & ((area < self.limits.smallest) | (area > self.limits.largest))
        faces = faces & (self.forces.doubtful(placed) | (self.limits.parts > 0))
        chosen = np.flatnonzero(faces)
        if not len(chosen):
            return wrong
        drawn = self.layout.polygons(placed, faces, exact=False)
        valid = shapely.is_valid(drawn)
        wrong[chosen[~valid]] = True
        parts = self.limits.parts[chosen]
        wrong[chosen] |= parts_of(drawn, valid & (parts > 0)) != np.where(valid, parts, 0)
        return wrong

    def _take(self, state: State, trial: State, better: Flags) -> None:
        """Take over the positions of the blocks that got better."""
        mesh = self.layout.mesh
        mine = better[mesh.block]
        state.xy[mine] = trial.xy[mine]
        slid = np.flatnonzero(better[self.block_of_slider])
        state.s[slid] = trial.s[slid]
