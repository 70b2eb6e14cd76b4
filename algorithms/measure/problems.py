"""Problems found in a street network, and how they become a layer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import geopandas as gpd
import shapely
from pyproj import CRS

ERROR = "error"
WARNING = "warning"


@dataclass(frozen=True)
class Problem:
    """One violation of a rule, or one thing that makes a street layer doubtful.

    Attributes
    ----------
    kind
        Short name of the rule, such as "dead end".
    text
        What is wrong, as a sentence with numbers and units.
    geometry
        Where, in the working CRS.
    features
        Ids of the streets concerned.
    severity
        "error" counts as a violation, "warning" does not.
    """

    kind: str
    text: str
    geometry: shapely.Geometry
    features: tuple[str, ...] = ()
    severity: str = ERROR


@dataclass(frozen=True, eq=False)
class ValidationReport:
    """What `validate_network` found.

    Attributes
    ----------
    problems
        One row per problem in the CRS of the streets: kind, severity ("error" or "warning"),
        text, feature (ids of the streets concerned, separated by commas) and geometry.
    numbers
        TOTAL_LENGTH, MEAN_DISTANCE and MAX_DISTANCE of the designed streets in metres,
        VIOLATIONS (problems of severity "error"), and the count of each kind, such as
        DEAD_END, whatever its weight.
    """

    problems: gpd.GeoDataFrame
    numbers: dict[str, float] = field(default_factory=dict)

    @property
    def violations(self) -> int:
        """Number of problems of severity "error"."""
        return int((self.problems["severity"] == ERROR).sum())


def weighted(problems: Sequence[Problem], weight: float) -> list[Problem]:
    """Give problems the severity that a rule's weight means.

    Parameters
    ----------
    problems
        All violations of one rule.
    weight
        Infinite: errors; positive: warnings; 0: the rule is off and nothing is left.
    """
    if weight <= 0:
        return []
    severity = ERROR if math.isinf(weight) else WARNING
    return [Problem(p.kind, p.text, p.geometry, p.features, severity) for p in problems]


def problem_layer(problems: Sequence[Problem], crs: CRS, target: CRS) -> gpd.GeoDataFrame:
    """Make a layer of problems.

    Parameters
    ----------
    problems
        Any number.
    crs, target
        CRS of their geometry and of the layer.
    """
    columns = {
        "kind": [p.kind for p in problems],
        "severity": [p.severity for p in problems],
        "text": [p.text for p in problems],
        "feature": [", ".join(p.features) for p in problems],
    }
    frame = gpd.GeoDataFrame(columns, geometry=[p.geometry for p in problems], crs=crs)
    return frame.to_crs(target) if len(frame) else frame.set_crs(target, allow_override=True)
