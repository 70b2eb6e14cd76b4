"""Numbers that every site may have of its own, by a field or an expression of its features."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from qgis.core import QgsExpressionContext, QgsProcessingParameters

from ...algorithms.errors import InputError
from .. import compat, parameters
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

    found = values_of_features(request, key, layer)
    values, shapes = list(found.values()), [shape for shape, _ in found.values()]
    frame = geopandas.GeoSeries(shapely.make_valid(shapes), crs=sites[0].source_crs)
    result: list[float | None] = []
    for site in sites:
        shared = shapely.area(shapely.intersection(frame.to_crs(site.crs).array, site.polygon))
        own = [(a, v) for a, (_, v) in zip(shared.tolist(), values) if a > 0 and v is not None]
        whole = sum(area for area, _ in own)
        result.append(sum(area * value for area, value in own) / whole if whole else None)
    return result


def values_of_features(
    request: Request, key: str, layer: str
) -> dict[int, tuple[Any, float | None]]:
    """Return the shape and the value of a parameter for each feature of a layer, by its id.

    Raises
    ------
    InputError
        A value is no number or out of range; the text names the feature.
    """
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
                    f"{parameters.title(definition)} is {value}.",
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


def record(base: Any, sites: Sequence[Any], asked: Sequence[Any]) -> str:
    """Return what was asked as JSON, which `Specification.from_json` reads: once, or by site."""
    from ...algorithms.network.specification import sites_json

    if all(own == base for own in asked):
        return str(base.to_json())
    return sites_json({site.site_id: own for site, own in zip(sites, asked)})
