"""The layers that the measures of streets write; see `fields`."""

from __future__ import annotations

from .fields import Field, LayerKind

_BETWEENNESS = "shortest paths that run through it, as a share of those between all pairs of {}"
_CLOSENESS = "1 / mean distance to all that can be reached (per km), times the share of these"
_HIERARCHY = "class by the number of streets that it meets, 1 for the many with few"
MEASURED_STREETS = LayerKind(
    "streets",
    "Measured streets",
    "LineString",
    (
        Field("length_m", "number", "length in metres"),
        Field("sinuosity", "number", "length / straight distance of its ends, 1 if straight"),
        Field("bearing_deg", "number", "direction as an axis, degrees from north, 0 to 180"),
        Field("natural_id", "integer", "number of its natural street, 1 for the longest"),
        Field("natural_m", "number", "length of its natural street, in metres"),
        Field("connectivity", "integer", "other natural streets that its natural street meets"),
        Field("hierarchy", "integer", f"natural street: {_HIERARCHY}"),
        Field("betweenness", "number", _BETWEENNESS.format("junctions and dead ends")),
        Field("closeness", "number", f"{_CLOSENESS}; mean of both ends"),
        Field("degree_start", "integer", "number of streets at its first point, with itself"),
        Field("degree_end", "integer", "number of streets at its last point, with itself"),
        Field("dead_end", "yes/no", "whether one of its ends is blind"),
    ),
    "measured_streets",
    like="INPUT",
)
NATURAL_STREETS = LayerKind(
    "natural",
    "Natural streets",
    "MultiLineString",
    (
        Field("natural_id", "integer", "number of the natural street, 1 for the longest"),
        Field("length_m", "number", "length in metres"),
        Field("segments", "integer", "pieces between places where streets meet"),
        Field("connectivity", "integer", "other natural streets that it meets"),
        Field("hierarchy", "integer", _HIERARCHY),
    ),
    "natural_streets",
    on_request=True,
)
MEASURED_JUNCTIONS = LayerKind(
    "nodes",
    "Street junctions",
    "Point",
    (
        Field("junction_id", "integer", "number of the junction, from 1"),
        Field("degree", "integer", "number of streets that meet here"),
        Field(
            "kind",
            "text",
            "dead end; of three streets T or Y; of four X (both go straight on) or K; star of more",
        ),
        Field(
            "deviation_deg",
            "number",
            "mean deviation of the angles between streets from those of the kind, degrees",
        ),
        Field("betweenness", "number", _BETWEENNESS.format("other junctions and dead ends")),
        Field("closeness", "number", _CLOSENESS),
    ),
    "measured_junctions",
)
