"""The parameters about the site and the roads that several tools share."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

from qgis.core import QgsProcessingParameterDefinition

from ...algorithms.errors import InputError
from .. import parameters
from ..progress import FeedbackProgress, QuietProgress
from ..request import Request

#: Roads this near to the edge of the site run along it (metres).
ALONG_EDGE = 2.0
#: Length of roads inside a site from which it is worth a line in the log (metres).
WORTH_TELLING = 10.0
INNER_ROADS = {
    "ignore": "the site is designed as if they were not there",
    "keep": "they stay as existing streets",
}


def site(key: str = "INPUT") -> QgsProcessingParameterDefinition:
    """Declare the site layer."""
    return parameters.layer(
        key,
        "Site",
        "Parcels or site polygons. Adjoining polygons are joined to one site; every site in the "
        "layer, or of the selection, is treated. Any coordinate reference system will do.",
        "polygon",
    )


def roads() -> QgsProcessingParameterDefinition:
    """Declare the layer of existing roads."""
    return parameters.layer(
        "ROADS",
        "Existing roads",
        "Centre lines of the roads around the site. Roads along its edge become boundary "
        "streets, and where others arrive streets may leave the site. Without roads the whole "
        "outer edge of the site counts as a street.",
        "line",
        optional=True,
    )


def obstacles(*, advanced: bool = False) -> QgsProcessingParameterDefinition:
    """Declare the layer of obstacles."""
    return parameters.layer(
        "OBSTACLES",
        "Obstacles",
        "Polygons that must stay free of streets, such as buildings to keep, water or trees.",
        "polygon",
        optional=True,
        advanced=advanced,
    )


def access_points(*, advanced: bool = True) -> QgsProcessingParameterDefinition:
    """Declare the layer of access points."""
    return parameters.layer(
        "ACCESS_POINTS",
        "Access points",
        "Points on or near the edge of the site where streets may leave it. They replace those "
        "that are found where the existing roads arrive.",
        "point",
        optional=True,
        advanced=advanced,
    )


def snapping(*, advanced: bool) -> Iterator[QgsProcessingParameterDefinition]:
    """Declare how roads and site are brought together."""
    yield parameters.number(
        "SNAP_DISTANCE",
        "Snap distance",
        "Largest distance between the edge of the site and the centre line of a road that runs "
        "along it. Site polygons often end at the property line, half a street width away. A "
        "prepared site keeps the distance that it was prepared with, where that is larger.",
        unit="m",
        default=30.0,
        minimum=0.1,
        maximum=500.0,
        advanced=advanced,
    )
    yield parameters.choice(
        "INNER_ROADS",
        "Roads inside the site",
        "What becomes of roads that run through the site.",
        INNER_ROADS,
        default="ignore",
        advanced=advanced,
    )


def prepared_sites(
    request: Request,
    progress: FeedbackProgress,
    key: str = "INPUT",
    *,
    no_roads: str = "the whole outer edge of each site counts as a street",
) -> Any:
    """Read the layers above and return the `PreparedSites` of the library.

    Without roads it tells what that means: `no_roads`.

    Raises
    ------
    InputError
        No polygon of the layer can be used as a site.
    """
    from ...algorithms.site import access_points_of_sites, prepare_sites

    reading = progress.part(0.0, 0.5)
    polygons = request.frame(key, reading)
    if polygons is None:
        raise InputError("No site is given.", "Choose a layer with polygons.")
    given = {
        name: request.frame(name, reading)
        for name in ("ROADS", "OBSTACLES", "ACCESS_POINTS")
        if request.declares(name)
    }
    if request.declares("ROADS") and request.has("ROADS") and given["ROADS"] is None:
        progress.warn(
            f"{request.name('ROADS')}: the layer of roads is empty, so {no_roads}. See whether it "
            "is the right layer, and whether its source has data here."
        )
    options: dict[str, Any] = {"without_roads": f"No road layer is given: {no_roads}."}
    if request.declares("SNAP_DISTANCE"):
        options["snap_distance"] = request.number("SNAP_DISTANCE")
        options["inner_roads"] = request.word("INNER_ROADS")
    for name, option in (
        (key, "polygon_layer"),
        ("ROADS", "road_layer"),
        ("OBSTACLES", "obstacle_layer"),
    ):
        if name == key or given.get(name) is not None:
            options[option] = request.name(name)
    preparing = progress.part(0.5, 1.0)
    if not request.declares("ROADS"):
        # The library remarks that there are none, which nobody could give here.
        preparing = QuietProgress(preparing.feedback, preparing.start, preparing.end)
    prepared = prepare_sites(
        polygons,
        given.get("ROADS"),
        given.get("OBSTACLES"),
        progress=preparing,
        **options,
    )
    if given.get("ROADS") is not None and options.get("inner_roads") == "ignore":
        _tell_left_out(given["ROADS"], prepared.sites, progress)
    points = given.get("ACCESS_POINTS")
    if points is None:
        return prepared
    shared = access_points_of_sites(points, prepared.sites, request.name("ACCESS_POINTS"))
    return dataclasses.replace(
        prepared,
        sites=tuple(
            dataclasses.replace(site, access_points=tuple(own))
            for site, own in zip(prepared.sites, shared)
        ),
    )


def _tell_left_out(roads: Any, sites: Any, progress: FeedbackProgress) -> None:
    """Say how much of the roads lies inside the sites and is left out."""
    import numpy as np
    import shapely

    length = major = 0.0
    main = _main_roads(roads)
    for site in sites:
        known = [street.line for street in (*site.boundary_streets, *site.inner_streets)]
        around = site.polygon.buffer(-ALONG_EDGE)
        shapely.prepare(around)
        lines = roads.geometry.dropna().to_crs(site.crs)
        lines = lines[np.isfinite(lines.bounds).all(axis=1)]
        lines = lines[shapely.intersects(lines.to_numpy(), around)]
        of_main = lines.index.isin(main)
        own = shapely.union_all(known).buffer(ALONG_EDGE) if known else shapely.Polygon()
        cut = shapely.intersection(shapely.force_2d(lines.to_numpy()), around)
        left_out = shapely.length(shapely.difference(cut, own))
        length += float(left_out.sum())
        major += float(left_out[of_main].sum())
    if length >= WORTH_TELLING:
        progress.info(
            f"Existing roads run inside the site over {length:.0f} m and are left out. To keep "
            "them as streets choose 'keep' for 'Roads inside the site'."
        )
    if major >= WORTH_TELLING:
        progress.warn(
            f"Main roads run inside the site over {major:.0f} m and are left out as well. They "
            "will hardly be given up: choose 'keep' for 'Roads inside the site'."
        )


def _main_roads(roads: Any) -> Any:
    """Index of the roads that are collectors or more by their class, where it is known."""
    from ...algorithms.streets.layers import CLASS_LEVEL

    by_lower = {str(column).lower(): column for column in roads.columns}
    for name in ("highway", "kind", "class", "fclass"):
        if name in by_lower:
            kinds = roads[by_lower[name]].astype(str).str.lower().str.removesuffix("_link")
            return roads.index[kinds.isin(list(CLASS_LEVEL))]
    return roads.index[:0]
