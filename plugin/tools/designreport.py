"""Designs as one page to read, print and send, with maps, figures, targets and sources."""

from __future__ import annotations

import datetime
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsMapLayer,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterMultipleLayers,
    QgsProcessingParameterString,
)

from ...algorithms.errors import CancelledError, InputError
from ...algorithms.report import (
    Design,
    Report,
    Target,
    TargetResult,
    check_targets,
    group_layers,
    parse_targets,
    report_page,
    target_of,
)
from .. import compat, parameters, report_layout, report_maps, settings
from ..files import FileKind
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..report_facts import Shown, credits_of, only_design, problems_of, read, runs_of
from ..report_sheets import data_pictures, design_pictures, order, sheets_of
from ..request import Request
from ..tool import Tool

_MONTHS = (
    "January", "February", "March", "April", "May", "June", "July", "August", "September",
    "October", "November", "December",
)  # fmt: skip
#: Fields of a table of targets.
_FIGURE, _LEAST, _MOST = "figure", "at_least", "at_most"


class DesignReport(Tool):
    """Writes a report about one design or several."""

    about = About(
        name="designreport",
        title="Write design report",
        group="measure",
        tags=(
            "report", "html", "pdf", "print", "layout", "comparison", "variants", "targets",
            "figures", "map", "legend", "licence", "platwright",
        ),
        summary="Writes one page about one design or several: maps, what was asked, figures "
        "against targets, how good the solver proves them, a comparison, problems, data sources.",
        paragraphs=(
            "Give any layers that the tools made: streets, blocks, parcels, buildings, rooms, "
            "measured streets, tables. The tools keep with every file what was asked and what "
            "came out; layers of one run belong together, and what was made of them later goes "
            "with the run whose file, folder or names it shares. A field 'design' parts the "
            "features of one layer. Layers that tell nothing are drawn and listed as data.",
            "The page holds its pictures and asks nothing of any network, so that it can be sent "
            "as it is. It prints on A4 from any browser, also into a PDF. Layers are drawn in the "
            "style that they have in QGIS, those of files in the style that lies with them.",
            "Figures of a target are named by their keys, which stand beside them in the page.",
        ),
        picture="Streets and blocks of a design; the page about them.",
    )  # fmt: skip
    layers: ClassVar = {}
    files: ClassVar = {
        "OUTPUT": FileKind("Report", "html", "The page, complete in one file.", others=("htm",)),
        "LAYOUT": FileKind(
            "Print layout",
            "qpt",
            "A sheet of A4 with map, legend, scale bar and north arrow, as a template for the "
            "print layouts of QGIS.",
        ),
    }
    numbers: ClassVar = {
        "DESIGNS_FOUND": "Number of designs",
        "PICTURES": "Number of maps",
        "TARGETS_MET": "Targets that are met, each counted once for each design",
        "TARGETS_MISSED": "Targets that are not met, likewise",
    }
    needs = ()

    def __init__(self) -> None:
        super().__init__()
        #: Copies of the layers of one run, and the background; see `prepareAlgorithm`.
        self._shown: list[Shown] | None = None
        self._background: list[QgsMapLayer] = []

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the layers, what the page says of itself, targets, and how it looks."""
        layers = QgsProcessingParameterMultipleLayers("LAYERS", "Layers", compat.SOURCE_TABLE)
        layers.setHelp("Layers and tables of one design or several, and data such as the site.")
        yield layers
        yield _text("TITLE", "Title", "Heading of the page. Empty: Design report.")
        yield _text("PLACE", "Place", "Where the designs are.")
        yield _text("AUTHOR", "Author", "Who reports.")
        yield _text(
            "TARGETS",
            "Targets",
            "One a line, or divided by semicolons, such as: TOTAL_LENGTH <= 5000; DEAD_ENDS = 0.",
            lines=True,
        )
        yield parameters.layer(
            "TARGET_TABLE",
            "Table of targets",
            "With the fields figure (a key, as TOTAL_LENGTH), at_least and at_most, either or "
            "both.",
            "table",
            optional=True,
        )
        yield parameters.raster(
            "BACKGROUND",
            "Background",
            "Raster or tiles below all maps. Those of a service are fetched while the page is "
            "made, and are in it then.",
            advanced=False,
        )
        yield _text(
            "DESIGNS",
            "Layers by design",
            "Where the tool cannot know it: one design a line, its name, an equals sign, and the "
            "names of its layers with commas between, such as: Quiet = streets_a, parcels_a.",
            lines=True,
            advanced=True,
        )
        yield parameters.number(
            "PICTURE_WIDTH",
            "Width of the maps (pixels)",
            "More is sharper in print, and a larger file.",
            default=1600,
            minimum=400,
            maximum=6000,
            integer=True,
            advanced=True,
        )

    def initAlgorithm(self, configuration: Any = None) -> None:
        """Declare the parameters; the page is what the tool is for, so that it is always made."""
        super().initAlgorithm(configuration)
        page = self.parameterDefinition("OUTPUT")
        page.setFlags(page.flags() & ~compat.OPTIONAL)
        page.setCreateByDefault(True)

    def prepareAlgorithm(
        self,
        parameters: dict[str, Any],
        context: QgsProcessingContext,
        feedback: QgsProcessingFeedback,  # noqa: ARG002
    ) -> bool:
        """Take copies of the layers, here where they belong to: the run may be elsewhere."""
        background = self.parameterAsRasterLayer(parameters, "BACKGROUND", context)
        self._background = report_maps.copies([background] if background is not None else [])
        given = self.parameterAsLayerList(parameters, "LAYERS", context)
        made = report_maps.copies(given)
        project = context.project()
        self._shown = []
        for at, (layer, copy) in enumerate(zip(given, made)):
            own = project is not None and project.mapLayer(layer.id()) is not None
            copy.setName(_name(layer, own))
            shown = Shown(copy, str(at), source=layer.source(), own=own, name=copy.name())
            self._shown.append(shown)
        return True

    def check(self, request: Request) -> None:
        """Check that there are layers, and that the texts can be read."""
        given = request.parameters.get("LAYERS")
        layers = self.parameterAsLayerList(request.parameters, "LAYERS", request.context)
        if self._shown is None and (
            not layers or (isinstance(given, (list, tuple)) and len(layers) < len(given))
        ):
            raise InputError(
                "There are no layers to report on, or one of them cannot be read.",
                "Choose layers that open in QGIS.",
            )
        self._targets(request)
        _designs(request)
        request.raster("BACKGROUND")

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Read what the layers tell, draw the maps and write the page."""
        shown = self._claimed(progress)
        transforms = request.context.transformContext()
        groups = group_layers([own.facts() for own in shown], _designs(request))
        by_key = {own.key: own for own in shown}
        of_design = {
            group.name: [
                only_design(by_key[key], group.name, progress)
                if key in group.by_field
                else by_key[key]
                for key in group.layers
            ]
            for group in groups
        }
        used = {own.key for group in of_design.values() for own in group}
        data = order([own for own in shown if own.key not in used])
        runs = {name: runs_of(own, name) for name, own in of_design.items()}
        # targets before maps: a figure that nobody has is told at once
        plain = [Design(name, runs=runs[name]) for name in of_design]
        results = check_targets(self._targets(request), {own.name: own.figures for own in plain})
        width = request.integer("PICTURE_WIDTH")
        sheets = sheets_of(of_design, width, transforms)
        below = self._background
        designs = []
        for at, (name, own) in enumerate(of_design.items()):
            part = progress.part(
                0.1 + 0.8 * at / len(of_design), 0.1 + 0.8 * (at + 1) / len(of_design)
            )
            part.stage(f"Drawing {name}", 0.0)
            pictures = design_pictures(name, own, data, below, sheets.get(name), part)
            problems = problems_of(own, part)
            rows = tuple(one.row() for one in own)
            designs.append(Design(name, pictures, runs[name], problems, rows))
        maps = () if designs else data_pictures(data, below, width, transforms, progress)
        progress.stage("Writing the page", 0.95)
        report = Report(
            title=_words(request, "TITLE") or "Design report",
            date=_today(),
            version=settings.version(),
            place=_words(request, "PLACE"),
            author=_words(request, "AUTHOR"),
            designs=tuple(designs),
            targets=results,
            data=tuple(own.row() for own in data),
            data_pictures=maps,
            credits=credits_of([*shown, *(Shown(own, "", source=own.source()) for own in below)]),
        )
        self._shown, self._background = None, []
        first = next(iter(sheets.values()), None)
        return _result(report, first, progress)

    def _claimed(self, progress: FeedbackProgress) -> list[Shown]:
        """Return the layers with all they tell, in this thread."""
        copies = self._shown or []
        report_maps.claim([*(own.layer for own in copies), *self._background])
        progress.stage("Reading what the layers tell", 0.0)
        for own in copies:
            if progress.cancelled():
                raise CancelledError
            read(own, progress)
        return copies

    def _targets(self, request: Request) -> tuple[Target, ...]:
        """Return the targets of the text and of the table."""
        found = list(parse_targets(_words(request, "TARGETS")))
        source = request.source("TARGET_TABLE")
        if source is None:
            return tuple(found)
        names = {own.name().lower(): own.name() for own in source.fields()}
        if _FIGURE not in names or not {_LEAST, _MOST} & set(names):
            raise InputError(
                f"It lacks the field {_FIGURE}, or both of {_LEAST} and {_MOST}.",
                "Add them: the key of a figure, and its limits as numbers.",
                layer=request.name("TARGET_TABLE"),
            )
        for feature in source.getFeatures():
            limits = [
                _limit(feature, names[own], request.name("TARGET_TABLE")) if own in names else None
                for own in (_LEAST, _MOST)
            ]
            what = feature[names[_FIGURE]]
            if not compat.is_null(what):
                found += target_of(str(what).strip(), *limits)
        return tuple(found)


