"""Single trips drawn from a demand.

The number of trips of each kind is its demand times the time, rounded; nothing is left to
chance there. Which pairs of places they join is drawn systematically (one random start, then equal
steps through the added-up demand), so that every pair has its expected number of trips rounded
down or up. Departures are uniform over the time, in whole seconds, which is a Poisson process of
which the total is known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ..types import KINDS, Demand, FloatArray, IntArray
from .options import SimulationOptions

#: More would take hours to simulate.
MOST = 500_000


@dataclass(frozen=True, eq=False)
class Trips:
    """The t trips, by departure.

    Attributes
    ----------
    kind
        Shape (t,). Position in `KINDS`.
    origin, destination
        Shape (t,). Places.
    depart
        Shape (t,). Whole seconds.
    """

    kind: IntArray
    origin: IntArray
    destination: IntArray
    depart: FloatArray


def draw(demand: Demand, options: SimulationOptions) -> Trips:
    """Draw trips.

    Raises
    ------
    InputError
        There are none, too many, or a number is negative or not finite.
    """
    rng = np.random.default_rng(options.seed)
    hours = options.end / 3600.0
    parts: list[tuple[IntArray, IntArray, IntArray]] = []
    for number, kind in enumerate(KINDS):
        trips = np.asarray(demand.trips.get(kind, np.zeros((0, 0))), dtype=np.float64) * hours
        start, turn = rng.random(2)
        if not np.isfinite(trips).all() or bool((trips < 0).any()):
            raise InputError(
                f"The demand of {kind} has numbers below 0, or none at all.",
                "Give vehicles per hour.",
            )
        count = int(np.floor(trips.sum() + turn if trips.sum() < 1 else trips.sum() + 0.5))
        if count > MOST:
            raise InputError(
                f"The demand of {kind} is {count} trips, and at most {MOST} can be simulated.",
                "Lower the demand or the hours.",
            )
        if count:
            added = np.cumsum(trips.ravel())
            steps = (np.arange(count) + start) * (added[-1] / count)
            # steps are below the total, but for rounding
            pair = np.searchsorted(added, np.minimum(steps, added[-1] * (1 - 1e-12)), "right")
            origin, destination = np.divmod(pair, trips.shape[1])
            parts.append((np.full(count, number), origin, destination))
    if not parts:
        raise InputError("The demand is less than one trip.", "Give more vehicles per hour.")
    kinds, origins, destinations = (np.concatenate(column) for column in zip(*parts))
    # Whole seconds, the steps of the simulator: it would keep others waiting until the next one.
    depart = np.floor(rng.uniform(0.0, options.end, len(kinds)))
    order = np.argsort(depart, kind="stable")
    return Trips(
        kind=kinds[order].astype(np.int64),
        origin=origins[order].astype(np.int64),
        destination=destinations[order].astype(np.int64),
        depart=depart[order],
    )
