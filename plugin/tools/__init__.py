"""The tools, one file each, in the order of the planner's work."""

from __future__ import annotations

from .preparesite import PrepareSite

TOOLS = (PrepareSite,)
