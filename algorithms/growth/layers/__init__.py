"""What has grown, as layers, as a graph, and without its dead ends."""

from .collect import COLUMNS, growth_layers

__all__ = ["COLUMNS", "growth_layers"]
