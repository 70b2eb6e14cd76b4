"""A street plan: what was designed, for one site and for all of a run."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from shapely.geometry import LineString

from ..errors import PlatwrightError
from ..network.specification import Specification
from ..site.types import AccessPoint, Site
from .align import Alignment
from .blocks import Block
from .cross_streets import CrossStreet
from .given_levels import Division
from .joints import Connector
from .levels import LevelledNetwork
from .segments import Segment

#: A new street that begins this near to where an existing one arrives (metres), and turns from
#: it by less than this (degrees), continues it.
ARRIVES, TURNS = 15.0, 40.0


@dataclass(frozen=True, eq=False)
class SitePlan:
    """The street plan of one site, or of one sub-region of it, in its working CRS.

    Attributes
    ----------
    site
        The site; where given streets divide it, the sub-region.
    network
        Chosen mesh edges and how they were found.
    alignment
        Where the streets run.
    segments
        New streets between junctions.
    cross_streets
        Those of the new streets that are no mesh lines, see `cross_streets`.
    connectors
        Pieces of street from the property line to the centre line.
    blocks
        What the streets enclose.
    arrivals
        Existing streets that could be continued.
    uncovered
        Positions of mesh vertices that no street reaches within the coverage range.
    specification
        What was asked of this site.
    division
        How given streets divide the whole site, shared by the plans of its sub-regions; None
        where there are none.
    """

    site: Site
    network: LevelledNetwork
    alignment: Alignment
    segments: tuple[Segment, ...]
    cross_streets: tuple[CrossStreet, ...]
    connectors: tuple[Connector, ...]
    blocks: tuple[Block, ...]
    arrivals: tuple[AccessPoint, ...]
    uncovered: tuple[tuple[float, float], ...]
    specification: Specification
    division: Division | None = None

    @property
    def whole(self) -> Site:
        """The whole site."""
        return self.site if self.division is None else self.division.site

    @property
    def continued(self) -> int:
        """How many arriving streets go on into the site."""
        return len(self.arrivals) - len(self.not_continued)

    @property
    def not_continued(self) -> list[AccessPoint]:
        """Arriving streets that neither a new street nor a kept one inside carries on."""
        lines = [segment.line for segment in self.segments]
        lines += [street.line for street in self.site.inner_streets]
        return [point for point in self.arrivals if not goes_on(point, lines)]


@dataclass(frozen=True, eq=False)
class StreetPlan:
    """The street plans of all sites of a run.

    Attributes
    ----------
    plans
        One plan per site that could be designed; where given streets divide a site, one per
        sub-region, one after the other.
    specification
        What was asked, of the first site where each has its own.
    seconds
        Wall time.
    stopped
        Why the search ended: one of `network.problem.STOPS`.
    failures
        Sites that could not be designed, and why.
    """

    plans: tuple[SitePlan, ...]
    specification: Specification
    seconds: float
    stopped: str = field(default="optimal")
    failures: tuple[tuple[Site, PlatwrightError], ...] = ()

    @property
    def by_site(self) -> list[list[SitePlan]]:
        """The plans, those of the sub-regions of one site together."""
        groups: list[list[SitePlan]] = []
        for plan in self.plans:
            same = groups and plan.division is not None and groups[-1][0].whole is plan.whole
            groups = [*groups[:-1], [*groups[-1], plan]] if same else [*groups, [plan]]
        return groups

    @property
    def numbers(self) -> dict[str, float]:
        """Figures of the whole run; lengths and distances in metres, gap as a share."""
        rows = [s for plan in self.plans for s in plan.segments]
        length = sum(s.line.length for s in rows)
        mean = sum(s.mean_distance * s.line.length for s in rows) / length if length else 0.0
        objective = sum(plan.network.objective for plan in self.plans)
        bound = sum(plan.network.bound for plan in self.plans)
        return {
            "TOTAL_LENGTH": length,
            "MEAN_DISTANCE": mean,
            "MAX_DISTANCE": max((s.furthest for s in rows), default=0.0),
            "OBJECTIVE": objective,
            "BOUND": bound,
            "ACHIEVED_GAP": max(0.0, (objective - bound) / objective) if objective > 0 else 0.0,
            "SECONDS": self.seconds,
        }

    def to_json(self) -> str:
        """Specification and result as JSON, for the metadata of layers."""
        result = {
            "specification": json.loads(self.specification.to_json()),
            "result": {k: round(v, 6) for k, v in self.numbers.items()},
            "stopped": self.stopped,
        }
        return json.dumps(result, sort_keys=True)


def no_plan(
    failures: Sequence[tuple[Site, PlatwrightError]], specification: Specification
) -> StreetPlan:
    """Return the plan of a run that gave none, for the layers that tell why.

    Parameters
    ----------
    failures
        The sites without a design, and why each has none.
    specification
        What was asked.
    """
    return StreetPlan((), specification, 0.0, failures=tuple(failures))


def goes_on(point: AccessPoint, streets: Sequence[LineString]) -> bool:
    """Whether one of the streets continues the one that arrives at a point.

    Examples
    --------
    >>> arriving = AccessPoint((0.0, 0.0), (0.0, -8.0), (0.0, 1.0))
    >>> goes_on(arriving, [LineString([(3, 0), (9, 70)])])
    True
    >>> goes_on(arriving, [LineString([(3, 0), (70, 9)])])
    False
    """
    for line in streets:
        points = np.asarray(line.coords)
        for way in (points, points[::-1]):
            if math.dist(way[0], point.xy) > ARRIVES:
                continue
            ahead = LineString(way).interpolate(ARRIVES)
            step = np.array([ahead.x, ahead.y]) - way[0]
            size = float(np.hypot(*step)) or 1.0
            if float(step @ np.asarray(point.direction)) / size > math.cos(math.radians(TURNS)):
                return True
    return False
