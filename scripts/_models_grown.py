"""The model that grows streets into a site and cuts the blocks into parcels; see _models.py."""

from __future__ import annotations

from typing import Any

from _model_draft import Draft, asked, flags, made, of_tool

#: Inputs of the model that are those of its tools; the second ones are behind Advanced.
GROWTH = ("GRAMMAR", "SCALE", "SEED")
GROWTH_MORE = (
    "LARGEST_BLOCK", "GRAMMAR_FILE", "MAX_LENGTH", "EDGE", "DEAD_ENDS", "INNER_ROADS",
)  # fmt: skip
PARCELS = ("PARCEL_WIDTH", "PARCEL_DEPTH")
PARCELS_MORE = ("METHOD", "DEEP_BLOCKS")


def grown_streets_and_parcels() -> Draft:
    """From a site to streets that grow in it, and their parcels."""
    draft = Draft(
        "growstreetsandparcels",
        "Streets and parcels of a site, grown",
        "Grows streets into a site by the rules of a grammar and cuts the blocks between them "
        "into parcels.",
        "Four steps: Prepare site, Grow streets, Parcels in blocks, Measure parcels. The streets "
        "go on from the existing roads; those along the edge of the site give access as well. "
        "Another seed makes another plan.\n\n"
        "The scale decides how large the blocks are: they must be deep enough for two rows of "
        "parcels, or much of the land becomes green.",
    )
    draft.input(of_tool("preparesite", "INPUT"))
    draft.input(of_tool("growstreets", "ROADS"))
    draft.input(of_tool("growstreets", "OBSTACLES"))
    for key in GROWTH:
        draft.input(of_tool("growstreets", key))
    for key in PARCELS:
        draft.input(of_tool("parcelblocks", key))
    for key in GROWTH_MORE:
        draft.input(of_tool("growstreets", key), Flags=_advanced("growstreets", key))
    for key in PARCELS_MORE:
        draft.input(of_tool("parcelblocks", key), Flags=_advanced("parcelblocks", key))
    draft.input(of_tool("preparesite", "SNAP_DISTANCE"), Flags=flags(advanced=True))
    near = {"SNAP_DISTANCE": asked("SNAP_DISTANCE")}
    draft.step(
        "site", "platwright:preparesite", "Prepare site",
        {
            "INPUT": asked("INPUT"), "ROADS": asked("ROADS"), "OBSTACLES": asked("OBSTACLES"),
            "INNER_ROADS": asked("INNER_ROADS"), **near,
        },
        SITE="Site", PROBLEMS="Problems of the site",
    )  # fmt: skip
    around = {"OBSTACLES": made("site", "SITE_OBSTACLES"), **near}
    wishes = {key: asked(key) for key in (*GROWTH, *GROWTH_MORE)}
    draft.step(
        "streets", "platwright:growstreets", "Grow streets",
        {"INPUT": made("site", "SITE"), "ROADS": asked("ROADS"), **around, **wishes},
        STREETS="Streets", NODES="Nodes", PROBLEMS="Problems of the streets",
    )  # fmt: skip
    sizes = {key: asked(key) for key in PARCELS}
    draft.step(
        "parcels", "platwright:parcelblocks", "Parcels in blocks",
        {
            "STREETS": made("streets", "STREETS"), "SITE": made("site", "SITE"), **around,
            **sizes, **{key: asked(key) for key in PARCELS_MORE},
        },
        PARCELS="Parcels", BLOCKS="Blocks", STREET_SPACE="Street space",
        PROBLEMS="Problems of the parcels",
    )  # fmt: skip
    draft.step(
        "measures", "platwright:measureparcels", "Measure parcels",
        {
            "INPUT": made("parcels", "PARCELS"), "STREETS": made("streets", "STREETS"),
            "SITE": made("site", "SITE"), **sizes,
        },
        HISTOGRAM="Histogram of parcels",
    )  # fmt: skip
    return draft


def _advanced(tool: str, key: str) -> Any:
    """Return the flags of an input of a tool, behind Advanced."""
    return of_tool(tool, key).flags() | flags(advanced=True)
