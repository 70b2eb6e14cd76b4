"""Numbers that every site may have of its own, by a field or an expression of its features."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from qgis.core import QgsExpressionContext, QgsProcessingParameters

from ...algorithms.errors import CancelledError, InputError, PlatwrightError
from .. import compat
from ..progress import FeedbackProgress
from ..request import Request


def per_feature(request: Request, keys: Sequence[str]) -> tuple[str, ...]:
    """Return those of some parameters that are given feature by feature."""
    return tuple(key for key in keys if QgsProcessingParameters.isDynamic(request.parameters, key))


def values_of_sites(
    request: Request, key: str, sites: Sequence[Any], layer: str = "INPUT"
) -> list[float | None]:
    """Return the value of a parameter for each site; None where its features have none.

    A site that was joined from several features has the mean of their values, each counted by
    the ground that it brings in.

    Raises
    ------
    InputError
        A value is no number or out of range; the text names the feature.
    """
    import geopandas
    import shapely

    found = _values_of_features(request, key, layer)
    values, shapes = list(found.values()), [shape for shape, _ in found.values()]
    frame = geopandas.GeoSeries(shapely.make_valid(shapes), crs=sites[0].source_crs)
    result: list[float | None] = []
    for site in sites:
        shared = shapely.area(shapely.intersection(frame.to_crs(site.crs).array, site.polygon))
        own = [(a, v) for a, (_, v) in zip(shared.tolist(), values) if a > 0 and v is not None]
        whole = sum(area for area, _ in own)
        result.append(sum(area * value for area, value in own) / whole if whole else None)
    return result


def _values_of_features(
    request: Request, key: str, layer: str
) -> dict[int, tuple[Any, float | None]]:
    """Return the shape and the value of each feature, by its id."""
    import shapely

    source = request.source(layer)
    if source is None:
        return {}
    definition = request.tool.parameterDefinition(key)
    context = QgsExpressionContext(request.context.expressionContext())
    context.appendScope(source.createExpressionContextScope())
    context.setFields(source.fields())
    found: dict[int, tuple[Any, float | None]] = {}
    for feature in source.getFeatures():
        if feature.geometry().isEmpty():
            continue
        context.setFeature(feature)
        value, good = request.parameters[key].value(context)
        if compat.is_null(value) or value == "":
            number = None
        else:
            number = _number(value) if good else None
            if number is None or not definition.minimum() <= number <= definition.maximum():
                raise InputError(
                    f"{definition.description()} is {value}.",
                    f"Give a number from {definition.minimum():g} to {definition.maximum():g}, or "
                    "nothing for the usual one.",
                    layer=request.name(layer),
                    feature=feature.id(),
                )
        shape = shapely.from_wkb(bytes(feature.geometry().asWkb().data()), on_invalid="ignore")
        found[feature.id()] = shapely.force_2d(shape), number
    return found


def _number(value: Any) -> float | None:
    try:
        return float(value)
    except (TypeError, ValueError):
        return None


def specifications(
    request: Request, base: Any, keys: Sequence[str], sites: Sequence[Any]
) -> list[Any]:
    """Return the specification of each site: `base` with the numbers that its features give."""
    values = {key: values_of_sites(request, key, sites) for key in keys}
    made = []
    for at, site in enumerate(sites):
        own = {key.lower(): row[at] for key, row in values.items() if row[at] is not None}
        try:
            made.append(dataclasses.replace(base, **own))
        except InputError as error:
            raise InputError(f"{site.name}: {error}", feature=site.feature) from error
    return made


def design_each(
    sites: Sequence[Any],
    asked: Sequence[Any],
    design: Callable[[Sequence[Any], Any, FeedbackProgress], Any],
    progress: FeedbackProgress,
) -> list[Any]:
    """Design sites that are asked for different things; return one plan for each demand.

    Parameters
    ----------
    sites, asked
        The sites and the specification of each.
    design
        Designs some sites by one specification, as `design_streets` does.
    progress
        Told of the share that is done; a cancelled run keeps the plans that there are.

    Raises
    ------
    PlatwrightError
        No site could be designed.
    """
    from ...algorithms.streets import StreetPlan

    groups: dict[Any, list[Any]] = {}
    for site, specification in zip(sites, asked):
        groups.setdefault(specification, []).append(site)
    area = sum(site.polygon.area for site in sites)
    plans: list[Any] = []
    errors: list[PlatwrightError] = []
    done = 0.0
    for specification, own in groups.items():
        share = sum(site.polygon.area for site in own) / area
        timed = dataclasses.replace(
            specification, time_limit=max(1.0, share * specification.time_limit)
        )
        try:
            plans.append(design(own, timed, progress.part(done, done + share)))
        except CancelledError:
            if not plans:
                raise
            break
        except PlatwrightError as error:
            if len(groups) == 1:
                raise
            progress.warn(f"{own[0].name}: {error}")
            errors.append(error)
            plans.append(StreetPlan((), timed, 0.0, failures=tuple((s, error) for s in own)))
        done += share
        if progress.cancelled():
            break
    if errors and not any(plan.plans for plan in plans):
        raise errors[0]
    return plans


def joined_plan(plans: Sequence[Any], base: Any) -> Any:
    """Return several plans as one, for its figures; `base` stands for what they have in common."""
    from ...algorithms.streets import StreetPlan

    order = ("cancelled", "time", "gap", "optimal")
    return StreetPlan(
        tuple(own for plan in plans for own in plan.plans),
        base,
        sum(plan.seconds for plan in plans),
        min((plan.stopped for plan in plans), key=order.index),
        tuple(failure for plan in plans for failure in plan.failures),
    )


def joined_layers(plans: Sequence[Any]) -> dict[str, Any]:
    """Return the layers of several plans as one of each kind, numbered through."""
    import pandas

    from ...algorithms.streets import plan_layers

    parts = [plan_layers(plan) for plan in plans]
    joined: dict[str, Any] = {}
    for key in parts[0]:
        full = [part[key] for part in parts if len(part[key])]
        joined[key] = pandas.concat(full, ignore_index=True) if full else parts[0][key]
        name = f"{key[:-1]}_id"
        if name in joined[key].columns:
            joined[key][name] = range(1, len(joined[key]) + 1)
    return joined


def record(base: Any, sites: Sequence[Any], asked: Sequence[Any]) -> str:
    """Return what was asked as JSON: one specification, or one for each site by its number."""
    if all(own == base for own in asked):
        return str(base.to_json())
    rows: Mapping[str, Any] = {
        str(site.site_id): json.loads(own.to_json()) for site, own in zip(sites, asked)
    }
    return json.dumps({"sites": rows}, sort_keys=True)
