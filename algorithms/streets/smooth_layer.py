"""Smoothing of a street layer: any line layer in, the same features out, gentler."""

from __future__ import annotations

from dataclasses import dataclass

import geopandas as gpd
import numpy as np
import shapely
from scipy.spatial import cKDTree

from ..errors import CancelledError, InputError
from ..progress import Progress, Share, Silent
from .angles import NetworkFigures, network_figures
from .smooth_anchors import ON_EDGE, find_anchors
from .smooth_frames import StreetFrame, read_points, read_polygons
from .smooth_graph import SAME, Geometries, StreetNet, build_net, overlapping
from .smoothing import Smoothed, Smoothing, smooth_net

#: A point fixes the street that is this near (metres).
FIX_REACH = 5.0


@dataclass(frozen=True, eq=False)
class SmoothedStreets:
    """A smoothed street layer.

    Attributes
    ----------
    streets
        All features with all their columns, in the CRS of the input, and `moved_m`: the furthest
        that a street lies from where it was, metres. `length_m`, where it was there and true,
        tells the new length.
    problems
        Columns layer, feature, problem, action, severity, in the CRS of the input.
    before, after
        Figures of the streets that could move.
    largest_move
        Largest `moved_m`, metres.
    max_move
        Furthest that any street was allowed to move, metres.
    held_back
        Number of features that moved less than they would have.
    complete
        False where the caller cancelled: the streets are then those of the last safe drawing.
    """

    streets: gpd.GeoDataFrame
    problems: gpd.GeoDataFrame
    before: NetworkFigures
    after: NetworkFigures
    largest_move: float
    max_move: float
    held_back: int
    complete: bool


def smooth_streets(
    streets: gpd.GeoDataFrame,
    wishes: Smoothing | None = None,
    *,
    site: gpd.GeoDataFrame | None = None,
    obstacles: gpd.GeoDataFrame | None = None,
    fixed_points: gpd.GeoDataFrame | None = None,
    street_layer: str = "Streets",
    site_layer: str = "Site",
    obstacle_layer: str = "Obstacles",
    point_layer: str = "Fixed points",
    progress: Progress | None = None,
) -> SmoothedStreets:
    """Make the streets of a layer gentler and their junctions right-angled (CND appendix).

    What was connected stays connected, no block comes or goes, no street newly crosses another
    one, an obstacle or the edge of the site. Streets with the value "existing" or "given" in a
    field `status` keep their course, dead ends their place.

    Parameters
    ----------
    streets
        Lines in any CRS; the index holds the feature ids. Ends that meet within 0.5 m, ends on
        another line and shared vertices are junctions; other crossings are taken as bridges.
    wishes
        What is asked; None for the usual.
    site
        Polygons. Streets inside them are smoothed and stay there; the others keep their course.
        Ends at their edge slide along it.
    obstacles
        Polygons that no street may newly touch, or come nearer to than 6 m.
    fixed_points
        Points. The street within 5 m of each keeps its place there and, where it ends, its
        direction.
    street_layer, site_layer, obstacle_layer, point_layer
        Names of the layers, for messages.
    progress
        Told of the stages, asked for cancellation.

    Returns
    -------
    SmoothedStreets
        The layer, what was found, and figures before and after.

    Raises
    ------
    InputError
        A layer has no CRS, there is no line in the layer of streets or something else than
        lines, or the site is somewhere else.
    CancelledError
        The caller cancelled before there was a safe drawing.

    Examples
    --------
    >>> from shapely.geometry import LineString
    >>> main = LineString([(0, 0), (100, 6), (200, 0)])
    >>> leg = LineString([(100, 6), (120, 90)])
    >>> layer = gpd.GeoDataFrame({"name": ["A", "B"]}, geometry=[main, leg], crs=32633)
    >>> made = smooth_streets(layer)
    >>> made.streets.columns.tolist(), made.after.angle_mean < made.before.angle_mean
    (['name', 'geometry', 'moved_m'], True)
    """
    told = progress or Silent()
    told.stage("Joining the streets", 0.0)
    own = StreetFrame(streets, street_layer)
    ground = _ground(site, own, site_layer)
    barred = read_polygons(obstacles, own.crs, obstacle_layer)
    marks, mark_ids = read_points(fixed_points, own.crs, point_layer)
    _go_on(told.cancelled())
    net = build_net(own.lines, marks, FIX_REACH, own.existing)
    _go_on(told.cancelled())
    doubled, pairs = overlapping(net.lines)
    existing = own.existing[net.street]
    anchors = find_anchors(
        net, existing | doubled, site=ground, slide=wishes is None or wishes.slide
    )
    for k in np.flatnonzero(net.marks < 0).tolist():
        what = f"there is no street within {FIX_REACH:g} m"
        place = shapely.points(marks[k])
        own.problems.add(point_layer, mark_ids[k], what, "ignored", "warning", place, own.crs)
    done = smooth_net(net, anchors, wishes, obstacles=barred, progress=Share(told, 0.1, 0.9))
    _go_on(not done.complete and all(a is b for a, b in zip(done.lines, net.lines)))
    told.stage("Measuring the streets", 0.9)
    _tell_streets(own, net, pairs)
    _tell_place(own, net, barred, done)
    moving = ~(existing | doubled)
    if ground is not None:
        moving &= shapely.intersects(ground.buffer(-ON_EDGE), net.lines)
    made, moved = own.rebuilt(net, done.lines)
    held = len({own.row[s] for s in net.street[done.held_back].tolist()})
    return SmoothedStreets(
        made,
        own.problems.to_frame(own.source),
        network_figures(net, net.lines, moving),
        network_figures(net, done.lines, moving),
        float(moved.max(initial=0.0)),
        done.max_move,
        held,
        done.complete,
    )


