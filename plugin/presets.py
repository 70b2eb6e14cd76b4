"""Kinds of neighbourhood: each stands for numbers that the planner has left empty.

A number that is given always counts; a preset only says what an empty one means. That holds in
the dialog, in models and on the command line alike, where nobody can tell a default from the
same number typed by hand.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from qgis.core import QgsProcessingParameterDefinition

from . import parameters
from .progress import FeedbackProgress
from .request import Request

#: Key of the parameter.
KEY = "PRESET"


@dataclass(frozen=True)
class Preset:
    """One kind of neighbourhood.

    Attributes
    ----------
    text
        What it stands for.
    values
        Numbers by the key of their parameter.
    """

    text: str
    values: Mapping[str, float]


#: The presets by their words, which saved models keep.
PRESETS = {
    "city blocks": Preset(
        "two rows of 30 m lots and a street of 12 m",
        {"BLOCK_WIDTH": 72.0, "BLOCK_LENGTH": 150.0},
    ),
    "terraced rows": Preset(
        "narrow lots, long blocks", {"BLOCK_WIDTH": 60.0, "BLOCK_LENGTH": 180.0}
    ),
    "dense grid": Preset(
        "short blocks, about those of 200 by 200 feet with streets of 60 feet in Portland",
        {"BLOCK_WIDTH": 80.0, "BLOCK_LENGTH": 80.0},
    ),
    "perimeter blocks": Preset(
        "houses around a courtyard", {"BLOCK_WIDTH": 100.0, "BLOCK_LENGTH": 140.0}
    ),
    "garden suburb": Preset(
        "deep gardens, long blocks, streets may bend",
        {"BLOCK_WIDTH": 90.0, "BLOCK_LENGTH": 240.0, "WEIGHT_STRAIGHT": 0.2},
    ),
    "campus": Preset(
        "large buildings in green, with few streets",
        {"BLOCK_WIDTH": 130.0, "BLOCK_LENGTH": 220.0},
    ),
}
DEFAULT = "city blocks"


def parameter() -> QgsProcessingParameterDefinition:
    """Declare the choice of a preset."""
    return parameters.choice(
        KEY,
        "Kind of neighbourhood",
        "Says what the numbers that are left empty are; a number that is given always counts.",
        {word: f"{preset.text} ({_figures(preset)})" for word, preset in PRESETS.items()},
        default=DEFAULT,
    )


def _figures(preset: Preset) -> str:
    block = f"{preset.values['BLOCK_WIDTH']:g} x {preset.values['BLOCK_LENGTH']:g} m"
    others = [
        f"{key.replace('_', ' ').lower()} {value:g}"
        for key, value in preset.values.items()
        if not key.startswith("BLOCK")
    ]
    return ", ".join([block, *others])


def implied(request: Request) -> Mapping[str, float]:
    """Return the numbers of the chosen preset by the keys of their parameters."""
    return PRESETS[request.word(KEY) if request.declares(KEY) else DEFAULT].values


def number(request: Request, key: str) -> float | None:
    """Return a number: as given, else as the preset says, else None."""
    given = request.optional_number(key)
    return implied(request).get(key) if given is None else given


def tell(request: Request, progress: FeedbackProgress) -> None:
    """Say in the log what the preset set, and which of its numbers were given instead."""
    used, given = [], []
    for key, value in implied(request).items():
        title = parameters.title(request.tool.parameterDefinition(key))
        (given if request.has(key) else used).append(f"{title} {value:g}")
    word = request.word(KEY)
    if used:
        progress.info(f"Preset '{word}' sets: {'; '.join(used)}.")
    if given:
        progress.info(f"Preset '{word}' would set, but other values are given: {'; '.join(given)}.")
