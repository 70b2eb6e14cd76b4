"""The tools, one file each, in the order of the planner's work."""

from __future__ import annotations

from .assigntraffic import AssignTraffic
from .candidatemesh import CandidateMesh
from .designcity import DesignCity
from .designfloor import DesignFloor
from .designgamelevel import DesignGameLevel
from .designreport import DesignReport
from .designstreets import DesignStreets
from .exploretradeoffs import ExploreTradeoffs
from .growstreets import GrowStreets
from .installdependencies import InstallDependencies
from .layoutresidential import LayoutResidential
from .measuredesign import MeasureDesign
from .measurelanduse import MeasureLandUse
from .measureparcels import MeasureParcels
from .measurestreets import MeasureStreets
from .optimiselayout import OptimiseLayout
from .osmboundary import OsmBoundary
from .osmlayers import OsmLayers
from .parcelblocks import ParcelBlocks
from .preparesite import PrepareSite
from .resplitlayout import ResplitLayout
from .simulatetraffic import SimulateTraffic
from .smoothstreets import SmoothStreets
from .splitsite import SplitSite
from .validatenetwork import ValidateNetwork

TOOLS = (
    OsmBoundary,
    OsmLayers,
    PrepareSite,
    CandidateMesh,
    DesignStreets,
    ExploreTradeoffs,
    DesignCity,
    GrowStreets,
    SmoothStreets,
    SplitSite,
    ParcelBlocks,
    OptimiseLayout,
    ResplitLayout,
    LayoutResidential,
    DesignFloor,
    DesignGameLevel,
    ValidateNetwork,
    MeasureDesign,
    MeasureStreets,
    MeasureParcels,
    MeasureLandUse,
    AssignTraffic,
    SimulateTraffic,
    DesignReport,
    InstallDependencies,
)
