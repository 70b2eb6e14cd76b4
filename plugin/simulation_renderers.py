"""How simulated traffic looks: by its flow as assigned traffic, by speed, waiting and time lost."""

from __future__ import annotations

from collections.abc import Callable

from qgis.core import (
    QgsFeatureRenderer,
    QgsGraduatedSymbolRenderer,
    QgsRendererRange,
    QgsVectorLayer,
)

from .street_renderers import COLD_HOT
from .symbols import GREY, line
from .traffic_renderers import flows

_WIDTHS = (0.4, 0.6, 0.8, 1.1, 1.5, 2.0)


def _classes(
    field: str, bounds: tuple[float, ...], unit: str, colours: tuple[str, ...] = COLD_HOT
) -> QgsFeatureRenderer:
    """Streets in fixed classes of a field, so that designs are compared by their colours."""
    ranges = [QgsRendererRange(-2.0, -1e-9, line(GREY, 0.2), "no traffic")]
    for low, high, colour, width in zip(bounds, (*bounds[1:], 1e9), colours, _WIDTHS):
        label = f"{low:g} to {high:g} {unit}" if high < 1e9 else f"{low:g} {unit} and more"
        ranges.append(QgsRendererRange(low, high, line(colour, width), label))
    renderer = QgsGraduatedSymbolRenderer(f'coalesce("{field}", -1)', ranges)
    renderer.setUsingSymbolLevels(True)
    return renderer


def _waiting(_: QgsVectorLayer) -> QgsFeatureRenderer:
    return _classes("waiting_s", (0.0, 1.0, 3.0, 10.0, 30.0, 60.0), "s")


def _loss(_: QgsVectorLayer) -> QgsFeatureRenderer:
    return _classes("loss_s", (0.0, 2.0, 5.0, 10.0, 30.0, 60.0), "s")


def _speed(_: QgsVectorLayer) -> QgsFeatureRenderer:
    bounds = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0)
    return _classes("travel_kmh", bounds, "km/h", COLD_HOT[::-1])


SIMULATION_RENDERERS: dict[str, Callable[[], QgsFeatureRenderer]] = {"simulated_streets": flows}
SIMULATION_TITLES = {"simulated_streets": "Vehicles per hour"}
SIMULATION_OTHERS: dict[str, dict[str, Callable[[QgsVectorLayer], QgsFeatureRenderer]]] = {
    "simulated_streets": {"Speed": _speed, "Waiting": _waiting, "Time lost": _loss},
}
