"""The model that cleans a footprint, plans its storeys and measures what the plan gives."""

from __future__ import annotations

from typing import Any

from _model_draft import Draft, asked, flags, made, of_tool, value

#: Inputs of Design floor plan; the second ones are behind Advanced.
BASIC = ("SINKS", "OBSTACLES", "TEMPLATE_SET", "MODULE", "STOREYS", "CORRIDOR_WIDTH")
MORE = ("TEMPLATES", "TEMPLATE_FILE", "DEAD_ENDS", "CORRIDORS_GIVEN", "TIME_LIMIT", "SEED")
#: Native tools that are used.
FIX, AGGREGATE = "native:fixgeometries", "native:aggregate"


def floor_plan() -> Draft:
    """From a footprint to rooms, corridors and a schedule of rooms."""
    draft = Draft(
        "floorplan",
        "Floor plan of a footprint",
        "Fills the storeys of a building with rooms and corridors, and lists the rooms by kind.",
        "Three steps: Fix geometries, Design floor plan, Aggregate. Take a building of any layer, "
        "such as Buildings of OpenStreetMap layers; select it and tick Selected features only.\n\n"
        "The schedule has a row for each kind of room on each storey: how many there are, their "
        "area, and the mean and longest way to an exit.",
    )
    draft.input(of_tool("designfloor", "INPUT"))
    for key in BASIC:
        draft.input(of_tool("designfloor", key))
    for key in MORE:
        own = of_tool("designfloor", key)
        draft.input(own, Flags=own.flags() | flags(advanced=True))
    draft.step("fixed", FIX, "Footprints without faults", {"INPUT": asked("INPUT")})
    draft.step(
        "plan", "platwright:designfloor", "Design floor plan",
        {
            "INPUT": made("fixed", "OUTPUT"),
            **{key: asked(key) for key in (*BASIC, *MORE)},
        },
        ROOMS="Rooms", CORRIDORS="Corridors", CORRIDOR_LINES="Corridor lines", DOORS="Doors",
        SHAFTS="Shafts and obstacles", PROBLEMS="Problems of the floors",
    )  # fmt: skip
    draft.step(
        "schedule", AGGREGATE, "Schedule of rooms",
        {
            "INPUT": made("plan", "ROOMS"),
            "GROUP_BY": value('array("footprint_id", "floor", "template")'),
            "AGGREGATES": value(list(_columns())),
        },
        OUTPUT="Schedule of rooms",
    )  # fmt: skip
    return draft


def _columns() -> Any:
    """Yield the columns of the schedule as the tool wants them."""
    whole, number, text = (2, 10, 0), (6, 0, 2), (10, 0, 0)
    for name, source, how, (kind, length, precision) in (
        ("footprint_id", '"footprint_id"', "first_value", whole),
        ("floor", '"floor"', "first_value", whole),
        ("template", '"template"', "first_value", text),
        ("use", '"use"', "first_value", text),
        ("rooms", '"room_id"', "count", whole),
        ("area_m2", '"area_m2"', "sum", number),
        ("mean_way_m", '"distance_m"', "mean", number),
        ("longest_way_m", '"distance_m"', "maximum", number),
    ):
        yield {
            "name": name, "input": source, "aggregate": how, "type": kind, "length": length,
            "precision": precision, "delimiter": ",",
        }  # fmt: skip
