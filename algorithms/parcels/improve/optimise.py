"""Streets of a mesh moved all at once (UP section 6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...errors import CancelledError
from ...progress import Progress, Silent
from ..roadmesh import StreetMesh
from ..roadmesh.passing import next_along, pass_by
from ..rules import ParcelRules
from .energy import Energy, Terms
from .freedom import NEAR, SOFT
from .guard import ANGLE, Guard, guard_of
from .weights import Weights

Floats = npt.NDArray[np.float64]
#: Once no vertex moves further in an iteration, nothing more is to be gained (metres).
STILL = 0.02
#: Vertices of a region that a step would break get so much drag, and so many times as much each
#: time that it breaks again; after so many times they stay where they are.
DRAG = 4.0
HARDER = 4.0
TRIES = 6
#: How often a step that does not lower the energy is halved.
HALVINGS = 4
#: Junctions stay on edges that lead the same way as their first one, but for the turn of a soft
#: corner.
LEAST_COSINE = float(np.cos(np.radians(SOFT)))


def optimise_mesh(
    mesh: StreetMesh,
    rules: ParcelRules,
    *,
    weights: Weights | None = None,
    iterations: int = 10,
    progress: Progress | None = None,
) -> StreetMesh:
    """Move the streets of a mesh so that rows of parcels fit better between them.

    Two steps take turns: to every region with four sides a strip between parallel curves is
    fitted; then all that may move is moved, by one sparse least-squares solution, towards these
    strips, with streets that stay fair, meet at right angles, and stay near to where they were.
    Where a region would fold, lose half its area or get a corner below 60 degrees, the step is
    shortened. What was given stays as it is, to the bit; streets that end on the edge of the
    site or on a given street slide along it, over gentle bends too but not over corners.

    After Y.-L. Yang, J. Wang, E. Vouga and P. Wonka, "Urban pattern: layout design by
    hierarchical domain splitting", ACM Transactions on Graphics 32 (2013), section 6; right
    angles at junctions, uneven vertices, weights of strips that are far from even, and the
    shortened steps are additions.

    Parameters
    ----------
    mesh
        The mesh; it is not changed.
    rules
        Say how deep parcels should be.
    weights
        Of the terms of the energy; None for those of `Weights`.
    iterations
        At most so many are done.
    progress
        Told of the iterations, asked for cancellation.

    Returns
    -------
    StreetMesh
        The same vertices and regions by number, at other places. Its energy is never above that
        of the mesh given. Only where a junction slid over a vertex of the edge do the rings of
        the regions beside it differ: that vertex has changed sides.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    told = progress or Silent()
    state = _State.of(mesh.copy(), rules, weights or Weights())
    if not state.energy.freedom.size:
        return state.mesh
    least, best = state.value, state.mesh.copy()
    for done in range(iterations):
        if told.cancelled():
            msg = "cancelled while streets were improved"
            raise CancelledError(msg)
        told.stage("Improving streets", done / iterations)
        moved = state.move()
        if state.value < least:
            least, best = state.value, state.mesh.copy()
        if moved < STILL:
            break
    return best


@dataclass
class _State:
    """A mesh on its way, and what is known of it."""

    mesh: StreetMesh
    energy: Energy
    guard: Guard
    terms: Terms
    drag: Floats
    ways: dict[int, Floats]

    @classmethod
    def of(cls, mesh: StreetMesh, rules: ParcelRules, weights: Weights) -> _State:
        """Begin with a mesh, which changes."""
        energy = Energy.of(mesh, rules, weights)
        freedom = energy.freedom
        ways = dict(zip(freedom.sliders.tolist(), freedom.ways(mesh.xy)))
        drag = np.zeros(len(mesh.xy))
        return cls(mesh, energy, guard_of(mesh), energy.at(mesh.xy), drag, ways)

    @property
    def value(self) -> float:
        """The energy, square metres."""
        return self.terms.value(self.mesh.xy)

    def move(self) -> float:
        """Do one step, and return how far the vertex went that went furthest, metres."""
        step, beyond = self._sound()
        value = self.value
        for _ in range(HALVINGS):
            terms = self.energy.at(self.mesh.xy + step)
            if terms.value(self.mesh.xy + step) < value:
                break
            # the strips moved too, further than was good
            step, beyond = step / 2, np.zeros_like(beyond)
        else:
            return 0.0
        self.mesh.xy = self.mesh.xy + step
        self.terms = terms
        if self._pass(beyond):
            self.terms = self.energy.at(self.mesh.xy)
        return float(np.abs(step).max())

    def _sound(self) -> tuple[Floats, Floats]:
        """Find a step that breaks no region; none where there is no such."""
        xy = self.mesh.xy
        for _ in range(TRIES):
            step, beyond = self.energy.step(xy, self.terms, self.drag)
            bad = self.guard.broken_at(xy + step)
            if not len(bad):
                return step, beyond
            self.drag[bad] = np.maximum(DRAG, self.drag[bad] * HARDER)
        # streets drag each other along, so all that is left is a shorter way for all
        none = np.zeros_like(beyond)
        for _ in range(TRIES):
            step = step / 2
            if not len(self.guard.broken_at(xy + step)):
                return step, none
        return np.zeros_like(xy), none

    def _pass(self, beyond: Floats) -> bool:
        """Let junctions pass vertices of the edge that they would slide beyond."""
        freedom = self.energy.freedom
        trial = self.mesh.copy()
        passed: list[int] = []
        for k in np.flatnonzero(beyond):
            side = 0 if beyond[k] < 0 else 1
            v = int(freedom.sliders[k])
            b = int((freedom.before, freedom.after)[side][k])
            near = np.hypot(*(self.mesh.xy[b] - self.mesh.xy[v])) < 2 * NEAR
            soft = near and freedom.apart[k, side] <= NEAR and self._leads_on(trial, v, b)
            if soft and pass_by(trial, v, b, NEAR):
                passed.append(v)
        if not passed:
            return False
        energy = self.energy.renewed(trial, passed)
        guard = guard_of(trial, self.guard.areas)
        before = self.guard.sharpest(self.mesh.xy, passed)
        blunt = guard.sharpest(trial.xy, passed) >= np.minimum(ANGLE, before)
        if energy is None or len(guard.broken_at(trial.xy)) or not blunt.all():
            return False
        self.mesh, self.energy, self.guard = trial, energy, guard
        return True

    def _leads_on(self, mesh: StreetMesh, v: int, b: int) -> bool:
        """Tell whether the edge after b leads much the same way as the one that v began on."""
        c = next_along(mesh, v, b)
        if c is None:
            return False
        way = mesh.xy[c] - mesh.xy[b]
        return abs(float(way @ self.ways[v])) >= LEAST_COSINE * float(np.hypot(*way))
