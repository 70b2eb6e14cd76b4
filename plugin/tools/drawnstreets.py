"""Streets that a planner hands over: given ones, and those of an earlier design."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...algorithms.errors import InputError
from ..request import Request


def given_streets(request: Request, frame: Any, crs: Any) -> dict[str, Any]:
    """Return the given streets by level as `Wishes` takes them.

    Raises
    ------
    InputError
        A level is none of 1 to 4; the text names the feature.
    """
    lines: dict[int, list[Any]] = {}
    ids: dict[int, list[int]] = {}
    # of an earlier design, what it designed
    frame = with_status(frame, ("new", "given"))
    for i, line in single_shapes(frame, crs):
        value = frame["level"].get(i) if "level" in frame.columns else None
        level = "1" if value is None or value != value else str(value).removesuffix(".0")
        if level not in ("1", "2", "3", "4"):
            raise InputError(
                f"Its level is {value}.",
                "Give 1 (major), 2 (collector), 3 (local) or 4 (cul-de-sac) in the field level.",
                layer=request.name("GIVEN"),
                feature=i,
            )
        lines.setdefault(int(level), []).append(line)
        ids.setdefault(int(level), []).append(i)
    names = dict.fromkeys(lines, request.name("GIVEN"))
    return {"given": lines, "given_ids": ids, "given_layers": names}


def required_streets(frame: Any, crs: Any) -> tuple[list[tuple[int, Any]], list[int]]:
    """Return required streets with their feature ids, and the level of each, 0 for the first."""
    # of an earlier design, what it designed
    frame = with_status(frame, ("new",))
    found = single_shapes(frame, crs)
    levels = []
    for i, _ in found:
        value = frame["level"].get(i) if "level" in frame.columns else None
        levels.append(int(value) if value in (2, 3, 4) else 0)
    return found, levels


def earlier_streets(frame: Any, crs: Any) -> dict[int, list[Any]]:
    """Return the new streets of an earlier design by level, 0 where it is not told."""
    if frame is None:
        return {}
    frame = with_status(frame, ("new",))
    found: dict[int, list[Any]] = {}
    for i, line in single_shapes(frame, crs):
        value = frame["level"].get(i) if "level" in frame.columns else None
        known = value in (1, 2, 3, 4)
        found.setdefault(int(value) if known else 0, []).append(line)
    return found


def with_status(frame: Any, words: Sequence[str]) -> Any:
    """Return the streets of an earlier design with these words as status.

    Other layers may have a field of that name, too: where nothing has such a status, all counts.
    """
    if frame is None or "status" not in frame.columns:
        return frame
    own = frame["status"].isin(words)
    return frame[own] if own.any() else frame


def single_shapes(frame: Any, crs: Any) -> list[tuple[int, Any]]:
    """Return feature ids and single geometries of a layer in a CRS; nothing where none is given."""
    if frame is None:
        return []
    shapes = frame.geometry.copy()
    areas = shapes.geom_type.isin(("Polygon", "MultiPolygon"))
    torn = areas & ~shapes.is_valid
    if torn.any():
        shapes[torn] = shapes[torn].make_valid()
    parts = shapes.to_crs(crs).explode(index_parts=False)
    # a repaired area may come with lines
    parts = parts[~(parts.isna() | parts.is_empty | (areas[parts.index] & (parts.area == 0)))]
    return [(int(i), shape) for i, shape in parts.items()]
