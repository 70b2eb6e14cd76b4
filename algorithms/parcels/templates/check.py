"""Checks of drawn templates: every message names template, layer, feature and field."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import shapely

from ...errors import InputError
from .mesh import MERGE, Topology, TopologyError, corner_signs, topology
from .repeat import REPEAT, cells
from .types import (
    CORNER_KINDS,
    DEFORMATIONS,
    FURNITURE,
    LAND,
    MEANINGS,
    OUTLINE_MEANINGS,
    SHAPE_MEANINGS,
    Edge,
    Face,
    Template,
    TemplateLibrary,
)

#: Feature ids: layer -> name of the template -> one for each feature.
Ids = Mapping[str, Mapping[str, Sequence[int]]]


def check_library(library: TemplateLibrary, ids: Ids | None = None) -> None:
    """Raise an error that a planner can act on if a library cannot be used.

    Parameters
    ----------
    library
        The templates.
    ids
        Feature ids to name; without, features are numbered in the order in which they are written.

    Raises
    ------
    InputError
        If a field or a drawing cannot be used.
    """
    ids = numbered(library) if ids is None else ids
    seen: set[str] = set()
    for template in library:
        where = ids["templates"].get(template.name, [0])[0]
        if template.name in seen:
            raise InputError(
                f"There are two templates named '{template.name}'.",
                "Give each a name of its own (field 'name').",
                layer="templates", feature=where,
            )  # fmt: skip
        seen.add(template.name)
        _check_attributes(template, where)
    fills = {template.region_label for template in library}
    for template in library:
        _Drawing(template, ids, fills).check()
    _check_circles(library, ids)


def numbered(library: TemplateLibrary) -> Ids:
    """Give the features of a library the ids that `write_library` gives them.

    Parameters
    ----------
    library
        The templates.
    """
    found: dict[str, dict[str, list[int]]] = {"templates": {}, "faces": {}, "edges": {}}
    found["corners"] = {}
    for number, template in enumerate(library):
        found["templates"].setdefault(template.name, []).append(number + 1)
    for layer in ("faces", "edges", "corners"):
        count = 0
        for template in library:
            features = getattr(template, layer)
            of = found[layer].setdefault(template.name, [])
            of.extend(range(count + 1, count + 1 + len(features)))
            count += len(features)
    return found


def _check_attributes(template: Template, where: int) -> None:
    """Check the row of a template in the table."""

    def wrong(field: str, problem: str, remedy: str) -> InputError:
        of = f"Template '{template.name}', field '{field}'"
        return InputError(f"{of}: {problem}", remedy, layer="templates", feature=where)

    if not template.name.strip():
        raise wrong("name", "it is empty.", "Give the template a name.")
    if template.level not in (1, 2, 3):
        raise wrong("level", f"{template.level} is no level.", "Give 1, 2 or 3.")
    if not template.region_label.strip():
        raise wrong("region_label", "it is empty.", "Say what it fills, for example block.")
    if not (math.isfinite(template.probability) and template.probability > 0):
        raise wrong("probability", f"it is {template.probability:g}.", "Give more than 0.")
    if template.min_uses < 0:
        raise wrong("min_uses", f"it is {template.min_uses}.", "Give 0 or more.")
    if template.max_uses != -1 and template.max_uses < max(template.min_uses, 1):
        raise wrong(
            "max_uses",
            f"{template.max_uses} is below 1 or below min_uses, {template.min_uses}.",
            "Give at least as many, or -1 for no bound.",
        )
    for field in ("lot_width", "lot_depth"):
        value = getattr(template, field)
        if not (math.isfinite(value) and value >= 0):
            raise wrong(field, f"it is {value:g}.", "Give metres, or 0 for 'never scaled'.")
    if (template.lot_width > 0) != (template.lot_depth > 0):
        raise wrong("lot_depth", "one of lot_width and lot_depth is 0.", "Give both or none.")
    if not template.faces:
        raise wrong("name", "no face belongs to it.", "Draw at least one in layer 'faces'.")


class _Drawing:
    """The checks of the drawing of one template."""

    def __init__(self, template: Template, ids: Ids, fills: set[str]) -> None:
        self.template = template
        self.ids = ids
        self.fills = fills

    def wrong(
        self, layer: str, index: int, field: str, problem: str, remedy: str = ""
    ) -> InputError:
        of = self.ids.get(layer, {}).get(self.template.name, [])
        feature = of[index] if index < len(of) else index + 1
        text = f"Template '{self.template.name}', field '{field}': {problem}"
        return InputError(text, remedy, layer=layer, feature=feature)

    def check(self) -> None:
        for index, face in enumerate(self.template.faces):
            self._face(index, face)
        try:
            mesh = topology([face.polygon for face in self.template.faces])
        except TopologyError as error:
            at = f"near {error.where.real:.2f}, {error.where.imag:.2f}"
            raise self.wrong(
                "faces", error.face, "geometry", f"the face {error} ({at}).",
                "Let the faces meet along whole edges, without gaps, overlaps or holes "
                "(snapping in QGIS does it).",
            ) from None  # fmt: skip
        self._repeats()
        for index, edge in enumerate(self.template.edges):
            self._edge(index, edge, mesh)
        self._corners(mesh)

    def _face(self, index: int, face: Face) -> None:
        polygon = face.polygon
        if not isinstance(polygon, shapely.Polygon) or polygon.is_empty or not polygon.is_valid:
            reason = shapely.is_valid_reason(polygon) if polygon is not None else "none"
            raise self.wrong(
                "faces", index, "geometry", f"it is no valid polygon ({reason}).",
                "Draw the face anew, without crossing itself.",
            )  # fmt: skip
        if polygon.interiors:
            raise self.wrong(
                "faces", index, "geometry", "the face has a hole.",
                "Cut the face in two, so that each part is without a hole.",
            )  # fmt: skip
        known = {*LAND, *(FURNITURE if self.template.level == 3 else ()), *self.fills}
        if face.label not in known:
            raise self.wrong(
                "faces", index, "label", f"no template fills regions labelled '{face.label}'.",
                f"Use one of {', '.join(sorted(known))}.",
            )  # fmt: skip
        if face.deform not in DEFORMATIONS:
            raise self.wrong(
                "faces", index, "deform", f"'{face.deform}' is no kind of deformation.",
                f"Use one of {', '.join(DEFORMATIONS)}.",
            )  # fmt: skip
        for side in ("width", "depth"):
            least, most = getattr(face, f"{side}_min"), getattr(face, f"{side}_max")
            if not (0 < least <= most < math.inf):
                raise self.wrong(
                    "faces", index, f"{side}_min", f"{least:g} to {most:g} is no range of factors.",
                    f"Give {side}_min above 0 and not above {side}_max.",
                )  # fmt: skip
        if not math.isfinite(face.axis):
            raise self.wrong("faces", index, "axis", "it is no number.", "Give degrees.")
        if not (0 < face.tolerance < math.inf):
            text = f"it is {face.tolerance:g}."
            raise self.wrong("faces", index, "tolerance", text, "Give metres, more than 0.")
        if face.repeat and not REPEAT.fullmatch(face.repeat):
            raise self.wrong(
                "faces", index, "repeat", f"'{face.repeat}' is no direction.",
                "Leave it empty, or write x or y, with a name after it if there are several.",
            )  # fmt: skip

    def _repeats(self) -> None:
        stretches = cells(self.template)
        for at, cell in enumerate(stretches):
            index = self.template.faces.index(cell.faces[0])
            for other in stretches[:at]:
                shared = min(cell.end, other.end) - max(cell.start, other.start)
                if other.axis == cell.axis and shared > MERGE:
                    raise self.wrong(
                        "faces", index, "repeat",
                        f"'{cell.name}' repeats from {cell.start:g} to {cell.end:g} m, where "
                        f"'{other.name}' repeats, too.",
                        "Give both the same name, or leave rows that are counted each by itself "
                        "to templates of their own, as 'Two rows counted each' does.",
                    )  # fmt: skip
            if not 0 < cell.least <= cell.ideal <= cell.most < math.inf:
                raise self.wrong(
                    "faces", index, "repeat_ideal",
                    f"the width of one repeat should be {cell.ideal:g} m, "
                    f"between {cell.least:g} and {cell.most:g} m.",
                    "Give repeat_min above 0, and repeat_ideal between it and repeat_max.",
                )  # fmt: skip
            for where, face in enumerate(self.template.faces):
                if face.repeat == cell.name:
                    continue
                xy = shapely.get_coordinates(face.polygon)[:, cell.axis]
                within = (xy > cell.start + MERGE) & (xy < cell.end - MERGE)
                if within.any():
                    raise self.wrong(
                        "faces", where, "repeat",
                        f"it has a vertex inside the stretch from {cell.start:g} to {cell.end:g} m "
                        f"that '{cell.name}' repeats.",
                        "Let it end there, reach across, or repeat as well.",
                    )  # fmt: skip

    def _edge(self, index: int, edge: Edge, mesh: Topology) -> None:
        if edge.meaning not in MEANINGS:
            raise self.wrong(
                "edges", index, "meaning", f"'{edge.meaning}' is no meaning of an edge.",
                f"Use one of {', '.join(MEANINGS)}.",
            )  # fmt: skip
        if edge.line is None or edge.line.is_empty or edge.line.length < MERGE:
            text = "there is no line."
            raise self.wrong("edges", index, "geometry", text, "Draw it, or delete the feature.")
        z = mesh.points[mesh.outline]
        outline = shapely.LinearRing(np.stack([z.real, z.imag], axis=1))
        if edge.meaning in OUTLINE_MEANINGS:
            if edge.line.difference(outline.buffer(2 * MERGE)).length > MERGE:
                raise self.wrong(
                    "edges", index, "geometry",
                    f"a line that means '{edge.meaning}' leaves the outline of the template.",
                    "Draw it along the outline, snapped to its vertices.",
                )  # fmt: skip
        elif edge.meaning in SHAPE_MEANINGS:
            points = shapely.points(mesh.points.real, mesh.points.imag)
            count = int((shapely.distance(points, edge.line) < 2 * MERGE).sum())
            repeats = any(face.repeat for face in self.template.faces)
            if count < (2 if repeats else 3):
                raise self.wrong(
                    "edges", index, "geometry",
                    f"a line that stays '{edge.meaning}' has {count} vertices of faces on it.",
                    "Draw it through three or more of them.",
                )  # fmt: skip
        else:
            streets = [f.polygon for f in self.template.faces if f.label in ("street", "lane")]
            around = shapely.union_all([*streets]).buffer(2 * MERGE)
            if edge.line.difference(around).length > MERGE:
                raise self.wrong(
                    "edges", index, "geometry", "a centre line leaves the street and lane faces.",
                    "Draw it inside them.",
                )  # fmt: skip

    def _corners(self, mesh: Topology) -> None:
        z = mesh.points[mesh.outline]
        marks = []
        for index, mark in enumerate(self.template.corners):
            if mark.kind not in CORNER_KINDS:
                raise self.wrong(
                    "corners", index, "kind", f"'{mark.kind}' is no kind of corner.",
                    f"Use one of {', '.join(CORNER_KINDS)}.",
                )  # fmt: skip
            missing = mark.point is None or mark.point.is_empty
            where = 0j if missing else complex(mark.point.x, mark.point.y)
            if missing or np.abs(z - where).min() > 2 * MERGE:
                raise self.wrong(
                    "corners", index, "geometry", "it is on no vertex of the outline.",
                    "Snap the point to a vertex of the outline.",
                )  # fmt: skip
            marks.append((where, mark.kind))
        if not corner_signs(z, marks).any() and len(self.template.faces) > 1:
            raise self.wrong(
                "faces", 0, "geometry", "its outline has no corner, yet it has several faces.",
                "Mark corners in layer 'corners', or draw one face only.",
            )  # fmt: skip


def _check_circles(library: TemplateLibrary, ids: Ids) -> None:
    """Raise an error if a template can end up inside itself."""
    inside: dict[str, set[str]] = {}
    for template in library:
        own = inside.setdefault(template.region_label, set())
        own.update(face.label for face in template.faces)
    for template in library:
        if template.level == 3:
            continue
        for index, face in enumerate(template.faces):
            if face.label in LAND:
                continue
            seen: set[str] = set()
            waiting = [face.label]
            while waiting:
                label = waiting.pop()
                if label not in seen and label not in LAND:
                    seen.add(label)
                    waiting.extend(inside.get(label, ()))
            if template.region_label in seen:
                raise _Drawing(template, ids, set()).wrong(
                    "faces", index, "label",
                    f"'{face.label}' is filled by templates that contain "
                    f"'{template.region_label}' again.",
                    "Let faces be filled by templates of a finer kind only.",
                )  # fmt: skip
