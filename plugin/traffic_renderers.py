"""How traffic looks: grey without any, then from blue to red and wider (CND Fig. 8)."""

from __future__ import annotations

from collections.abc import Callable

from qgis.core import (
    QgsFeatureRenderer,
    QgsGraduatedSymbolRenderer,
    QgsRendererRange,
    QgsVectorLayer,
)

from .street_renderers import COLD_HOT
from .symbols import GREY, by_value, line, marker

#: Bounds of the classes of flow, vehicles per hour: each about twice the one before.
_FLOWS = (0.05, 10, 25, 50, 100, 250, 500, 1e9)
#: Bounds of the classes of volume / capacity.
_USES = (1e-6, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0, 1e9)
_COLOURS = (*COLD_HOT, "#7a1522")
_WIDTHS = (0.4, 0.6, 0.8, 1.1, 1.5, 2.0, 2.6)


def _classes(field: str, bounds: tuple[float, ...], unit: str) -> QgsFeatureRenderer:
    """Streets in classes of a field, grey below the first, those of the highest on top."""
    ranges = [QgsRendererRange(-1.0, bounds[0], line("#c9c4bb", 0.35), "no traffic")]
    for at, (low, high) in enumerate(zip(bounds, bounds[1:])):
        shown = 0 if at == 0 else low
        label = f"{shown:g} and more{unit}" if high >= 1e9 else f"{shown:g} to {high:g}{unit}"
        ranges.append(QgsRendererRange(low, high, line(_COLOURS[at], _WIDTHS[at]), label))
    renderer = QgsGraduatedSymbolRenderer(f'coalesce("{field}", 0)', ranges)
    renderer.setUsingSymbolLevels(True)
    return renderer


def flows(_: QgsVectorLayer | None = None) -> QgsFeatureRenderer:
    """Return streets by their flow, `flow_veh_h`."""
    return _classes("flow_veh_h", _FLOWS, " vehicles/h")


def _through(_: QgsVectorLayer) -> QgsFeatureRenderer:
    return _classes("through_veh_h", _FLOWS, " vehicles/h")


def _use(_: QgsVectorLayer) -> QgsFeatureRenderer:
    return _classes("v_c", _USES, "")


def _places() -> QgsFeatureRenderer:
    return by_value(
        "kind",
        [
            ("gate", "gate", marker("diamond", "#b5302a", 3.0)),
            ("interior", "interior place", marker("circle", GREY, 1.2)),
        ],
    )


TRAFFIC_RENDERERS: dict[str, Callable[[], QgsFeatureRenderer]] = {
    "assigned_streets": flows,
    "traffic_places": _places,
}
TRAFFIC_TITLES = {"assigned_streets": "Vehicles per hour"}
TRAFFIC_OTHERS: dict[str, dict[str, Callable[[QgsVectorLayer], QgsFeatureRenderer]]] = {
    "assigned_streets": {"Volume / capacity": _use, "Gate to gate": _through},
}
