"""A layer of streets and one of lines without access, as they are in each working CRS."""

from __future__ import annotations

from dataclasses import replace

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS

from ..errors import InputError
from ..progress import Progress
from ..site.crs import layer_crs
from ..site.repair import Problems, overlay
from .blocklines import DRAWN
from .streetspace import Floats, StreetLines, StreetWidths, noded, read_streets

#: A street of which so much lies along lines without access gives none (share).
MOSTLY = 0.8


class StreetLayer:
    """Streets and lines without access, read once for each working CRS.

    Parameters
    ----------
    streets
        Centre lines, or None.
    widths, given
        See `widths_of`; None for the usual ones.
    closed
        Lines without access, or None.
    layer
        Name of the layer of streets.
    problems
        Takes what could not be used.
    """

    def __init__(
        self,
        streets: gpd.GeoDataFrame | None,
        widths: StreetWidths | None,
        given: Floats | None,
        closed: gpd.GeoDataFrame | None,
        layer: str,
        problems: Problems,
    ) -> None:
        self._streets, self._closed = streets, closed
        self._widths, self._given = widths or StreetWidths(), given
        self._layer, self._problems = layer, problems
        self._read: dict[CRS, StreetLines] = {}
        self._drawn: dict[CRS, shapely.Geometry | None] = {}

    def lines(self, crs: CRS, progress: Progress) -> StreetLines | None:
        """Return the noded streets, or None where no layer is given.

        Parameters
        ----------
        crs
            Working CRS.
        progress
            Asked for cancellation.

        Raises
        ------
        InputError
            If no line of the layer is a street.
        CancelledError
            If the caller cancels.
        """
        if self._streets is None:
            return None
        if crs not in self._read:
            problems = Problems() if self._read else self._problems
            read = read_streets(
                self._streets, self._widths, crs, self._layer, problems, given=self._given
            )
            if len(read.lines) == 0:
                raise InputError(
                    "it has no line that is a street.",
                    "Choose a layer with the centre lines of streets.",
                    layer=self._layer,
                )
            drawn = self.drawn(crs)
            lines = noded(read, progress)
            if drawn is not None:
                beside = shapely.buffer(drawn, DRAWN, cap_style="flat")
                shared = shapely.length(overlay(shapely.intersection, lines.lines, beside))
                open_ = lines.access & (shared < MOSTLY * shapely.length(lines.lines))
                lines = replace(lines, access=open_)
            self._read[crs] = lines
        return self._read[crs]

    def drawn(self, crs: CRS) -> shapely.Geometry | None:
        """Return the lines without access as one geometry, or None.

        Parameters
        ----------
        crs
            Working CRS.
        """
        if self._closed is None:
            return None
        if crs not in self._drawn:
            source = layer_crs(self._closed, "Lines without access")
            shapes = shapely.force_2d(np.asarray(self._closed.geometry.array, dtype=object))
            usable = ~shapely.is_missing(shapes) & ~shapely.is_empty(shapes)
            usable &= np.isfinite(shapely.bounds(shapes).reshape(-1, 4)).all(axis=1)
            moved = gpd.GeoSeries(shapes[usable], crs=source).to_crs(crs).to_numpy()
            self._drawn[crs] = shapely.union_all(moved) if len(moved) else None
        return self._drawn[crs]


class Quiet:
    """Passes everything on but remarks: that no road is given is no news here.

    Parameters
    ----------
    progress
        Told of the rest.
    """

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self.stage, self.search = progress.stage, progress.search
        self.warn, self.cancelled = progress.warn, progress.cancelled

    def info(self, text: str) -> None:
        """Leave the remark out."""
