"""Lines of OpenStreetMap as other programs read them: which of them are streets.

QuickOSM makes a column of every tag; the OSM driver of GDAL keeps some tags as columns and the
rest, as the text of an hstore, in ``other_tags``. Both put streams, tracks and fences among the
streets.
"""

from __future__ import annotations

import re
from typing import Any

import geopandas as gpd
import numpy as np
import numpy.typing as npt

#: Columns that only layers of OpenStreetMap have, in QuickOSM, GDAL, osmnx and Overpass turbo.
_SIGNS = {"full_id", "osm_id", "osmid", "osm_way_id", "other_tags", "@id"}
_PAIR = re.compile(r'"((?:[^"\\]|\\.)*)"\s*=>\s*"((?:[^"\\]|\\.)*)"')
_NO = ("", "no", "0", "false", "f", "n")
#: Values of highway of what is not there yet or no more, and of what is beside streets.
_NO_STREETS = (
    "", "no", "planned", "proposed", "abandoned", "disused", "razed", "demolished", "services",
    "rest_area", "bus_stop",
)  # fmt: skip


def is_osm(frame: gpd.GeoDataFrame) -> bool:
    """Tell whether a layer holds things of OpenStreetMap, streets among them.

    Parameters
    ----------
    frame
        Any layer.
    """
    names = {str(c).lower() for c in frame.columns}
    return "highway" in names and bool(names & _SIGNS)


def hstore(value: Any) -> dict[str, str]:
    r"""Return the tags of a text such as GDAL writes into other_tags.

    Parameters
    ----------
    value
        The text; anything else has no tags.

    Examples
    --------
    >>> hstore('"layer"=>"-1","tunnel"=>"yes"')
    {'layer': '-1', 'tunnel': 'yes'}
    """
    if not isinstance(value, str):
        return {}
    return {re.sub(r"\\(.)", r"\1", k): re.sub(r"\\(.)", r"\1", v) for k, v in _PAIR.findall(value)}


def tag(frame: gpd.GeoDataFrame, key: str) -> npt.NDArray[Any]:
    """Return the values of a tag, from its column or from other_tags.

    Parameters
    ----------
    frame
        A layer of OpenStreetMap.
    key
        The tag.

    Returns
    -------
    numpy.ndarray of str
        In lower case, empty where the tag is missing.
    """
    by_lower = {str(c).lower(): c for c in reversed(list(frame.columns))}
    found = np.full(len(frame), "", dtype=object)
    if "other_tags" in by_lower:
        found[:] = [hstore(v).get(key, "") for v in frame[by_lower["other_tags"]]]
    if key in by_lower:
        column = frame[by_lower[key]]
        own = column.astype(object).where(column.notna(), "").to_numpy()
        found = np.array([str(v).strip() or f for v, f in zip(own, found)], dtype=object)
    return np.array([v.lower() for v in found], dtype=object).reshape(-1)


def no_street(frame: gpd.GeoDataFrame) -> npt.NDArray[np.bool_]:
    """Tell which lines of a layer of OpenStreetMap are something else than streets.

    Parameters
    ----------
    frame
        A layer for which `is_osm` holds.

    Returns
    -------
    numpy.ndarray of bool
        True for lines without a value of highway, such as streams, tracks and fences, for streets
        that are planned or gone, and for the outlines of squares (area=yes).
    """
    area = tag(frame, "area") == "yes"
    other: npt.NDArray[np.bool_] = area | np.isin(tag(frame, "highway"), _NO_STREETS)
    return other


def in_tunnel(frame: gpd.GeoDataFrame) -> npt.NDArray[np.bool_]:
    """Tell which lines of a layer of OpenStreetMap run in a tunnel.

    Parameters
    ----------
    frame
        A layer for which `is_osm` holds.

    Returns
    -------
    numpy.ndarray of bool
        True where tunnel says anything but no.
    """
    return ~np.isin(tag(frame, "tunnel"), _NO)
