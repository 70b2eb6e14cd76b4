"""Layers that tell when their features appeared play in the temporal controller of QGIS."""

from __future__ import annotations

from qgis.core import QgsVectorLayer

from . import compat
from .fields import LayerKind

#: Kind of the field that says so.
KIND = "date and time"


def moment_of(kind: LayerKind) -> str:
    """Return the name of the field that says when a feature appeared; empty where none does."""
    return next((field.name for field in kind.fields if field.kind == KIND), "")


def play(layer: QgsVectorLayer, kind: LayerKind) -> None:
    """Let the features of a layer appear one after the other, and stay.

    Those without a moment are always there. Where the controller is off, all are shown.

    Parameters
    ----------
    layer
        The layer. Where its format knows no moments, it stays as it is.
    kind
        What it holds.
    """
    name = moment_of(kind)
    place = layer.fields().indexOf(name) if name else -1
    if place < 0 or layer.fields().at(place).type() != compat.FIELD_TYPES[KIND]:
        return
    settings = layer.temporalProperties()
    settings.setMode(compat.TEMPORAL_INSTANT)
    settings.setStartField(name)
    settings.setAccumulateFeatures(True)
    settings.setIsActive(True)
