"""The layers of residential zones; see `fields`."""

from __future__ import annotations

from .fields import Field, LayerKind

_SITE = Field("site_id", "integer", "number of the zone, from 1")
_BUILDING = Field("building_id", "integer", "number of the building, from 1")
_PATCH = Field("patch_id", "integer", "number of the patch, from 1")
BUILDINGS = LayerKind(
    "buildings",
    "Buildings",
    "Polygon",
    (
        _BUILDING,
        _SITE,
        _PATCH,
        Field("type", "text", "its kind, as the table of building types calls it"),
        Field("use", "text", "residence or facility"),
        Field("height_m", "number", "height in metres"),
        Field("storeys", "integer", "number of floors"),
        Field("footprint_m2", "number", "ground that it covers, in square metres"),
        Field("floor_area_m2", "number", "floor area in square metres"),
        Field("dwellings", "integer", "number of dwellings"),
        Field("group", "integer", "buildings of one number border upon each other"),
        Field("sun_hours", "number", "hours of sun at the balcony façade on the day of the rule"),
        Field("shaded", "yes/no", "whether it lacks sun by the rule; only residences may not"),
        Field("facing_deg", "number", "true azimuth that the balconies face, in degrees"),
        Field("rotation", "number", "rotation of a symbol along the façade, in degrees clockwise"),
        Field("way_m", "number", "length of the way from the entrance to a street, in metres"),
        Field("turns", "integer", "number of turns on that way"),
    ),
    "zone_buildings",
)
SHADOWS = LayerKind(
    "shadows",
    "Shadows",
    "MultiPolygon",
    (
        _BUILDING,
        _SITE,
        Field("rule", "text", "by which rule it is drawn"),
        Field("area_m2", "number", "area in square metres"),
    ),
    "zone_shadows",
)
PATHS = LayerKind(
    "paths",
    "Paths",
    "LineString",
    (
        Field("path_id", "integer", "number of the path, from 1"),
        _SITE,
        _PATCH,
        Field("kind", "text", "entrance (to one building), group (along several) or shared"),
        Field("buildings", "integer", "number of buildings whose way out leads over it"),
        Field("length_m", "number", "length in metres"),
        Field("turns", "integer", "number of turns"),
        Field("width_m", "number", "width in metres"),
        Field("exit", "yes/no", "whether it ends at a street"),
    ),
    "zone_paths",
)
CORRIDORS = LayerKind(
    "corridors",
    "Corridors",
    "LineString",
    (
        Field("corridor_id", "integer", "number of the corridor, from 1"),
        _SITE,
        Field("level", "integer", "1 major, 2 collector, 3 local, 4 cul-de-sac"),
        Field("name", "text", "name of the street, where it has one"),
        Field("width_m", "number", "width in metres"),
        Field("length_m", "number", "length in metres"),
        Field("edge", "yes/no", "whether it runs along the edge of the zone"),
    ),
    "zone_corridors",
)
PARKING = LayerKind(
    "parking",
    "Parking",
    "Polygon",
    (
        Field("parking_id", "integer", "number of the row of bays, from 1"),
        _SITE,
        Field("places", "integer", "number of parking places"),
        Field("area_m2", "number", "area in square metres"),
    ),
    "zone_parking",
)
GREEN = LayerKind(
    "green",
    "Green",
    "Polygon",
    (
        Field("green_id", "integer", "number of the plot, from 1"),
        _SITE,
        Field("area_m2", "number", "area in square metres"),
    ),
    "zone_green",
)
TREES = LayerKind(
    "trees",
    "Trees",
    "Point",
    (
        Field("tree_id", "integer", "number of the tree, from 1"),
        _SITE,
        Field("beside", "text", "corridor, path or green"),
    ),
    "zone_trees",
)
PATCHES = LayerKind(
    "patches",
    "Patches",
    "Polygon",
    (
        _PATCH,
        _SITE,
        Field("feature", "text", "id of the feature of the layer of patches, if it is of one"),
        Field("residences", "text", "pattern of residences"),
        Field("facilities", "text", "pattern of facilities"),
        Field("paths", "text", "pattern of paths"),
        Field("area_m2", "number", "area in square metres"),
        Field("buildings", "integer", "number of buildings"),
        Field("far", "number", "floor area / area of the patch"),
        Field("density", "number", "ground that is built on / area of the patch"),
    ),
    "zone_patches",
)
