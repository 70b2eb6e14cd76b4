"""Stretches of a drawing that repeat, and drawings brought to the size of parcels wished for.

A template that repeats is treated as a frame with a repeating middle: what lies before the
stretch stays, what lies behind it moves, what reaches across it grows.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from .mesh import MERGE, coordinates, topology
from .types import LAND, CornerMark, Edge, Face, Template

Floats = npt.NDArray[np.float64]
#: How a direction of repeats is written.
REPEAT = re.compile(r"[xy]( .*)?")
#: Bounds of one repeat where none are given, as factors of its ideal length.
LEAST, MOST = 0.7, 1.4


@dataclass(frozen=True)
class SizedFace(Face):
    """A face of a template that was brought to size.

    Attributes
    ----------
    wish
        Ideal width and depth as factors of those that it has now.
    origin
        Which face of the drawing it is, or a repeat of; -1: not known.
    """

    wish: tuple[float, float] = (1.0, 1.0)
    origin: int = -1


@dataclass(frozen=True)
class Cell:
    """A stretch of a template that repeats.

    Attributes
    ----------
    name
        What its faces have in their field `repeat`.
    axis
        0: along x, 1: along y.
    start, end
        Where it is drawn, metres.
    ideal, least, most
        Length of one repeat, metres.
    faces
        The faces in it.
    """

    name: str
    axis: int
    start: float
    end: float
    ideal: float
    least: float
    most: float
    faces: tuple[Face, ...]


def cells(template: Template) -> list[Cell]:
    """Find the stretches of a template that repeat, in order of their names.

    Parameters
    ----------
    template
        The template.
    """
    found = []
    for name in sorted({face.repeat for face in template.faces if face.repeat}):
        faces = tuple(face for face in template.faces if face.repeat == name)
        axis = 0 if name.startswith("x") else 1
        xy = shapely.get_coordinates([face.polygon for face in faces])[:, axis]
        start, end = float(xy.min()), float(xy.max())
        drawn = end - start

        def given(field: str, default: float, faces: tuple[Face, ...] = faces) -> float:
            values = [getattr(face, field) for face in faces if getattr(face, field) != 0]
            return float(values[0]) if values else default

        ideal = given("repeat_ideal", drawn)
        least = given("repeat_min", LEAST * ideal)
        most = given("repeat_max", MOST * ideal)
        found.append(Cell(name, axis, start, end, ideal, least, most, faces))
    return found


def repeated(template: Template, counts: Mapping[str, int]) -> Template:
    """Repeat the stretches of a template.

    Parameters
    ----------
    template
        The template.
    counts
        How often, for each name of repeats; 1 or more.

    Returns
    -------
    Template
        A drawing that repeats nothing any more.
    """
    for name in [cell.name for cell in cells(template)]:
        # found anew: the stretches before it have moved it
        cell = next(cell for cell in cells(template) if cell.name == name)
        count = counts.get(cell.name, 1)
        length = cell.end - cell.start
        grow = _shift_behind(cell, (count - 1) * length)
        faces: list[Face] = []
        for face in template.faces:
            if face.repeat != cell.name:
                faces.append(replace(face, polygon=shapely.transform(face.polygon, grow)))
                continue
            for k in range(count):
                move = np.zeros(2)
                move[cell.axis] = k * length
                # cells that meet must do so to the last bit, so the end is not computed twice
                on = _repeat(cell, k, length)
                faces.append(replace(face, polygon=shapely.transform(face.polygon, on), repeat=""))
        template = _with_lines(template, faces, grow, cell, count)
    return template


def _with_lines(
    template: Template,
    faces: list[Face],
    grow: Callable[[Floats], Floats],
    cell: Cell,
    count: int,
) -> Template:
    """Move lines and marks along; those inside the stretch, not across all of it, repeat."""
    edges: list[Edge] = []
    for edge in template.edges:
        along = shapely.get_coordinates(edge.line)[:, cell.axis]
        within = along.min() > cell.start - MERGE and along.max() < cell.end + MERGE
        across = np.ptp(along) > cell.end - cell.start - 2 * MERGE
        if within and not across and np.any((along > cell.start + MERGE) & (along < cell.end)):
            for k in range(count):
                on = _repeat(cell, k, cell.end - cell.start)
                edges.append(replace(edge, line=shapely.transform(edge.line, on)))
        else:
            edges.append(replace(edge, line=shapely.transform(edge.line, grow)))
    corners = [replace(c, point=shapely.transform(c.point, grow)) for c in template.corners]
    return replace(template, faces=tuple(faces), edges=tuple(edges), corners=tuple(corners))


def _shift_behind(cell: Cell, by: float) -> Callable[[Floats], Floats]:
    def move(xy: Floats) -> Floats:
        out = xy.copy()
        out[xy[:, cell.axis] > cell.end - MERGE, cell.axis] += by
        return out

    return move


def _repeat(cell: Cell, k: int, length: float) -> Callable[[Floats], Floats]:
    def move(xy: Floats) -> Floats:
        out = xy.copy()
        out[:, cell.axis] += k * length
        return out

    return move


def _redrawn(template: Template, faces: list[Face], move: Callable[[Floats], Floats]) -> Template:
    """Move the lines and marks of a template along with its faces."""
    return replace(
        template,
        faces=tuple(faces),
        edges=tuple(Edge(shapely.transform(e.line, move), e.meaning) for e in template.edges),
        corners=tuple(
            CornerMark(shapely.transform(c.point, move), c.kind) for c in template.corners
        ),
    )


def factors(template: Template, face: Face, width: float, depth: float) -> tuple[float, float]:
    """Tell how much a face is scaled along its width and depth; 0 for no wish of its own.

    Parameters
    ----------
    template, face
        The face and the template that it is of.
    width, depth
        Of the parcel wished for, metres.
    """
    if template.lot_width == 0 or template.lot_depth == 0:
        return 1.0, 1.0
    if face.label in ("street", "lane"):
        return 1.0, 1.0 if face.deform == "rigid" else 0.0
    if face.label == "parcel" or face.label not in LAND:
        return width / template.lot_width, depth / template.lot_depth
    return 0.0, 0.0


def scaled(template: Template, width: float, depth: float) -> Template:
    """Redraw a template for parcels of another size; streets keep their width.

    Parameters
    ----------
    template
        The template.
    width, depth
        Of the parcel wished for, metres.

    Returns
    -------
    Template
        Its coordinates run through one monotone map per axis: a stretch of x or y is scaled as
        the streets in it wish, or else as its parcels do on average.
    """
    template = _noded(template)
    ideal = {cell.name: cell for cell in cells(template)}
    wishes: list[list[tuple[float, float, float, bool]]] = [[], []]
    plain = np.sqrt(
        width * depth / (template.lot_width * template.lot_depth)
        if template.lot_width and template.lot_depth
        else 1.0
    )
    for face in template.faces:
        turned = round(face.axis / 90.0)
        if abs(face.axis / 90.0 - turned) > 0.01:
            # scaled differently along x and y, slanted parcels would not stay rectangles
            wishes = [[], []]
            break
        both = factors(template, face, width, depth)
        both = both if turned % 2 == 0 else both[::-1]
        for axis in (0, 1):
            cell = ideal.get(face.repeat)
            if both[axis] > 0:
                own = cell is not None and cell.axis == axis
                longer = cell.ideal / (cell.end - cell.start) if cell and own else 1.0
                firm = face.label in ("street", "lane")
                box = face.polygon.bounds
                wishes[axis].append((box[axis], box[axis + 2], both[axis] * longer, firm))
    xy = shapely.get_coordinates([face.polygon for face in template.faces])
    maps = [_axis_map(xy[:, axis], wishes[axis], float(plain)) for axis in (0, 1)]

    def move(points: Floats) -> Floats:
        return np.stack([np.interp(points[:, a], *maps[a]) for a in (0, 1)], axis=1)

    faces: list[Face] = []
    for origin, face in enumerate(template.faces):
        cell = ideal.get(face.repeat)
        by = 1.0
        if cell is not None:
            by = float(np.diff(np.interp([cell.start, cell.end], *maps[cell.axis]))[0]) / cell.ideal
        values = {f.name: getattr(face, f.name) for f in fields(Face)}
        values["polygon"] = shapely.transform(face.polygon, move)
        for name in ("ideal", "least", "most"):
            short = {"least": "min", "most": "max"}.get(name, name)
            values[f"repeat_{short}"] = 0.0 if cell is None else getattr(cell, name) * by
        wish = _wish(template, face, values["polygon"], width, depth, cell)
        faces.append(SizedFace(**values, wish=wish, origin=origin))
    return _redrawn(template, faces, move)


def _noded(template: Template) -> Template:
    """Give faces the vertices of their neighbours, so that they still meet after the map."""
    mesh = topology([face.polygon for face in template.faces])
    faces = []
    for face, ring in zip(template.faces, mesh.rings):
        z = mesh.points[ring]
        faces.append(replace(face, polygon=shapely.Polygon(np.stack([z.real, z.imag], axis=1))))
    return replace(template, faces=tuple(faces))


def _wish(
    template: Template, face: Face, now: Any, width: float, depth: float, cell: Cell | None
) -> tuple[float, float]:
    """Give the ideal size of a face as factors of the size that the map has given it."""
    across, along = factors(template, face, width, depth)
    drawn, mapped = (_extent(polygon, face.axis) for polygon in (face.polygon, now))
    longer = [1.0, 1.0]
    if cell is not None:
        turned = round(face.axis / 90.0) % 2
        longer[cell.axis ^ turned] = cell.ideal / (cell.end - cell.start)
    return (
        across * longer[0] * drawn[0] / mapped[0] if across > 0 else 1.0,
        along * longer[1] * drawn[1] / mapped[1] if along > 0 else 1.0,
    )


def _extent(polygon: Any, axis: float) -> tuple[float, float]:
    """Measure width and depth of a face in its frame."""
    z = coordinates(polygon) * np.exp(-1j * np.radians(axis))
    return float(np.ptp(z.real)), float(np.ptp(z.imag))


def _axis_map(
    values: Floats, wishes: list[tuple[float, float, float, bool]], plain: float
) -> tuple[Floats, Floats]:
    """Give old and new coordinates along an axis, shape (k,) each."""
    old = np.unique(values)
    steps = np.diff(old)
    for k, (a, b) in enumerate(zip(old[:-1], old[1:])):
        over = [(f, firm) for start, end, f, firm in wishes if start < b and end > a]
        firm = [f for f, is_firm in over if is_firm]
        use = firm or [f for f, _ in over] or [plain]
        steps[k] *= np.exp(np.mean(np.log(use)))
    return old, np.concatenate([[old[0]], old[0] + np.cumsum(steps)])
