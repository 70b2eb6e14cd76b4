"""Write the models of the plugin from what its tools declare.

Run by scripts/make_models in the environment with QGIS 3.22, so that older versions read them.
The inputs of a model are those of its tools, with their help and defaults; the keys are checked
against the tools, so that no model asks for what they do not have.
"""

from __future__ import annotations

import importlib
import os
import sys
import tempfile
from pathlib import Path

from _model_draft import Draft, asked, flags, made, of_tool, value
from _models_grown import grown_streets_and_parcels
from _models_place import ask_for_design, design, place_to_design, place_to_report
from _models_rooms import floor_plan
from _models_zone import residential_zone

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "plugin" / "models"
#: Native tools that are used.
MERGE, DROP = "native:mergevectorlayers", "native:deletecolumn"


def parcels_to_design() -> Draft:
    """From parcels and roads to a street design."""
    draft = Draft(
        "parcelstodesign",
        "From parcels and roads to a street design",
        "Joins parcels to a site, designs its streets and checks them.",
        "Three steps: Prepare site, Design streets, Validate street network. Give any parcels or "
        "one polygon, and the centre lines of the roads around.\n\n"
        "To draw or edit the candidate streets yourself, run Candidate mesh, edit its edges, and "
        "give them here as Candidate mesh.",
    )
    draft.input(of_tool("preparesite", "INPUT"))
    draft.input(of_tool("preparesite", "ROADS"))
    draft.input(of_tool("preparesite", "OBSTACLES"))
    ask_for_design(draft, advanced_snap=False)
    draft.input(of_tool("designstreets", "MESH_EDGES"))
    design(
        draft, asked("INPUT"), asked("ROADS"), asked("OBSTACLES"), MESH_EDGES=asked("MESH_EDGES")
    )
    return draft


def streets_and_parcels() -> Draft:
    """From a site to its streets and parcels."""
    draft = Draft(
        "streetsandparcels",
        "Streets and parcels of a site",
        "Designs the streets of a site and cuts the blocks between them into parcels.",
        "Three steps: Prepare site, Design streets, Parcels in blocks. Blocks as wide as two "
        "parcels are deep and a street is wide suit best: 72 m for parcels 30 m deep.",
    )
    draft.input(of_tool("preparesite", "INPUT"))
    draft.input(of_tool("preparesite", "ROADS"))
    draft.input(of_tool("preparesite", "OBSTACLES"))
    empty = "Empty: as the kind of neighbourhood says. Optional."
    draft.input(
        of_tool("designstreets", "BLOCK_WIDTH"),
        Help=f"Wished width of the blocks, from street centre line to centre line. {empty}",
    )
    for key in ("PARCEL_WIDTH", "PARCEL_DEPTH", "METHOD", "DEEP_BLOCKS"):
        draft.input(of_tool("parcelblocks", key))
    for tool, key in (
        ("designstreets", "PRESET"), ("designstreets", "SINK_MODE"),
        ("designstreets", "TIME_LIMIT"), ("preparesite", "SNAP_DISTANCE"),
    ):  # fmt: skip
        draft.input(of_tool(tool, key), Flags=flags(advanced=True))
    near = {"SNAP_DISTANCE": asked("SNAP_DISTANCE")}
    draft.step(
        "site", "platwright:preparesite", "Prepare site",
        {
            "INPUT": asked("INPUT"), "ROADS": asked("ROADS"), "OBSTACLES": asked("OBSTACLES"),
            **near,
        },
        SITE="Site", PROBLEMS="Problems of the site",
    )  # fmt: skip
    wishes = {key: asked(key) for key in ("PRESET", "BLOCK_WIDTH", "SINK_MODE", "TIME_LIMIT")}
    around = {"OBSTACLES": made("site", "SITE_OBSTACLES"), **near}
    draft.step(
        "streets", "platwright:designstreets", "Design streets",
        {"INPUT": made("site", "SITE"), "ROADS": asked("ROADS"), **around, **wishes},
        STREETS="Streets", PROBLEMS="Problems of the streets",
    )  # fmt: skip
    sizes = ("PARCEL_WIDTH", "PARCEL_DEPTH", "METHOD", "DEEP_BLOCKS")
    draft.step(
        "parcels", "platwright:parcelblocks", "Parcels in blocks",
        {
            "STREETS": made("streets", "STREETS"), "SITE": made("site", "SITE"), **around,
            **{key: asked(key) for key in sizes},
        },
        PARCELS="Parcels", BLOCKS="Blocks", STREET_SPACE="Street space",
        PROBLEMS="Problems of the parcels",
    )  # fmt: skip
    return draft


