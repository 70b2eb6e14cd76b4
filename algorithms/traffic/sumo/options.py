"""What a simulation is asked for."""

from __future__ import annotations

from dataclasses import dataclass

from ...errors import InputError

#: How vehicles find their ways.
SHORTEST, REROUTING, ITERATED = "shortest", "rerouting", "iterated"
ROUTES = (SHORTEST, REROUTING, ITERATED)


@dataclass(frozen=True)
class SimulationOptions:
    """How traffic is simulated.

    Attributes
    ----------
    hours
        How long traffic is measured.
    warm_up
        Minutes of the same traffic before, to fill the streets; not measured.
    clearing
        Minutes at most after the last departure in which vehicles may still arrive.
    routes
        "shortest": everybody takes the way that is fastest on empty streets. "rerouting": drivers
        choose by the speeds of the moment, at departure and once a minute. "iterated": the hour
        is driven again and again, and each time some drivers change to what would have been
        their fastest way (method of successive averages), as in a dynamic user equilibrium.
    iterations
        How often the hour is driven with "iterated".
    seed
        Of the departures and of the behaviour of drivers.
    left_hand
        Whether one drives on the left.
    speed_deviation
        Standard deviation of the drivers' wished speeds, as a share of the speed of the street;
        0 where nobody drives faster than that.
    patience
        Seconds after which a vehicle that stands is moved on along its way ("teleport"), so that
        a knot that cannot be untied does not stop everything; counted in the result.
    time_limit
        Seconds that all of it may take, on the clock of the wall.
    """

    hours: float = 1.0
    warm_up: float = 15.0
    clearing: float = 60.0
    routes: str = ITERATED
    iterations: int = 5
    seed: int = 0
    left_hand: bool = False
    speed_deviation: float = 0.0
    patience: float = 300.0
    time_limit: float = 600.0

    def __post_init__(self) -> None:
        """Check every value.

        Raises
        ------
        InputError
            A value is out of range.
        """
        if self.routes not in ROUTES:
            raise InputError(
                f"There is no kind of routes '{self.routes}'.", f"Choose {', '.join(ROUTES)}."
            )
        ranges = {
            "hours": (self.hours, 0.05, 24.0),
            "warm_up": (self.warm_up, 0.0, 240.0),
            "clearing": (self.clearing, 0.0, 1440.0),
            "iterations": (self.iterations, 1, 100),
            "seed": (self.seed, 0, 2**31 - 1),
            "speed_deviation": (self.speed_deviation, 0.0, 0.5),
            "patience": (self.patience, 10.0, 36000.0),
            "time_limit": (self.time_limit, 1.0, 86400.0),
        }
        for name, (value, least, most) in ranges.items():
            if not least <= value <= most:
                raise InputError(
                    f"The simulation cannot have {name} = {value:g}.",
                    f"Give a value from {least:g} to {most:g}.",
                )

    @property
    def begin(self) -> float:
        """When the measured time begins, seconds."""
        return 60.0 * self.warm_up

    @property
    def end(self) -> float:
        """When it ends and the last vehicle departs, seconds."""
        return self.begin + 3600.0 * self.hours

    @property
    def stop(self) -> float:
        """When the simulation ends at the latest, seconds."""
        return self.end + 60.0 * self.clearing
