"""What becomes of courts: they get a way to the street, or become parcels behind others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import shapely

from ...measure.parcel_shape import corner_deviation, rectangle_ratio, undesirable
from ..halving.halve import halve, most
from ..halving.mosaic import Mosaic
from ..halving.rectangle import smallest_rectangle
from ..rules import ParcelRules
from ..types import Block, Plot
from .guard import BEHIND
from .strips import give_way, lines_to_street

Floats = npt.NDArray[np.float64]
#: Vertices of neighbours nearer than this to an edge belong on it (metres).
ON_EDGE = 1e-3
#: Parcels may be larger than the largest by this rather than leave land without a way.
ROOM = 1.5
NO_WAY = "no way to the street"


def open_courts(block: Block, plots: Sequence[Plot], rules: ParcelRules) -> list[Plot]:
    """Give every court that touches no street a way to one, `flag_width` wide.

    Parameters
    ----------
    block
        A sound block.
    plots
        Its plots.
    rules
        What parcels keep, see `strips.give_way`.

    Returns
    -------
    list of Plot
        Plots; a court between parcels that cannot give way is noted so.
    """
    return _resolve(block, plots, rules, flags=False)


def flag_courts(block: Block, plots: Sequence[Plot], rules: ParcelRules) -> list[Plot]:
    """Make parcels of courts, each with an access strip of `flag_width` to the street.

    Parameters
    ----------
    block, plots, rules
        See `open_courts`.

    Returns
    -------
    list of Plot
        Plots; parcels behind others are noted so. What no strip leads to joins a parcel beside
        it, or stays a court.
    """
    return _resolve(block, plots, rules, flags=True)


def _resolve(block: Block, plots: Sequence[Plot], rules: ParcelRules, flags: bool) -> list[Plot]:
    plots = stitch(plots)
    mosaic = Mosaic.of_faces([plot.polygon for plot in plots], block.closed)
    parcels = [i for i, plot in enumerate(plots) if plot.use == "parcel"]
    courts = [i for i, plot in enumerate(plots) if plot.use == "court"]
    others = [i for i, plot in enumerate(plots) if plot.use not in ("parcel", "court")]
    note = next((plots[i].note for i in courts), "")
    behind: list[int] = []
    after: list[tuple[int, str]] = []
    small = [court for court in courts if mosaic.area(court) < rules.least_area]
    # bits beside corner parcels belong to the court, or to the parcels behind that take its place
    joined_courts = [f for f in courts if f not in small] if flags else _joined(mosaic, courts)
    for court in joined_courts:
        if not flags and mosaic.area(court) < rules.least_area:
            small = [court, *(f for f in small if f in mosaic.faces and f != court)]
            continue
        cells = [court]
        if flags:
            behind, cells = _flags(mosaic, court, parcels, behind, rules)
        for cell in cells:
            reached = mosaic.frontage(cell) >= 0.9 * rules.flag_width
            joined = cell if reached else give_way(mosaic, cell, parcels, rules)
            after.append((cell, NO_WAY) if joined is None else (joined, note))
    for bit in small:
        if bit in mosaic.faces and not (
            _swallowed(mosaic, bit, parcels, rules) or _given(mosaic, [bit], behind, rules)
        ):
            after.append((bit, note))
    # faces of parcels were renumbered in place, so that they keep the order of their plots
    before = [plot for plot in plots if plot.use == "parcel"]
    found = [replace(plot, polygon=shape) for plot, shape in zip(before, mosaic.polygons(parcels))]
    found += [replace(plots[i], polygon=shape) for i, shape in zip(others, mosaic.polygons(others))]
    found += [Plot(shape, "parcel", BEHIND) for shape in mosaic.polygons(behind)]
    faces = [face for face, _ in after]
    return found + [
        Plot(shape, "court", note) for shape, (_, note) in zip(mosaic.polygons(faces), after)
    ]


def _flags(
    mosaic: Mosaic, court: int, parcels: list[int], behind: list[int], rules: ParcelRules
) -> tuple[list[int], list[int]]:
    """Cut a court into parcels with strips; return those so far, and the cells left over."""
    rim = {(min(e), max(e)) for e in mosaic.edges(court)}
    streets = set(mosaic.fronts)
    # for the moment every edge of the court gives access, so that each cell touches its rim
    mosaic.fronts = set(rim)
    cells, todo = [], [court]
    while todo:
        face = todo.pop()
        parts = halve(mosaic, face, rules) if mosaic.area(face) > most(rules) else []
        cells += [] if parts else [face]
        todo += parts
    mosaic.fronts = mosaic.descend(streets)
    made: list[int] = []
    lots = [cell for cell in cells if mosaic.area(cell) >= rules.least_area]
    left = [cell for cell in cells if cell not in lots]
    while lots:
        # those with the fewest ways to choose from first
        ways = {cell: len(list(lines_to_street(mosaic, cell, parcels))) for cell in lots}
        cell = min(lots, key=lambda face: (ways[face], face))
        lots.remove(cell)
        joined = give_way(mosaic, cell, parcels, rules)
        if joined is None:
            left.append(cell)
        else:
            made.append(joined)
    courts = []
    for cell in left:
        if not (
            _given(mosaic, [cell], made, rules)
            or _shared(mosaic, cell, made, rules)
            or _given(mosaic, [cell], made, rules, ROOM)
        ):
            courts.append(cell)
    return [*behind, *made], _joined(mosaic, courts)


def _given(
    mosaic: Mosaic, cells: Sequence[int], made: list[int], rules: ParcelRules, room: float = 1.0
) -> bool:
    """Join each cell to a parcel beside it that does not become too large; all or none."""
    saved, before = mosaic.save(), list(made)
    for cell in cells:
        shared = mosaic.neighbours(cell, made)
        most_area = room * rules.largest_area
        fits = [f for f in shared if mosaic.area(f) + mosaic.area(cell) <= most_area]
        best = max(fits, key=lambda face: shared[face], default=None)
        joined = None if best is None else mosaic.join([best, cell])
        if best is None or joined is None:
            mosaic.restore(saved)
            made[:] = before
            return False
        made[made.index(best)] = joined
    return True


def _shared(mosaic: Mosaic, cell: int, made: list[int], rules: ParcelRules) -> bool:
    """Share a cell between two parcels beside it."""
    saved = mosaic.save()
    place, way, _, _ = smallest_rectangle(mosaic.places(cell))
    for direction in (way, (-way[1], way[0])):
        parts = mosaic.cut(cell, place, direction)
        if len(parts) == 2 and _given(mosaic, parts, made, rules):
            return True
        mosaic.restore(saved)
        saved = mosaic.save()
    return False


def _swallowed(mosaic: Mosaic, court: int, parcels: list[int], rules: ParcelRules) -> bool:
    """Join a bit of court to a parcel beside it that keeps its good shape."""
    saved = mosaic.save()
    shared = mosaic.neighbours(court, parcels)
    for parcel in sorted(shared, key=lambda face: -shared[face]):
        joined = mosaic.join([parcel, court])
        if joined is not None and mosaic.area(joined) <= rules.largest_area:
            shape = np.array(mosaic.polygons([joined]), dtype=object)
            if not undesirable(corner_deviation(shape), rectangle_ratio(shape))[0]:
                parcels[parcels.index(parcel)] = joined
                return True
        mosaic.restore(saved)
        saved = mosaic.save()
    return False


def _joined(mosaic: Mosaic, faces: Sequence[int]) -> list[int]:
    """Join faces that touch."""
    todo, found = list(faces), []
    while todo:
        face = todo.pop()
        for other in mosaic.neighbours(face, todo):
            joined = mosaic.join([face, other])
            if joined is not None:
                todo.remove(other)
                todo.append(joined)
                break
        else:
            found.append(face)
    return found


def stitch(plots: Sequence[Plot]) -> list[Plot]:
    """Put the vertices of neighbours on the edges of plots, so that all are shared.

    Parameters
    ----------
    plots
        Plots that tile a block, but may lack each other's vertices.
    """
    polygons = np.array([plot.polygon for plot in plots], dtype=object)
    corners = np.unique(shapely.get_coordinates(polygons), axis=0)
    tree = shapely.STRtree(shapely.points(corners))
    found = []
    for plot in plots:
        rings = [
            _with_vertices(shapely.get_coordinates(ring), corners, tree)
            for ring in (plot.polygon.exterior, *plot.polygon.interiors)
        ]
        if all(ring is None for ring in rings):
            found.append(plot)
            continue
        old = [plot.polygon.exterior, *plot.polygon.interiors]
        new = [shapely.get_coordinates(o) if r is None else r for o, r in zip(old, rings)]
        found.append(replace(plot, polygon=shapely.Polygon(new[0], new[1:])))
    return found


def _with_vertices(xy: Floats, corners: Floats, tree: shapely.STRtree) -> Floats | None:
    """Return a ring with the corners that lie on it; None if it has them all."""
    edges = shapely.linestrings(np.stack([xy[:-1], xy[1:]], axis=1))
    edge, corner = tree.query(edges, predicate="dwithin", distance=ON_EDGE)
    way = xy[edge + 1] - xy[edge]
    size = np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-12)
    along = ((corners[corner] - xy[edge]) * way).sum(axis=1) / size
    inside = (along > ON_EDGE) & (along < size - ON_EDGE)
    if not inside.any():
        return None
    edge, corner, along = edge[inside], corner[inside], along[inside]
    order = np.lexsort((along, edge))
    return np.insert(xy, edge[order] + 1, corners[corner[order]], axis=0)
