"""The layers of parcels that the tools write; see `fields`."""

from __future__ import annotations

from .fields import STREETS, Field, LayerKind

#: How good a parcel is, as `measureparcels` writes it.
QUALITY = (
    Field("area_m2", "number", "area in square metres"),
    Field("frontage_m", "number", "length of its outline along streets, in metres"),
    Field("depth_m", "number", "extent away from its street, in metres"),
    Field("width_m", "number", "mean width, area / depth, in metres"),
    Field("p_angle", "number", "mean deviation of its corners from 90 degrees, in degrees"),
    Field("p_area", "number", "smallest rectangle around it / area; 1 for a rectangle"),
    Field("p_ideal", "number", "its area against the ideal one, the larger / the smaller"),
    Field(
        "p_similarity",
        "number",
        "mean distance of its outline from the ideal rectangle laid over it, in metres",
    ),
    Field("undesirable", "yes/no", "p_angle over 15 degrees or p_area over 1.2"),
    Field("access", "yes/no", "at least 3 m of its outline lie along a street"),
)
MEASURED_PARCELS = LayerKind(
    "parcels",
    "Measured parcels",
    "Polygon",
    QUALITY,
    "parcel_quality",
    like="INPUT",
)
PARCEL_HISTOGRAM = LayerKind(
    "histogram",
    "Histogram of parcels",
    "NoGeometry",
    (
        Field("measure", "text", "the measure that is counted, a field of the parcels"),
        Field("unit", "text", "unit of the bounds of the class, empty for a bare number"),
        Field("bin_from", "number", "lower bound of the class"),
        Field("bin_to", "number", "upper bound, empty for the last class, which is open"),
        Field("count", "integer", "number of parcels from the lower to below the upper bound"),
        Field("share_pct", "number", "the same as a share of all parcels, %"),
    ),
    "",
)
LAND_USE = LayerKind(
    "land_use",
    "Land use",
    "NoGeometry",
    (
        Field("land_use", "text", "streets, parcels, parks, other, or all"),
        Field("polygons", "integer", "number of polygons of the use"),
        Field("area_m2", "number", "area on the site in square metres"),
        Field("share_pct", "number", "share of the site, %"),
    ),
    "",
)
_OWN = {field.name: field for field in QUALITY}
_BLOCK_ID = Field("block_id", "integer", "number of the block, from 1")
_OF_SITE = Field("site_id", "integer", "number of the site, empty for blocks that were given")
_FEATURE = Field("feature", "text", "id of the feature of the block or site that it is from")
PARCELS = LayerKind(
    "parcels",
    "Parcels",
    "Polygon",
    (
        Field("parcel_id", "integer", "number of the parcel, from 1"),
        _BLOCK_ID,
        _OF_SITE,
        _FEATURE,
        Field("land_use", "text", "parcel, green, court (inside a block), lane or street"),
        *(_OWN[name] for name in ("area_m2", "frontage_m", "depth_m", "width_m")),
        *(_OWN[name] for name in ("p_angle", "p_area", "undesirable")),
        Field("corner", "yes/no", "whether it lies along two streets of different direction"),
        _OWN["access"],
        Field("template", "text", "template that it was drawn from, empty for none"),
        Field("note", "text", "why it is what it is, where that is worth telling"),
    ),
    "parcels",
)
PARCEL_BLOCKS = LayerKind(
    "parcel_blocks",
    "Blocks",
    "Polygon",
    (
        _BLOCK_ID,
        _OF_SITE,
        _FEATURE,
        Field("area_m2", "number", "area in square metres"),
        Field("perimeter_m", "number", "perimeter with all holes, in metres"),
        Field("open_m", "number", "length of its edges along streets, in metres"),
        Field("parcels", "integer", "number of its parcels"),
        Field("green_m2", "number", "area of greens and courts in it, in square metres"),
    ),
    "parcel_blocks",
)
STREET_SPACE = LayerKind(
    "street_space",
    "Street space",
    "MultiPolygon",
    (_OF_SITE, _FEATURE, Field("area_m2", "number", "area in square metres")),
    "street_space",
)
_VARIATION = Field("variation", "integer", "number of the variation, 1 is the best")
LAYOUT_STREETS = LayerKind(
    "streets",
    "Streets",
    "LineString",
    (*STREETS.fields, Field("width_m", "number", "width between property lines, m"), _VARIATION),
    "streets",
)
LAYOUT_PARCELS = LayerKind(
    "parcels", "Parcels", "Polygon", (*PARCELS.fields, _VARIATION), "parcels"
)
LAYOUT_BLOCKS = LayerKind(
    "parcel_blocks", "Blocks", "Polygon", (*PARCEL_BLOCKS.fields, _VARIATION), "parcel_blocks"
)
VARIATIONS = LayerKind(
    "variations",
    "Variations",
    "NoGeometry",
    (
        _VARIATION,
        Field("parcels", "integer", "number of parcels"),
        Field("p_angle", "number", "mean deviation of their corners from 90 degrees"),
        Field("p_area", "number", "mean of smallest rectangle around / area"),
        Field("undesirable_pct", "number", "undesirable parcels, %"),
        Field("green_pct", "number", "land that became green or court, %"),
        Field("street_pct", "number", "land that became street, %"),
        Field("street_m", "number", "length of the new streets, m"),
        Field("score", "number", "what they are ranked by, smaller is better"),
        Field("seed", "integer", "seed of the variation"),
    ),
    "",
)
_CHANGE = Field("change", "text", "kept, new, merged, or use (which was assigned)")
REDONE_PARCELS = LayerKind(
    "parcels",
    "Parcels",
    "Polygon",
    (
        Field("land_use", "text", "what it is, as before; of new ones parcel, green, court, lane"),
        Field("note", "text", "why it is what it is, where that is worth telling"),
        _CHANGE,
    ),
    "parcels",
    like="INPUT",
)
REDONE_STREETS = LayerKind(
    "streets", "Streets", "LineString", (_CHANGE,), "streets", like="INPUT_STREETS"
)
IMPROVED_PARCELS = LayerKind(
    "parcels", "Improved parcels", "Polygon", PARCELS.fields, "parcels", like="INPUT_PARCELS"
)
IMPROVED_STREETS = LayerKind(
    "streets",
    "Improved streets",
    "LineString",
    (Field("moved_m", "number", "furthest that a bend or end of it has moved, in metres"),),
    "smoothed",
    like="INPUT_STREETS",
    renewed=("length_m",),
)
_SITE = Field("site_id", "integer", "number of the site, from 1")
CROSS_FIELD = LayerKind(
    "cross_field",
    "Cross field",
    "MultiLineString",
    (
        _SITE,
        Field("angle_deg", "number", "direction of one arm, degrees clockwise from north, 0 to 90"),
        Field("boundary", "yes/no", "whether the cross lies on the edge"),
    ),
    "cross_field",
    on_request=True,
)
CANDIDATES = LayerKind(
    "candidates",
    "Candidate streets",
    "LineString",
    (
        _SITE,
        Field("rank", "integer", "1 for the best; 0 where it cannot be a street"),
        Field("quality", "number", "sum of all scores with their weights, smaller is better"),
        Field("div", "number", "score of even distances"),
        Field("db", "number", "score of whole rows of parcels on both sides"),
        Field("ds", "number", "score of the distance from irregular points"),
        Field("ct", "number", "score of continuity with streets that arrive"),
        Field("length_m", "number", "length in metres"),
        Field("reason", "text", "why it cannot be a street, empty where it can"),
    ),
    "candidates",
    on_request=True,
)
