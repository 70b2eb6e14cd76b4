"""Pictures of maps with what a reader needs beside them: scale, north, legend."""

from __future__ import annotations

import base64
import math
from dataclasses import dataclass

from .html import Html, tag, text

#: A scale bar takes at most this share of the width of a picture.
_SHARE = 0.28
_ROUND = (1.0, 2.0, 5.0)


@dataclass(frozen=True)
class LegendEntry:
    """One line of a legend.

    Attributes
    ----------
    label
        What it says.
    png
        Its symbol as a PNG, or empty for a heading.
    """

    label: str
    png: bytes = b""


@dataclass(frozen=True)
class Picture:
    """One map.

    Attributes
    ----------
    title
        What it shows.
    alt
        The same in a sentence, for who cannot see it.
    png
        The map as a PNG.
    width, height
        Its size in pixels.
    ground
        Width of the ground that it shows, m.
    crs
        Coordinate reference system, as a reader knows it.
    north
        Direction of true north, degrees clockwise from up.
    legend
        The legend.
    small
        The same map in fewer pixels, for an overview; empty for none.
    """

    title: str
    alt: str
    png: bytes
    width: int
    height: int
    ground: float
    crs: str
    north: float = 0.0
    legend: tuple[LegendEntry, ...] = ()
    small: bytes = b""


def scale_length(ground: float) -> float:
    """Return the length of a scale bar for a map of so many metres: 1, 2 or 5 times ten.

    Examples
    --------
    >>> scale_length(1000.0), scale_length(340.0)
    (200.0, 50.0)
    """
    most = _SHARE * ground
    if not (math.isfinite(most) and most > 0):
        return 0.0
    power = 10.0 ** math.floor(math.log10(most))
    return max(step * power for step in _ROUND if step * power <= most * (1 + 1e-9))


def scale_text(metres: float) -> str:
    """Return a length as on a scale bar."""
    if metres >= 1000:
        return f"{metres / 1000:g} km"
    return f"{metres:g} m" if metres >= 1 else f"{100 * metres:g} cm"


def data_uri(png: bytes) -> str:
    """Return a picture as an address that holds it."""
    return f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"


def overview(picture: Picture) -> Html:
    """Return a picture alone, small where it has a small one."""
    return tag(
        "img",
        src=data_uri(picture.small or picture.png),
        alt=picture.alt,
        width=picture.width,
        height=picture.height,
    )


def figure(picture: Picture) -> Html:
    """Return a picture with its scale bar, north arrow, legend and caption."""
    image = tag(
        "img",
        src=data_uri(picture.png),
        alt=picture.alt,
        width=picture.width,
        height=picture.height,
    )
    caption = f"{picture.title}. Coordinate reference system: {picture.crs}."
    return tag(
        "figure",
        tag("div", image, _marks(picture), class_="map"),
        tag("figcaption", caption),
        _legend(picture),
        class_="plan",
    )


def _marks(picture: Picture) -> Html:
    """Draw scale bar and north arrow over a map, in the units of its pixels."""
    wide, high = picture.width, picture.height
    unit = wide / 100.0
    x, y = 2.5 * unit, high - 2.5 * unit
    parts = []
    metres = scale_length(picture.ground)
    if metres:
        long = wide * metres / picture.ground
        parts += [
            _box(x - unit, y - 4.2 * unit, long + 2 * unit + 5 * unit, 5.4 * unit),
            _rect(x, y - unit, long / 2, unit, "#2b2925"),
            _rect(x + long / 2, y - unit, long / 2, unit, "#ffffff"),
            _letter(x, y - 1.7 * unit, 1.7 * unit, "0", "start"),
            _letter(x + long, y - 1.7 * unit, 1.7 * unit, scale_text(metres), "middle"),
        ]
    nx, ny, size = wide - 4.5 * unit, high - 5.5 * unit, 2.6 * unit
    points = [
        (0.0, -size),
        (0.42 * size, 0.7 * size),
        (0.0, 0.35 * size),
        (-0.42 * size, 0.7 * size),
    ]
    outline = " ".join(f"{px:.1f},{py:.1f}" for px, py in points)
    parts += [
        tag("circle", cx=f"{nx:.1f}", cy=f"{ny:.1f}", r=f"{4 * unit:.1f}", fill="#ffffff",
            fill_opacity="0.85"),
        tag(
            "g",
            tag("polygon", points=outline, fill="#2b2925"),
            _letter(0, -1.05 * size, 1.3 * unit, "N", "middle"),
            transform=f"translate({nx:.1f} {ny + 0.45 * unit:.1f}) rotate({picture.north:.2f})",
        ),
    ]  # fmt: skip
    label = f"Scale bar of {scale_text(metres)}; " if metres else ""
    return tag(
        "svg",
        *parts,
        viewBox=f"0 0 {wide} {high}",
        role="img",
        aria_label=f"{label}north arrow",
        font_family="inherit",
    )


def _box(x: float, y: float, wide: float, high: float) -> Html:
    return tag("rect", x=f"{x:.1f}", y=f"{y:.1f}", width=f"{wide:.1f}", height=f"{high:.1f}",
               rx=f"{high / 8:.1f}", fill="#ffffff", fill_opacity="0.85")  # fmt: skip


def _rect(x: float, y: float, wide: float, high: float, colour: str) -> Html:
    return tag("rect", x=f"{x:.1f}", y=f"{y:.1f}", width=f"{wide:.1f}", height=f"{high:.1f}",
               fill=colour, stroke="#2b2925", stroke_width=f"{high / 8:.2f}")  # fmt: skip


def _letter(x: float, y: float, size: float, words: str, anchor: str) -> Html:
    return tag("text", words, x=f"{x:.1f}", y=f"{y:.1f}", font_size=f"{size:.1f}",
               text_anchor=anchor, fill="#2b2925")  # fmt: skip


def _legend(picture: Picture) -> Html:
    if not picture.legend:
        return text("")
    rows = [
        tag("li", tag("img", src=data_uri(own.png), alt="", width=28, height=18), own.label)
        if own.png
        else tag("li", own.label, class_="heading")
        for own in picture.legend
    ]
    return tag("ul", *rows, class_="legend", aria_label="Legend")
