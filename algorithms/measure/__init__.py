"""Measures and checks of streets, read from layers alone; no producer is imported here."""

from .pattern import PatternMetrics, measure_pattern
from .plan import PlanMetrics, measure_plan
from .problems import ValidationReport
from .validate import validate_network

__all__ = [
    "PatternMetrics",
    "PlanMetrics",
    "ValidationReport",
    "measure_pattern",
    "measure_plan",
    "validate_network",
]
