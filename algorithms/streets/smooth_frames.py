"""Street layers and what lies around them, brought to metres and back."""

from __future__ import annotations

from typing import Any

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS

from ..errors import InputError
from ..network.problem import BoolArray, FloatArray
from ..site.crs import layer_crs, working_crs
from ..site.repair import Problems
from .smooth_graph import SAME, Geometries, StreetNet

#: The field `length_m` is brought up to date where it was true to this share, or to 0.1 m.
TRUE_LENGTH = 0.01
#: Streets with these words in the field `status` keep their course: those that are there, and
#: those that somebody has laid down.
KEPT = ("existing", "given")
_LINES = (1, 2, 5)
_MULTI_LINE = 5
_POLYGON = 3


class StreetFrame:
    """The street layer: its usable lines in the working CRS, and the way back.

    Attributes
    ----------
    lines
        Shape (k,). Single lines of some length.
    row
        Shape (k,). Position of the feature that each is of.
    """

    def __init__(self, frame: gpd.GeoDataFrame, layer: str) -> None:
        self.frame, self.layer, self.problems = frame, layer, Problems()
        self.source = layer_crs(frame, layer)
        self.ids = [str(label) for label in frame.index]
        self.given: Geometries = np.asarray(frame.geometry.array, dtype=object)
        usable = self._usable()
        if not usable.any():
            raise InputError("There are no lines in it.", "Choose a layer of streets.", layer=layer)
        bounds = shapely.total_bounds(self.given[usable])
        self.crs = working_crs(self.source, bounds, layer)
        flat = shapely.force_2d(self.given)
        planar = flat.copy()
        if self.crs != self.source:
            planar[usable] = gpd.GeoSeries(flat[usable], crs=self.source).to_crs(self.crs)
        parts, index = shapely.get_parts(planar[usable], return_index=True)
        self.flat_parts = shapely.get_parts(flat[usable])
        row = np.flatnonzero(usable)[index]
        long = shapely.length(parts) > SAME
        self.parts, self.part_row, self.long = parts, row, long
        for r in np.setdiff1d(row, row[long]).tolist():
            self.tell(r, "has no length", "kept as it is", "warning")
        if not long.any():
            raise InputError("No line in it has a length.", "Choose another layer.", layer=layer)
        self.lines, self.row = parts[long], row[long]
        self.existing = self._existing()[self.row]

    def _usable(self) -> BoolArray:
        """Tell which features are lines with finite coordinates; complain about others."""
        given = self.given
        none = shapely.is_missing(given) | shapely.is_empty(given)
        wrong = ~none & ~np.isin(shapely.get_type_id(given), _LINES)
        if wrong.any():
            first = int(np.flatnonzero(wrong)[0])
            raise InputError(
                f"It is a {given[first].geom_type}, not a line.",
                "Choose a layer of lines.",
                layer=self.layer,
                feature=self.ids[first],
            )
        for r in np.flatnonzero(none).tolist():
            what = "NULL" if given[r] is None else "EMPTY"
            self.tell(r, f"geometry is {what}", "kept as it is", "warning")
        finite = np.isfinite(shapely.bounds(given)).all(axis=1)
        for r in np.flatnonzero(~none & ~finite).tolist():
            self.tell(r, "coordinates are not finite", "kept as it is", "error", None)
        raised = np.flatnonzero(shapely.has_z(given))
        if len(raised):
            text = f"{len(raised)} features have heights (Z), this is the first"
            self.tell(int(raised[0]), text, "heights dropped where a street moves", "info")
        return np.asarray(~none & finite, dtype=bool)

    def _existing(self) -> BoolArray:
        """Tell which features say that they are streets to be kept."""
        by_lower = {str(c).lower(): c for c in self.frame.columns}
        if "status" not in by_lower:
            return np.zeros(len(self.frame), dtype=bool)
        texts = self.frame[by_lower["status"]].astype(str).str.strip().str.lower()
        return np.asarray(texts.isin(KEPT))

    def tell(
        self, row: int, problem: str, action: str, severity: str, where: Any = "feature"
    ) -> None:
        """Note a finding about a feature; `where` is in the working CRS, if it is a place."""
        shape, crs = (self.given[row], self.source) if isinstance(where, str) else (where, None)
        self.problems.add(
            self.layer, self.ids[row], problem, action, severity, shape, crs or self.crs
        )

    def rebuilt(self, net: StreetNet, lines: Geometries) -> tuple[gpd.GeoDataFrame, FloatArray]:
        """Return the layer with its lines as they are now, and how far each feature moved."""
        at = net.joined(lines)
        now = self.parts.copy()
        for k, position in enumerate(np.flatnonzero(self.long).tolist()):
            if k in at and not self.existing[k]:
                now[position] = shapely.linestrings(at[k])
        moved = np.zeros(len(self.frame))
        gap = shapely.hausdorff_distance(self.parts, now)
        same = ~(gap > 0)  # also where there is nothing to measure
        np.maximum.at(moved, self.part_row[~same], gap[~same])
        back = now.copy()
        if self.crs != self.source and (~same).any():
            back[~same] = self._returned(now[~same])
        back[same] = self.flat_parts[same]
        made = self.frame.copy()
        shapes = self.given.copy()
        for r in np.unique(self.part_row[~same]).tolist():
            own = back[slice(*np.searchsorted(self.part_row, [r, r + 1]))]
            multi = shapely.get_type_id(self.given[r]) == _MULTI_LINE
            shapes[r] = shapely.multilinestrings(own) if multi else own[0]
        made[made.geometry.name] = gpd.GeoSeries(shapes, index=made.index, crs=self.frame.crs)
        made["moved_m"] = moved
        self._lengths(made, now)
        return made, moved

    def _returned(self, lines: Geometries) -> Geometries:
        """Bring lines back to the CRS of the layer; points that did not move, exactly."""
        known = dict(
            zip(
                map(tuple, shapely.get_coordinates(self.parts).tolist()),
                shapely.get_coordinates(self.flat_parts).tolist(),
            )
        )
        moved = gpd.GeoSeries(lines, crs=self.crs).to_crs(self.source).to_numpy()
        xy, index = shapely.get_coordinates(moved, return_index=True)
        for k, place in enumerate(map(tuple, shapely.get_coordinates(lines).tolist())):
            if place in known:
                xy[k] = known[place]
        return np.asarray(shapely.linestrings(xy, indices=index), dtype=object)

    def _lengths(self, made: gpd.GeoDataFrame, now: Geometries) -> None:
        """Bring the field `length_m` up to date, where it was true."""
        by_lower = {str(c).lower(): c for c in made.columns}
        name = by_lower.get("length_m")
        if name is None or made[name].dtype.kind != "f":
            return
        before, after = np.zeros((2, len(made)))
        np.add.at(before, self.part_row, shapely.length(self.parts))
        np.add.at(after, self.part_row, shapely.length(now))
        said = made[name].to_numpy(dtype=float)
        true = np.abs(said - before) <= np.maximum(TRUE_LENGTH * before, 0.1)
        new = true & (made["moved_m"].to_numpy() > 0)
        made[name] = np.where(new, after, said)


