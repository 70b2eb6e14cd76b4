"""Laid out zones as ordinary layers, and their figures."""

from .collect import COLUMNS, layout_layers, zone_layers
from .figures import indices

#: The figures of RZ Table 5, as the tool calls them.
layout_figures = indices

__all__ = ["COLUMNS", "indices", "layout_figures", "layout_layers", "zone_layers"]
