"""OpenStreetMap around a site, as layers that are ready to design with."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from qgis.core import QgsCoordinateReferenceSystem, QgsProcessingParameterDefinition

from ...algorithms.errors import InputError
from .. import deps, fields, parameters
from ..bridge import crs_text
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..settings import osm_settings
from ..tool import Tool
from .osmboundary import chosen_file, source_file

NETWORK_TYPES = {
    "drive": "public streets for cars",
    "walk": "what may be walked on",
    "bike": "what may be cycled on",
    "all": "all ways in use, private ones and service ways too",
}
_DEGREES = "EPSG:4326"


class OsmLayers(Tool):
    """Fetches streets, intersections, buildings, land use and obstacles around a polygon."""

    about = About(
        name="osmlayers",
        title="OpenStreetMap layers",
        group="site",
        tags=(
            "osm", "openstreetmap", "overpass", "osmnx", "pbf", "streets", "roads", "buildings",
            "land use", "water", "parks", "rail", "download", "platwright",
        ),
        summary="Fetches streets, intersections, buildings, land use and obstacles around a "
        "polygon from OpenStreetMap or a file of it.",
        paragraphs=(
            "The data comes from the Overpass server in Settings > Options > Platwright, through "
            "the network settings of QGIS, or from a file (.osm, .osm.pbf), for which no network "
            "is needed.",
            "The layers are in metres, ready to design with: in the coordinate reference system "
            "of the input where that is in metres and true to 0.1 %, else in that of the UTM "
            "zone. They reach a little beyond the polygon, so that the streets along its edge "
            "and those that arrive there are among them: use OSM streets as existing roads and "
            "OSM obstacles as obstacles of Prepare site or Design streets.",
            "A street runs from junction to junction; it also ends where its class or name "
            "changes, and at bridges and tunnels. Obstacles are water, green, tracks, motorways "
            "and other ground that streets must not cross; a track becomes a strip of 8 m, a "
            "stream one of 4 m. Delete obstacles that are to be built on, such as the tracks of "
            "a rail yard that is the site. Buildings are no obstacles here: join those that stay "
            "to the obstacles with Merge vector layers.",
            "Whoever publishes a map made with the layers has to name the source: © OpenStreetMap "
            "contributors, Open Database License 1.0. The metadata of the layers says so, with "
            "the day of the data.",
        ),
        picture="A polygon; streets and intersections, buildings, water and green around it.",
        references=("OSMNX",),
    )  # fmt: skip
    layers: ClassVar = {
        "STREETS": fields.OSM_STREETS,
        "INTERSECTIONS": fields.INTERSECTIONS,
        "BUILDINGS": fields.BUILDINGS,
        "LANDUSE": fields.LANDUSE,
        "OBSTACLES": fields.OSM_OBSTACLES,
    }
    numbers: ClassVar = {
        "AREA": "Area of the polygon (ha)",
        "LENGTH": "Length of the streets (m)",
        "STREET_COUNT": "Number of streets",
        "INTERSECTION_COUNT": "Number of intersections",
        "BUILDING_COUNT": "Number of buildings",
        "OBSTACLE_COUNT": "Number of obstacles",
    }
    needs = deps.OSM

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the polygon or extent, the network type and the file."""
        yield parameters.layer(
            "INPUT",
            "Area",
            "Polygons of sites or of a boundary; all of the layer, or of the selection, are one "
            "area of at most 1000 km2. Give this or the extent.",
            "polygon",
            optional=True,
        )
        yield parameters.extent(
            "EXTENT",
            "Extent",
            "Rectangle instead of polygons; on the command line xmin,xmax,ymin,ymax and the "
            "coordinate reference system, such as 7.42,7.43,43.73,43.74 [EPSG:4326].",
        )
        yield parameters.choice(
            "NETWORK_TYPE",
            "Streets",
            "Which ways count as streets.",
            NETWORK_TYPES,
            default="drive",
        )
        yield source_file()
        yield parameters.number(
            "REACH",
            "Reach",
            "How far the layers reach beyond the polygon.",
            unit="m",
            default=80.0,
            minimum=0.0,
            maximum=2000.0,
            advanced=True,
        )

    def check(self, request: Request) -> None:
        """Find a wrong choice of area or file before the run."""
        if request.has("INPUT") == request.has("EXTENT"):
            both = request.has("INPUT")
            raise InputError(
                "Both an area and an extent are given." if both else "No area is given.",
                "Clear one of them." if both else "Choose a polygon layer or give an extent.",
            )
        if chosen_file(request) is None:
            osm_settings()

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read the area, fetch the layers, and bring them to metres."""
        from ...algorithms.osm import osm_layers
        from ...algorithms.osm.polygons import area_ha

        polygon, crs = _area(request, progress.part(0.0, 0.05))
        source = chosen_file(request)
        found = osm_layers(
            polygon,
            network_type=request.word("NETWORK_TYPE"),
            source=source,
            settings=None if source else osm_settings(),
            reach=request.number("REACH"),
            progress=progress.part(0.05, 1.0),
        )
        credit = found["streets"].attrs["osm"]
        day = f"Data of {credit['date']}" if credit["date"] else "Data without a date,"
        progress.info(
            f"{credit['attribution']}, {credit['licence']}. {day} from {credit['source']}."
        )
        text = crs_text(crs)
        return Result(
            crs=crs,
            layers={key: found[kind.key].to_crs(text) for key, kind in self.layers.items()},
            numbers={
                "AREA": area_ha(polygon),
                "LENGTH": float(found["streets"]["length_m"].sum()),
                "STREET_COUNT": len(found["streets"]),
                "INTERSECTION_COUNT": len(found["intersections"]),
                "BUILDING_COUNT": len(found["buildings"]),
                "OBSTACLE_COUNT": len(found["obstacles"]),
            },
            specification=to_json(
                {
                    "network_type": request.word("NETWORK_TYPE"),
                    "reach": request.number("REACH"),
                    "source": credit["source"],
                }
            ),
            credits=credit,
        )


def _area(request: Request, progress: FeedbackProgress) -> tuple[Any, QgsCoordinateReferenceSystem]:
    """Return the area in EPSG:4326, and the CRS in metres for the layers."""
    import geopandas
    import shapely

    from ...algorithms.osm.ground import site_polygon

    if request.has("INPUT"):
        frame, name = request.frame("INPUT", progress), request.name("INPUT")
        crs = request.crs("INPUT")
        polygon = site_polygon(frame, name)
    else:
        tool, name = request.tool, "Extent"
        rectangle = tool.parameterAsExtent(request.parameters, "EXTENT", request.context)
        if rectangle.isEmpty() or not rectangle.isFinite():
            raise InputError(
                "The extent has no area, or cannot be read.",
                "Write it as xmin,xmax,ymin,ymax [EPSG:4326].",
            )
        crs = tool.parameterAsExtentCrs(request.parameters, "EXTENT", request.context)
        if not crs.isValid():
            raise InputError(
                "The extent has no coordinate reference system.",
                "Write it behind the numbers, such as 7.42,7.43,43.73,43.74 [EPSG:4326].",
            )
        corners = (rectangle.xMinimum(), rectangle.yMinimum())
        shape = shapely.box(*corners, rectangle.xMaximum(), rectangle.yMaximum())
        frame = geopandas.GeoDataFrame(geometry=[shape], crs=crs_text(crs))
        polygon = site_polygon(frame, name)
    return polygon, _metric(polygon, crs, name)


def _metric(
    polygon: Any, crs: QgsCoordinateReferenceSystem, name: str
) -> QgsCoordinateReferenceSystem:
    """Return `crs` where it is in metres and true to scale at the polygon, else the local one."""
    import geopandas
    import numpy
    from pyproj import CRS

    from ...algorithms.site.crs import horizontal, working_crs

    own = horizontal(CRS.from_user_input(crs_text(crs)))
    moved = geopandas.GeoSeries([polygon], crs=_DEGREES).to_crs(own)
    metric = working_crs(own, numpy.asarray(moved.total_bounds), name)
    if metric == own:
        return crs
    code = metric.to_epsg()
    if code is not None:
        return QgsCoordinateReferenceSystem(f"EPSG:{code}")
    return QgsCoordinateReferenceSystem.fromWkt(metric.to_wkt())