def read_polygons(
    frame: gpd.GeoDataFrame | None, crs: CRS, layer: str, *, needed: bool = False
) -> Geometries | None:
    """Read the valid single polygons of a layer in the working CRS.

    Parameters
    ----------
    frame
        Polygons, in any state; None where the layer is not given.
    crs
        Working CRS.
    layer
        Name of the layer, for messages.
    needed
        Whether a layer without a polygon is a mistake.

    Returns
    -------
    array or None
        Shape (k,); None where there are none.

    Raises
    ------
    InputError
        The layer has no CRS, or no polygon though it should.
    """
    if frame is None:
        return None
    shapes, _ = _planar(frame, crs, layer)
    parts = shapely.get_parts(shapely.get_parts(shapely.make_valid(shapes)))
    parts = parts[shapely.get_type_id(parts) == _POLYGON]
    if needed and not len(parts):
        raise InputError("There is no polygon in it.", "Choose a layer of polygons.", layer=layer)
    return parts if len(parts) else None


def read_points(
    frame: gpd.GeoDataFrame | None, crs: CRS, layer: str
) -> tuple[FloatArray, list[str]]:
    """Read the points of a layer in the working CRS.

    Parameters
    ----------
    frame
        Points, single or several in one feature; None where the layer is not given.
    crs
        Working CRS.
    layer
        Name of the layer, for messages.

    Returns
    -------
    array, list
        Shape (k, 2), metres, and the id of the feature of each.

    Raises
    ------
    InputError
        The layer has no CRS.
    """
    if frame is None:
        return np.zeros((0, 2)), []
    shapes, ids = _planar(frame, crs, layer)
    parts, index = shapely.get_parts(shapes, return_index=True)
    xy = shapely.get_coordinates(shapely.centroid(parts)).reshape(-1, 2)
    return xy, [ids[k] for k in index.tolist()]


def _planar(frame: gpd.GeoDataFrame, crs: CRS, layer: str) -> tuple[Geometries, list[str]]:
    """Geometries in the working CRS, and their ids; what has no place is left out."""
    layer_crs(frame, layer)
    some = frame[~(frame.geometry.isna() | frame.geometry.is_empty)]
    planar = np.asarray(some.geometry.to_crs(crs).array, dtype=object)
    finite = np.isfinite(shapely.bounds(planar).reshape(-1, 4)).all(axis=1)
    return shapely.force_2d(planar[finite]), [str(label) for label in some.index[finite]]
