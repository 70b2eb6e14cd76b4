"""What the gallery of residential zones lays out: sites, patterns, settings."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from _gallery_places import CAMBRIDGE, OSM

#: The patterns of one zone as a whole, as `PATTERN` has them, and the one that mixes them.
PATTERNS = ("rows", "centric", "enclosed", "symmetrical", "dotted")
MIXED = "mixed"
TITLES = {
    "rows": "rows", "centric": "centric", "enclosed": "enclosed", "symmetrical": "symmetrical",
    "dotted": "dotted", MIXED: "mixed, one patch a park",
}  # fmt: skip
#: Patterns of the patches of a mixed plan, the largest first; the park is the one in the middle.
MIX = ("enclosed", "rows", "centric", "symmetrical", "dotted")
#: What corridors are designed with, by Design streets.
CORRIDORS: dict[str, Any] = {
    "BLOCK_WIDTH": 120, "BLOCK_LENGTH": 170, "TIME_LIMIT": 8, "SEED": 42
}  # fmt: skip
#: Layers of the tool that are drawn, from the top down, by their key: table and kind.
DRAWN = {
    "TREES": "trees", "BUILDINGS": "buildings", "SHADOWS": "shadows", "PARKING_BAYS": "parking",
    "PATHS": "paths", "CORRIDORS_USED": "corridors", "GREEN": "green", "PATCHES_USED": "patches",
}  # fmt: skip
#: Their kinds in `building_fields`.
KINDS = {
    "trees": "TREES", "buildings": "BUILDINGS", "shadows": "SHADOWS", "parking": "PARKING",
    "paths": "PATHS", "corridors": "CORRIDORS", "green": "GREEN", "patches": "PATCHES",
}  # fmt: skip


@dataclass(frozen=True)
class Zoned:
    """A zone of the gallery.

    Attributes
    ----------
    key
        Of its pictures and its figures.
    name
        What it is called.
    file
        See `_gallery_places.Where`.
    credit
        What pictures say of the data.
    types
        The shipped set of building types.
    shown
        The pattern that is drawn in 3D; empty for none.
    styles
        Styles of its buildings in which it is drawn large, too, by the ends of their pictures.
    asked
        What else the tool is told.
    """

    key: str
    name: str
    file: str
    credit: str
    types: str
    shown: str = ""
    styles: dict[str, str] = field(default_factory=dict)
    asked: dict[str, Any] = field(default_factory=dict)


ZONES = (
    Zoned("baltimore", "Brownfield, Baltimore", "sites/01_rect_brownfield_baltimore.gpkg", OSM,
          "multistorey", "enclosed", {"plan": "", "sun": "Hours of sun", "raised": "2.5D"}),
    Zoned("triesen", "Triesen, Liechtenstein", "sites/02_organic_triesen_li.gpkg", OSM, "slabs"),
    Zoned("notched", "Notched block, Cambridge", "sites/05_concave_notched_cambridge.gpkg",
          CAMBRIDGE, "mixed", MIXED),
    Zoned("l_shape", "L-shaped rail land, Cambridge", "sites/07_l_shape_rail_cambridge.gpkg",
          CAMBRIDGE, "highrise"),
    Zoned("baths", "Around the baths, Schaan", "sites/12_hole_baths_li.gpkg", OSM, "terraced"),
)  # fmt: skip
