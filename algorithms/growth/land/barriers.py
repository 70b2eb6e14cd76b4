"""What no street crosses: motorways and railways, and obstacles beside the sites."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely
from pyproj import CRS
from shapely.geometry import box

from ...site import osmlines
from ...site.crs import layer_crs
from ...site.prepare import SMALLEST_OBSTACLE
from ...site.repair import POLYGON_TYPE, Problems, overlay, repair_polygons
from ...site.roads import CLASS_COLUMNS, HIDDEN_COLUMNS
from ..types import BoolArray

#: Half the width that lines of a class take, metres: a carriageway with its shoulders, its ramps,
#: and a track with its clearance.
HALF_WIDTHS = {
    **dict.fromkeys(("motorway", "type autoroutier", "autoroute"), 10.0),
    "motorway_link": 5.0,
}
TRACK = 4.0
#: Values of OpenStreetMap's railway that are tracks of their own; trams run in streets.
TRACKS = ("rail", "light_rail", "subway", "narrow_gauge", "funicular")
#: Shorter stretches inside the ground are none (metres).
SHORTEST = 1.0

_NO = ("", "no", "0", "false", "f", "n")


def barriers(
    roads: gpd.GeoDataFrame,
    layer: str,
    area: shapely.Geometry | None,
    crs: CRS,
    problems: Problems,
) -> list[shapely.Geometry]:
    """Find the motorways and railways that run inside an area, but for those in tunnels.

    Parameters
    ----------
    roads
        Lines in any CRS, with the columns of classes and tunnels that `RoadLayer` knows.
    layer
        Its name, for messages.
    area
        Where streets may grow, metres; None for everywhere: then nothing holds the streets back,
        and the problems say so.
    crs
        Working CRS.
    problems
        Takes one row for motorways and one for railways.

    Returns
    -------
    list of Polygon
        The ground that they take.

    Raises
    ------
    InputError
        If the layer has no CRS.
    """
    own = layer_crs(roads, layer)
    half, rail = _half_widths(roads)
    line = np.isin(shapely.get_type_id(roads.geometry.to_numpy()), (1, 2, 5))
    rows = np.flatnonzero((half > 0) & line & ~_hidden(roads))
    lines = roads.geometry.iloc[rows]
    lines = shapely.force_2d((lines if own == crs else lines.to_crs(crs)).to_numpy())
    sound = shapely.is_valid(lines) & np.isfinite(shapely.bounds(lines).reshape(-1, 4)).all(axis=1)
    lines, rows = lines[sound], rows[sound]
    inside = lines if area is None else shapely.intersection(lines, area)
    long = shapely.length(inside) >= SHORTEST
    lines, inside, rows = lines[long], inside[long], rows[long]
    for what, of_kind in (("motorway", ~rail[rows]), ("railway", rail[rows])):
        if of_kind.any():
            feature = roads.index[int(rows[of_kind][0])]
            _tell(layer, feature, inside[of_kind], what, area is None, crs, problems)
    if area is None:
        return []
    # what runs beside the ground takes nothing of it; over its edge a little of the line belongs
    # to the part inside, so that no gap is left where they meet at an angle
    around = shapely.buffer(inside, 2 * half[rows])
    return list(shapely.buffer(shapely.intersection(lines, around), half[rows], cap_style="flat"))


def beside_sites(
    obstacles: gpd.GeoDataFrame, layer: str, strip: shapely.Geometry, crs: CRS
) -> list[shapely.Geometry]:
    """Find what of obstacles lies between the sites and the streets along their edges.

    Parameters
    ----------
    obstacles
        Polygons in any CRS; as inside of sites those under `SMALLEST_OBSTACLE` are left out.
    layer
        Its name, for messages.
    strip
        That ground, metres.
    crs
        Working CRS.

    Returns
    -------
    list of Polygon
        Parts of the obstacles.

    Raises
    ------
    InputError
        If the layer has no CRS.
    """
    own = layer_crs(obstacles, layer)
    if strip.is_empty or not len(obstacles):
        return []
    there = obstacles.geometry.notna() & ~obstacles.geometry.is_empty
    shapes = obstacles.geometry[there]
    window = box(*strip.bounds)
    window = window if own == crs else gpd.GeoSeries([window], crs=crs).to_crs(own).iloc[0]
    x0, y0, x1, y1 = window.bounds
    b = shapes.bounds.to_numpy().reshape(-1, 4)
    shapes = shapes[(b[:, 0] <= x1) & (b[:, 2] >= x0) & (b[:, 1] <= y1) & (b[:, 3] >= y0)]
    moved = shapes if own == crs else shapes.to_crs(crs)
    # the sites have told of repairs
    areas, _ = repair_polygons(
        moved.to_numpy().copy(), moved.index.to_numpy(), layer, crs, Problems()
    )
    areas = areas[shapely.area(areas) >= SMALLEST_OBSTACLE]
    parts = shapely.get_parts(overlay(shapely.intersection, areas, strip))
    return list(parts[shapely.get_type_id(parts) == POLYGON_TYPE])


def _tell(
    layer: str,
    feature: object,
    lines: npt.NDArray[np.object_],
    what: str,
    everywhere: bool,
    crs: CRS,
    problems: Problems,
) -> None:
    size = float(shapely.length(lines).sum())
    if everywhere:
        text = f"{size:.0f} m of {what} in the layer: new streets may cross it"
        todo = "give a polygon in which streets grow, to keep them off it"
    else:
        text = f"{size:.0f} m of {what} in the ground, which no street crosses"
        todo = "new streets end beside it; existing ones stay"
    problems.add(layer, feature, text, todo, "info", shapely.union_all(lines), crs)


def _half_widths(roads: gpd.GeoDataFrame) -> tuple[npt.NDArray[np.float64], BoolArray]:
    """Half the width of each feature, 0 where streets may cross it, and which are tracks."""
    kinds = _texts(roads, CLASS_COLUMNS)
    half = np.array([HALF_WIDTHS.get(kind, 0.0) for kind in kinds], dtype=float)
    # other_tags are read for the layers that have them
    track = np.isin(osmlines.tag(roads, "railway"), TRACKS) & (half == 0)
    return np.where(track, TRACK, half), track


def _hidden(roads: gpd.GeoDataFrame) -> BoolArray:
    hidden = ~np.isin(_texts(roads, HIDDEN_COLUMNS), _NO)
    return np.asarray(hidden | osmlines.in_tunnel(roads))


def _texts(roads: gpd.GeoDataFrame, candidates: tuple[str, ...]) -> npt.NDArray[np.object_]:
    """Texts of the first column, whatever its case, that is among the candidates."""
    by_lower = {str(column).lower(): column for column in reversed(list(roads.columns))}
    name = next((name for name in candidates if name in by_lower), None)
    if name is None:
        return np.full(len(roads), "", dtype=object)
    column = roads[by_lower[name]]
    texts = column.astype(object).where(column.notna(), "")
    return np.array([str(text).strip().lower() for text in texts], dtype=object).reshape(-1)
