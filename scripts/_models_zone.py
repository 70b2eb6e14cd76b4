"""The model that designs the streets of a zone and lays buildings out between them."""

from __future__ import annotations

from typing import Any

from _model_draft import Draft, asked, flags, made, of_tool

#: Inputs of the model that are those of its tools; the second ones are behind Advanced.
STREETS = ("BLOCK_WIDTH", "BLOCK_LENGTH")
BUILDINGS = ("TYPE_SET", "PATTERN", "FAR")
BUILDINGS_MORE = (
    "BUILDING_TYPES", "DENSITY", "GREEN_RATIO", "SUN_COEFFICIENT", "SUN_HOURS", "PATH_PATTERN",
    "METHOD", "SEED",
)  # fmt: skip
#: Blocks that are large enough for rows of houses with their greens (metres).
WIDE, LONG = 120.0, 170.0


def residential_zone() -> Draft:
    """From a site to streets, buildings, paths and greens."""
    draft = Draft(
        "residentialzone",
        "Residential zone of a site",
        "Designs the streets of a site and lays out buildings, paths, parking and green between "
        "them.",
        "Three steps: Prepare site, Design streets, Lay out residential zone. The streets cut the "
        "site into patches; each gets buildings in the pattern that is chosen, none in another's "
        "shade.\n\n"
        "Wider blocks give more freedom to rows and courts, narrower ones shorter ways.",
    )
    draft.input(of_tool("preparesite", "INPUT"))
    draft.input(of_tool("designstreets", "ROADS"))
    draft.input(of_tool("designstreets", "OBSTACLES"))
    for key, usual in zip(STREETS, (WIDE, LONG)):
        draft.input(of_tool("designstreets", key), DefaultValue=usual)
    for key in BUILDINGS:
        draft.input(of_tool("layoutresidential", key))
    for key in BUILDINGS_MORE:
        draft.input(of_tool("layoutresidential", key), Flags=_advanced(key))
    draft.input(of_tool("preparesite", "SNAP_DISTANCE"), Flags=flags(advanced=True))
    near = {"SNAP_DISTANCE": asked("SNAP_DISTANCE")}
    around = {"ROADS": asked("ROADS"), "OBSTACLES": asked("OBSTACLES"), **near}
    draft.step(
        "site", "platwright:preparesite", "Prepare site",
        {"INPUT": asked("INPUT"), **around},
        SITE="Site", PROBLEMS="Problems of the site",
    )  # fmt: skip
    draft.step(
        "streets", "platwright:designstreets", "Design streets",
        {
            "INPUT": made("site", "SITE"), **around,
            **{key: asked(key) for key in STREETS},
        },
        STREETS="Streets", PROBLEMS="Problems of the streets",
    )  # fmt: skip
    draft.step(
        "zone", "platwright:layoutresidential", "Lay out residential zone",
        {
            "INPUT": made("site", "SITE"), "CORRIDORS": made("streets", "STREETS"), **around,
            **{key: asked(key) for key in (*BUILDINGS, *BUILDINGS_MORE)},
        },
        BUILDINGS="Buildings", SHADOWS="Shadows", PATHS="Paths", PARKING_BAYS="Parking",
        GREEN="Green", TREES="Trees", PATCHES_USED="Patches", CORRIDORS_USED="Corridors",
        PROBLEMS="Problems of the zone",
    )  # fmt: skip
    return draft


def _advanced(key: str) -> Any:
    """Return the flags of an input of the tool, behind Advanced."""
    return of_tool("layoutresidential", key).flags() | flags(advanced=True)
