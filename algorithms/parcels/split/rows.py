"""Features of a layer that stay as they are, beside those that replace others."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd

#: Numbers of features, and those that new features take over from the ones they replace.
IDS = ("parcel_id", "street_id")
OF_HOME = ("site_id", "feature", "variation", "block_id")
#: Columns that are always there afterwards.
OWN = ("land_use", "note")


def column(frame: gpd.GeoDataFrame, name: str) -> pd.Series | None:
    """Find a column, whatever the case of its name.

    Parameters
    ----------
    frame
        The layer.
    name
        In lower case.
    """
    return next((frame[own] for own in frame.columns if str(own).lower() == name), None)


class Rows:
    """The features of a layer, which may be changed and replaced; the layer itself stays.

    Parameters
    ----------
    frame
        The layer; its index are integers.
    """

    def __init__(self, frame: gpd.GeoDataFrame) -> None:
        self.frame = frame

    def changed(self, told: pd.DataFrame, names: Sequence[str]) -> gpd.GeoDataFrame:
        """Give the layer with other values of some features.

        Parameters
        ----------
        told
            Values, by the labels of the features.
        names
            Columns, in lower case; of those but `OWN` the ones that the layer has are changed.
        """
        found = self._copy()
        own = {str(name).lower(): name for name in self.frame.columns}
        for name in names:
            if name not in told.columns:
                continue
            for target in {own.get(name, ""), name if name in OWN else ""} - {""}:
                values = found[target].astype(object)
                values.loc[told.index] = told[name].astype(object)
                found[target] = values
        return found

    def replaced(
        self,
        gone: Sequence[Hashable],
        layer: gpd.GeoDataFrame,
        homes: Sequence[Hashable] | None,
        change: str,
    ) -> gpd.GeoDataFrame:
        """Give the layer with some features replaced.

        Parameters
        ----------
        gone
            Labels of the features that are no more.
        layer
            The new features, in the CRS of the layer; columns of the same name are taken over.
        homes
            Label of the feature in whose place each is, None where there is no such.
        change
            What the column `change` says of them; of the others it says "kept".
        """
        kept = self._copy().drop(index=list(gone))
        kept["change"] = "kept"
        if not len(layer):
            return kept
        first = int(max(self.frame.index, default=-1)) + 1
        labels = range(first, first + len(layer))
        data: dict[str, Any] = {}
        for name in kept.columns:
            if name == kept.geometry.name:
                continue
            low = str(name).lower()
            values: Any = layer[low].astype(object).tolist() if low in layer.columns else None
            if low in IDS:
                values = self._numbers(str(name), len(layer), kept)
            elif low in OF_HOME and homes is not None:
                values = self.frame.loc[list(homes), name].astype(object).tolist()
                if low == "block_id":
                    values = self._blocks(str(name), values, layer)
            data[name] = pd.Series(values or [None] * len(layer), index=labels, dtype=object)
        data["change"] = [change] * len(layer)
        new = gpd.GeoDataFrame(
            pd.DataFrame(data, index=labels),
            geometry=gpd.GeoSeries(layer.geometry.to_numpy(), index=labels, crs=self.frame.crs),
        )
        if kept.geometry.name != "geometry":
            new = new.rename_geometry(kept.geometry.name)
        both = pd.concat([kept.astype(dict.fromkeys(data, object)), new])
        return gpd.GeoDataFrame(both, geometry=kept.geometry.name, crs=self.frame.crs)

    def _copy(self) -> gpd.GeoDataFrame:
        """Copy the layer, with the columns that are always there."""
        found = self.frame.copy()
        for name in OWN if column(self.frame, "street_id") is None else ():
            given = column(self.frame, name)
            found[name] = None if given is None else given
        return found

    def _numbers(self, name: str, count: int, kept: gpd.GeoDataFrame) -> list[Any] | None:
        """Numbers for new features, above those that there were; None where they are words."""
        values = pd.to_numeric(self.frame[name], errors="coerce")
        if values.isna().all() and len(kept):
            return None
        top = 0 if values.isna().all() else int(values.max())
        return list(range(top + 1, top + 1 + count))

    def _blocks(self, name: str, values: list[Any], layer: gpd.GeoDataFrame) -> list[Any]:
        """Numbers of blocks: new ones where a new block lies on several old ones."""
        numbers = pd.to_numeric(self.frame[name], errors="coerce")
        if numbers.isna().all():
            return values
        free = int(numbers.max()) + 1
        found = np.array(values, dtype=object)
        for block in pd.unique(layer["block_id"]):
            own = (layer["block_id"] == block).to_numpy()
            if len(set(found[own].tolist())) > 1:
                found[own], free = free, free + 1
        return list(found)
