"""Designs as one page to read, print and send: facts of layers in, an HTML document out."""

from .designs import DesignGroup, LayerFacts, group_layers
from .figures import Figure, figure_text, figures_of, split_unit
from .page import report_page
from .pictures import LegendEntry, Picture
from .report import Credit, Design, LayerRow, Problem, Report, Run
from .solver import SolverFacts, solver_facts
from .targets import Target, TargetResult, check_targets, parse_targets, target_of
from .wishes import InputFacts, Wish, wishes_of

__all__ = [
    "Credit",
    "Design",
    "DesignGroup",
    "Figure",
    "InputFacts",
    "LayerFacts",
    "LayerRow",
    "LegendEntry",
    "Picture",
    "Problem",
    "Report",
    "Run",
    "SolverFacts",
    "Target",
    "TargetResult",
    "Wish",
    "check_targets",
    "figure_text",
    "figures_of",
    "group_layers",
    "parse_targets",
    "report_page",
    "solver_facts",
    "split_unit",
    "target_of",
    "wishes_of",
]
