"""The layers that the tools write: geometry type, fields with units, readable names.

Sinks, help texts and tests are all made from these declarations.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from qgis.core import QgsFields

from . import compat


@dataclass(frozen=True)
class Field:
    """One field: its name, its kind (see `compat.make_field`) and what it says."""

    name: str
    kind: str
    text: str


@dataclass(frozen=True)
class LayerKind:
    """One kind of output layer.

    Attributes
    ----------
    key
        Key of the layer among those that the library returns.
    title
        Name of the layer in QGIS.
    geometry
        Name of the geometry type, a key of `compat.WKB`.
    fields
        The fields, in their order.
    style
        Name of the style in `styles`; empty for a table, whose geometry is "NoGeometry".
    like
        Key of the input layer whose features these are: its fields come before the others, and
        its features may have several parts. Empty for none.
    renewed
        Number fields of that layer, where it has them, whose values the tool tells anew.
    on_request
        Whether the layer is made only where the planner asks for it.
    """

    key: str
    title: str
    geometry: str
    fields: tuple[Field, ...]
    style: str
    like: str = ""
    renewed: tuple[str, ...] = ()
    on_request: bool = False

    @property
    def wkb(self) -> Any:
        """Geometry type of the sink."""
        return compat.WKB[self.geometry]

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of the fields."""
        return tuple(field.kind for field in self.fields)

    def qgs_fields(self, before: QgsFields | None = None) -> QgsFields:
        """Return the fields for a sink; `before` are those of the layer that it is like."""
        fields = QgsFields()
        for place in self.kept(before) if before is not None else ():
            fields.append(before.at(place))
        for field in self.fields:
            fields.append(compat.make_field(field.name, field.kind))
        return fields

    def kept(self, before: QgsFields) -> list[int]:
        """Return which fields of the layer that this is like are kept: all but its own."""
        own = {field.name.lower() for field in self.fields}
        return [at for at, field in enumerate(before) if field.name().lower() not in own]


_SITE_ID = Field("site_id", "integer", "number of the site, from 1, as in the site layer")

