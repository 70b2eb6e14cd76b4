"""Real layers become planar sites: read, repair, project, snap."""  # noqa: A005 (the room is named as in the design)

from __future__ import annotations

from .access_layer import access_points_from_layer, access_points_of_sites
from .carry import carry_to_centre_line
from .layers import bearing, site_layers
from .prepare import prepare_sites
from .types import AccessPoint, BoundaryStreet, PreparedSites, Site

__all__ = [
    "AccessPoint",
    "BoundaryStreet",
    "PreparedSites",
    "Site",
    "access_points_from_layer",
    "access_points_of_sites",
    "bearing",
    "carry_to_centre_line",
    "prepare_sites",
    "site_layers",
]
