"""Trade-offs: the same sites designed in many ways, compared in tables, plots and pictures."""

from .design import FIGURES
from .drawing import picture, plot
from .front import pareto_front
from .page import page
from .parameters import PARAMETERS, Run, grid, listed, parsed, read_rows, runs_of
from .tradeoffs import COLUMNS, Exploration, Explored, explore, table_of_axes

__all__ = [
    "COLUMNS",
    "FIGURES",
    "PARAMETERS",
    "Exploration",
    "Explored",
    "Run",
    "explore",
    "grid",
    "listed",
    "page",
    "pareto_front",
    "parsed",
    "picture",
    "plot",
    "read_rows",
    "runs_of",
    "table_of_axes",
]