PROBLEMS = LayerKind(
    "problems",
    "Problems",
    "Point",
    (
        Field("layer", "text", "the layer with the problem"),
        Field("feature", "text", "id of the feature in it, empty where it concerns no one"),
        Field("problem", "text", "what is wrong"),
        Field("action", "text", "what was done, or what to do"),
        Field("severity", "text", "info, warning or error"),
    ),
    "problems",
)
NETWORK_PROBLEMS = LayerKind(
    "problems",
    "Problems",
    "Point",
    (*PROBLEMS.fields, Field("kind", "text", "the rule that is broken")),
    "problems",
)
STREETS = LayerKind(
    "streets",
    "Streets",
    "LineString",
    (
        Field("street_id", "integer", "number of the street, from 1"),
        _SITE_ID,
        Field("level", "integer", "1 major, 2 collector, 3 local, 4 cul-de-sac"),
        Field(
            "status",
            "text",
            "new, existing, given (from a layer of streets), or connector (to the road outside)",
        ),
        Field("length_m", "number", "length in metres"),
        Field("dist_to_sink_m", "number", "shortest way to leave the site, mean of both ends, m"),
        Field("dist_start_m", "number", "the same from the first point of the line, m"),
        Field("dist_end_m", "number", "the same from the last point of the line, m"),
        Field("direction", "integer", "way out: 1 along the line, -1 against it, 0 level"),
        Field("speed_kmh", "number", "design speed in km/h"),
        Field("name", "text", "name of the street, where it has one"),
        Field("level_name", "text", "major, collector, local or cul-de-sac"),
        Field("turning_m", "number", "radius of the turning circle at a blind end, m"),
        Field("oneway", "yes/no", "traffic runs only in the direction of the line"),
    ),
    "streets",
)
SMOOTHED_STREETS = LayerKind(
    "streets",
    "Smoothed streets",
    "LineString",
    (Field("moved_m", "number", "furthest that the street lies from where it was, in metres"),),
    "smoothed",
    like="INPUT",
    renewed=("length_m",),
)
JUNCTIONS = LayerKind(
    "junctions",
    "Junctions",
    "Point",
    (
        Field("junction_id", "integer", "number of the junction, from 1"),
        _SITE_ID,
        Field("valence", "integer", "number of streets that meet here"),
        Field("is_sink", "yes/no", "whether traffic leaves the site here"),
        Field("dist_to_sink_m", "number", "shortest way along streets to leave the site, m"),
        Field("kind", "text", "what it is: crossing, T-junction, bend, end, exit"),
    ),
    "junctions",
)
BLOCKS = LayerKind(
    "blocks",
    "Blocks",
    "Polygon",
    (
        Field("block_id", "integer", "number of the block, from 1"),
        _SITE_ID,
        Field("area_m2", "number", "area in square metres"),
        Field("perimeter_m", "number", "perimeter in metres"),
        Field("width_m", "number", "short side of the smallest rectangle around it, m"),
        Field("length_m", "number", "long side of that rectangle, m"),
    ),
    "blocks",
)
SITE = LayerKind(
    "site",
    "Site",
    "Polygon",
    (
        _SITE_ID,
        Field("name", "text", "name of the site, where it has one"),
        Field("area_m2", "number", "area in square metres"),
        Field("area_ha", "number", "area in hectares"),
        Field("perimeter_m", "number", "perimeter with all holes, in metres"),
        Field("snap_m", "number", "snap distance that found its streets, in metres"),
    ),
    "site",
)
BOUNDARY_STREETS = LayerKind(
    "boundary_streets",
    "Boundary streets",
    "LineString",
    (
        _SITE_ID,
        Field("name", "text", "name of the street, where it has one"),
        Field("kind", "text", "class of the road as given, such as the OpenStreetMap value"),
        Field("place", "text", "edge, or inside for a street inside the site that is kept"),
        Field("length_m", "number", "length in metres"),
    ),
    "existing",
)
ACCESS_POINTS = LayerKind(
    "access_points",
    "Access points",
    "Point",
    (
        _SITE_ID,
        Field("name", "text", "name of the street that arrives here"),
        Field("bearing_deg", "number", "direction into the site, degrees clockwise from north"),
    ),
    "access",
)
SITE_OBSTACLES = LayerKind(
    "site_obstacles",
    "Site obstacles",
    "MultiPolygon",
    (_SITE_ID, Field("area_m2", "number", "area in square metres")),
    "obstacles",
)
EDGES = LayerKind(
    "edges",
    "Mesh edges",
    "LineString",
    (
        Field("edge_id", "integer", "number of the edge, from 0"),
        _SITE_ID,
        Field("length_m", "number", "length in metres"),
        Field("boundary", "yes/no", "whether it lies on the edge of the site"),
        Field("foreign", "yes/no", "whether it crosses ground outside the site"),
        Field("blocked", "yes/no", "whether it crosses an obstacle: no street may run there"),
    ),
    "edges",
)
VERTICES = LayerKind(
    "vertices",
    "Mesh vertices",
    "Point",
    (
        Field("vertex_id", "integer", "number of the vertex, from 0"),
        _SITE_ID,
        Field("valence", "integer", "number of edges that meet here"),
        Field("role", "text", "corner, boundary, inner, or irregular (inner, without four edges)"),
    ),
    "vertices",
)
FACES = LayerKind(
    "faces",
    "Mesh faces",
    "Polygon",
    (
        Field("face_id", "integer", "number of the face, from 0"),
        _SITE_ID,
        Field("area_m2", "number", "area in square metres"),
        Field("scaled_jacobian", "number", "1 for right angles, 0 where the face degenerates"),
    ),
    "faces",
)
BOUNDARIES = LayerKind(
    "boundaries",
    "Boundaries",
    "MultiPolygon",
    (
        Field("rank", "integer", "1 for the best candidate"),
        Field("name", "text", "name, empty where it has none"),
        Field("display_name", "text", "name with the names of what it lies in"),
        Field("kind", "text", "what it is: administrative, square, railway, park..."),
        Field("admin_level", "integer", "2 state ... 8 town, 10 quarter; differs by country"),
        Field("osm_id", "text", "OpenStreetMap id: R relation, W way"),
        Field("area_ha", "number", "area in hectares"),
        Field("match", "text", "how it was found"),
        Field("same_as", "text", "ids of other things in OpenStreetMap on the same ground"),
    ),
    "boundaries",
)
_OSM_ID = Field("osm_id", "text", "id in OpenStreetMap: N node, W way, R relation, and its number")
_OSM_NAME = Field("name", "text", "name, where it has one")
OSM_STREETS = LayerKind(
    "streets",
    "OSM streets",
    "LineString",
    (
        _OSM_ID,
        Field("highway", "text", "class of the street, as in OpenStreetMap"),
        Field("level", "integer", "1 major, 2 collector, 3 local, 4 service way or path"),
        Field("speed_kmh", "number", "speed limit in km/h, where it is mapped"),
        Field("lanes", "integer", "number of lanes, where it is mapped"),
        Field("oneway", "yes/no", "whether traffic goes along the line only"),
        Field("name", "text", "name or, without one, number of the road"),
        Field("length_m", "number", "length in metres on the ground"),
        Field("bridge", "text", "kind of bridge, empty where it is none"),
        Field("tunnel", "text", "kind of tunnel, empty where it is none"),
    ),
    "osm_streets",
)
INTERSECTIONS = LayerKind(
    "intersections",
    "Intersections",
    "Point",
    (
        _OSM_ID,
        Field("street_count", "integer", "number of streets that meet here"),
        Field("kind", "text", "junction or dead end"),
    ),
    "intersections",
)
BUILDINGS = LayerKind(
    "buildings",
    "Buildings",
    "MultiPolygon",
    (
        _OSM_ID,
        Field("kind", "text", "use of the building as in OpenStreetMap; yes where nobody said"),
        _OSM_NAME,
        Field("height_m", "number", "height in metres, as mapped or 3 m for each storey"),
        Field("levels", "number", "number of storeys, where it is mapped"),
        Field("height_from", "text", "what height_m comes from: height, levels, or nothing"),
    ),
    "buildings",
)
LANDUSE = LayerKind(
    "landuse",
    "Land use",
    "MultiPolygon",
    (
        _OSM_ID,
        Field(
            "theme",
            "text",
            "housing, work, development, public, transport, green, farming, water, other",
        ),
        Field("kind", "text", "use of the land, as in OpenStreetMap"),
        _OSM_NAME,
    ),
    "landuse",
)
OSM_OBSTACLES = LayerKind(
    "obstacles",
    "OSM obstacles",
    "MultiPolygon",
    (
        _OSM_ID,
        Field(
            "kind",
            "text",
            "water, sea, green, rail, motorway, airfield, military, wall or cliff",
        ),
        _OSM_NAME,
    ),
    "osm_obstacles",
)
FIGURES = LayerKind(
    "figures",
    "Figures of the design",
    "NoGeometry",
    (
        Field("design", "text", "name of the design"),
        Field("site_area_ha", "number", "area of the site in hectares"),
        Field("length_m", "number", "length of the new streets in metres"),
        Field("density_mha", "number", "length of the new streets per hectare of the site, m/ha"),
        Field("mean_way_m", "number", "mean way out of the site, m"),
        Field("longest_way_m", "number", "longest way out of the site, m"),
        Field("continued", "integer", "existing streets that go on into the site"),
        Field("arriving", "integer", "existing streets that arrive at it"),
        Field("bends", "integer", "turns over 20 degrees between junctions"),
        Field("t_junctions", "integer", "inner junctions of three streets"),
        Field("crossings", "integer", "inner junctions of four or more streets"),
        Field("blocks", "integer", "number of blocks"),
        Field("block_area_ha", "number", "median area of the blocks in hectares"),
        Field("block_width_m", "number", "median width of the blocks, m"),
        Field("block_length_m", "number", "longest side of a block, m"),
        Field("wide_enough_pct", "number", "blocks of 76 to 111 % of the asked width, in %"),
        Field("too_thin_pct", "number", "blocks under 62 % of the asked width, in %"),
        Field("rectangular_pct", "number", "mean share of a block in its smallest rectangle, %"),
        Field("violations", "integer", "broken rules"),
        Field("warnings", "integer", "warnings"),
    ),
    "",
)
