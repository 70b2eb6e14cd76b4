"""Symbols and classes of the output layers: made in code, so that every QGIS reads them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from qgis.core import (
    QgsAbstractVectorLayerLabeling,
    QgsFeatureRenderer,
    QgsFeatureRequest,
    QgsGraduatedSymbolRenderer,
    QgsPalLayerSettings,
    QgsRendererRange,
    QgsSingleSymbolRenderer,
    QgsSymbol,
    QgsTextBufferSettings,
    QgsTextFormat,
    QgsVectorLayer,
    QgsVectorLayerSimpleLabeling,
)
from qgis.PyQt.QtGui import QColor

from .building_renderers import BUILDING_OTHERS, BUILDING_RENDERERS, BUILDING_TITLES
from .city_renderers import CITY_OTHERS, CITY_RENDERERS, CITY_TITLES
from .growth_renderers import GROWTH_OTHERS, GROWTH_RENDERERS, GROWTH_TITLES
from .parcel_renderers import PARCEL_OTHERS, PARCEL_RENDERERS, PARCEL_TITLES
from .room_renderers import ROOM_LABELS, ROOM_OTHERS, ROOM_RENDERERS, ROOM_TITLES
from .simulation_renderers import (
    SIMULATION_OTHERS,
    SIMULATION_RENDERERS,
    SIMULATION_TITLES,
)
from .street_renderers import STREET_OTHERS, STREET_RENDERERS, STREET_TITLES
from .symbols import GREY, INK, by_value, fill, line, marker
from .traffic_renderers import TRAFFIC_OTHERS, TRAFFIC_RENDERERS, TRAFFIC_TITLES


def _streets() -> QgsFeatureRenderer:
    renderer = by_value(
        "if(\"status\" in ('new', 'given'), \"level\", 'existing')",
        [
            ("existing", "existing", line(GREY, 1.0)),
            (1, "major", line("#8e2b1d", 1.9)),
            (2, "collector", line("#c8442c", 1.4)),
            (3, "local", line("#e58a3a", 0.8)),
            (4, "cul-de-sac", line("#f0b56a", 0.6)),
            ("", "connector or other", line("#c8442c", 0.6, "dash")),
        ],
    )
    # Collectors over locals wherever they meet.
    renderer.setUsingSymbolLevels(True)
    return renderer


def _blocks() -> QgsFeatureRenderer:
    shades = (
        ("under 40 m", 0, 40, "#f6d7c8"),
        ("40 to 60 m", 40, 60, "#f5ecd2"),
        ("60 to 80 m", 60, 80, "#dfe8c9"),
        ("80 to 110 m", 80, 110, "#c2dbc6"),
        ("110 m and more", 110, 1e9, "#a6c8cc"),
    )
    ranges = [
        QgsRendererRange(low, high, fill(colour, GREY), f"width {label}")
        for label, low, high, colour in shades
    ]
    return QgsGraduatedSymbolRenderer("width_m", ranges)


def _junctions() -> QgsFeatureRenderer:
    return by_value(
        'coalesce("is_sink", false)',
        [
            (False, "street junction", marker("circle", INK, 1.2)),
            (True, "way out of the site", marker("circle", "#2f6f73", 2.2)),
        ],
    )


def _problems() -> QgsFeatureRenderer:
    return by_value(
        "severity",
        [
            ("error", "error", marker("cross_fill", "#c00000", 4.0)),
            ("warning", "warning", marker("triangle", "#f0a000", 3.4)),
            ("info", "information", marker("circle", "#4f7fb5", 2.2)),
        ],
    )


def _vertices() -> QgsFeatureRenderer:
    return by_value(
        "role",
        [
            ("corner", "corner", marker("square", INK, 1.6)),
            ("irregular", "inner, irregular", marker("diamond", "#c8442c", 1.8)),
            ("boundary", "boundary", marker("circle", GREY, 0.8)),
            ("inner", "inner", marker("circle", GREY, 0.8)),
        ],
    )


def _edges() -> QgsFeatureRenderer:
    return by_value(
        "if(\"blocked\" OR \"foreign\", 'barred', 'open')",
        [
            ("open", "may become a street", line(GREY, 0.15)),
            ("barred", "crosses an obstacle or foreign ground", line("#c8442c", 0.2, "dot")),
        ],
    )


#: From near to far, or from little to much.
_RAMP = ("#2f6f73", "#5f9e7a", "#a8b85c", "#e3b04b", "#d9753a", "#a8321f")
#: Steps of classes in metres; the smallest is taken that spans a layer.
_STEPS = (10, 25, 50, 100, 200, 250, 500, 1000, 2000, 5000)


def _by_distance(layer: QgsVectorLayer) -> QgsFeatureRenderer:
    """Streets by the way out of the site, in round classes that span the layer."""
    index = layer.fields().indexOf("dist_to_sink_m")
    most = layer.maximumValue(index) if index >= 0 else None
    most = float(most) if isinstance(most, (int, float)) and math.isfinite(most) else 0.0
    step = next((s for s in _STEPS if s * len(_RAMP) >= most), _STEPS[-1])
    ranges = [QgsRendererRange(-2.0, -0.5, line(GREY, 0.6), "existing")]
    for at, colour in enumerate(_RAMP):
        last = at == len(_RAMP) - 1
        label = f"{at * step} m and more" if last else f"{at * step} to {(at + 1) * step} m"
        high = max(most, (at + 1) * step) + 1 if last else (at + 1) * step
        ranges.append(QgsRendererRange(at * step, high, line(colour, 1.0), label))
    # Existing streets are themselves the way out: they have no distance.
    return QgsGraduatedSymbolRenderer('coalesce("dist_to_sink_m", -1)', ranges)


def _by_area(_: QgsVectorLayer) -> QgsFeatureRenderer:
    """Blocks by their area in hectares."""
    limits = (0, 0.25, 0.5, 1, 2, 4)
    shades = ("#f7e3d0", "#f1cda6", "#dcc98f", "#b3c08a", "#7fa98a", "#4f8a86")
    ranges = []
    for at, (low, colour) in enumerate(zip(limits, shades)):
        high = limits[at + 1] if at + 1 < len(limits) else 1e9
        label = f"{low:g} to {high:g} ha" if at + 1 < len(limits) else f"{low:g} ha and more"
        ranges.append(QgsRendererRange(low, high, fill(colour, GREY), label))
    return QgsGraduatedSymbolRenderer('"area_m2" / 10000', ranges)


def _smoothed() -> QgsFeatureRenderer:
    """Streets by how far they have moved."""
    classes = (
        ("stayed (under 0.5 m)", -1.0, 0.5, GREY, 0.8),
        ("0.5 to 2 m", 0.5, 2.0, _RAMP[0], 1.0),
        ("2 to 5 m", 2.0, 5.0, _RAMP[2], 1.0),
        ("5 to 10 m", 5.0, 10.0, _RAMP[4], 1.0),
        ("10 m and more", 10.0, 1e9, _RAMP[5], 1.0),
    )
    ranges = [
        QgsRendererRange(low, high, line(colour, width), f"moved {label}" if low > 0 else label)
        for label, low, high, colour, width in classes
    ]
    return QgsGraduatedSymbolRenderer("moved_m", ranges)


def _boundaries() -> QgsFeatureRenderer:
    """Candidates for a place: the best one stands out, small ones lie over large ones."""
    colours = ("181,64,42", "47,111,115", "201,138,27", "91,95,168", "111,143,58")
    entries: list[tuple[Any, str, QgsSymbol]] = [
        (rank, f"rank {rank}", fill(f"{colour},{70 if rank == 1 else 25}", colour, 0.5))
        for rank, colour in enumerate(colours, 1)
    ]
    renderer = by_value("rank", [*entries, ("", "lower ranks", fill("140,134,124,20", GREY))])
    large_first = QgsFeatureRequest.OrderByClause("area_ha", False)
    renderer.setOrderBy(QgsFeatureRequest.OrderBy([large_first]))
    renderer.setOrderByEnabled(True)
    return renderer


def _rank_labels() -> QgsAbstractVectorLayerLabeling:
    settings = QgsPalLayerSettings()
    settings.fieldName = (
        """concat("rank", '. ', coalesce("name", concat("kind", ' ', "osm_id")), '\\n',"""
        """ round("area_ha", if("area_ha" < 10, 1, 0)), ' ha')"""
    )
    settings.isExpression = True
    text = QgsTextFormat()
    text.setSize(9)
    text.setColor(QColor(INK))
    halo = QgsTextBufferSettings()
    halo.setEnabled(True)
    halo.setSize(0.8)
    text.setBuffer(halo)
    settings.setFormat(text)
    return QgsVectorLayerSimpleLabeling(settings)


#: Labels by the names of styles, for those that have any.
LABELS: dict[str, Callable[[], QgsAbstractVectorLayerLabeling]] = {
    "boundaries": _rank_labels,
    **ROOM_LABELS,
}


def _osm_streets() -> QgsFeatureRenderer:
    renderer = by_value(
        "if(\"tunnel\" <> '', 'tunnel', \"level\")",
        [
            (1, "major", line("#6b6459", 1.8)),
            (2, "collector", line("#837b6e", 1.2)),
            (3, "local", line("#9d958a", 0.8)),
            (4, "service way or path", line("#b8b1a6", 0.4)),
            ("tunnel", "tunnel", line("#b8b1a6", 0.6, "dot")),
        ],
    )
    renderer.setUsingSymbolLevels(True)
    return renderer


def _intersections() -> QgsFeatureRenderer:
    return by_value(
        "kind",
        [
            ("junction", "junction", marker("circle", INK, 1.2)),
            ("dead end", "dead end", marker("square", "#c8442c", 1.2)),
        ],
    )


def _landuse() -> QgsFeatureRenderer:
    shades = {
        "housing": "#e8d3c4",
        "work": "#d8c7dc",
        "development": "#f1dda0",
        "public": "#f3d9a9",
        "transport": "#d6d3cd",
        "green": "#c6dcae",
        "farming": "#e7e6bf",
        "water": "#b5d3e2",
        "other": "#e6e2da",
    }
    return by_value(
        "theme", [(theme, theme, fill(shade, GREY, 0.1)) for theme, shade in shades.items()]
    )


def _osm_obstacles() -> QgsFeatureRenderer:
    return by_value(
        "if(\"kind\" IN ('water', 'sea'), 'water', \"kind\")",
        [
            ("water", "water", fill("#8fbad1", "#4f86a5", 0.2)),
            ("green", "green", fill("#b3d195", "#6f9440", 0.2)),
            ("rail", "rail", fill("#6d6a75", "#4d4a55", 0.2, "b_diagonal")),
            ("motorway", "motorway", fill("#b5765f", "#8e2b1d", 0.2, "b_diagonal")),
            ("", "other barrier", fill("#9b3a2f", "#9b3a2f", 0.3, "b_diagonal")),
        ],
    )


#: Styles by the names that `fields` uses; each makes a fresh renderer.
RENDERERS: dict[str, Callable[[], QgsFeatureRenderer]] = {
    "streets": _streets,
    "junctions": _junctions,
    "blocks": _blocks,
    "problems": _problems,
    "vertices": _vertices,
    "edges": _edges,
    "site": lambda: QgsSingleSymbolRenderer(fill("160,176,96,50", "#55702f", 0.6)),
    "existing": lambda: QgsSingleSymbolRenderer(line(GREY, 1.0)),
    "access": lambda: QgsSingleSymbolRenderer(marker("triangle", "#2f6f73", 3.0)),
    "obstacles": lambda: QgsSingleSymbolRenderer(fill("#9b3a2f", "#9b3a2f", 0.3, "b_diagonal")),
    "boundaries": _boundaries,
    "faces": lambda: QgsSingleSymbolRenderer(fill("#f5f1e8", "#d8d2c6", 0.1)),
    "smoothed": _smoothed,
    "osm_streets": _osm_streets,
    "intersections": _intersections,
    "buildings": lambda: QgsSingleSymbolRenderer(fill("#cfc8bd", "#8c867c", 0.15)),
    "landuse": _landuse,
    "osm_obstacles": _osm_obstacles,
    **PARCEL_RENDERERS,
    **BUILDING_RENDERERS,
    **CITY_RENDERERS,
    **GROWTH_RENDERERS,
    **ROOM_RENDERERS,
    **STREET_RENDERERS,
    **TRAFFIC_RENDERERS,
    **SIMULATION_RENDERERS,
}

#: What the styles above show, as the planner reads it in the list of a layer's styles.
TITLES = {
    "streets": "Level",
    "blocks": "Width",
    **PARCEL_TITLES,
    **BUILDING_TITLES,
    **CITY_TITLES,
    **GROWTH_TITLES,
    **ROOM_TITLES,
    **STREET_TITLES,
    **TRAFFIC_TITLES,
    **SIMULATION_TITLES,
}
#: Further styles that a layer offers: by the name of its first one, their titles and what makes
#: them for a layer.
OTHERS: dict[str, dict[str, Callable[[QgsVectorLayer], QgsFeatureRenderer]]] = {
    "streets": {"Distance to the exit": _by_distance},
    "blocks": {"Area": _by_area},
    **PARCEL_OTHERS,
    **BUILDING_OTHERS,
    **CITY_OTHERS,
    **GROWTH_OTHERS,
    **ROOM_OTHERS,
    **STREET_OTHERS,
    **TRAFFIC_OTHERS,
    **SIMULATION_OTHERS,
}
