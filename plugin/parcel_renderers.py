"""How parcels look: from blue, as wished, to red, undesirable (UP Figs. 10 and 12)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from qgis.core import (
    QgsFeatureRenderer,
    QgsGraduatedSymbolRenderer,
    QgsRendererRange,
    QgsSingleSymbolRenderer,
    QgsVectorLayer,
)

from .symbols import GREY, by_value, fill, line

#: From good to bad.
BLUE_RED = ("#2b5c9e", "#6b9bc9", "#c4d8e6", "#f3c9ae", "#dd7f62", "#b5302a")
#: What is no parcel, or has no value.
_NONE = "#dfe5cf"
#: Share of what makes a parcel undesirable: 1 where p_angle is 15 degrees or p_area 1.2.
_QUALITY = 'coalesce(max("p_angle" / 15, ("p_area" - 1) / 0.2), -1)'


def _classes(expression: str, limits: Sequence[float], labels: Sequence[str]) -> QgsFeatureRenderer:
    """Return a renderer by classes from blue to red; values below 0 are none.

    Parameters
    ----------
    expression
        What is shown; -1 where there is nothing to show.
    limits
        Upper bounds of all classes but the last.
    labels
        Of the classes.
    """
    ranges = [QgsRendererRange(-2.0, -0.001, fill(_NONE, GREY, 0.1), "not measured")]
    bounds = [-0.001, *limits, 1e9]
    ranges += [
        QgsRendererRange(low, high, fill(colour, "#ffffff", 0.15), label)
        for low, high, colour, label in zip(bounds, bounds[1:], BLUE_RED, labels)
    ]
    return QgsGraduatedSymbolRenderer(expression, ranges)


def _quality() -> QgsFeatureRenderer:
    labels = (
        "very good: under a quarter of both limits",
        "good: under half of both limits",
        "fair: under three quarters of both limits",
        "poor: within the limits",
        "undesirable: p_angle over 15 degrees or p_area over 1.2",
        "undesirable: more than twice a limit",
    )
    return _classes(_QUALITY, (0.25, 0.5, 0.75, 1.0, 2.0), labels)


def _by(field: str, unit: str, limits: Sequence[float]) -> Callable[..., QgsFeatureRenderer]:
    """Return what makes a renderer by a field, where 0 or 1 is the best."""
    unit = unit and f" {unit}"
    steps = [f"under {limits[0]:g}{unit}"]
    steps += [f"{low:g} to {high:g}{unit}" for low, high in zip(limits, limits[1:])]
    steps.append(f"{limits[-1]:g}{unit} and more")

    def make(_: QgsVectorLayer) -> QgsFeatureRenderer:
        return _classes(f'coalesce("{field}", -1)', limits, steps)

    return make


def _access(_: QgsVectorLayer) -> QgsFeatureRenderer:
    ranges = [
        QgsRendererRange(low, high, fill(colour, "#ffffff", 0.15), label)
        for low, high, colour, label in (
            (-2.0, -0.5, _NONE, "not measured"),
            (-0.5, 0.5, BLUE_RED[-1], "no access: less than 3 m along a street"),
            (0.5, 2.0, BLUE_RED[1], "access to a street"),
        )
    ]
    return QgsGraduatedSymbolRenderer(
        'case when "access" then 1 when not "access" then 0 else -1 end', ranges
    )


def _land_use() -> QgsFeatureRenderer:
    """Parcels to build on, greens, and ways, by what they are."""
    uses = (
        ("parcel", "parcel", "#f3e3bf"),
        ("green", "green", "#b3d195"),
        ("court", "court inside a block", "#cfe2b4"),
        ("lane", "lane", "#ddd8ce"),
        ("street", "street", "#e6e2da"),
        ("", "other", "#d8c7dc"),
    )
    return by_value("land_use", [(use, text, fill(shade, GREY, 0.15)) for use, text, shade in uses])


def _candidates() -> QgsFeatureRenderer:
    """Streets that a site might be split along, the best ones on top of the others."""
    ranges = [
        QgsRendererRange(low, high, line(colour, width), label)
        for low, high, colour, width, label in (
            (-0.5, 0.5, "#d8d2c6", 0.2, "cannot be a street"),
            (0.5, 1.5, BLUE_RED[0], 1.4, "the best"),
            (1.5, 5.5, BLUE_RED[1], 0.9, "rank 2 to 5"),
            (5.5, 20.5, BLUE_RED[2], 0.6, "rank 6 to 20"),
            (20.5, 1e9, BLUE_RED[3], 0.3, "further ones"),
        )
    ]
    return QgsGraduatedSymbolRenderer("rank", ranges)


PARCEL_RENDERERS: dict[str, Callable[[], QgsFeatureRenderer]] = {
    "parcel_quality": _quality,
    "parcels": _land_use,
    "parcel_blocks": lambda: QgsSingleSymbolRenderer(fill("243,227,191,0", "#4a443b", 0.5)),
    "cross_field": lambda: QgsSingleSymbolRenderer(line(GREY, 0.2)),
    "candidates": _candidates,
    "street_space": lambda: QgsSingleSymbolRenderer(fill("#e6e2da", "#c9c4b8", 0.1)),
}
PARCEL_TITLES = {"parcel_quality": "Quality", "parcels": "Land use"}
_CORNERS = _by("p_angle", "degrees", (2, 5, 10, 15, 30))
_RECTANGLE = _by("p_area", "", (1.02, 1.05, 1.1, 1.2, 1.5))
PARCEL_OTHERS: dict[str, dict[str, Callable[[QgsVectorLayer], QgsFeatureRenderer]]] = {
    "parcels": {
        "Quality": lambda _: _quality(),
        "Corners": _CORNERS,
        "Rectangle": _RECTANGLE,
        "Access": _access,
    },
    "parcel_quality": {
        "Corners": _CORNERS,
        "Rectangle": _RECTANGLE,
        "Distance from the ideal parcel": _by("p_similarity", "m", (0.25, 0.5, 1, 2, 4)),
        "Access": _access,
    },
}
