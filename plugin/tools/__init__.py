"""The tools, one file each, in the order of the planner's work."""

from __future__ import annotations

from .candidatemesh import CandidateMesh
from .designstreets import DesignStreets
from .preparesite import PrepareSite
from .validatenetwork import ValidateNetwork

TOOLS = (PrepareSite, CandidateMesh, DesignStreets, ValidateNetwork)
