"""The same streets and trips in the traffic simulator Eclipse SUMO, vehicle by vehicle."""

from __future__ import annotations

from .find import Sumo, find_sumo
from .layers import problem_points, street_columns
from .options import ROUTES, SimulationOptions
from .result import Counts, Simulation
from .simulate import simulate

__all__ = [
    "ROUTES", "Counts", "Simulation", "SimulationOptions", "Sumo", "find_sumo",
    "problem_points", "simulate", "street_columns",
]  # fmt: skip
