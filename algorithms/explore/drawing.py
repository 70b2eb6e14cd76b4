"""Designs in pictures: length against distance, and all plans side by side (CND figures 5, 8)."""

from __future__ import annotations

import importlib
import io
import math
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import numpy as np
import shapely

from ..errors import InputError, MissingDependencyError
from .design import FIGURES
from .tradeoffs import Exploration, Explored, label

#: Files that can be drawn.
ENDINGS = ("svg", "png")
#: Colour and width of a street by its level.
_LEVELS = {
    1: ("#8e2b1d", 1.8),
    2: ("#c8442c", 1.5),
    3: ("#e58a3a", 1.0),
    4: ("#f0b56a", 0.8),
}
_INK, _GREY, _GROUND, _FRONT = "#2c2a26", "#9c978c", "#f3efe6", "#2f6f73"
_DPI = 150
#: Side of one plan, inches.
_SIDE = 2.6
#: Letters of a line below a plan.
_LINE = 34


def plot(exploration: Exploration, ending: str = "svg") -> bytes:
    """Draw each design as a point: length against distance (CND figure 5).

    Parameters
    ----------
    exploration
        Its first two `columns` are the axes; the front is joined by a line.
    ending
        "svg" or "png".

    Returns
    -------
    bytes
        The file.

    Raises
    ------
    InputError
        There is no design to draw, or the ending is another.
    MissingDependencyError
        matplotlib is not installed.
    """
    figure = _figure(6.4, 4.8)
    axes = figure.add_subplot()
    across, up = (*exploration.columns, "mean_distance_m")[:2]
    done = [one for one in exploration.done if _known(one, across, up)]
    if not done:
        raise InputError("There is no design to draw.", "See the reasons in the table of designs.")
    points = np.array([[one.figures[across], one.figures[up]] for one in done])
    front = np.array([one.pareto for one in done])
    line = points[front][np.lexsort(points[front].T[::-1])]
    axes.plot(*line.T, color=_FRONT, linewidth=1.0, zorder=1)
    axes.scatter(*points[~front].T, s=34, color=_GREY, zorder=2, label="another is better")
    text = "no other is better in every way"
    axes.scatter(*points[front].T, s=44, color=_FRONT, zorder=3, label=text)
    for at, names in _together(points, [str(one.run.number) for one in done]):
        axes.annotate(names, at, (5, 4), textcoords="offset points", fontsize=8, color=_INK)
    axes.set_xlabel(_axis(across))
    axes.set_ylabel(_axis(up))
    axes.margins(0.08)
    axes.grid(visible=True, color="#e3ded2", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.tick_params(labelsize=8)
    axes.legend(frameon=False, fontsize=8)
    figure.tight_layout()
    return _saved(figure, ending)


def picture(exploration: Exploration, ending: str = "png") -> bytes:
    """Draw all plans side by side at one scale, with their lengths and distances (CND figure 8).

    Parameters
    ----------
    exploration
        Designs without result keep their place and say why.
    ending
        "svg" or "png".

    Returns
    -------
    bytes
        The file.

    Raises
    ------
    InputError
        The ending is another.
    MissingDependencyError
        matplotlib is not installed.
    """
    bounds = _bounds(exploration)
    columns, rows = _shape(exploration)
    aspect = (bounds[3] - bounds[1]) / (bounds[2] - bounds[0])
    width = _SIDE if aspect <= 1 else max(1.7, _SIDE / aspect)
    height = max(0.6, width * aspect) + 0.62
    figure = _figure(columns * width, rows * height + 0.35)
    outlines = [shapely.boundary(site.polygon) for site in exploration.prepared.sites]
    for at, one in enumerate(exploration.designs):
        axes = figure.add_subplot(rows, columns, at + 1)
        for site, outline in zip(exploration.prepared.sites, outlines):
            _fill(axes, site.polygon)
            _lines(axes, [outline], _GREY, 0.5)
        _draw(axes, exploration, one)
        axes.set_xlim(bounds[0], bounds[2])
        axes.set_ylim(bounds[1], bounds[3])
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.set_title(_heading(one, exploration.varied), fontsize=6.5, color=_INK, pad=3,
                       parse_math=False)  # fmt: skip
        if one.pareto:
            axes.title.set_color(_FRONT)
            axes.title.set_fontweight("bold")
    _scale(figure.axes[0], bounds)
    figure.tight_layout(pad=0.4, h_pad=0.8, w_pad=0.6)
    return _saved(figure, ending)


def _shape(exploration: Exploration) -> tuple[int, int]:
    """Return columns and rows: those of the grid where there is one, else about a square."""
    total, varied = len(exploration.designs), exploration.varied
    if len(varied) == 2:
        last = [str(one.run.values.get(varied[1])) for one in exploration.designs]
        columns = len(set(last))
        if columns <= 8 and columns * len(set(zip(_firsts(exploration), last))) == total * columns:
            return columns, math.ceil(total / columns)
    columns = min(6, math.ceil(math.sqrt(total)))
    return columns, math.ceil(total / columns)


def _firsts(exploration: Exploration) -> list[str]:
    key = exploration.varied[0]
    return [str(one.run.values.get(key)) for one in exploration.designs]


def _heading(one: Explored, varied: Sequence[str]) -> str:
    """Return what stands above a plan."""
    words = f"{one.run.number}: {label(one.run, varied)}".split()
    lines = [""]
    for word in words:
        fits = len(lines[-1]) + len(word) < _LINE
        lines[-1:] = [f"{lines[-1]} {word}".strip()] if fits else [lines[-1], word]
    if one.state == "done":
        length, mean = one.figures["length_m"], one.figures["mean_distance_m"]
        lines.append(f"L {length:,.0f} m, d {mean:.0f} m".replace(",", "\N{NO-BREAK SPACE}"))
    return "\n".join(lines)


def _draw(axes: Any, exploration: Exploration, one: Explored) -> None:
    """Draw the streets of a design, or that there is none."""
    if one.state != "done":
        text = "no design" if one.state == "failed" else "cancelled"
        axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", fontsize=8, color=_GREY)
        return
    streets = one.layers["streets"].to_crs(exploration.prepared.sites[0].crs)
    new = streets["status"].isin(["new", "connector", "given"])
    _lines(axes, streets.geometry[~new], _GREY, 1.0)
    for level, (colour, width) in reversed(_LEVELS.items()):
        _lines(axes, streets.geometry[new & (streets["level"] == level)], colour, width)


def _lines(axes: Any, shapes: Any, colour: str, width: float) -> None:
    collections = importlib.import_module("matplotlib.collections")
    parts = shapely.get_parts(np.array(list(shapes), dtype=object))
    lines = [shapely.get_coordinates(part) for part in parts]
    axes.add_collection(collections.LineCollection(lines, colors=colour, linewidths=width))


def _fill(axes: Any, polygon: shapely.Polygon) -> None:
    """Fill a polygon, its holes left out."""
    paths = importlib.import_module("matplotlib.path")
    patches = importlib.import_module("matplotlib.patches")
    rings = [paths.Path(shapely.get_coordinates(ring)) for ring in shapely.get_rings(polygon)]
    path = paths.Path.make_compound_path(*rings)
    axes.add_patch(patches.PathPatch(path, facecolor=_GROUND, edgecolor="none"))


def _scale(axes: Any, bounds: tuple[float, float, float, float]) -> None:
    """Draw a scale bar below the first plan."""
    width = bounds[2] - bounds[0]
    size = 10 ** math.floor(math.log10(0.4 * width))
    size *= max(k for k in (1, 2, 4) if k * size <= 0.4 * width)
    line = importlib.import_module("matplotlib.lines").Line2D
    share = size / width
    bar = line([0.02, 0.02 + share], [-0.03, -0.03], transform=axes.transAxes, color=_INK)
    bar.set(linewidth=1.2, clip_on=False)
    axes.add_line(bar)
    axes.text(0.04 + share, -0.03, f"{size:g} m", transform=axes.transAxes, fontsize=6, va="center")


def _bounds(exploration: Exploration) -> tuple[float, float, float, float]:
    """Return what each plan shows: the sites with a margin, metres."""
    boxes = np.array([site.polygon.bounds for site in exploration.prepared.sites])
    low, high = boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)
    margin = 0.04 * float((high - low).max())
    return (*(low - margin), *(high + margin))


