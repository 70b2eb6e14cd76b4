"""The models that begin with the name of a place."""

from __future__ import annotations

from typing import Any

from _model_draft import Draft, asked, expression, flags, made, of_tool, value

#: Native tools that are used.
FILTER, REPROJECT = "native:extractbyexpression", "native:reprojectlayer"
#: The UTM zone at the middle of the step "Place".
UTM = (
    "'EPSG:' || to_string(to_int("
    "if(@Place_BOUNDARIES_miny + @Place_BOUNDARIES_maxy >= 0, 32601, 32701)"
    " + floor(((@Place_BOUNDARIES_minx + @Place_BOUNDARIES_maxx) / 2 + 180) / 6)))"
)


def ask_for_design(draft: Draft, *, advanced_snap: bool, advanced_blocks: bool = False) -> None:
    """Ask for the kind of neighbourhood and how the streets are designed."""
    draft.input(of_tool("designstreets", "PRESET"))
    blocks = flags(advanced=advanced_blocks, optional=True)
    empty = "Empty: as the kind of neighbourhood says. Optional."
    draft.input(
        of_tool("designstreets", "BLOCK_WIDTH"),
        Help=f"Wished width of the blocks, from street centre line to centre line. {empty}",
        Flags=blocks,
    )
    draft.input(
        of_tool("designstreets", "BLOCK_LENGTH"),
        Help=f"Wished greatest length of the blocks, not less than their width. {empty}",
        Flags=blocks,
    )
    draft.input(of_tool("designstreets", "SINK_MODE"))
    draft.input(of_tool("preparesite", "SNAP_DISTANCE"), Flags=flags(advanced=advanced_snap))
    draft.input(of_tool("designstreets", "TIME_LIMIT"), Flags=flags(advanced=True))
    draft.input(of_tool("preparesite", "INNER_ROADS"), Flags=flags(advanced=True))


def design(draft: Draft, site: Any, roads: Any, obstacles: Any, **more: Any) -> None:
    """Prepare a site, design its streets, and check them."""
    nearness = {key: asked(key) for key in ("SNAP_DISTANCE", "INNER_ROADS")}
    draft.step(
        "site", "platwright:preparesite", "Prepare site",
        {"INPUT": site, "ROADS": roads, "OBSTACLES": obstacles, **nearness},
        SITE="Site", BOUNDARY_STREETS="Boundary streets", ACCESS_POINTS="Access points",
        SITE_OBSTACLES="Site obstacles", PROBLEMS="Problems of the site",
    )  # fmt: skip
    keys = ("PRESET", "BLOCK_WIDTH", "BLOCK_LENGTH", "SINK_MODE", "TIME_LIMIT")
    wishes = {key: asked(key) for key in keys}
    draft.step(
        "design", "platwright:designstreets", "Design streets",
        {
            "INPUT": made("site", "SITE"), "ROADS": roads,
            "OBSTACLES": made("site", "SITE_OBSTACLES"), **nearness, **wishes, **more,
        },
        STREETS="Streets", JUNCTIONS="Junctions", BLOCKS="Blocks",
        PROBLEMS="Problems of the design",
    )  # fmt: skip
    draft.step(
        "exits", FILTER, "Ways out of the site",
        {"INPUT": made("design", "JUNCTIONS"), "EXPRESSION": value('"is_sink"')},
    )  # fmt: skip
    draft.step(
        "check", "platwright:validatenetwork", "Validate street network",
        {
            "INPUT": made("design", "STREETS"), "SITE": made("site", "SITE"),
            "BOUNDARY_STREETS": made("site", "BOUNDARY_STREETS"),
            "OBSTACLES": made("site", "SITE_OBSTACLES"), "SINKS": made("exits", "OUTPUT"),
        },
        PROBLEMS="Broken rules",
    )  # fmt: skip


def _ask_for_place(draft: Draft) -> None:
    """Ask which place it is, and what of it is given up."""
    from qgis.core import QgsProcessingParameterString

    draft.input(
        of_tool("osmboundary", "PLACE"),
        Flags=flags(),
        Help="A name, with the town or the country after a comma where needed (Larvotto, Monaco), "
        "or an OpenStreetMap id (R5986437, way/686693023), or the address of a thing on "
        "openstreetmap.org.",
    )
    draft.input(
        of_tool("osmboundary", "RANK"),
        DefaultValue=1,
        Flags=flags(),
        Help="Which of the candidates that Find boundary of a place lists. Default: 1.",
    )
    draft.input(of_tool("osmboundary", "SOURCE_FILE"))
    built = QgsProcessingParameterString("BUILT_ON", "Obstacles to build on", "", False, True)
    built.setHelp(
        "Kinds of obstacles that are given up, with commas between: water, sea, green, rail, "
        "motorway, airfield, military, wall, cliff. Thus 'rail' where a rail yard is the site. "
        "Optional."
    )
    draft.input(built)


