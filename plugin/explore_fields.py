"""The layers that `exploretradeoffs` writes; see `fields`."""

from __future__ import annotations

from .fields import PROBLEMS, STREETS, Field, LayerKind

_DESIGN = Field("design", "integer", "number of the design, from 1")
EXPLORED_STREETS = LayerKind(
    "streets",
    "Streets of all designs",
    "LineString",
    (
        _DESIGN,
        Field("design_name", "text", "what was asked of the design"),
        Field("pareto", "yes/no", "whether no other design is better in every way"),
        *STREETS.fields,
    ),
    "streets",
)
DESIGNS = LayerKind(
    "designs",
    "Comparison of designs",
    "NoGeometry",
    (
        _DESIGN,
        Field("name", "text", "what was asked"),
        Field("parameter_x", "text", "the first parameter that differs"),
        Field("value_x", "text", "its value"),
        Field("parameter_y", "text", "the second parameter that differs, where there is one"),
        Field("value_y", "text", "its value"),
        Field("length_m", "number", "length of the new streets in metres"),
        Field("mean_distance_m", "number", "mean way out of the site in metres"),
        Field("max_distance_m", "number", "longest way out of the site in metres"),
        Field("objective", "number", "price; to be compared only where the same was asked"),
        Field("bound", "number", "lower bound of that price, proven program by program"),
        Field("gap", "number", "gap between that price and that bound, share of the price"),
        Field("seconds", "number", "time of the design in seconds"),
        Field("dead_ends", "integer", "number of dead ends"),
        Field("blocks", "integer", "number of blocks"),
        Field("violations", "integer", "broken rules, as an independent check finds them"),
        Field("pareto", "yes/no", "whether no other is better in length and mean way out"),
        Field("state", "text", "done, failed or cancelled"),
        Field("reason", "text", "why there is no design"),
        Field("hurried", "yes/no", "whether the time limit ended the search"),
        Field("parameters", "text", "all that was asked otherwise than usual, as JSON"),
    ),
    "",
)
EXPLORED_PROBLEMS = LayerKind(
    "problems",
    "Problems",
    "Point",
    (
        Field("design", "integer", "number of the design, empty where it concerns the site"),
        *PROBLEMS.fields,
    ),
    "problems",
    on_request=True,
)
