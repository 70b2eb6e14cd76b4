"""What a layer remembers of how it was made: the specification and the result, as JSON.

A loaded layer carries them as custom properties and in its metadata, a file in what its format
has for it: the metadata table of a GeoPackage, or a .qmd file beside any other.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from qgis.core import QgsLayerMetadata, QgsVectorLayer

from . import geopackage

#: Prefix of the custom properties of layers, and of the items in a GeoPackage.
PREFIX = "platwright"


@dataclass(frozen=True)
class Record:
    """How a layer was made.

    Attributes
    ----------
    tool
        Id of the tool.
    title
        What the layer is.
    specification
        What was asked, as JSON.
    result
        What came out, as JSON.
    credits
        Whose the data is: attribution, licence, source, date; empty for the planner's own.
    """

    tool: str
    title: str
    specification: str
    result: str
    credits: Mapping[str, str] = field(default_factory=dict)

    @property
    def items(self) -> dict[str, str]:
        """The record as named texts."""
        items = {"tool": self.tool, "specification": self.specification, "result": self.result}
        return {**items, "credits": to_json(self.credits)} if self.credits else items

    @property
    def abstract(self) -> str:
        """A few sentences about the layer."""
        text = f"{self.title}, made by the Platwright tool {self.tool}."
        if self.credits:
            of = " of " + self.credits["date"] if self.credits.get("date") else ""
            text += (
                f" Data{of}: {self.credits.get('attribution', '')}, "
                f"{self.credits.get('licence', '')}, from {self.credits.get('source', '')}."
            )
        return text

    def metadata(self) -> QgsLayerMetadata:
        """Return the record as metadata of a QGIS layer."""
        metadata = QgsLayerMetadata()
        metadata.setTitle(self.title)
        metadata.setAbstract(self.abstract)
        metadata.setType("dataset")
        if self.credits:
            metadata.setRights([self.credits.get("attribution", "")])
            metadata.setLicenses([self.credits.get("licence", "")])
        metadata.setHistory([f"{PREFIX}/{key}={text}" for key, text in self.items.items()])
        return metadata

    def attach(self, layer: QgsVectorLayer) -> None:
        """Put the record on a layer."""
        for key, text in self.items.items():
            layer.setCustomProperty(f"{PREFIX}/{key}", text)
        layer.setMetadata(self.metadata())

    def save(self, source: str) -> None:
        """Put the record into a file, or beside it.

        Parameters
        ----------
        source
            The layer in the file, as QGIS names it.
        """
        path, table = geopackage.parts(source)
        if path.lower().endswith(".gpkg"):
            _save_in_geopackage(path, table, self)
            return
        layer = QgsVectorLayer(source, self.title, "ogr")
        if layer.isValid():
            layer.setMetadata(self.metadata())
            layer.saveDefaultMetadata()


def _save_in_geopackage(path: str, name: str, record: Record) -> None:
    dataset = geopackage.open_dataset(path, change=True)
    if dataset is None:
        return
    table = dataset.GetLayerByName(name) if name else dataset.GetLayer(0)
    if table is not None:
        for key, text in record.items.items():
            table.SetMetadataItem(f"{PREFIX}_{key}", text)
        table.SetMetadataItem("DESCRIPTION", record.abstract)
    # Both must go, the table first, or nothing is written.
    del table
    del dataset


def read_record(layer: QgsVectorLayer) -> dict[str, str]:
    """Return what `Record.attach` or `Record.save` left with a layer; empty where nothing.

    Returns
    -------
    dict
        The keys "tool", "specification", "result" and, where the data is somebody's, "credits".
    """
    found = {}
    for key in ("tool", "specification", "result", "credits"):
        text = layer.customProperty(f"{PREFIX}/{key}")
        if text:
            found[key] = str(text)
    found = found or _from_history(layer.metadata()) or _from_geopackage(layer)
    if not found and not layer.metadata().title():
        layer.loadDefaultMetadata()  # from the .qmd file, which QGIS reads in its window only
        found = _from_history(layer.metadata())
    return found


def _from_history(metadata: QgsLayerMetadata) -> dict[str, str]:
    found = {}
    for line in metadata.history():
        name, _, text = line.partition("=")
        if name.startswith(f"{PREFIX}/"):
            found[name[len(PREFIX) + 1 :]] = text
    return found


def _from_geopackage(layer: QgsVectorLayer) -> dict[str, str]:
    path, name = geopackage.parts(layer.dataProvider().dataSourceUri())
    if not path.lower().endswith(".gpkg"):
        return {}
    dataset = geopackage.open_dataset(path)
    if dataset is None:
        return {}
    table = dataset.GetLayerByName(name) if name else dataset.GetLayer(0)
    items = table.GetMetadata() if table is not None else {}
    return {
        key[len(PREFIX) + 1 :]: text for key, text in items.items() if key.startswith(f"{PREFIX}_")
    }


def to_json(values: Mapping[str, Any]) -> str:
    """Return plain values as JSON with sorted keys; what JSON has no word for becomes null."""
    clean = {
        key: None if isinstance(value, float) and value - value != 0 else value
        for key, value in values.items()
    }
    return json.dumps(clean, sort_keys=True, default=float)
