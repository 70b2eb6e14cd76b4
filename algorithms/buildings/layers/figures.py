"""What was reached of what was asked (RZ Table 5)."""

from __future__ import annotations

from collections.abc import Mapping

import geopandas as gpd
from pyproj import CRS

from ...measure.zone_figures import zone_figures
from ..rules import LayoutRules


def indices(
    layers: Mapping[str, gpd.GeoDataFrame], rules: LayoutRules, *, crs: CRS | None = None
) -> dict[str, float]:
    """Give the indices of laid out zones, reached and asked (RZ Table 5).

    Parameters
    ----------
    layers
        Those of `zone_layers`.
    rules
        What was asked.
    crs
        CRS to measure in; None for one that fits.

    Returns
    -------
    dict of str to float
        "far_reached" and "far_asked", "density_...", "green_..." as ratios; "parking_places" and
        "parking_asked"; "residence_share", "facility_share", "path_share", "street_share" and
        "parking_share" in % of the zone; "zone_ha", "building_count", "dwellings",
        "dwellings_ha", "parking_per_dwelling", "shaded" (residences), "mean_sun" and "least_sun"
        (hours, residences), "mean_way" and "longest_way" (metres). nan where there is nothing
        to measure.

    Raises
    ------
    InputError
        If a layer is missing.
    """
    found = zone_figures(layers, crs=crs)
    built = layers["buildings"]
    asked = float(built["parking"].sum()) if "parking" in built.columns else 0.0
    return {
        "zone_ha": found.zone_ha,
        "far_reached": found.far,
        "far_asked": rules.far,
        "density_reached": found.density,
        "density_asked": rules.density,
        "green_reached": found.green,
        "green_asked": rules.green,
        "residence_share": found.residence_pct,
        "facility_share": found.facility_pct,
        "path_share": found.path_pct,
        "street_share": found.street_pct,
        "parking_share": found.parking_pct,
        "parking_places": float(found.parking_places),
        "parking_asked": asked,
        "parking_per_dwelling": found.parking_per_dwelling,
        "building_count": float(found.buildings),
        "dwellings": float(found.dwellings),
        "dwellings_ha": found.dwellings_ha,
        "shaded": float(found.shaded),
        "mean_sun": found.mean_sun,
        "least_sun": found.least_sun,
        "mean_way": found.mean_way,
        "longest_way": found.longest_way,
    }
