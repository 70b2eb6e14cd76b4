"""The independent check of streets that were designed, asked as the planner asked for them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Optional

import geopandas as gpd
import pandas as pd

from .. import measure
from ..errors import CancelledError
from ..levels import LOCAL
from ..network.specification import Specification
from ..progress import Progress
from ..streets import StreetPlan, sink_places

Layers = Mapping[str, Any]


def check_design(
    found: Layers,
    around: Layers,
    plan: StreetPlan,
    given: Layers,
    progress: Progress,
) -> Optional[measure.ValidationReport]:
    """Return what the checker says of a design, or None where the planner would not wait.

    It is told what the planner gave, never what the design made of it; exits are where the mesh
    has them.

    Parameters
    ----------
    found, around
        The layers of the design and those of the prepared sites.
    plan
        The `StreetPlan`.
    given
        The layers SINKS, REQUIRED and FORBIDDEN of the planner, None where not given.
    progress
        Asked for cancellation.
    """
    asked = plan.specification
    if not plan.plans:
        return None
    scale = min(own.network.ground.mesh.edge_length for own in plan.plans)
    try:
        return measure.validate_network(
            found["streets"].set_index("street_id", drop=False),
            site=around["site"].set_index("site_id", drop=False),
            obstacles=around["site_obstacles"],
            boundary_streets=_edge_streets(around, asked.sink_mode),
            snap_distance=plan.plans[0].site.snap_distance,
            sinks=_exits(plan),
            required=given["REQUIRED"],
            forbidden=given["FORBIDDEN"],
            **_covered(plan),
            **_limits(plan),
            edge_length=scale,
            dead_ends=asked.dead_ends,
            t_junctions=asked.t_junctions,
            branches=asked.branches,
            progress=progress,
            **_prices(asked),
        )
    except CancelledError:
        progress.warn("The streets were not checked, because the run was stopped before.")
        return None


def _edge_streets(around: Layers, mode: str) -> Any:
    """Return the streets along the edge of the sites; where none is given the edge is one."""
    if mode != "boundary" and len(around["boundary_streets"]):
        return around["boundary_streets"]
    outline = around["site"].copy()
    outline.geometry = outline.boundary
    return outline


def _prices(asked: Specification) -> dict[str, Any]:
    """Return the weights that are left to the rule set, as that set has them.

    The planner's rules have none: they price the shape of streets in other ways.
    """
    paper = asked.rules == "paper"
    implied = {"too_close": math.inf if paper else 0.0, "zigzags": 5.0 if paper else 0.0}
    given = {name: getattr(asked, name) for name in implied}
    return {name: implied[name] if value is None else value for name, value in given.items()}


def _covered(plan: StreetPlan) -> dict[str, Any]:
    """Return the ranges that are asked in metres; none where the rules ask for no certain one.

    Vertices of the mesh of local streets must be in range, along its edges or straight; that of
    culs-de-sac is finer. The ground between them is up to half a diagonal of a cell away from the
    nearest.
    """
    asked = plan.specification
    if asked.rules != "paper":
        return {"coverage_m": None}
    metric = asked.coverage is not None and asked.coverage_unit != "edges"
    meshes = [
        solved.problem.mesh
        for own in plan.plans
        for solved in own.network.solved
        if solved.level == LOCAL
    ] or [own.network.ground.mesh for own in plan.plans]
    scale = min(mesh.edge_length for mesh in meshes)
    reach = (asked.coverage or 1.0) * (1.0 if metric else scale)
    longest = max(float(mesh.lengths.max()) for mesh in meshes)
    slack = math.sqrt(0.5) * longest
    return {
        "coverage_m": float(reach + slack),
        "coverage_areas": _areas(plan),
        "coverage_slack_m": slack,
    }


def _areas(plan: StreetPlan) -> Any:
    """Return the areas with a range of their own; None where there are none."""
    own = plan.plans[0]
    zones = own.network.ground.preferences.density
    if not zones:
        return None
    return gpd.GeoDataFrame(
        {"coverage_m": [zone.value for zone in zones]},
        geometry=[zone.shape for zone in zones],
        index=[zone.feature for zone in zones],
        crs=own.site.crs,
    )


def _limits(plan: StreetPlan) -> dict[str, Any]:
    """Return what is asked of the network as a whole.

    The planner's rules price long ways, near junctions and streets that are the only way to a
    place, those of the paper forbid them.
    """
    asked = plan.specification
    return {
        "exits_most": asked.exits,
        "length_budget_m": asked.length_budget,
        "max_distance_m": asked.max_distance,
        "junction_spacing_m": asked.junction_spacing,
        "functions": math.inf if asked.rules == "paper" else 1.0,
    }


def _exits(plan: StreetPlan) -> Any:
    """Return the places where the planner lets traffic leave; None where that is a whole edge."""
    if plan.specification.sink_mode not in ("access", "points"):
        return None
    parts = []
    for own in plan.plans:
        x, y = sink_places(own.network.ground).T
        places = gpd.GeoSeries.from_xy(x, y, crs=own.site.crs)
        parts.append(gpd.GeoDataFrame(geometry=places.to_crs(own.site.source_crs)))
    return pd.concat(parts, ignore_index=True)
