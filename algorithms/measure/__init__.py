"""Measures and checks of streets, read from layers alone; no producer is imported here."""

from .plan import PlanMetrics, measure_plan
from .problems import ValidationReport
from .validate import validate_network

__all__ = ["PlanMetrics", "ValidationReport", "measure_plan", "validate_network"]
