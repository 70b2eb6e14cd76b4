"""What a planner should know, as a layer: remarks about floors, reasons why there is no plan."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import geopandas as gpd
import shapely

from ..errors import InfeasibleError
from ..site.repair import Problems
from .floors import Floor, Remark
from .why import NoPlanError


def reasons_of(floor: Floor, error: InfeasibleError) -> list[Remark]:
    """Return why a floor has no plan, each reason at its cells.

    Parameters
    ----------
    floor
        The floor.
    error
        What was raised for it.
    """
    whole = floor.polygon.representative_point()
    if not isinstance(error, NoPlanError):
        # the first sentence is the problem, the others say what to do
        problem, _, action = str(error).partition(". ")
        return [Remark(f"{problem.rstrip('.')}.", action, "error", whole)]
    corners = floor.mesh.vertices[floor.mesh.faces]
    found = []
    for reason in error.reasons:
        places = [shapely.Point(corners[f].mean(axis=0)) for f in reason.faces] or [whole]
        found += [Remark(reason.problem, reason.action, "error", place) for place in places]
    return found


def problem_layer(
    remarks: Iterable[Remark], layer: str, feature: object, crs: Any, source_crs: Any
) -> gpd.GeoDataFrame:
    """Return remarks as points with the fields of the layers of problems.

    Parameters
    ----------
    remarks
        Remarks, metres in `crs`.
    layer, feature
        What they are about.
    crs, source_crs
        Working CRS, and the CRS of the layer that is returned.
    """
    problems = Problems()
    for own in remarks:
        place = own.geometry.representative_point()
        words = own.text.rstrip("."), own.action.rstrip(".")
        problems.add(layer, feature, *words, own.severity, place, crs)
    return problems.to_frame(source_crs)
