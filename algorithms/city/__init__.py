"""Cities: a municipality divided by its major roads and designed sub-region by sub-region."""

from .agreement import Agreement, Meeting
from .division import divide_city
from .layers import city_layers
from .rules import MAJOR, CityRules
from .run import CityPlan, Outcome, design_city
from .store import CityFile
from .types import City, DividingRoad, PlannedJunction, SubRegion

__all__ = [
    "MAJOR",
    "Agreement",
    "City",
    "CityFile",
    "CityPlan",
    "CityRules",
    "DividingRoad",
    "Meeting",
    "Outcome",
    "PlannedJunction",
    "SubRegion",
    "city_layers",
    "design_city",
    "divide_city",
]