def _surroundings(draft: Draft) -> None:
    """Find a place, and what lies around it, in metres."""
    # a model does not fill in its defaults on the command line, and without a rank all
    # candidates would be joined to one site
    draft.step(
        "place", "platwright:osmboundary", "Place",
        {
            "PLACE": asked("PLACE"), "RANK": expression("coalesce(@RANK, 1)"),
            "SOURCE_FILE": asked("SOURCE_FILE"),
        },
    )  # fmt: skip
    draft.step(
        "metres", REPROJECT, "In metres",
        {"INPUT": made("place", "BOUNDARIES"), "TARGET_CRS": expression(UTM)},
    )  # fmt: skip
    draft.step(
        "map", "platwright:osmlayers", "Surroundings",
        {"INPUT": made("metres", "OUTPUT"), "SOURCE_FILE": asked("SOURCE_FILE")},
        STREETS="Streets of OpenStreetMap", BUILDINGS="Buildings of OpenStreetMap",
        OBSTACLES="Obstacles of OpenStreetMap",
    )  # fmt: skip
    draft.step(
        "kept", FILTER, "Obstacles that stay",
        {
            "INPUT": made("map", "OBSTACLES"),
            "EXPRESSION": expression(
                "'not regexp_match(''' || replace(lower(coalesce(@BUILT_ON, '')), '''', ' ')"
                " || ''', ''\\\\b'' || coalesce(\"kind\", ''-'') || ''\\\\b'')'"
            ),
        },
    )  # fmt: skip


def place_to_design() -> Draft:
    """From a place name to a street design."""
    draft = Draft(
        "placetodesign",
        "From a place name to a street design",
        "Finds a place in OpenStreetMap, fetches what lies around it, and designs its streets.",
        "Five steps: Find boundary of a place, OpenStreetMap layers, Prepare site, Design streets, "
        "Validate street network. The place is the site: choose one that is to be built, as a "
        "rail yard, a brownfield or a field, not a town that is built already.\n\n"
        "Names are seldom unique. Run Find boundary of a place first to see all that a name may "
        "mean, and give the number of the right one here as Rank.\n\n"
        "Where the streets that are there touch the site on one side only, as at the sea, let "
        "them leave it at the whole boundary.\n\n"
        "With an OpenStreetMap file no network is needed. All layers are in metres, in the UTM "
        "zone of the place. The data is © OpenStreetMap contributors, Open Database License 1.0.",
    )
    _ask_for_place(draft)
    ask_for_design(draft, advanced_snap=True)
    _surroundings(draft)
    design(draft, made("metres", "OUTPUT"), made("map", "STREETS"), made("kept", "OUTPUT"))
    return draft


def place_to_report() -> Draft:
    """From a place name to a report on its design."""
    draft = Draft(
        "placetoreport",
        "From a place name to a report",
        "Finds a place in OpenStreetMap, designs its streets and parcels, sends traffic over "
        "them, and writes one page about it all.",
        "Eight steps: Find boundary of a place, OpenStreetMap layers, Prepare site, Design "
        "streets, Validate street network, Parcels in blocks, Assign traffic, Write design "
        "report. The page opens in any browser and needs no network.\n\n"
        "The place is the site: choose one that is to be built, as a rail yard, a brownfield or "
        "a field. Names are seldom unique: run Find boundary of a place first to see all that a "
        "name may mean, and give the number of the right one here as Rank.\n\n"
        "With an OpenStreetMap file no network is needed. The data is © OpenStreetMap "
        "contributors, Open Database License 1.0; the page says so.",
        main=("report", "OUTPUT"),
    )
    _ask_for_place(draft)
    ask_for_design(draft, advanced_snap=True, advanced_blocks=True)
    draft.input(
        of_tool("assigntraffic", "DENSITY"),
        Help="Traffic of the place itself, spread evenly over its area. Default: 250.",
    )
    draft.input(of_tool("designreport", "TARGETS"))
    _surroundings(draft)
    design(draft, made("metres", "OUTPUT"), made("map", "STREETS"), made("kept", "OUTPUT"))
    streets, site = made("design", "STREETS"), made("site", "SITE")
    draft.step(
        "parcels", "platwright:parcelblocks", "Parcels in blocks",
        {
            "STREETS": streets, "SITE": site, "OBSTACLES": made("site", "SITE_OBSTACLES"),
            "SNAP_DISTANCE": asked("SNAP_DISTANCE"),
        },
        PARCELS="Parcels",
    )  # fmt: skip
    draft.step(
        "traffic", "platwright:assigntraffic", "Assign traffic",
        {"INPUT": streets, "SITE": site, "GATES": made("exits", "OUTPUT"),
         "DENSITY": expression("coalesce(@DENSITY, 250)")},
        STREETS="Traffic",
    )  # fmt: skip
    draft.step(
        "report", "platwright:designreport", "Write design report",
        {
            "LAYERS": [
                streets, made("design", "BLOCKS"), made("parcels", "PARCELS"),
                made("traffic", "STREETS"), site, made("map", "STREETS"),
                made("design", "PROBLEMS"), made("traffic", "PROBLEMS"),
            ],
            "PLACE": asked("PLACE"), "TARGETS": asked("TARGETS"),
        },
        OUTPUT="Report",
    )  # fmt: skip
    return draft
