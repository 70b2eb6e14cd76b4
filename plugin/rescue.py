"""Keeps the design of a cancelled run for a planner in a QGIS window.

QGIS drops the temporary layers of a run that was cancelled, and loads no layer of it. So they
are saved in a file of the user's profile, with their styles.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsApplication,
    QgsProcessingContext,
    QgsVectorFileWriter,
)

from . import styles
from .fields import LayerKind

_ON_EXISTING = QgsVectorFileWriter.ActionOnExistingFile


def needed() -> bool:
    """Tell whether this is a QGIS window; elsewhere results arrive in spite of a cancel."""
    return QgsApplication.platform() == "desktop"


def save(
    outputs: Mapping[str, Any], kinds: Mapping[str, LayerKind], context: QgsProcessingContext
) -> Path | None:
    """Save the temporary layers among the outputs of a run as tables of one GeoPackage.

    Returns
    -------
    Path or None
        The file, or None where no output was temporary or nothing could be saved.
    """
    folder = Path(QgsApplication.qgisSettingsDirPath()) / "platwright" / "cancelled"
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / time.strftime("%Y-%m-%d_%H-%M-%S.gpkg")
    for key, kind in kinds.items():
        layer = context.temporaryLayerStore().mapLayer(str(outputs.get(key)))
        if layer is None:
            continue
        options = QgsVectorFileWriter.SaveVectorOptions()
        options.driverName = "GPKG"
        options.layerName = kind.key
        options.actionOnExistingFile = (
            _ON_EXISTING.CreateOrOverwriteLayer
            if path.exists()
            else _ON_EXISTING.CreateOrOverwriteFile
        )
        QgsVectorFileWriter.writeAsVectorFormatV3(
            layer, str(path), context.transformContext(), options
        )
        styles.save(f"{path}|layername={kind.key}", kind)
    return path if path.exists() else None
