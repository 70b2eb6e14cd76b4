"""Rows of buildings and of their shadows."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from ...site.crs import transformer
from ..details.parking import places_needed
from ..layout import Layout
from ..rules import LayoutRules, SunRule
from ..shape import facing_vectors, footprints, residences, sizes
from ..sun.shade import shaded
from ..types import Floats
from ..zone import Zone

MONTHS = (
    "January", "February", "March", "April", "May", "June", "July", "August", "September",
    "October", "November", "December",
)  # fmt: skip
#: Façades are turned to the map by pieces of this length, metres.
REACH = 1.0


def building_rows(layout: Layout, rules: LayoutRules) -> dict[str, Any]:
    """Give the columns of the buildings."""
    zone, types, placed = layout.zone, layout.types, layout.placements
    kinds = [types[k] for k in placed.type]
    size = sizes(types, placed)
    plan = layout.paths
    dark = shaded(zone, types, placed, rules.sun) & residences(types, placed)
    return {
        "building_id": np.arange(1, len(placed) + 1),
        "site_id": [zone.site_id] * len(placed),
        "patch_id": placed.patch + 1,
        "type": [kind.name for kind in kinds],
        "use": [kind.use for kind in kinds],
        "height_m": size[:, 2],
        "storeys": np.array([kind.storeys for kind in kinds], dtype=np.int64),
        "footprint_m2": size[:, 0] * size[:, 1],
        "floor_area_m2": np.array([kind.floor_area_m2 for kind in kinds], dtype=float),
        "dwellings": np.array([kind.dwellings for kind in kinds], dtype=np.int64),
        "parking": places_needed(types, placed),
        "group": np.unique(layout.group, return_inverse=True)[1].astype(np.int64) + 1,
        # sums of steps come out as 1.9999999
        "sun_hours": np.round(layout.sun_hours, 6),
        "shaded": dark,
        "facing_deg": (placed.facing + zone.convergence_deg) % 360.0,
        "rotation": rotations(zone, placed.xy, placed.facing),
        "reached": plan.reached,
        "way_m": np.where(plan.reached, plan.length_m, np.nan),
        "turns": [int(t) if yes else None for t, yes in zip(plan.turns, plan.reached)],
        "geometry": footprints(types, placed),
    }


def shadow_rows(layout: Layout, rules: LayoutRules) -> dict[str, Any]:
    """Give the columns of the shadows."""
    count = len(layout.shadows)
    return {
        "building_id": np.arange(1, count + 1),
        "site_id": [layout.zone.site_id] * count,
        "rule": [rule_text(rules.sun)] * count,
        "area_m2": shapely.area(list(layout.shadows)),
        "geometry": [_multi(shadow) for shadow in layout.shadows],
    }


def rule_text(rule: SunRule) -> str:
    """Say a sun rule in words.

    Examples
    --------
    >>> rule_text(SunRule(coefficient=1.2))
    '1.2 x height behind the building'
    >>> rule_text(SunRule(hours=2.0))
    '2 h of sun between 9:00 and 15:00 on 20 January'
    """
    if rule.hours is None:
        return f"{rule.coefficient:g} x height behind the building"
    window = " and ".join(f"{int(h)}:{round(h % 1 * 60):02d}" for h in (rule.start, rule.end))
    return f"{rule.hours:g} h of sun between {window} on {rule.day} {MONTHS[rule.month - 1]}"


def rotations(zone: Zone, xy: Floats, facing: Floats) -> Floats:
    """Give the rotation of symbols on a map in the CRS of the input, degrees clockwise.

    Parameters
    ----------
    zone
        For its CRSs.
    xy
        Centres, metres, shape (n, 2).
    facing
        Azimuths of the balconies in the working CRS, shape (n,).

    Returns
    -------
    numpy.ndarray
        Shape (n,), 0 up to 360; 0 where the balconies are below on the map. A map in degrees is
        taken to have north above.
    """
    if zone.source_crs.is_geographic:
        azimuth = facing + zone.convergence_deg
    elif zone.source_crs == zone.crs:
        azimuth = facing
    else:
        there = transformer(zone.crs, zone.source_crs)
        step = xy + REACH * facing_vectors(facing)
        x, y = there.transform(xy[:, 0], xy[:, 1])
        u, v = there.transform(step[:, 0], step[:, 1])
        azimuth = np.degrees(np.arctan2(np.asarray(u) - x, np.asarray(v) - y))
    return np.asarray(np.round((azimuth - 180.0) % 360.0, 6) % 360.0)


def _multi(shape: shapely.Geometry) -> shapely.MultiPolygon:
    """Give polygons as one geometry of several parts."""
    parts = shapely.get_parts(shape)
    return shapely.MultiPolygon(parts[shapely.get_type_id(parts) == 3].tolist())
