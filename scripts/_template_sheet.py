"""The sheet that pictures the shipped templates: drawn to scale, and warped into bent regions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import shapely
from platwright.parcels.rules import ParcelRules
from platwright.parcels.templates import Template, TemplateLibrary, cells, repeated, scaled
from platwright.parcels.types import Block
from platwright.parcels.warp import match_templates
from shapely.geometry import LineString, Polygon

from _template_drawing import outline

#: Colours by label; what other templates fill stays white.
FILLS = {
    "parcel": "#f4e7cb", "green": "#b5d59b", "court": "#d5e5bd", "street": "#d9d9d9",
    "lane": "#c9c9c9", "building": "#c98f7a", "parking": "#dcdcdc", "house": "#b5664f",
    "driveway": "#cfcfcf", "garden": "#cfe3b8", "pool": "#8fc9e6",
}  # fmt: skip
LINES = {
    "street": "#c0392b", "no street": "#8e44ad", "any": "#7f8c8d", "straight": "#1e8449",
    "circle": "#1e8449", "smooth": "#1e8449", "centre": "#2471a3",
}  # fmt: skip
COLUMNS, CELL, ROW, SCALE = 4, 250.0, 182.0, 1.25
#: How often stretches are repeated in the right-hand pictures.
TIMES = 4


def path(polygon: Polygon, at: tuple[float, float], scale: float) -> str:
    """Write a polygon as SVG path data, y upwards."""
    xy = shapely.get_coordinates(polygon.exterior)
    pairs = " ".join(f"{at[0] + x * scale:.1f},{at[1] - y * scale:.1f}" for x, y in xy[:-1])
    return f"M{pairs}z"


def polyline(line: LineString, at: tuple[float, float], scale: float, colour: str) -> str:
    """Write a line as an SVG element."""
    pairs = " ".join(f"{at[0] + x * scale:.1f},{at[1] - y * scale:.1f}" for x, y in line.coords)
    return f'<polyline points="{pairs}" fill="none" stroke="{colour}" stroke-width="1.6"/>'


def bent(polygon: Polygon) -> Polygon:
    """Bend and skew a region the way that real blocks are."""
    centre = np.array(polygon.centroid.coords[0])

    def move(xy: np.ndarray) -> np.ndarray:
        q = (xy - centre) * (1.04, 0.98)
        bow = np.stack([0.08 * q[:, 1], 0.0012 * q[:, 0] ** 2], axis=1)
        return np.asarray(q + bow)

    return shapely.orient_polygons(shapely.transform(shapely.segmentize(polygon, 10.0), move))


def drawing(template: Template, at: tuple[float, float], room: float) -> list[str]:
    """Draw a template as it is in the library."""
    box = shapely.total_bounds([face.polygon for face in template.faces])
    scale = min(SCALE, room / (box[2] - box[0]), (ROW - 60) / (box[3] - box[1]))
    if template.level == 3:
        scale = min(room / 20, (ROW - 60) / (box[3] - box[1]), 4.0)
    origin = (at[0] - box[0] * scale, at[1] + box[3] * scale)
    parts = []
    for face in template.faces:
        dash = ' stroke-dasharray="4 3"' if face.repeat else ""
        parts.append(
            f'<path d="{path(face.polygon, origin, scale)}" '
            f'fill="{FILLS.get(face.label, "#fff")}" stroke="#555" stroke-width=".7"{dash}/>'
        )
    parts += [polyline(e.line, origin, scale, LINES[e.meaning]) for e in template.edges]
    return parts


def example(
    template: Template, library: TemplateLibrary, at: tuple[float, float], room: float
) -> list[str]:
    """Draw a template warped into a bent region."""
    rules = ParcelRules()
    times = {cell.name: TIMES * (3 if "Town" in template.name else 1) for cell in cells(template)}
    drawn = repeated(scaled(template, rules.width, rules.depth), times)
    region = bent(outline(drawn))
    block = Block(region)
    found = match_templates(
        [block], library, rules, region_label=template.region_label, names=[template.name], seed=3
    )[0]
    if not found:
        return []
    box = region.bounds
    scale = min(SCALE, room / (box[2] - box[0]), (ROW - 60) / (box[3] - box[1]))
    origin = (at[0] - box[0] * scale, at[1] + box[3] * scale)
    parts = []
    for plot in found[0].plots:
        fill = FILLS[plot.note if plot.note in FILLS else plot.use]
        parts.append(
            f'<path d="{path(plot.polygon, origin, scale)}" fill="{fill}" stroke="#555" '
            'stroke-width=".7"/>'
        )
    parts += [polyline(line, origin, scale, LINES["centre"]) for line in found[0].streets]
    return parts


def sheet(library: TemplateLibrary) -> str:
    """Give the sheet as SVG."""
    shown = list(library)
    rows = -(-len(shown) // COLUMNS)
    width, height = COLUMNS * CELL, rows * ROW + 50
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" '
        'font-family="sans-serif" font-size="11">',
        f'<rect width="{width:g}" height="{height:g}" fill="#fff"/>',
    ]
    for k, template in enumerate(shown):
        x, y = (k % COLUMNS) * CELL + 10, (k // COLUMNS) * ROW + 10
        parts.append(
            f'<text x="{x:g}" y="{y + 12:g}" font-weight="bold" fill="#222">{template.name}</text>'
            f'<text x="{x:g}" y="{y + 26:g}" fill="#666">level {template.level}, '
            f"fills: {template.region_label}</text>"
        )
        warped = template.level < 3 and template.region_label != "row"
        room = 88.0 if warped else 200.0
        parts += drawing(template, (x, y + 36), room)
        if warped:
            parts += example(template, library, (x + 102, y + 36), 126.0)
    parts += legend(10.0, rows * ROW + 26)
    parts.append("</svg>\n")
    return "\n".join(parts)


def legend(x: float, y: float) -> Iterable[str]:
    """Explain colours and lines."""
    names: Sequence[tuple[str, str]] = [
        ("street beyond", "street"), ("no street beyond", "no street"),
        ("keeps its shape", "circle"), ("centre line", "centre"),
    ]  # fmt: skip
    for text, meaning in names:
        yield polyline(LineString([(x, -y), (x + 22, -y)]), (0, 0), 1.0, LINES[meaning])
        yield f'<text x="{x + 27:g}" y="{y + 4:g}" fill="#222">{text}</text>'
        x += 126
    yield f'<text x="{x:g}" y="{y + 4:g}" fill="#222">dashed: repeats</text>'
    x += 102
    for label in ("parcel", "green", "court", "street", "building", "parking"):
        yield (
            f'<rect x="{x:g}" y="{y - 6:g}" width="12" height="12" fill="{FILLS[label]}" '
            'stroke="#555" stroke-width=".5"/>'
            f'<text x="{x + 16:g}" y="{y + 4:g}" fill="#222">{label}</text>'
        )
        x += 62


def write(library: TemplateLibrary, target: Path) -> None:
    """Write the sheet."""
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(sheet(library), encoding="utf-8")
