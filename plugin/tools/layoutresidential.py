"""A residential zone: buildings in the sun, the ways to them, and what lies between."""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Callable, Iterator
from typing import Any, ClassVar

from qgis.core import QgsProcessingParameterDefinition

from .. import building_fields, deps, fields
from ..files import FileKind
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool
from . import buildinginputs, parcelinputs, siteinputs
from .collect import joined, without_frontage

#: What is to be done where no road runs along a zone.
NO_STREET = (
    "paths and corridors find no street there: give a larger snap distance or another layer of "
    "roads, or none at all, so that the whole edge counts as a street"
)


class LayoutResidential(Tool):
    """Lays out residential zones."""

    about = About(
        name="layoutresidential",
        title="Lay out residential zone",
        group="buildings",
        tags=(
            "buildings", "housing", "residential", "zone", "layout", "sunlight", "shadow", "sun",
            "far", "floor area ratio", "density", "paths", "green", "parking", "trees", "3d",
            "cityjson", "gltf", "site planning", "platwright",
        ),
        summary="Puts buildings into a zone up to the floor area ratio, in the pattern you choose, "
        "no residence in the shade of another and all within reach, with paths, parking and green.",
        paragraphs=(
            "Corridors, which are streets, cut the zone into patches. Buildings stand in "
            "rows, in rings, around courts, in symmetry or singly; they face the equator where the "
            "patch allows it. Every entrance gets a path to a street.",
            "Sun is kept by a spacing behind each building, a multiple of its height, or by hours "
            "of sun at the façade with the balconies on a day of the year, by the true shadows. "
            "Hours of sun are told for each building either way.",
            "The log tells what was reached of floor area ratio, density and green; what could not "
            "be reached is in the layer of problems, with the reason.",
            "Buildings have a height for 3D views (View > New 3D Map View); the styles of the "
            "layer have a 2.5D view, and one by hours of sun. CityJSON and glTF files open in "
            "other programs.",
        ),
        picture="A zone with corridors; buildings, paths, green and parking laid out in it.",
        references=("RZ",),
    )  # fmt: skip
    layers: ClassVar = {
        "BUILDINGS": building_fields.BUILDINGS,
        "SHADOWS": building_fields.SHADOWS,
        "PATHS": building_fields.PATHS,
        "CORRIDORS_USED": building_fields.CORRIDORS,
        "PARKING_BAYS": building_fields.PARKING,
        "GREEN": building_fields.GREEN,
        "TREES": building_fields.TREES,
        "PATCHES_USED": building_fields.PATCHES,
        "PROBLEMS": fields.PROBLEMS,
    }
    files: ClassVar = {
        "CITYJSON_FILE": FileKind(
            "CityJSON file", "json", "The buildings as solids, with the ground, as CityJSON 2.0."
        ),
        "GLTF_FILE": FileKind(
            "glTF file", "glb", "The whole plan in 3D as binary glTF 2.0.", binary=True
        ),
    }
    numbers: ClassVar = {
        "FAR_REACHED": "Floor area ratio",
        "DENSITY_REACHED": "Building density",
        "GREEN_REACHED": "Green ratio",
        "RESIDENCE_SHARE": "Ground under residences (%)",
        "FACILITY_SHARE": "Ground under facilities (%)",
        "PATH_SHARE": "Ground under paths (%)",
        "PARKING_SHARE": "Ground under parking (%)",
        "PARKING_PLACES": "Parking places",
        "PARKING_PER_DWELLING": "Parking places per dwelling",
        "BUILDING_COUNT": "Number of buildings",
        "DWELLINGS": "Number of dwellings",
        "SHADED": "Residences in the shade",
        "LEAST_SUN": "Least hours of sun of a residence (h)",
        "MEAN_SUN": "Mean hours of sun of residences (h)",
        "MEAN_WAY": "Mean way from an entrance to a street (m)",
        "OBJECTIVE": "Objective of the placement, smaller is better",
        "SECONDS": "Time of the run (s)",
    }
    needs = (*deps.LAYERS, *deps.SOLVERS, "pvlib")

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the zone, its streets, what is built, and the details."""
        zone = siteinputs.site()
        zone.setDescription("Zone")
        zone.setHelp(
            "Polygons of the zone, or parcels that are joined to one. Every zone of the layer, or "
            "of the selection, is laid out. Any coordinate reference system will do."
        )
        yield zone
        roads = siteinputs.roads()
        roads.setHelp(
            "Centre lines of the roads around the zone. Paths and corridors lead to those along "
            "its edge. Without roads the whole outer edge counts as a street. Optional."
        )
        yield roads
        yield from buildinginputs.land()
        yield from buildinginputs.wishes()
        yield from buildinginputs.indices()
        yield from buildinginputs.patterns()
        yield from buildinginputs.sun()
        yield from buildinginputs.distances()
        obstacles = siteinputs.obstacles(advanced=True)
        obstacles.setHelp(
            "Polygons that nothing is built on, such as water, trees or buildings to keep. "
            "Optional."
        )
        yield obstacles
        yield from siteinputs.snapping(advanced=True)
        yield from parcelinputs.street_widths()
        yield from buildinginputs.search()

    def check(self, request: Request) -> None:
        """Check numbers and words that must fit together."""
        buildinginputs.rules_of(request)
        buildinginputs.choice_of(request)

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Prepare the zones, lay all of them out and collect the layers."""
        from ...algorithms.buildings.export import city_json, gltf
        from ...algorithms.buildings.layers import layout_figures, zone_layers

        begun = time.monotonic()
        rules = buildinginputs.rules_of(request)
        types = buildinginputs.types_of(request, progress.part(0.0, 0.02))
        prepared = siteinputs.prepared_sites(request, progress.part(0.02, 0.1))
        layouts = self._layouts(request, prepared.sites, types, rules, progress.part(0.1, 0.9))
        if progress.cancelled():
            progress.warn("Cancelled: the layers have the best plan so far.")
        progress.stage("Collecting the layers", 0.92)
        found = zone_layers(layouts, rules)
        figures = layout_figures(found, rules)
        files: dict[str, str | bytes] = {}
        if request.has("CITYJSON_FILE"):
            files["CITYJSON_FILE"] = json.dumps(city_json(found))
        if request.has("GLTF_FILE"):
            files["GLTF_FILE"] = gltf(found)
        before = without_frontage(prepared.problems, NO_STREET)
        found["problems"] = joined(before, found["problems"])
        _tell(figures, rules, progress)
        objective = sum(layout.score.total for layout in layouts) / len(layouts)
        return Result(
            crs=request.crs("INPUT"),
            layers={key: found[kind.key] for key, kind in self.layers.items()},
            numbers={
                **{key: figures[key.lower()] for key in self.numbers if key.lower() in figures},
                "OBJECTIVE": objective,
                "SECONDS": time.monotonic() - begun,
            },
            specification=to_json(
                {
                    "rules": dataclasses.asdict(rules),
                    "types": [dataclasses.asdict(kind) for kind in types],
                    "patterns": dataclasses.asdict(buildinginputs.choice_of(request)),
                }
            ),
            keep=True,
            files=files,
        )

    def _layouts(
        self, request: Request, sites: Any, types: Any, rules: Any, progress: FeedbackProgress
    ) -> Any:
        """Return a `Layout` of each zone; a cancelled run keeps those that have buildings."""
        from ...algorithms.buildings.design import lay_out, nothing_built
        from ...algorithms.buildings.layout import Finding
        from ...algorithms.errors import CancelledError

        refused = _refused(sites, types, rules, request.name("INPUT"))
        zones = self._zones(request, progress)
        layouts: list[Any] = []
        for at, site in enumerate(sites):
            part = progress.part(at / len(sites), (at + 1) / len(sites))
            if layouts and progress.cancelled():
                break
            try:
                zone, findings = zones(site, part)
            except CancelledError:
                if not layouts:
                    raise
                break
            if site.site_id in refused:
                error = refused[site.site_id]
                progress.warn(str(error))
                place = zone.polygon.representative_point()
                why = Finding(error.problem, error.remedy, "error", place)
                layouts.append(nothing_built(zone, types, rules, why))
                continue
            layout = lay_out(zone, types, rules, part)
            layouts.append(dataclasses.replace(layout, findings=(*findings, *layout.findings)))
        return layouts

    def _zones(
        self, request: Request, progress: FeedbackProgress
    ) -> Callable[[Any, FeedbackProgress], Any]:
        """Read corridors and patches; return what cuts a site into patches by them."""
        from ...algorithms.buildings.corridors import zone_of_site

        frames = {key: request.frame(key, progress) for key in ("CORRIDORS", "PATCHES")}

        def of_site(site: Any, part: FeedbackProgress) -> Any:
            return zone_of_site(
                site,
                corridors=frames["CORRIDORS"],
                corridor_layer=request.name("CORRIDORS"),
                widths=parcelinputs.widths_of(request),
                patches=frames["PATCHES"],
                patch_layer=request.name("PATCHES"),
                choice=buildinginputs.choice_of(request),
                progress=part,
            )

        return of_site


def _refused(sites: Any, types: Any, rules: Any, layer: str) -> dict[int, Any]:
    """Return why some sites cannot have buildings at all, by their number.

    Raises
    ------
    InputError
        None of them can.
    """
    from ...algorithms.buildings.tables import check_indices
    from ...algorithms.errors import InputError

    refused = {}
    for site in sites:
        try:
            check_indices(types, rules, site.polygon.area)
        except InputError as error:
            named = InputError(error.problem, error.remedy, layer=layer, feature=site.feature)
            refused[site.site_id] = named
    if len(refused) == len(sites):
        raise next(iter(refused.values()))
    return refused


def _tell(figures: Any, rules: Any, progress: FeedbackProgress) -> None:
    """Put what was asked beside what was reached into the log."""
    for what, asked, key in (
        ("Floor area ratio", rules.far, "far_reached"),
        ("Building density", rules.density, "density_reached"),
        ("Green ratio", rules.green, "green_reached"),
    ):
        progress.info(f"{what}: {figures[key]:.3f} reached, {asked:g} asked")
