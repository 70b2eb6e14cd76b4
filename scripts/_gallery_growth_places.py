"""What the gallery of growth grows and measures: sites, grammars, settings, towns."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from _gallery_places import CAMBRIDGE, OSM

#: The grammars that come along.
GRAMMARS = ("organic", "grid", "hex", "line", "radial", "suburb")
SEED = 42
#: The CRS of open ground; no place is meant by it.
OPEN_CRS = "EPSG:32632"
#: What the six are grown with.
OPEN: dict[str, Any] = {"SCALE": 60, "MAX_SEGMENTS": 600}
#: What is grown twice, as published and planar, and the side of the part that is shown (metres).
PAIR: dict[str, Any] = {"GRAMMAR": "line", "SCALE": 60, "MAX_SEGMENTS": 1500}
PAIR_SIDE = 900.0


@dataclass(frozen=True)
class Grown:
    """A picture of streets that grew into a site.

    Attributes
    ----------
    key
        Of its picture and its figures.
    name
        What it is called.
    file
        See `_gallery_places.Where`.
    credit
        What the picture says of the data.
    asked
        What the tool is told beside the layers; what is not said here is as the dialog has it.
    """

    key: str
    name: str
    file: str
    credit: str
    asked: dict[str, Any] = field(default_factory=dict)

    def words(self) -> str:
        """Say what was asked, for the table."""
        scale = f"{self.asked['GRAMMAR']}, scale {self.asked['SCALE']} m, seed {self.asked['SEED']}"
        snap = self.asked.get("SNAP_DISTANCE")
        return f"{scale}, snap distance {snap} m" if snap else scale


def _ask(grammar: str, scale: int, seed: int = SEED, **more: Any) -> dict[str, Any]:
    return {"GRAMMAR": grammar, "SCALE": scale, "SEED": seed, **more}


_ALEWIFE = "sites/09_rail_lands_alewife_1km.gpkg"
SITES = (
    Grown("triesen", "Triesen, Liechtenstein", "sites/02_organic_triesen_li.gpkg", OSM,
          _ask("organic", 40, 8)),
    Grown("helsinki", "Rail yard, Helsinki", "data/helsinki/helsinki_yard.gpkg", OSM,
          _ask("grid", 60, 6, SNAP_DISTANCE=60)),
    Grown("notched", "Notched block, Cambridge", "sites/05_concave_notched_cambridge.gpkg",
          CAMBRIDGE, _ask("organic", 50, 6)),
    Grown("locust_point", "Rail yard at Locust Point, Baltimore",
          "sites/08_railyard_locust_point_1km.gpkg", OSM, _ask("line", 70, 3)),
    Grown("alewife_organic", "Rail lands at Alewife, Cambridge", _ALEWIFE, CAMBRIDGE,
          _ask("organic", 70)),
    Grown("alewife_suburb", "Rail lands at Alewife, Cambridge", _ALEWIFE, CAMBRIDGE,
          _ask("suburb", 60)),
)  # fmt: skip
#: The site whose growth is played, and the share of streets that each frame has at least.
PLAYED, FRAMES = "alewife_organic", (0.1, 0.35, 0.65, 1.0)


@dataclass(frozen=True)
class Town:
    """A real town that is measured: key, name and file below the folder of the test data."""

    key: str
    name: str
    file: str


TOWNS = (
    Town("vaduz", "Vaduz, Liechtenstein", "town/vaduz_li.gpkg"),
    Town("baltimore", "Baltimore, south-east", "town/baltimore_se_md.gpkg"),
    Town("monaco", "Monaco", "town/monaco.gpkg"),
)
#: The town that is shown.
SHOWN = "monaco"
#: Grammars that are measured beside the towns, and how: as long as the streets of Monaco, about.
MEASURED = ("organic", "grid", "hex", "line", "suburb")
MEASURED_OPEN: dict[str, Any] = {"SCALE": 60, "MAX_LENGTH": 40_000, "ITERATIONS": 1000}
#: CitySprout's own medians of 50 cities of 500,000 people: circuity, road density (hm per hm2) and
#: its living metric, second version, of decay 1 and 5.
PUBLISHED = {
    "organic": (1.348, 0.545, 0.800, 0.452),
    "line": (1.208, 1.260, 0.746, 0.344),
    "hex": (1.270, 0.997, 0.742, 0.337),
    "grid": (1.303, 1.584, 0.730, 0.321),
}
POPULATION, CITIES = 500_000, 5
