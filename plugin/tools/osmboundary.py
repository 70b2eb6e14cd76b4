"""A place name, an OpenStreetMap id or a point becomes the boundary of what is meant."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterFile,
    QgsProcessingParameterPoint,
    QgsProcessingParameterString,
)

from ...algorithms.errors import InputError
from .. import deps, fields, parameters
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool

#: The CRS that OpenStreetMap is in.
CRS = "EPSG:4326"
# All files, too, since Processing would refuse another ending without saying why.
_FILES = "OpenStreetMap (*.osm.pbf *.pbf *.osm *.osm.gz *.osm.bz2);;All files (*.*)"


class OsmBoundary(Tool):
    """Lists every area that a place name, an id or a point may mean."""

    about = About(
        name="osmboundary",
        title="Find boundary of a place",
        group="site",
        tags=("openstreetmap", "osm", "place", "boundary", "town", "nominatim", "geocode",
              "platwright"),
        summary="Finds the areas that a place name, an OpenStreetMap id or a point may mean.",
        paragraphs=(
            "Names are seldom unique: all candidates are listed, ranked, with what they are, "
            "their administrative level and their area, so that the wrong one is seen before "
            "anything is built on it. Where the first is not the one you mean, give its number "
            "as Rank, or its id as Place.",
            "A point gives the areas that enclose it, the smallest first; so does a place that "
            "OpenStreetMap knows as a point only, administrative boundaries first.",
            "The names are looked up by Nominatim and the areas fetched from Overpass, at the "
            "addresses of Settings > Options > Platwright; answers are kept in a folder. With a "
            "file as source no network is needed. The data is © OpenStreetMap contributors, "
            "under the Open Database License.",
        ),
        picture="A place name; all boundaries that fit it, numbered by rank.",
        references=("OSMNX",),
    )  # fmt: skip
    layers: ClassVar = {"BOUNDARIES": fields.BOUNDARIES}
    numbers: ClassVar = {
        "FOUND": "Number of candidates",
        "AREA": "Area of the first candidate listed (ha)",
    }
    texts: ClassVar = {
        "NAME": "Name of the first candidate listed",
        "OSM_ID": "OpenStreetMap id of the first candidate listed",
    }
    needs = (*deps.LAYERS, "requests")

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield what is asked for, where it is looked up, and how much of it is listed."""
        place = QgsProcessingParameterString("PLACE", "Place", "", False, True)
        place.setHelp(
            "A name, with the town or the country after a comma where needed (Larvotto, Monaco), "
            "or an OpenStreetMap id (R5986437, way/686693023), or the address of a thing on "
            "openstreetmap.org. Without it a point is needed. Optional."
        )
        yield place
        point = QgsProcessingParameterPoint("POINT", "Point", None, True)
        point.setHelp(
            "A point on the map, as 7.4325,43.7415 [EPSG:4326]. Alone: what encloses it; with a "
            "place: the candidates nearest to it come first. Optional."
        )
        yield point
        yield source_file()
        yield parameters.number(
            "RANK",
            "Rank",
            "Only the candidate of this rank is written. Empty: all of them.",
            minimum=1,
            integer=True,
        )
        yield parameters.number(
            "LIMIT",
            "Most candidates",
            "More than these are counted but not written.",
            default=20,
            minimum=1,
            maximum=1000,
            integer=True,
            advanced=True,
        )

    def check(self, request: Request) -> None:
        """Refuse a question without content, and settings or files that cannot be used."""
        from ...algorithms.osm.boundaries import check_question

        check_question(self._place(request), self._point(request), request.integer("LIMIT"))
        source = chosen_file(request)
        if source is None:
            from ..settings import osm_settings

            osm_settings()

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Look the place up."""
        from ...algorithms.osm import OsmSettings, boundaries
        from ..settings import osm_settings

        source = chosen_file(request)
        rank = request.integer("RANK") if request.has("RANK") else None
        frame = boundaries(
            self._place(request),
            point=self._point(request),
            source=source,
            settings=osm_settings() if source is None else OsmSettings(),
            progress=progress,
            limit=max(request.integer("LIMIT"), rank or 1),
        )
        found = len(frame)
        if rank is not None:
            if rank > found:
                raise InputError(
                    f"There is no candidate of rank {rank}: {found} were found.",
                    "Choose one of those that the log lists, or leave Rank empty.",
                )
            frame = frame[frame["rank"] == rank]
        first = frame.iloc[0]
        return Result(
            crs=QgsCoordinateReferenceSystem(CRS),
            layers={"BOUNDARIES": frame.astype({"admin_level": object}).where(frame.notna(), None)},
            numbers={
                "FOUND": found,
                "AREA": float(first["area_ha"]),
                "NAME": str(first["display_name"]),
                "OSM_ID": str(first["osm_id"]),
            },
            specification=to_json(
                {
                    "place": self._place(request),
                    "point": self._point(request),
                    "source_file": source.name if source else "",
                    "rank": rank,
                }
            ),
            credits=frame.attrs["osm"],
        )

    def _place(self, request: Request) -> str:
        return str(self.parameterAsString(request.parameters, "PLACE", request.context))

    def _point(self, request: Request) -> tuple[float, float] | None:
        """Return longitude and latitude, or None."""
        if not request.has("POINT"):
            return None
        crs = QgsCoordinateReferenceSystem(CRS)
        point = self.parameterAsPoint(request.parameters, "POINT", request.context, crs)
        return float(point.x()), float(point.y())


def source_file() -> QgsProcessingParameterDefinition:
    """Declare the file that may stand in for the services."""
    definition = QgsProcessingParameterFile(
        "SOURCE_FILE", "OpenStreetMap file", defaultValue=None, optional=True, fileFilter=_FILES
    )
    definition.setHelp(
        "An .osm or .osm.pbf file to read instead of asking the services: no network is needed. "
        "Optional."
    )
    return definition


def chosen_file(request: Request) -> Path | None:
    """Return that file, or None where none is given.

    Raises
    ------
    InputError
        There is no such file, or it is none of OpenStreetMap.
    DependencyError
        The package that reads such files is not installed.
    """
    from ...algorithms.osm import files

    if not request.has("SOURCE_FILE"):
        return None
    name = request.tool.parameterAsFile(request.parameters, "SOURCE_FILE", request.context)
    path = Path(files.check_file(str(name)))
    # Loaded like all compiled packages, before the library would.
    deps.load(("osmium",))
    return path
