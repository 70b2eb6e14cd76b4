"""Which maps a report has: the plan of each design, then one for each thing that was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from qgis.core import (
    QgsCoordinateTransformContext,
    QgsFeatureRequest,
    QgsMapLayer,
    QgsRectangle,
    QgsVectorLayer,
)

from ..algorithms.report import Picture
from .progress import FeedbackProgress
from .report_facts import Shown, shape_of
from .report_maps import Sheet, box_of, extent_of

#: Points over lines over areas over whatever else.
_OVER = {"Point": 3, "LineString": 2, "Polygon": 1}
#: Features by which the size of areas is judged.
_SAMPLE = 200
#: Maps of two designs share their ground if it overlaps by this share of the smaller one.
_SHARED = 0.3
#: What is worth a sign on the plan.
_GRAVE = ("warning", "error")


def order(layers: Sequence[Shown]) -> list[Shown]:
    """Return layers with shapes, the topmost first: points, lines, small areas, large ones."""
    return sorted((own for own in layers if not own.table), key=_rank)


def _rank(shown: Shown) -> tuple[int, float]:
    layer = shown.layer
    if not isinstance(layer, QgsVectorLayer):
        return 0, 0.0
    if shown.tells_problems:
        return -4, 0.0
    over = _OVER.get(shape_of(layer), 1)
    return -over, _size(layer) if over == 1 else 0.0


def _size(layer: QgsVectorLayer) -> float:
    """Return the mean area of some features, by their boxes."""
    request = QgsFeatureRequest().setLimit(_SAMPLE)
    boxes = [feature.geometry().boundingBox() for feature in layer.getFeatures(request)]
    areas = [box.area() for box in boxes if box.isFinite()]
    return sum(areas) / len(areas) if areas else 0.0


def sheets_of(
    designs: Mapping[str, Sequence[Shown]],
    width: int,
    transforms: QgsCoordinateTransformContext,
) -> dict[str, Sheet]:
    """Return the sheet of each design: one for all where they are on the same ground.

    Designs without shapes, as those of which only a table tells, have none.
    """
    drawn = {
        name: [own.layer for own in order(layers) if _has_ground(own.layer)]
        for name, layers in designs.items()
    }
    drawn = {name: layers for name, layers in drawn.items() if layers}
    if not drawn:
        return {}
    common = Sheet([own for layers in drawn.values() for own in layers], width, transforms)
    boxes = [box_of(layers, common.crs, transforms) for layers in drawn.values()]
    shared = all(
        _shared_area(a, b) >= _SHARED * min(a.area(), b.area())
        for at, a in enumerate(boxes)
        for b in boxes[at + 1 :]
    )
    if shared:
        return dict.fromkeys(drawn, common)
    return {name: Sheet(layers, width, transforms) for name, layers in drawn.items()}


def _shared_area(one: QgsRectangle, other: QgsRectangle) -> float:
    # where nothing is shared, newer QGIS gives a rectangle turned inside out, of infinite area
    return float(one.intersect(other).area()) if one.intersects(other) else 0.0


def _has_ground(layer: QgsMapLayer) -> bool:
    return layer.crs().isValid() and extent_of(layer) is not None


def design_pictures(
    name: str,
    layers: Sequence[Shown],
    data: Sequence[Shown],
    background: Sequence[QgsMapLayer],
    sheet: Sheet | None,
    progress: FeedbackProgress,
) -> tuple[Picture, ...]:
    """Return the plan of a design and a map of each layer that measures it."""
    if sheet is None:
        return ()
    drawn = order(layers)
    plan = [own for own in drawn if not own.measure and _worth_drawing(own)]
    measured = [own for own in drawn if own.measure and not own.tells_problems]
    around = [own.layer for own in data]
    below = list(background)
    made = []
    if plan:
        words = ", ".join(dict.fromkeys(own.layer.name() for own in plan))
        shown = [*(own.layer for own in plan), *around]
        alt = f"Map of the plan {name}: {words}."
        made.append(
            sheet.picture(f"{name}: the plan", alt, shown, progress, below=below, small=True)
        )
    for own in measured:
        title = f"{name}: {own.layer.name()}"
        made.append(
            sheet.picture(
                title,
                f"Map of what was measured of {name}: {own.layer.name()}.",
                [own.layer],
                progress,
                below=[*around, *below],
                small=not made,
            )
        )
    return tuple(made)


def _worth_drawing(shown: Shown) -> bool:
    """Tell whether a layer belongs on the plan: of problems only those with grave ones."""
    if not shown.tells_problems:
        return True
    at = shown.layer.fields().lookupField("severity")
    return any(str(value) in _GRAVE for value in shown.layer.uniqueValues(at))


def data_pictures(
    data: Sequence[Shown],
    background: Sequence[QgsMapLayer],
    width: int,
    transforms: QgsCoordinateTransformContext,
    progress: FeedbackProgress,
) -> tuple[Picture, ...]:
    """Return one map of layers that are of no design."""
    layers = [own.layer for own in data if _has_ground(own.layer)]
    if not layers:
        return ()
    sheet = Sheet(layers, width, transforms)
    words = ", ".join(dict.fromkeys(own.name() for own in layers))
    title, alt = "The data", f"Map of the data: {words}."
    return (sheet.picture(title, alt, layers, progress, below=background, small=True),)
