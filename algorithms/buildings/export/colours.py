"""Colours of plans in 3D, those of the styles in QGIS."""

from __future__ import annotations

from collections.abc import Mapping

COLOURS: Mapping[str, str] = {
    "plate": "#f7f4ee",
    "paved": "#e4dccb",
    "corridor": "#c9c4bb",
    "path": "#e9dfc7",
    "parking": "#b9b6c0",
    "green": "#b9d296",
    "low walls": "#f2c9a1",
    "low roof": "#f7e0c8",
    "middle walls": "#e29a6b",
    "middle roof": "#f0c4a5",
    "high walls": "#b5583c",
    "high roof": "#d99b86",
    "facility walls": "#7f9fc4",
    "facility roof": "#b4c6dd",
    "stem": "#8a6d52",
    "crown": "#6f9a58",
}


def linear(colour: str) -> list[float]:
    """Give a colour as glTF has it: linear red, green and blue, 0 to 1.

    Parameters
    ----------
    colour
        As #rrggbb in sRGB (IEC 61966-2-1).

    Examples
    --------
    >>> linear("#ff8000")
    [1.0, 0.21586, 0.0]
    """
    found = []
    for at in (1, 3, 5):
        part = int(colour[at : at + 2], 16) / 255
        bright = part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4
        found.append(round(bright, 5))
    return found
