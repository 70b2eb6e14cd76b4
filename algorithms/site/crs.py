"""Coordinate systems: from whatever the layers have to plane metres and back.

Degrees and feet never reach the mathematics (design notes, section 3).
"""

from __future__ import annotations

from functools import lru_cache

import geopandas as gpd
import numpy as np
import numpy.typing as npt
from pyproj import CRS, Proj, Transformer
from pyproj.exceptions import ProjError

from ..errors import InputError

DISTORTION = 1e-3
"""Largest accepted relative error of lengths in a working CRS."""


def layer_crs(frame: gpd.GeoDataFrame, layer: str) -> CRS:
    """Give the CRS of a layer.

    Parameters
    ----------
    frame
        The layer.
    layer
        Its name, for the message.

    Returns
    -------
    CRS
        Horizontal part of the layer's CRS.

    Raises
    ------
    InputError
        If the layer has no CRS.
    """
    if frame.crs is None:
        raise InputError(
            "has no coordinate reference system (CRS).",
            "Assign the right one (in QGIS: right-click the layer, Layer CRS, Set Layer CRS) "
            "and run again.",
            layer=layer,
        )
    return horizontal(CRS.from_user_input(frame.crs))


def horizontal(crs: CRS) -> CRS:
    """Give the horizontal part of a compound CRS, or the CRS itself.

    Parameters
    ----------
    crs
        Any CRS.

    Returns
    -------
    CRS
        A CRS with two axes where there is one.
    """
    if crs.is_compound:
        return CRS.from_user_input(crs.sub_crs_list[0])
    return crs


def distortion(crs: CRS, bounds: npt.NDArray[np.float64]) -> float:
    """Measure by how much lengths are wrong in a projected CRS.

    Parameters
    ----------
    crs
        Projected CRS.
    bounds
        Smallest x, smallest y, largest x, largest y, in `crs`.

    Returns
    -------
    float
        Largest |scale - 1| at the corners and the centre; infinite where unknown.
    """
    x, y = _five_points(bounds)
    try:
        lon, lat = transformer(crs, crs.geodetic_crs).transform(x, y)
        factors = Proj(crs).get_factors(lon, lat, errcheck=False)
    except (ProjError, TypeError):
        return float("inf")
    scales = np.concatenate(
        [np.atleast_1d(factors.meridional_scale), np.atleast_1d(factors.parallel_scale)]
    )
    # get_factors measures on the grid of the ellipsoid, unit by unit: metres per metre
    return float(np.max(np.abs(scales - 1.0))) if np.all(np.isfinite(scales)) else float("inf")


def is_metric(crs: CRS) -> bool:
    """Tell whether a CRS is projected and counts in metres.

    Parameters
    ----------
    crs
        Any CRS.

    Returns
    -------
    bool
        True where both horizontal axes are in metres.
    """
    return bool(crs.is_projected) and all(
        abs(axis.unit_conversion_factor - 1.0) < 1e-12 for axis in crs.axis_info[:2]
    )


def working_crs(crs: CRS, bounds: npt.NDArray[np.float64], layer: str) -> CRS:
    """Choose the planar CRS, in metres, in which a site is worked on.

    The input's own where it is metric and true to 0.1 % over the bounds; else the UTM zone
    of the centre, else a transverse Mercator projection centred there.

    Parameters
    ----------
    crs
        CRS of the input.
    bounds
        Smallest x, smallest y, largest x, largest y of the site, in `crs`.
    layer
        Name of the layer, for the message.

    Returns
    -------
    CRS
        Projected CRS in metres.

    Raises
    ------
    InputError
        If the coordinates do not fit the CRS.
    """
    if is_metric(crs) and distortion(crs, bounds) < DISTORTION:
        return crs
    x, y = _five_points(bounds)
    try:
        lon, lat = transformer(crs, CRS.from_epsg(4326)).transform(x, y)
    except ProjError as error:
        raise _misfit(crs, layer) from error
    if not (np.all(np.isfinite(lon)) and np.all(np.abs(lat) <= 90.0)):
        raise _misfit(crs, layer)
    utm = _utm(float(lon[4]), float(lat[4]))
    if utm is not None and distortion(utm, _project(utm, lon, lat)) < DISTORTION:
        return utm
    # rounded, so that preparing a prepared site again picks the same projection
    centre = f"+lat_0={round(float(lat[4]), 2)} +lon_0={round(float(lon[4]), 2)}"
    return CRS.from_user_input(f"+proj=tmerc {centre} +k=1 +datum=WGS84 +units=m +type=crs")


@lru_cache(maxsize=64)
def transformer(source: CRS, target: CRS) -> Transformer:
    """Give the transformer between two CRSs, x before y.

    Parameters
    ----------
    source, target
        From and to.

    Returns
    -------
    Transformer
        Takes and gives x (east) first.
    """
    return Transformer.from_crs(source, target, always_xy=True)


def _five_points(
    bounds: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    x0, y0, x1, y1 = (float(b) for b in bounds)
    x = np.array([x0, x1, x1, x0, (x0 + x1) / 2])
    y = np.array([y0, y0, y1, y1, (y0 + y1) / 2])
    return x, y


def _project(
    crs: CRS, lon: npt.NDArray[np.float64], lat: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    x, y = transformer(CRS.from_epsg(4326), crs).transform(lon, lat)
    return np.array([np.min(x), np.min(y), np.max(x), np.max(y)])


def _utm(lon: float, lat: float) -> CRS | None:
    if not -80.0 <= lat <= 84.0:
        return None
    zone = int((lon + 180.0) // 6.0) % 60 + 1
    return CRS.from_epsg((32600 if lat >= 0 else 32700) + zone)


def _misfit(crs: CRS, layer: str) -> InputError:
    return InputError(
        f"the coordinates do not fit the layer's CRS ({crs.name}).",
        "Assign the CRS in which the layer was drawn and run again.",
        layer=layer,
    )
