"""The roads that divide a city, and the streets that meet them, from one layer of lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely

from ..errors import InputError
from ..progress import Progress
from ..site.crs import layer_crs
from ..site.osmlines import in_tunnel, is_osm, no_street, tag
from ..site.roads import CLASS_COLUMNS, NAME_COLUMNS, NOT_STREETS
from .rules import CLOSED, CityRules

Texts = npt.NDArray[Any]
Lines = npt.NDArray[Any]


@dataclass(frozen=True, eq=False)
class CityRoads:
    """Roads of a city in its working CRS.

    Attributes
    ----------
    major
        Shape (n,). Lines that divide, metres.
    names, kinds
        Shape (n,). Their names and classes.
    closed
        Shape (n,). Whether nobody enters the ground beside them from there.
    minor
        Shape (m,). The other streets; where they meet a major road is a junction already.
    """

    major: Lines
    names: Texts
    kinds: Texts
    closed: npt.NDArray[np.bool_]
    minor: Lines


def read_roads(
    frame: gpd.GeoDataFrame,
    rules: CityRules,
    crs: Any,
    within: shapely.Geometry,
    layer: str,
    progress: Progress,
) -> CityRoads:
    """Read the roads that divide a city.

    Parameters
    ----------
    frame
        Lines in any CRS, with a road class (``highway``, ``fclass``...) or a ``level``.
    rules
        Which of them divide.
    crs
        Working CRS.
    within
        Polygons of the city, metres in `crs`.
    layer
        Name of the layer, for messages.
    progress
        Told how many lines were found.

    Returns
    -------
    CityRoads
        Those near the city.

    Raises
    ------
    InputError
        If the layer has no CRS, or none of its lines in the city divides it.
    """
    source = layer_crs(frame, layer)
    kinds, names = _first(frame, CLASS_COLUMNS), _first(frame, NAME_COLUMNS, lower=False)
    divides = np.isin(kinds, rules.classes) | _by_level(frame, rules.level)
    street = ~np.isin(kinds, list(NOT_STREETS - set(CLOSED)))
    if is_osm(frame):
        street &= ~no_street(frame) & ~in_tunnel(frame)
    else:
        street &= np.isin(tag(frame, "tunnel"), ("", "no", "0", "false", "f", "n"))
    geometry = shapely.force_2d(np.asarray(frame.geometry.array, dtype=object))
    kind = shapely.get_type_id(geometry)
    street &= np.isin(kind, (1, 2, 5, 7)) & ~shapely.is_empty(geometry)
    parts, row = shapely.get_parts(geometry[street], return_index=True)
    row = np.flatnonzero(street)[row]
    if source != crs:
        parts = gpd.GeoSeries(parts, crs=source).to_crs(crs).to_numpy()
    usable = np.isin(shapely.get_type_id(parts), (1, 2)) & (shapely.length(parts) > 0)
    usable &= np.all(np.isfinite(shapely.bounds(parts).reshape(-1, 4)), axis=1)
    parts, row = parts[usable], row[usable]
    near = shapely.intersects(parts, _prepared(shapely.buffer(within, 1.0)))
    parts, row = parts[near], row[near]
    own = divides[row]
    if not own.any():
        raise InputError(
            "no road of it divides the municipality: none has one of the classes "
            f"{', '.join(rules.classes) or '(none chosen)'}, or a level up to {rules.level}.",
            "Choose other road classes, or see whether the layer has a column highway, fclass or "
            "level and lies where the municipality is.",
            layer=layer,
        )
    progress.info(
        f"Layer '{layer}': {int(own.sum())} lines divide the municipality, "
        f"{int((~own).sum())} other streets in it are to be designed anew."
    )
    return CityRoads(
        parts[own],
        names[row][own],
        kinds[row][own],
        np.isin(kinds[row][own], CLOSED),
        parts[~own & ~np.isin(kinds[row], CLOSED)],
    )


def _first(frame: gpd.GeoDataFrame, candidates: tuple[str, ...], *, lower: bool = True) -> Texts:
    """Texts of the first column, whatever its case, that is among the candidates."""
    by_lower = {str(c).lower(): c for c in reversed(list(frame.columns))}
    for name in candidates:
        if name in by_lower:
            column = frame[by_lower[name]]
            texts = column.astype(object).where(column.notna(), "").to_numpy()
            found = [str(t).strip() for t in texts]
            return np.array([t.lower() for t in found] if lower else found, dtype=object)
    return np.full(len(frame), "", dtype=object)


def _by_level(frame: gpd.GeoDataFrame, deepest: int) -> npt.NDArray[np.bool_]:
    """Tell which lines have a level that divides."""
    by_lower = {str(c).lower(): c for c in reversed(list(frame.columns))}
    found = np.zeros(len(frame), dtype=np.bool_)
    if "level" not in by_lower:
        return found
    for i, value in enumerate(frame[by_lower["level"]].tolist()):
        if isinstance(value, (int, float, np.number)) and np.isfinite(float(value)):
            found[i] = 1 <= float(value) <= deepest
    return found


def _prepared(geometry: shapely.Geometry) -> shapely.Geometry:
    """Return a geometry that answers many questions fast."""
    shapely.prepare(geometry)
    return geometry
