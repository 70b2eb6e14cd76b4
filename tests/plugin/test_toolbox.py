"""The whole toolbox: every tool says what it is, what it takes and what it gives."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

KEYS = {
    "osmboundary": {"PLACE", "POINT", "SOURCE_FILE", "RANK", "LIMIT", "BOUNDARIES"},
    "osmlayers": {
        "INPUT", "EXTENT", "NETWORK_TYPE", "SOURCE_FILE", "REACH", "STREETS", "INTERSECTIONS",
        "BUILDINGS", "LANDUSE", "OBSTACLES",
    },
    "preparesite": {
        "INPUT", "ROADS", "OBSTACLES", "SNAP_DISTANCE", "INNER_ROADS",
        "SITE", "BOUNDARY_STREETS", "ACCESS_POINTS", "SITE_OBSTACLES", "PROBLEMS",
    },
    "candidatemesh": {
        "INPUT", "ACCESS_POINTS", "OBSTACLES", "EDGE_LENGTH", "EDGES", "VERTICES", "FACES",
    },
    "designstreets": {
        "INPUT", "ROADS", "ACCESS_POINTS", "SNAP_DISTANCE", "SINK_MODE", "SINKS", "OBSTACLES",
        "REQUIRED", "FORBIDDEN", "MESH_EDGES", "EDGE_LENGTH", "RULES", "BLOCK_WIDTH",
        "BLOCK_LENGTH", "COVERAGE", "WEIGHT_LENGTH", "WEIGHT_DISTANCE", "WEIGHT_STRAIGHT",
        "WEIGHT_CONTINUE", "DEAD_ENDS", "ZIGZAGS", "TOO_CLOSE", "T_JUNCTIONS", "BRANCHES",
        "LEVELS", "TIME_LIMIT", "GAP", "SEED", "SOLVER",
        "STREETS", "JUNCTIONS", "BLOCKS", "PROBLEMS",
    },
    "exploretradeoffs": {
        "INPUT", "ROADS", "PARAMETER_X", "VALUES_X", "PARAMETER_Y", "VALUES_Y", "SINK_MODE",
        "SPECIFICATIONS", "PRESET", "BLOCK_WIDTH", "BLOCK_LENGTH", "OBSTACLES", "SINKS", "RULES",
        "TIME_LIMIT", "EFFORT", "SEED", "WORKERS", "CLUSTER",
        "STREETS", "DESIGNS", "PROBLEMS", "PLOT", "PICTURE",
    },
    "designcity": {
        "INPUT", "ROADS", "MAJOR_ROADS", "OBSTACLES", "PRESET", "BLOCK_WIDTH", "BLOCK_LENGTH",
        "FINISHED", "ROAD_CLASSES", "SPACING", "LEAST_AREA", "MOST_AREA", "STREET_SPACE",
        "TOLERANCE", "EFFORT", "SEED", "WORKERS", "CLUSTER",
        "STREETS", "SUB_REGIONS", "JUNCTIONS", "PROBLEMS",
    },
    "growstreets": {
        "INPUT", "ROADS", "OBSTACLES", "START_POINTS", "GRAMMAR", "SCALE",
        "LARGEST_BLOCK", "MAX_LENGTH", "MAX_SEGMENTS", "POPULATION", "PEOPLE", "ITERATIONS",
        "SEED", "GRAMMAR_FILE", "EDGE",
        "OBSTACLE_EDGE", "DEAD_ENDS", "INTERSECT_RADIUS", "CLEARANCE", "MIN_ANGLE", "DIRECTION",
        "AS_PUBLISHED", "SNAP_DISTANCE", "INNER_ROADS", "CRS",
        "STREETS", "NODES", "ROADS_MERGED", "BLOCKS", "PROBLEMS", "STEPS",
    },
    "smoothstreets": {
        "INPUT", "SITE", "OBSTACLES", "FIXED_POINTS", "SHAPE", "STRENGTH", "MAX_MOVE",
        "FILLET_RADIUS", "FILLET_ANGLE", "SQUARE_JUNCTIONS", "SLIDING_ENDS", "STREETS", "PROBLEMS",
    },
    "parcelblocks": {
        "INPUT", "STREETS", "SITE", "STREET_WIDTH", "METHOD", "PARCEL_WIDTH", "PARCEL_DEPTH",
        "DEEP_BLOCKS", "MIN_FRONTAGE", "MIN_AREA", "MAX_AREA", "CORNER_WIDTH", "REMAINDER",
        "GREENS", "LANE_WIDTH", "FLAG_WIDTH", "SEED", "CLOSED", "OBSTACLES", "EDGE",
        "SNAP_DISTANCE", "WIDTH_MAJOR", "WIDTH_COLLECTOR", "WIDTH_LOCAL", "WIDTH_CUL_DE_SAC",
        "PARCELS", "PROBLEMS", "BLOCKS", "STREET_SPACE",
    },
    "splitsite": {
        "INPUT", "ROADS", "KEY_ELEMENTS", "TEMPLATES", "PARCEL_WIDTH", "PARCEL_DEPTH",
        "STREET_WIDTH", "VARIATIONS", "KEEP", "KEY_STREETS", "BLOCK_LENGTH", "FIELD", "GUIDES",
        "WEIGHT_DIVERGENCE", "WEIGHT_ROWS", "WEIGHT_SINGULARITIES", "WEIGHT_CONTINUITY", "EFFORT",
        "TURNING_RADIUS", "OBSTACLES", "TEMPLATE_FILE", "TEMPLATE_NAMES", "MIN_FRONTAGE",
        "MIN_AREA", "MAX_AREA", "CORNER_WIDTH", "REMAINDER", "GREENS", "LANE_WIDTH", "FLAG_WIDTH",
        "SEED", "DEEP_BLOCKS", "METHOD", "SNAP_DISTANCE", "INNER_ROADS",
        "STREETS", "PARCELS", "BLOCKS", "PROBLEMS", "VARIATION_TABLE", "CROSS_FIELD", "CANDIDATES",
    },
    "optimiselayout": {
        "INPUT_STREETS", "INPUT_PARCELS", "SITE", "ROADS", "PARCEL_WIDTH", "PARCEL_DEPTH",
        "MIN_FRONTAGE", "MIN_AREA", "MAX_AREA", "CORNER_WIDTH", "REMAINDER", "GREENS", "LANE_WIDTH",
        "FLAG_WIDTH", "SEED", "DEEP_BLOCKS", "METHOD", "SNAP_DISTANCE", "WIDTH_MAJOR",
        "WIDTH_COLLECTOR", "WIDTH_LOCAL", "WIDTH_CUL_DE_SAC", "STREETS", "PARCELS", "PROBLEMS",
    },
    "resplitlayout": {
        "INPUT", "WHERE", "AREA", "INPUT_STREETS", "ACTION", "USE", "PARCEL_WIDTH", "PARCEL_DEPTH",
        "STREET_WIDTH", "SITE", "ROADS", "SNAP_DISTANCE", "MIN_FRONTAGE", "MIN_AREA", "MAX_AREA",
        "CORNER_WIDTH", "REMAINDER", "GREENS", "LANE_WIDTH", "FLAG_WIDTH", "SEED", "DEEP_BLOCKS",
        "METHOD", "BLOCK_LENGTH", "FIELD", "EFFORT", "TURNING_RADIUS", "WEIGHT_DIVERGENCE",
        "WEIGHT_ROWS", "WEIGHT_SINGULARITIES", "WEIGHT_CONTINUITY", "PARCELS", "STREETS",
        "PROBLEMS",
    },
    "validatenetwork": {
        "INPUT", "SITE", "SINKS", "OBSTACLES", "COVERAGE", "DEAD_ENDS", "ZIGZAGS", "TOO_CLOSE",
        "T_JUNCTIONS", "BRANCHES", "PROBLEMS",
    },
    "measuredesign": {
        "INPUT", "SITE", "BOUNDARY_STREETS", "ACCESS_POINTS", "OBSTACLES", "BLOCK_WIDTH", "NAME",
        "FIGURES",
    },
    "measurestreets": {
        "INPUT", "SITE", "MAX_TURN", "WIDTH_FIELD", "WIDTH", "CENTRALITY", "EXACT", "SOURCES",
        "SEED", "OUTPUT", "NATURAL_STREETS", "JUNCTIONS", "PROBLEMS",
    },
    "measureparcels": {
        "INPUT", "STREETS", "SITE", "PARCEL_WIDTH", "PARCEL_DEPTH", "SIMPLIFY", "STREET_DISTANCE",
        "USE_FIELD", "OUTPUT", "HISTOGRAM", "PROBLEMS", "HISTOGRAM_HTML",
    },
    "assigntraffic": {
        "INPUT", "SITE", "GATES", "FLOWS", "DENSITY", "THROUGH", "METHOD", "SHARE_OUT", "SHARE_IN",
        "SHARE_WITHIN", "SHARE_THROUGH", "GATE_CHOICE", "GATE_REACH", "WEIGHTS", "WEIGHT_FIELD",
        "ZONES", "PART_LENGTH", "SPEEDS", "SPEED_MAJOR", "SPEED_COLLECTOR", "SPEED_LOCAL",
        "SPEED_CUL_DE_SAC", "CAPACITY_MAJOR", "CAPACITY_COLLECTOR", "CAPACITY_LOCAL",
        "CAPACITY_CUL_DE_SAC", "ALPHA", "BETA", "GAP", "TIME_LIMIT", "STREETS", "PLACES",
        "PROBLEMS",
    },
    "simulatetraffic": {
        "INPUT", "SITE", "GATES", "FLOWS", "DENSITY", "THROUGH", "ROUTES", "SHARE_OUT", "SHARE_IN",
        "SHARE_WITHIN", "SHARE_THROUGH", "GATE_CHOICE", "GATE_REACH", "WEIGHTS", "WEIGHT_FIELD",
        "ZONES", "PART_LENGTH", "SPEEDS", "SPEED_MAJOR", "SPEED_COLLECTOR", "SPEED_LOCAL",
        "SPEED_CUL_DE_SAC", "CAPACITY_MAJOR", "CAPACITY_COLLECTOR", "CAPACITY_LOCAL",
        "CAPACITY_CUL_DE_SAC", "HOURS", "WARM_UP", "ITERATIONS", "TIME_LIMIT", "LEFT_HAND",
        "PATIENCE", "SEED", "STREETS", "PROBLEMS",
    },
    "measurelanduse": {
        "INPUT", "USE_FIELD", "STREETS", "BLOCKS", "SITE", "OUTPUT", "PROBLEMS",
    },
    "layoutresidential": {
        "INPUT", "ROADS", "CORRIDORS", "TYPE_SET", "BUILDING_TYPES", "PATTERN", "FAR",
        "SUN_COEFFICIENT", "DENSITY", "GREEN_RATIO", "FAR_LIMIT", "DENSITY_LIMIT", "PARKING",
        "PATCHES", "FACILITY_PATTERN", "PATH_PATTERN", "FACING", "SUN_HOURS", "SUN_MONTH",
        "SUN_DAY", "SUN_START", "SUN_END", "SETBACK", "GAP", "GROUP", "PATH_WIDTH",
        "TREE_SPACING", "OBSTACLES", "SNAP_DISTANCE", "INNER_ROADS", "WIDTH_MAJOR",
        "WIDTH_COLLECTOR", "WIDTH_LOCAL", "WIDTH_CUL_DE_SAC", "METHOD", "TIME_LIMIT", "SEED",
    },
    "designfloor": {
        "INPUT", "MODULE", "MESH", "TEMPLATE_SET", "TEMPLATES", "TEMPLATE_FILE", "SINKS",
        "OBSTACLES", "CORRIDOR_WIDTH", "STOREYS", "DEAD_ENDS", "BRANCHES", "OUTER", "CLOSE",
        "WEIGHT_LENGTH", "WEIGHT_DISTANCE", "WAYS", "PART_SIZE", "CORRIDORS_GIVEN", "TIME_LIMIT",
        "SEED",
    },
    "designgamelevel": {
        "INPUT", "MODULE", "LEVEL_TYPE", "TEMPLATE_SET", "TEMPLATES", "TEMPLATE_FILE", "SINKS",
        "OBSTACLES", "MIN_LENGTH", "MAX_LENGTH", "TREASURE_ROOMS", "TIME_LIMIT", "SEED", "TILES",
    },
    "designreport": {
        "LAYERS", "TITLE", "PLACE", "AUTHOR", "TARGETS", "TARGET_TABLE", "BACKGROUND", "DESIGNS",
        "PICTURE_WIDTH", "OUTPUT", "LAYOUT",
    },
    "installdependencies": {
        "ACTION", "CONSENT", "OPENSTREETMAP", "ORTOOLS", "PBF", "SUMO", "WHEELS",
    },
}  # fmt: skip
NUMBERS = {
    "osmboundary": {"FOUND", "AREA", "NAME", "OSM_ID"},
    "osmlayers": {
        "AREA", "LENGTH", "STREET_COUNT", "INTERSECTION_COUNT", "BUILDING_COUNT",
        "OBSTACLE_COUNT",
    },
    "designstreets": {
        "TOTAL_LENGTH", "MEAN_DISTANCE", "MAX_DISTANCE", "OBJECTIVE", "BOUND", "ACHIEVED_GAP",
        "SECONDS", "VIOLATIONS",
    },
    "exploretradeoffs": {"REQUESTED", "ACHIEVED", "FRONT", "SHORTEST", "NEAREST"},
    "designcity": {
        "REGION_COUNT", "DONE", "FAILED", "RESUMED", "TOTAL_LENGTH", "MEAN_DISTANCE", "OBJECTIVE",
        "BOUND", "ACHIEVED_GAP", "AGREEMENT", "CROSSINGS", "STAGGERED", "COMPUTING", "SECONDS",
    },
    "growstreets": {
        "SEGMENTS", "NODE_COUNT", "ROAD_COUNT", "TOTAL_LENGTH", "POPULATION_REACHED",
        "ITERATIONS_DONE", "BLOCK_COUNT", "DEAD_ENDS_LEFT", "LEFT_OUT", "SECONDS", "STOPPED",
    },
    "smoothstreets": {
        "ANGLE_BEFORE", "ANGLE_AFTER", "ANGLE_P90_BEFORE", "ANGLE_P90_AFTER", "BENDS_BEFORE",
        "BENDS_AFTER", "SHORTEST_BEFORE", "SHORTEST_AFTER", "LENGTH_BEFORE", "LENGTH_AFTER",
        "LARGEST_MOVE", "HELD_BACK",
    },
    "parcelblocks": {
        "REQUESTED", "ACHIEVED", "MEAN_P_ANGLE", "MEAN_P_AREA", "UNDESIRABLE", "WITH_ACCESS",
        "GREEN", "SECONDS",
    },
    "splitsite": {
        "PARCEL_COUNT", "MEAN_P_ANGLE", "MEAN_P_AREA", "UNDESIRABLE", "GREEN", "STREET_SHARE",
        "STREET_LENGTH", "SCORE", "MADE", "SECONDS",
    },
    "optimiselayout": {
        "PARCELS_BEFORE", "PARCELS_AFTER", "P_ANGLE_BEFORE", "P_ANGLE_AFTER", "P_AREA_BEFORE",
        "P_AREA_AFTER", "UNDESIRABLE_BEFORE", "UNDESIRABLE_AFTER", "LARGEST_MOVE", "BETTER",
        "SECONDS",
    },
    "resplitlayout": {"CHOSEN", "MADE", "KEPT"},
    "validatenetwork": {"VIOLATIONS"},
    "measuredesign": {"LENGTH_M", "BLOCKS", "BLOCK_WIDTH_M", "VIOLATIONS"},
    "measurestreets": {
        "AREA_KM2", "LENGTH_KM", "STREET_KM_KM2", "SEGMENTS", "SEGMENT_MEAN", "INTERSECTIONS",
        "INTERSECTIONS_KM2", "THREE_WAY", "FOUR_WAY", "FIVE_WAY", "T_PCT", "Y_PCT", "X_PCT",
        "DEAD_ENDS", "DEAD_ENDS_KM2", "DEAD_ENDS_PCT", "BLOCKS", "BLOCK_MEAN_HA",
        "BLOCK_MEDIAN_HA", "BLOCK_MAX_HA", "ENTROPY", "ORDER", "ENTROPY_LENGTH", "ORDER_LENGTH",
        "SINUOSITY", "CIRCUITY", "ROADS_PCT", "NATURAL_COUNT", "NATURAL_MAX", "HT_INDEX",
        "LIVABILITY", "BETWEENNESS_MEAN", "BETWEENNESS_MAX", "CLOSENESS_MEAN", "COMPONENTS",
        "LARGEST_PCT", "MESHEDNESS", "BETA", "GAMMA", "CROSSINGS",
    },
    "assigntraffic": {
        "TOTAL_LENGTH", "DESIGN_LENGTH", "MEAN_DISTANCE", "DISTANCE_OUT", "DISTANCE_IN",
        "DISTANCE_WITHIN", "DISTANCE_THROUGH", "MEAN_TIME", "TIME_OUT", "TIME_IN", "TIME_WITHIN",
        "TIME_THROUGH", "VEHICLES", "UNSERVED", "VEHICLE_KM", "VEHICLE_HOURS", "MAX_USE",
        "GATES_FOUND", "ACHIEVED_GAP", "SECONDS",
    },
    "simulatetraffic": {
        *(
            f"MEAN_{mean}" if kind == "MEAN" else f"{mean}_{kind}"
            for mean in ("DISTANCE", "TIME", "WAITING", "FINISHED")
            for kind in ("MEAN", "OUT", "IN", "WITHIN", "THROUGH")
        ),
        "MEAN_DELAY", "TRIPS", "ARRIVED", "RUNNING", "NOT_ENTERED", "NO_WAY", "NOWHERE",
        "MOVED_ON",
    },
    "measureparcels": {
        "COUNT", "PER_KM2", "P_ANGLE", "P_AREA", "P_IDEAL", "P_SIMILARITY", "UNDESIRABLE",
        "ACCESS_PCT", "CV_AREA",
    },
    "measurelanduse": {
        "STREETS_PCT", "PARCELS_PCT", "PARKS_PCT", "OTHER_PCT", "BLOCKS_KM2", "BLOCK_MAX",
        "BLOCK_MEAN", "BLOCK_MIN", "STREET_KM_KM2", "INTERSECTIONS_KM2", "DEAD_ENDS_KM2",
        "PARCELS_KM2",
    },
    "layoutresidential": {
        "BUILDINGS", "SHADOWS", "PATHS", "CORRIDORS_USED", "PARKING_BAYS", "GREEN", "TREES",
        "PATCHES_USED", "PROBLEMS", "CITYJSON_FILE", "GLTF_FILE", "FAR_REACHED",
        "DENSITY_REACHED", "GREEN_REACHED", "RESIDENCE_SHARE", "FACILITY_SHARE", "PATH_SHARE",
        "PARKING_SHARE", "PARKING_PLACES", "PARKING_PER_DWELLING", "BUILDING_COUNT", "DWELLINGS",
        "SHADED", "LEAST_SUN", "MEAN_SUN", "MEAN_WAY", "OBJECTIVE", "SECONDS",
    },
    "designfloor": {
        "ROOMS", "CORRIDORS", "CORRIDOR_LINES", "DOORS", "SHAFTS", "CELLS", "PROBLEMS",
        "ROOM_COUNT", "CORRIDOR_SHARE", "NET_TO_GROSS", "CORRIDOR_LENGTH", "MEAN_EGRESS",
        "MAX_EGRESS", "OBJECTIVE", "BOUND", "GAP", "SECONDS",
    },
    "designgamelevel": {
        "BLOCKS", "ROUTE", "DOORS", "START_GOAL", "ADJACENCY", "PROBLEMS", "TILED_FILE",
        "BLOCK_COUNT", "DOOR_COUNT", "TREASURES", "ROUTE_LENGTH", "OBJECTIVE", "BOUND", "GAP",
        "SECONDS",
    },
    "designreport": {
        "OUTPUT", "LAYOUT", "DESIGNS_FOUND", "PICTURES", "TARGETS_MET", "TARGETS_MISSED",
    },
    "installdependencies": {"PACKAGES", "FOLDER"},
}  # fmt: skip
UNITS = {
    "BLOCK_WIDTH": "(m)",
    "BLOCK_LENGTH": "(m)",
    "EDGE_LENGTH": "(m)",
    "SNAP_DISTANCE": "(m)",
    "TIME_LIMIT": "(s)",
    "DIRECTION": "(degrees)",
    "REACH": "(m)",
    "MAX_MOVE": "(m)",
    "FILLET_RADIUS": "(m)",
    "SCALE": "(m)",
    "MAX_LENGTH": "(m)",
    "MIN_ANGLE": "(degrees)",
    "FILLET_ANGLE": "(degrees)",
    "STRENGTH": "(percent)",
    "PARCEL_WIDTH": "(m)",
    "PARCEL_DEPTH": "(m)",
    "STREET_WIDTH": "(m)",
    "MIN_AREA": "(m2)",
}


@pytest.fixture(params=sorted(KEYS))
def tool(request, toolbox):
    return toolbox.tool(request.param)


def test_the_provider_lists_every_tool(provider):
    tools = {a.name() for a in provider.algorithms() if a.groupId() != "models"}
    assert tools == set(KEYS)
    assert Path(provider.svgIconPath()).is_file()


def test_groups_follow_the_order_of_the_work(provider):
    tools = [a for a in provider.algorithms() if a.groupId() != "models"]
    groups = {a.name(): a.group() for a in tools}
    assert groups == {
        "osmboundary": "1 Site",
        "osmlayers": "1 Site",
        "preparesite": "1 Site",
        "candidatemesh": "1 Site",
        "designstreets": "2 Streets",
        "exploretradeoffs": "2 Streets",
        "designcity": "2 Streets",
        "growstreets": "2 Streets",
        "smoothstreets": "2 Streets",
        "splitsite": "3 Parcels",
        "parcelblocks": "3 Parcels",
        "optimiselayout": "3 Parcels",
        "resplitlayout": "3 Parcels",
        "validatenetwork": "6 Measure",
        "measuredesign": "6 Measure",
        "measurestreets": "6 Measure",
        "measureparcels": "6 Measure",
        "measurelanduse": "6 Measure",
        "simulatetraffic": "6 Measure",
        "assigntraffic": "6 Measure",
        "designreport": "6 Measure",
        "layoutresidential": "4 Buildings",
        "designfloor": "5 Rooms",
        "designgamelevel": "5 Rooms",
        "installdependencies": "9 Set-up",
    }


def test_keys_are_those_that_saved_models_use(tool):
    keys = {p.name() for p in tool.parameterDefinitions()}
    assert keys >= KEYS[tool.name()]
    assert {o.name() for o in tool.outputDefinitions()} >= NUMBERS.get(tool.name(), set())


def test_every_parameter_is_named_and_explained(tool):
    from qgis.core import QgsProcessingParameterNumber

    for p in tool.parameterDefinitions():
        assert p.description(), p.name()
        assert len(p.help()) > 15, p.name()
        assert p.help().endswith("."), p.name()
        assert p.name() == p.name().upper()
        if isinstance(p, QgsProcessingParameterNumber) and p.name() in UNITS:
            assert UNITS[p.name()] in p.description()


def test_the_help_ends_with_the_default_or_says_optional(tool):
    from qgis.core import QgsProcessingParameterDefinition

    optional = QgsProcessingParameterDefinition.Flag.FlagOptional
    for p in tool.parameterDefinitions():
        if p.isDestination():
            continue
        if p.flags() & optional:
            assert p.help().endswith(" Optional."), p.name()
        elif p.defaultValue() is not None:
            default = p.defaultValue()
            words = {True: "yes", False: "no"}
            given = words[default] if isinstance(default, bool) else default
            shown = given if isinstance(given, str) else f"{given:g}"
            assert re.search(rf" Default: {re.escape(shown)}( \w+)?\.$", p.help()), p.name()


def test_no_dialog_has_more_than_eight_basic_inputs(tool):
    from qgis.core import QgsProcessingParameterDefinition

    advanced = QgsProcessingParameterDefinition.Flag.FlagAdvanced
    basic = [
        p for p in tool.parameterDefinitions()
        if not p.isDestination() and not p.flags() & advanced
    ]  # fmt: skip
    assert len(basic) <= 8


def test_defaults_are_accepted(tool):
    for p in tool.parameterDefinitions():
        if p.defaultValue() is not None:
            assert p.checkValueIsAcceptable(p.defaultValue()), p.name()


def test_help_tells_every_input_and_every_field(tool, package):
    text = tool.shortHelpString()
    for p in tool.parameterDefinitions():
        if not p.isDestination():
            assert p.help()[:30].split("&")[0] in re.sub(r"&#x27;", "'", text)
    for kind in tool.layers.values():
        for field in kind.fields:
            assert f"<b>{field.name}</b>" in text
            assert field.text
    assert len(tool.tags()) >= 5
    assert tool.shortDescription() in text


def test_an_icon_of_its_own_or_of_its_group(tool):
    assert Path(tool.svgIconPath()).stem in {tool.name(), tool.groupId()}
    assert not tool.icon().isNull()


def test_a_missing_package_is_named_before_the_dialog_opens(tool, package, monkeypatch):
    deps = package("plugin.deps")
    if not tool.needs:
        pytest.skip("a tool that needs no packages")
    assert tool.canExecute()[0] is True
    newer = deps.PACKAGES["geopandas"]._replace(least="999.0")
    monkeypatch.setitem(deps.PACKAGES, "geopandas", newer)
    monkeypatch.delitem(sys.modules, "geopandas", raising=False)
    good, text = tool.canExecute()
    assert not good
    assert "geopandas (version 999.0 or newer, found" in text
    assert "Settings > Options > Platwright" in text
