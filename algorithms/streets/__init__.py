"""Street plans: network, levels, alignment, segments, blocks and their layers."""

from .angles import NetworkFigures
from .distances import sink_places
from .fitting import edge_length, site_mesh
from .heights import HeightGrid, no_heights
from .layers import plan_layers
from .plan import design_streets, plan_site
from .preferences import Preferences, Zone
from .site_plan import SitePlan, StreetPlan, no_plan
from .smooth_layer import SmoothedStreets, smooth_streets
from .smoothing import Smoothing
from .survey import Ground, arriving_streets, survey
from .why_not import NoDesignError
from .wishes import Wishes

__all__ = [
    "Ground",
    "HeightGrid",
    "NetworkFigures",
    "NoDesignError",
    "Preferences",
    "SitePlan",
    "SmoothedStreets",
    "Smoothing",
    "StreetPlan",
    "Wishes",
    "Zone",
    "arriving_streets",
    "design_streets",
    "edge_length",
    "no_heights",
    "no_plan",
    "plan_layers",
    "plan_site",
    "sink_places",
    "site_mesh",
    "smooth_streets",
    "survey",
]