def _ask_for_names(draft: Draft) -> None:
    """Ask what two designs are called."""
    from qgis.core import QgsProcessingParameterString

    for number, word in enumerate(("first", "second"), 1):
        title = f"Name of the {word} design"
        name = QgsProcessingParameterString(f"NAME_{number}", title, "", False, True)
        name.setHelp("Stands in the table. Empty: the name of the layer. Optional.")
        draft.input(name, Flags=flags(advanced=True, optional=True))


def compare_designs() -> Draft:
    """Compare two designs."""
    draft = Draft(
        "comparedesigns",
        "Compare two designs",
        "Sets the figures of two street layers on the same site side by side.",
        "Both layers are measured in the same way on the prepared site, wherever they come from: "
        "Design streets, a drawing, a survey. The table has a row for each design and a column "
        "for each figure, as Measure design gives them; two layers show where rules are "
        "broken.\n\n"
        "The designs need not have the same coordinate reference system.",
    )
    draft.input(of_tool("measuredesign", "INPUT"), Name="FIRST", Description="First design")
    draft.input(of_tool("measuredesign", "INPUT"), Name="SECOND", Description="Second design")
    draft.input(of_tool("preparesite", "INPUT"), Name="SITE")
    draft.input(of_tool("preparesite", "ROADS"))
    draft.input(of_tool("preparesite", "OBSTACLES"))
    draft.input(of_tool("measuredesign", "BLOCK_WIDTH"))
    draft.input(of_tool("preparesite", "SNAP_DISTANCE"))
    _ask_for_names(draft)
    draft.step(
        "site", "platwright:preparesite", "Prepare site",
        {
            "INPUT": asked("SITE"), "ROADS": asked("ROADS"), "OBSTACLES": asked("OBSTACLES"),
            "SNAP_DISTANCE": asked("SNAP_DISTANCE"),
        },
    )  # fmt: skip
    around = {
        "SITE": made("site", "SITE"),
        "BOUNDARY_STREETS": made("site", "BOUNDARY_STREETS"),
        "OBSTACLES": made("site", "SITE_OBSTACLES"),
    }
    for number, word in enumerate(("first", "second"), 1):
        given = {"INPUT": asked(word.upper()), **around}
        draft.step(
            word, "platwright:measuredesign", f"Measure the {word} design",
            {
                **given, "ACCESS_POINTS": made("site", "ACCESS_POINTS"),
                "BLOCK_WIDTH": asked("BLOCK_WIDTH"), "NAME": asked(f"NAME_{number}"),
            },
        )  # fmt: skip
        draft.step(
            f"check{number}", "platwright:validatenetwork", f"Check the {word} design",
            {**given, "EDGE_LENGTH": asked("BLOCK_WIDTH")},
            PROBLEMS=f"Broken rules of the {word} design",
        )  # fmt: skip
    draft.step(
        "both", MERGE, "Both rows",
        {"LAYERS": [made("first", "FIGURES"), made("second", "FIGURES")]},
    )  # fmt: skip
    draft.step(
        "compared", DROP, "Table",
        {"INPUT": made("both", "OUTPUT"), "COLUMN": value(["fid", "layer", "path"])},
        OUTPUT="Comparison",
    )  # fmt: skip
    return draft


def drafts() -> list[Draft]:
    """Put all models together; the tools must be known to QGIS."""
    return [
        place_to_design(),
        place_to_report(),
        parcels_to_design(),
        streets_and_parcels(),
        grown_streets_and_parcels(),
        residential_zone(),
        floor_plan(),
        compare_designs(),
    ]


def stale(texts: dict[Path, str]) -> list[Path]:
    """Return the files that say something else, and those of models that are no more."""
    wrong = [p for p, t in texts.items() if not p.is_file() or p.read_text("utf-8") != t]
    return sorted({*wrong, *(p for p in FOLDER.glob("*.model3") if p not in texts)})


def main() -> None:
    """Write the models, or check them."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    from qgis.analysis import QgsNativeAlgorithms
    from qgis.core import QgsApplication

    application = QgsApplication([], False)
    application.initQgis()
    registry = application.processingRegistry()
    registry.addProvider(QgsNativeAlgorithms(registry))
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "platwright_models").symlink_to(ROOT, target_is_directory=True)
        sys.path.insert(0, folder)
        plugin = importlib.import_module("platwright_models").classFactory(None)
        plugin.initProcessing()
        texts = {FOLDER / f"{draft.name}.model3": draft.text() for draft in drafts()}
        plugin.unload()
    wrong = stale(texts)
    if "--check" not in sys.argv:
        for path, text in texts.items():
            path.write_text(text, encoding="utf-8")
    for path in wrong:
        verb = "out of date" if "--check" in sys.argv or path not in texts else "written"
        print(f"{path.relative_to(ROOT)}: {verb}")
    sys.stdout.flush()
    # What lives on at the end of the program would end it badly.
    os._exit(1 if "--check" in sys.argv and wrong else 0)


if __name__ == "__main__":
    main()