def _known(one: Explored, *names: str) -> bool:
    return all(math.isfinite(one.figures[name]) for name in names)


def _together(points: Any, names: Sequence[str]) -> list[tuple[Any, str]]:
    """Return each place once with the names of all that lie there."""
    places: dict[tuple[float, ...], list[str]] = {}
    for at, name in zip(np.round(points, 1).tolist(), names):
        places.setdefault(tuple(at), []).append(name)
    return [(at, ", ".join(some)) for at, some in places.items()]


def _axis(name: str) -> str:
    return FIGURES[name].replace(" in metres", " (m)").replace(" in seconds", " (s)")


def figures() -> ModuleType:
    """Return the package that pictures are drawn with.

    Raises
    ------
    MissingDependencyError
        It is not installed.
    """
    try:
        return importlib.import_module("matplotlib.figure")
    except ImportError as error:
        msg = f"Pictures need the Python package matplotlib ({error}). QGIS usually brings it."
        raise MissingDependencyError(msg) from error


def _figure(width: float, height: float) -> Any:
    """Return an empty picture (inches) that belongs to no window."""
    return figures().Figure(figsize=(width, height), dpi=_DPI)


def _saved(figure: Any, ending: str) -> bytes:
    """Return a picture as a file; the same picture is the same file."""
    if ending not in ENDINGS:
        raise InputError(
            f"Pictures of the kind {ending} cannot be drawn.", f"Choose {' or '.join(ENDINGS)}."
        )
    matplotlib = importlib.import_module("matplotlib")
    buffer = io.BytesIO()
    if ending == "png":
        canvas = importlib.import_module("matplotlib.backends.backend_agg").FigureCanvasAgg
        canvas(figure).print_png(buffer)
        return buffer.getvalue()
    canvas = importlib.import_module("matplotlib.backends.backend_svg").FigureCanvasSVG
    with matplotlib.rc_context({"svg.hashsalt": "platwright", "svg.fonttype": "none"}):
        canvas(figure).print_svg(buffer, metadata={"Date": None})
    return buffer.getvalue()