def _go_on(cancelled: bool) -> None:
    """Stop where nothing that is worth keeping will come."""
    if cancelled:
        raise CancelledError("Cancelled before the streets were smoothed.")


def _ground(
    site: gpd.GeoDataFrame | None, streets: StreetFrame, layer: str
) -> shapely.Geometry | None:
    """Return the ground of the site as one; None where it is not given."""
    parts = read_polygons(site, streets.crs, layer, needed=True)
    if parts is None:
        return None
    ground = shapely.union_all(parts)
    shapely.prepare(ground)
    if not shapely.intersects(ground, streets.lines).any():
        raise InputError(
            "No street lies in the site.",
            "Choose the site of these streets, and see whether both layers have the right CRS.",
            layer=layer,
        )
    return ground


def _tell_streets(streets: StreetFrame, net: StreetNet, pairs: list[tuple[int, int]]) -> None:
    """Note streets that share a stretch, meet themselves, or cross without a junction."""
    row = streets.row[net.street]
    for i, j in pairs:
        what = (
            f"shares a stretch with feature {streets.ids[row[j]]}" if i != j else "crosses itself"
        )
        streets.tell(int(row[i]), what, "left where it is", "warning", net.lines[i])
    i, j = shapely.STRtree(net.lines).query(net.lines, predicate="intersects")
    i, j = i[i < j], j[i < j]
    shared = set(pairs)
    apart = np.array([(a, b) not in shared for a, b in zip(i.tolist(), j.tolist())], dtype=bool)
    i, j = i[apart], j[apart]
    at, index = shapely.get_parts(
        shapely.intersection(net.lines[i], net.lines[j]), return_index=True
    )
    if not len(at):
        return
    gap, _ = cKDTree(net.nodes).query(shapely.get_coordinates(shapely.centroid(at)))
    for k in np.flatnonzero(gap > SAME).tolist():
        a, b = int(row[i[index[k]]]), int(row[j[index[k]]])
        streets.tell(
            a,
            f"crosses feature {streets.ids[b]} without a junction",
            "taken as a bridge; for a junction split both streets there",
            "info",
            at[k],
        )


def _tell_place(
    streets: StreetFrame, net: StreetNet, obstacles: Geometries | None, done: Smoothed
) -> None:
    """Note streets that were on an obstacle before, and those that were held back."""
    row = streets.row[net.street]
    if obstacles is not None:
        k, j = shapely.STRtree(obstacles).query(net.lines, predicate="intersects")
        part = shapely.intersection(net.lines[k], obstacles[j])
        seen: set[int] = set()
        for e, place in zip(k.tolist(), part):
            r = int(row[e])
            if place.length > 1.0 and r not in seen:
                seen.add(r)
                streets.tell(r, "runs over an obstacle", "kept there", "warning", place)
    held: dict[int, int] = {}
    for e in np.flatnonzero(done.held_back).tolist():
        held.setdefault(int(row[e]), e)
    for r, e in held.items():
        streets.tell(
            r,
            "would cross a street, come too near to an obstacle, or leave the site",
            "moved less than it would",
            "info",
            done.lines[e],
        )
