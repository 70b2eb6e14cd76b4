"""How the layers of a whole city look."""

from __future__ import annotations

from collections.abc import Callable

from qgis.core import QgsFeatureRenderer, QgsVectorLayer

from .symbols import GREY, by_value, fill, marker


def _sub_regions() -> QgsFeatureRenderer:
    return by_value(
        "state",
        [
            ("done", "designed", fill("#f3ecdb", "#8c867c", 0.3)),
            ("left", "stays as it is", fill("#dcdfd8", "#8c867c", 0.3)),
            ("failed", "failed", fill("#f0c4bd", "#b5302a", 0.5)),
            ("not reached", "not reached", fill("#ffffff", "#8c867c", 0.3, "b_diagonal")),
        ],
    )


def _by_gap(_: QgsVectorLayer) -> QgsFeatureRenderer:
    shades = (("proven best", "#5b8f6a"), ("up to 5 %", "#c9cf8f"), ("more", "#dd7f62"))
    by_gap = (
        "CASE WHEN \"gap_pct\" < 0.01 THEN 'proven best' "
        "WHEN \"gap_pct\" <= 5 THEN 'up to 5 %' WHEN \"gap_pct\" > 5 THEN 'more' END"
    )
    entries = [(label, label, fill(colour, "#6b6459", 0.2)) for label, colour in shades]
    return by_value(by_gap, [*entries, ("", "no design", fill("#eeeeee", GREY, 0.2))])


def _junctions() -> QgsFeatureRenderer:
    return by_value(
        "state",
        [
            ("crossing", "streets of both sides", marker("circle", "#3f7d4f", 2.0)),
            ("T-junction", "streets of one side", marker("triangle", "#3b6ea5", 2.2)),
            ("staggered", "the other side ends nearby", marker("diamond", "#b5302a", 2.8)),
            ("not used", "not used", marker("circle", "#c9c4b8", 1.2)),
        ],
    )


CITY_RENDERERS: dict[str, Callable[[], QgsFeatureRenderer]] = {
    "sub_regions": _sub_regions,
    "city_junctions": _junctions,
}
CITY_TITLES = {"sub_regions": "State"}
CITY_OTHERS: dict[str, dict[str, Callable[[QgsVectorLayer], QgsFeatureRenderer]]] = {
    "sub_regions": {"Gap": _by_gap},
}