def _result(report: Report, sheet: Any, progress: FeedbackProgress) -> Result:
    """Return the page, the print layout and the numbers, and tell which targets are missed."""
    met = sum(own.met is True for own in report.targets)
    missed = [own for own in report.targets if own.met is False]
    for own in missed:
        progress.info(_missed(own))
    named = dict.fromkeys(own.attribution for own in report.credits if own.attribution)
    texts = {
        "title": report.title,
        "subtitle": " · ".join(filter(None, (report.place, report.author))),
        "sources": ", ".join(named),
        "date": f"{report.date}, Platwright {report.version}",
    }
    pictures = sum(len(own.pictures) for own in report.designs) + len(report.data_pictures)
    return Result(
        crs=QgsCoordinateReferenceSystem(),
        layers={},
        numbers={
            "DESIGNS_FOUND": len(report.designs),
            "PICTURES": pictures,
            "TARGETS_MET": met,
            "TARGETS_MISSED": len(missed),
        },
        files={"OUTPUT": report_page(report), "LAYOUT": report_layout.template(texts, sheet)},
    )


def _text(
    key: str, title: str, help_text: str, *, lines: bool = False, advanced: bool = False
) -> QgsProcessingParameterDefinition:
    definition = QgsProcessingParameterString(key, title, "", lines, True)
    definition.setHelp(f"{help_text} Optional.")
    if advanced:
        definition.setFlags(definition.flags() | compat.ADVANCED)
    return definition


