"""The layers of a city that is designed sub-region by sub-region; see `fields`."""

from __future__ import annotations

from .fields import STREETS, Field, LayerKind

_SUB_REGION = Field("sub_region", "integer", "number of the sub-region, from 1")
_KEPT = {
    field.name: field for field in STREETS.fields if field.name not in ("street_id", "site_id")
}
CITY_STREETS = LayerKind(
    "streets",
    "Streets",
    "LineString",
    (
        Field("street_id", "integer", "number of the street, from 1"),
        Field("sub_region", "integer", "sub-region that it lies in; empty for roads between them"),
        _KEPT.pop("level"),
        Field("status", "text", "new, existing (major road), or connector (between carriageways)"),
        *(field for name, field in _KEPT.items() if name != "status"),
    ),
    "streets",
)
SUB_REGIONS = LayerKind(
    "sub_regions",
    "Sub-regions",
    "Polygon",
    (
        _SUB_REGION,
        Field("area_ha", "number", "area in hectares"),
        Field("state", "text", "done, failed, left (nothing was to be designed), or not reached"),
        Field("reason", "text", "why it failed or was left"),
        Field("attempts", "integer", "how often it was tried; 0 if an earlier run had done it"),
        Field("seconds", "number", "time of its design in seconds"),
        Field("objective", "number", "price of its design"),
        Field("bound", "number", "lower bound of that price, proven program by program"),
        Field("gap_pct", "number", "gap between the two, percent of the price"),
        Field("length_m", "number", "length of its new streets in metres"),
        Field("mean_distance_m", "number", "mean way out of it in metres"),
        Field("junctions", "integer", "junctions that were planned along it"),
        Field("key", "text", "what its design depends on, as a hash"),
    ),
    "sub_regions",
)
CITY_JUNCTIONS = LayerKind(
    "junctions",
    "Junctions on major roads",
    "Point",
    (
        Field("junction_id", "integer", "number of the junction, from 1"),
        Field("kind", "text", "existing (streets meet there today), planned, or free"),
        Field(
            "state",
            "text",
            "crossing (streets of both sides), T-junction (of one), staggered (the other side "
            "ends nearby), or not used",
        ),
        Field("road", "text", "name of the road, where it has one"),
        Field("sub_regions", "text", "sub-regions whose streets meet there"),
        Field("offset_m", "number", "way along the road to the next end of the other side, m"),
    ),
    "city_junctions",
)
