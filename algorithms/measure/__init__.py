"""Measures and checks of streets, parcels and land, from layers alone; no producer is imported."""

from .landuse import LandUseFigures, LandUseReport, measure_land_use
from .parcel_figures import ParcelFigures
from .parcels import Ideal, ParcelReport, measure_parcels
from .pattern import PatternMetrics, measure_pattern
from .plan import PlanMetrics, measure_plan
from .problems import ValidationReport
from .street_figures import StreetFigures
from .streets import StreetOptions, StreetReport, measure_streets
from .validate import validate_network
from .zone_figures import ZoneFigures, zone_figures

__all__ = [
    "Ideal",
    "LandUseFigures",
    "LandUseReport",
    "ParcelFigures",
    "ParcelReport",
    "PatternMetrics",
    "PlanMetrics",
    "StreetFigures",
    "StreetOptions",
    "StreetReport",
    "ValidationReport",
    "ZoneFigures",
    "measure_land_use",
    "measure_parcels",
    "measure_pattern",
    "measure_plan",
    "measure_streets",
    "validate_network",
    "zone_figures",
]