def _words(request: Request, key: str) -> str:
    text = request.tool.parameterAsString(request.parameters, key, request.context)
    return str(text or "").strip()


def _name(layer: QgsMapLayer, own: bool) -> str:
    """Return the name of a layer: in QGIS its own, of a file that was named the table's."""
    _, _, table = layer.source().partition("|layername=")
    return layer.name() if own or not table else table.split("|", 1)[0]


def _designs(request: Request) -> Mapping[str, Sequence[str]]:
    """Return names of layers by design, as the planner wrote them."""
    found: dict[str, list[str]] = {}
    for line in filter(None, (own.strip() for own in _words(request, "DESIGNS").splitlines())):
        name, sign, rest = line.partition("=")
        names = [own.strip() for own in rest.split(",") if own.strip()]
        if not sign or not name.strip() or not names:
            raise InputError(
                f"'{line}' does not say which layers a design has.",
                "Write a name, an equals sign and names of layers: Quiet = streets_a, blocks_a.",
            )
        found.setdefault(name.strip(), []).extend(names)
    return found


def _limit(feature: Any, name: str, layer: str) -> float | None:
    value = feature[name]
    if compat.is_null(value) or value == "":
        return None
    try:
        return float(value)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{name} is '{value}', which is no number.",
            "Write the limit as a number.",
            layer=layer,
            feature=feature.id(),
        ) from error


def _missed(result: TargetResult) -> str:
    figure = result.figure
    told = "" if figure is None else f"{figure.label} {figure.text}, "
    unit = "" if figure is None else figure.unit
    return f"{result.design}: {told}the target is {result.target.words(unit)}: not met."


def _today() -> str:
    today = datetime.date.today()
    return f"{today.day} {_MONTHS[today.month - 1]} {today.year}"
