"""One run: the streets of the sites as it asks, their figures, and the independent check."""

from __future__ import annotations

import math
from typing import Any

import geopandas as gpd

from ..errors import CancelledError
from ..progress import Progress, Share
from ..site import site_layers
from ..streets import StreetPlan, design_streets, plan_layers
from .check import check_design

#: Figures of a design, in the order of tables, with what each says.
FIGURES = {
    "length_m": "length of the new streets in metres",
    "mean_distance_m": "mean way out of the site in metres",
    "max_distance_m": "longest way out of the site in metres",
    "objective": "price of the design; to be compared only where the same was asked",
    "bound": "lower bound of that price, proven program by program",
    "gap": "gap between that price and that bound, as a share of the price",
    "seconds": "time of the design in seconds",
    "dead_ends": "number of dead ends",
    "blocks": "number of blocks",
    "violations": "broken rules, as an independent check finds them",
}
_OF_PLAN = {
    "length_m": "TOTAL_LENGTH",
    "mean_distance_m": "MEAN_DISTANCE",
    "max_distance_m": "MAX_DISTANCE",
    "objective": "OBJECTIVE",
    "bound": "BOUND",
    "gap": "ACHIEVED_GAP",
    "seconds": "SECONDS",
}


def design(item: dict[str, Any], progress: Progress) -> dict[str, Any]:
    """Design the streets of a run; a task of `tasks.run_tasks`.

    Parameters
    ----------
    item
        "prepared" (`PreparedSites`), "specification", "wishes" by `site_id`, and "given": the
        layers SINKS, REQUIRED and FORBIDDEN of the planner.
    progress
        Told of stages; asked whether to stop.

    Returns
    -------
    dict
        "layers" as `plan_layers` gives them, with "violations" as `ValidationReport.problems`,
        and "figures" by the keys of `FIGURES`.

    Raises
    ------
    PlatwrightError
        There is no design; the text says why.
    CancelledError
        The run was cancelled: half a search is no design to compare.
    """
    prepared, wishes = item["prepared"], item["wishes"]
    plan = design_streets(
        prepared.sites,
        item["specification"],
        wishes=lambda site: wishes[site.site_id],
        progress=Share(progress, 0.0, 0.95),
    )
    if plan.stopped == "cancelled" or progress.cancelled():
        raise CancelledError
    if plan.failures:
        # lengths of some of the sites are no figures of a run
        raise plan.failures[0][1]
    layers = plan_layers(plan)
    around = site_layers(prepared)
    report = check_design(layers, around, plan, item["given"], Share(progress, 0.95, 1.0))
    checked = {} if report is None else {"violations": report.problems}
    return {
        "layers": {**layers, **checked},
        "by_clock": plan.stopped == "time",
        "figures": _figures(plan, layers, math.nan if report is None else report.violations),
    }


def _figures(
    plan: StreetPlan, layers: dict[str, gpd.GeoDataFrame], violations: float
) -> dict[str, float]:
    numbers = plan.numbers
    return {
        **{key: float(numbers[name]) for key, name in _OF_PLAN.items()},
        "dead_ends": int((layers["junctions"]["kind"] == "dead end").sum()),
        "blocks": len(layers["blocks"]),
        "violations": violations,
    }
