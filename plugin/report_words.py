"""What the keys of stored specifications are called, where no input of the tool has that name.

The tools store what they ask of the library, whose words differ here and there from those of
their inputs. A test holds the usual values against the library.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from qgis.core import QgsProcessingAlgorithm

from ..algorithms.report import InputFacts
from . import parameters

_PARCELS = {
    "width": "PARCEL_WIDTH",
    "depth": "PARCEL_DEPTH",
    "deep": "DEEP_BLOCKS",
}
#: Inputs under another name, by tool and key.
INPUTS: Mapping[str, Mapping[str, str]] = {
    "parcelblocks": _PARCELS,
    "optimiselayout": _PARCELS,
    "resplitlayout": _PARCELS,
    "splitsite": {**_PARCELS, "max_block_length": "BLOCK_LENGTH", "field_kind": "FIELD"},
    "layoutresidential": {
        "green": "GREEN_RATIO",
        "setback_m": "SETBACK",
        "gap_m": "GAP",
        "group_m": "GROUP",
        "path_m": "PATH_WIDTH",
        "tree_spacing_m": "TREE_SPACING",
    },
    "growstreets": {"people_per_metre": "PEOPLE"},
}
#: What has no input at all.
TITLES: Mapping[str, str] = {
    "cul_de_sac_length": "Longest cul-de-sac (m)",
    "turning_radius": "Radius of turning circles (m)",
    "gap": "Gap to stop at",
    "links": "Through routes",
    "level_settings": "Settings of levels",
    "step_m": "Distance of places that are tried (m)",
}
#: Usual values of the library, by tool and key, where those of the inputs are told in other words.
USUAL: Mapping[str, Mapping[str, Any]] = {
    "designstreets": {
        "branches": 0.0,
        "coverage_unit": "edges",
        "cul_de_sac_length": 150.0,
        "dead_ends": "forbid",
        "detour": 2.0,
        "gap": 0.01,
        "levels": 2,
        "one_way": "none",
        "rules": "planner",
        "sink_mode": "streets",
        "slope_weight": 1.0,
        "solver": "auto",
        "t_junctions": 0.0,
        "traffic": "out",
        "turning_radius": 9.0,
        "weight_distance": 0.0,
        "weight_length": 1.0,
    },
    "parcelblocks": {
        "min_frontage": 6.0,
        "corner_width": 1.0,
        "remainder": "redistribute",
        "deep": "court",
        "method": "strips",
        "lane_width": 6.0,
        "flag_width": 4.0,
        "greens": True,
    },
}


def inputs_of(tool: QgsProcessingAlgorithm) -> dict[str, InputFacts]:
    """Return what each key of the specifications of a tool is called, and its usual value."""
    name = tool.name()
    found = {key: InputFacts(title) for key, title in TITLES.items()}
    for own in tool.parameterDefinitions():
        if not own.isDestination():
            facts = InputFacts(parameters.title(own), own.defaultValue())
            found[own.name().lower()] = facts
    for key, parameter in INPUTS.get(name, {}).items():
        if parameter.lower() in found:
            found[key] = found[parameter.lower()]
    for key, value in USUAL.get(name, {}).items():
        if key in found:
            found[key] = InputFacts(found[key].title, value)
    return found
