"""The layers of all storeys of all buildings, and what could not be had."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import geopandas as gpd
import pandas as pd

from ..errors import InputError
from .design import Storey
from .floors import Remark
from .layers import COLUMNS, StoreyPlan, floor_figures, floor_layers
from .problems import problem_layer, reasons_of

#: Numbers that go through all buildings.
_IDS = ("room_id", "corridor_id", "line_id", "door_id", "face_id", "obstacle_id")


def floor_frames(
    storeys: Sequence[Storey], corridor_width: float, layer: str
) -> tuple[dict[str, gpd.GeoDataFrame], dict[str, float]]:
    """Write the plans of all storeys as layers.

    Parameters
    ----------
    storeys
        Storeys with and without plans, of any number of footprints in one CRS; at least one.
    corridor_width
        Metres.
    layer
        Name of the layer of footprints, for problems.

    Returns
    -------
    dict of str to geopandas.GeoDataFrame
        Those of `layers.COLUMNS`, with the number of the footprint, and "problems"; in the CRS of
        the footprints.
    dict of str to float
        Numbers of all storeys by the keys of the tool; none where there is no plan.
    """
    source = storeys[0].floor.source_crs
    made: list[dict[str, gpd.GeoDataFrame]] = []
    told: list[gpd.GeoDataFrame] = []
    features = list(dict.fromkeys(own.floor.feature for own in storeys))
    for number, feature in enumerate(features, start=1):
        mine = [own for own in storeys if own.floor.feature == feature]
        remarks = [remark for own in mine for remark in own.floor.remarks]
        for own in mine:
            told_of = reasons_of(own.floor, own.error) if own.error is not None else []
            if own.links_missing:
                told_of.append(_links_remark(own))
            which = f"Storey {own.floor.storey}: " if len(mine) > 1 else ""
            remarks += [dataclasses.replace(one, text=f"{which}{one.text}") for one in told_of]
        try:
            frames = _layers(mine, corridor_width)
        except InputError as error:
            place = mine[0].floor.polygon.representative_point()
            remarks.append(Remark(error.problem, error.remedy, "error", place))
            frames = None
        if frames is not None:
            made.append(_numbered(frames, number, made))
        # storeys of one building repeat what was found of their footprint
        once = {(own.text, own.action, own.geometry.wkb): own for own in remarks}
        crs = mine[0].floor.crs
        told.append(problem_layer(once.values(), layer, feature, crs, source))
    found = _joined(made, source)
    figures = _figures(found) if made else {}
    full = [own for own in told if len(own)]
    found["problems"] = pd.concat(full, ignore_index=True) if full else told[0]
    return found, figures


def _layers(storeys: Sequence[Storey], corridor_width: float) -> dict[str, gpd.GeoDataFrame] | None:
    """Return the layers of one building, or None where it has no plan."""
    plans = [
        StoreyPlan(own.problem, own.plan, own.floor.polygon, own.floor.storey)
        for own in storeys
        if own.plan is not None
    ]
    if not plans:
        return None
    floor = storeys[0].floor
    return floor_layers(plans, floor.crs, corridor_width, floor.source_crs)


def _numbered(
    frames: dict[str, gpd.GeoDataFrame], number: int, before: Sequence[dict[str, gpd.GeoDataFrame]]
) -> dict[str, gpd.GeoDataFrame]:
    """Give features the number of their building, and go on counting."""
    owner = {"room_id": "rooms", "corridor_id": "corridors", "line_id": "corridor_lines",
             "door_id": "doors", "face_id": "faces", "obstacle_id": "obstacles"}  # fmt: skip
    shift = {key: sum(len(own[name]) for own in before) for key, name in owner.items()}
    found = {}
    for name, frame in frames.items():
        own = frame.copy()
        for key in (key for key in _IDS if key in own.columns):
            own[key] = own[key].where(own[key] < 0, own[key] + shift[key])
        own["footprint_id"] = number
        found[name] = own
    return found


def _links_remark(storey: Storey) -> Remark:
    """Tell of short ways between parts that a storey has not."""
    return Remark(
        f"{storey.links_missing} of {storey.links} short ways between its parts are missing.",
        "More time, or larger parts, may help.",
        "warning",
        storey.floor.polygon.representative_point(),
    )


def _joined(made: Sequence[dict[str, gpd.GeoDataFrame]], crs: Any) -> dict[str, gpd.GeoDataFrame]:
    """Return the layers of all buildings as one each, empty where there is none."""
    found = {}
    for name, columns in COLUMNS.items():
        frames = [own[name] for own in made if len(own[name])]
        if frames:
            found[name] = pd.concat(frames, ignore_index=True)
            continue
        data: dict[str, list[Any]] = {column: [] for column in (*columns, "footprint_id")}
        found[name] = gpd.GeoDataFrame(data, geometry=[], crs=crs)
    return found


def _figures(found: dict[str, gpd.GeoDataFrame]) -> dict[str, float]:
    """Return the numbers that the tool tells."""
    figures = floor_figures(found)
    return {
        "ROOM_COUNT": figures["rooms"],
        "CORRIDOR_SHARE": 100.0 * figures["corridor_share"],
        "NET_TO_GROSS": 100.0 * figures["net_to_gross"],
        "CORRIDOR_LENGTH": figures["corridor_m"],
        "MEAN_EGRESS": figures["mean_egress_m"],
        "MAX_EGRESS": figures["max_egress_m"],
    }
