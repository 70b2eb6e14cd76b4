"""One sub-region designed: what a worker is given, and what it gives back, as plain text."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely.geometry import LineString, Point

from ..errors import InputError
from ..network.specification import Specification
from ..progress import Progress, Silent
from ..site.types import Site
from ..streets.layers import plan_layers
from ..streets.plan import plan_site
from ..streets.site_plan import StreetPlan
from ..streets.wishes import Wishes
from .types import City, SubRegion

#: Raise this when the same task may give another result: what was stored before is not taken.
FORMAT = 1
#: Streets cross the edge only this near to a planned junction (metres).
GATE = 20.0
#: Depth of the strip along the edge that streets cross nowhere else (metres).
STRIP = 6.0
#: Windows for every 100 candidate edges, where nothing else is asked.
EFFORT = 30.0
#: Wall-clock limit of a sub-region: a search that is not ended by its work (seconds).
LONGEST = 900.0
#: What a blind end costs where a sub-region is designed once more (mesh edge lengths).
BLIND = 1.0
LOOSER = (
    "the sub-region could not be designed as asked; once more, with blind ends allowed and "
    "junctions anywhere, it could."
)
#: Name of every sub-region while it is designed: its number is no part of the result.
NAME = "the sub-region"
#: Columns of streets that are kept, beside their course.
KEPT = (
    "level",
    "status",
    "length_m",
    "dist_to_sink_m",
    "dist_start_m",
    "dist_end_m",
    "direction",
    "speed_kmh",
    "turning_m",
    "oneway",
)


@dataclass(frozen=True)
class RegionTask:
    """What a worker needs to design one sub-region.

    Attributes
    ----------
    site
        The sub-region; its access points are its planned junctions.
    specification
        What is asked; its effort and seed make the result the same everywhere.
    looser
        Whether less is asked, since the first attempt found no design: streets may end blind and
        leave the sub-region anywhere along a road. It is no part of the key: one task, one result.
    """

    site: Site
    specification: Specification
    looser: bool = False

    @property
    def key(self) -> str:
        """Everything that the result depends on, as a hash of 32 hexadecimal digits."""
        site = self.site
        told: dict[str, Any] = {
            "format": FORMAT,
            "specification": json.loads(self.specification.to_json()),
            "ground": _wkb(site.polygon),
            "frontage": _wkb(site.street_frontage),
            "beside": [_wkb(s.line) for s in site.boundary_streets],
            "inside": [_wkb(s.line) for s in site.inner_streets],
            "obstacles": [_wkb(o) for o in site.obstacles],
            "junctions": [[*p.xy, *p.direction] for p in site.access_points],
            "snap": site.snap_distance,
            "crs": site.crs.to_wkt(),
        }
        text = json.dumps(told, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:32]


def task_of(city: City, region: SubRegion, specification: Specification) -> RegionTask:
    """Return the task of a sub-region.

    Parameters
    ----------
    city
        The divided city.
    region
        One of its sub-regions.
    specification
        What is asked of the whole city. Each sub-region draws a seed of its own from the seed
        and from where it lies, so that it is the same whatever else is designed.
    """
    site = city.site(region)
    alike = dataclasses.replace(
        site, name=NAME, feature=1, site_id=1, source_crs=site.crs,
        access_points=tuple(dataclasses.replace(p, name="", kind="") for p in site.access_points),
    )  # fmt: skip
    middle = region.polygon.representative_point()
    text = f"{specification.seed} {middle.x:.0f} {middle.y:.0f}"
    seed = int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big") % (2**31 - 1)
    own = dataclasses.replace(
        specification,
        seed=seed,
        effort=specification.effort or EFFORT,
        # the search ends by its work: neither time nor a gap may end it earlier or later
        time_limit=max(LONGEST, specification.time_limit),
        gap=0.0,
        sink_mode="streets",
    )
    return RegionTask(alike, own)


def design_region(task: RegionTask, progress: Progress | None = None) -> str:
    """Design the streets of one sub-region.

    Parameters
    ----------
    task
        The sub-region and what is asked.
    progress
        Asked for cancellation.

    Returns
    -------
    str
        JSON with "streets" (their courses, metres in the working CRS, and the fields of the
        layer of streets), "remarks", "numbers" and "seconds". All but the seconds is the same for
        the same task, bit for bit, on every machine with the same packages.

    Raises
    ------
    PlatwrightError
        If there is no design.
    """
    heard = _Heard(progress or Silent())
    begun = time.perf_counter()
    spec, site = task.specification, task.site
    if task.looser:
        spec = dataclasses.replace(spec, dead_ends=BLIND)
    if not site.access_points:
        raise InputError("No junction is planned along the sub-region.", "Ask for a less spacing.")
    wishes = Wishes(forbidden=[] if task.looser else closed_strips(site))
    plan = plan_site(site, spec, wishes, seconds=spec.time_limit, progress=heard, is_part=True)
    seconds = time.perf_counter() - begun
    whole = StreetPlan((plan,), spec, seconds, plan.network.stopped)
    streets = []
    for row in plan_layers(whole)["streets"].itertuples(index=False):
        if row.status in ("new", "connector"):
            fields = {name: _plain(getattr(row, name)) for name in KEPT}
            fields["xy"] = shapely.get_coordinates(row.geometry).tolist()
            streets.append(fields)
    numbers = {k.lower(): v for k, v in whole.numbers.items() if k != "SECONDS"}
    numbers["uncovered"] = float(len(plan.uncovered))
    return json.dumps(
        {
            "streets": streets,
            "remarks": [*([LOOSER] if task.looser else []), *heard.warnings],
            "numbers": numbers,
            "by_clock": plan.network.stopped == "time",
            "seconds": round(seconds, 3),
        },
        sort_keys=True,
    )


class _Heard(Silent):
    """Keeps warnings, and asks the caller whether to go on."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self.warnings: list[str] = []

    def warn(self, text: str) -> None:
        """Keep the warning, once."""
        if text not in self.warnings:
            self.warnings.append(text)

    def cancelled(self) -> bool:
        """Ask the caller."""
        return self._progress.cancelled()


def closed_strips(site: Site) -> list[shapely.Geometry]:
    """Return strips along the roads of a sub-region that no street crosses.

    They have gates at the planned junctions, so that streets leave nowhere else.

    Parameters
    ----------
    site
        A sub-region.
    """
    edge = site.polygon.boundary
    band = shapely.buffer(site.street_frontage, STRIP, cap_style="flat")
    inside = shapely.intersection(band, shapely.difference(site.polygon, shapely.buffer(edge, 0.5)))
    gates = shapely.buffer(shapely.points(site.access_xy), GATE)
    left = shapely.difference(inside, shapely.union_all(gates))
    return [part for part in shapely.get_parts(left) if part.area > 1.0]


def ends_at_edge(site: Site, streets: list[dict[str, Any]]) -> list[tuple[int, int]]:
    """Return which ends of streets lie on the edge of a sub-region.

    Parameters
    ----------
    site
        The sub-region.
    streets
        Streets as in the result of `design_region`.

    Returns
    -------
    list of (int, int)
        Number of the street in the list; 0 for its first point, -1 for its last.
    """
    edge = shapely.buffer(site.polygon.boundary, 0.25)
    shapely.prepare(edge)
    found = []
    for i, street in enumerate(streets):
        for end in (0, -1):
            if shapely.intersects(edge, Point(street["xy"][end])):
                found.append((i, end))
    return found


def line_of(street: dict[str, Any]) -> LineString:
    """Return the course of a street."""
    return LineString(np.asarray(street["xy"], dtype=float))


def _plain(value: Any) -> Any:
    """Return a field as JSON knows it; what is missing is null."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return None
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and math.isnan(value) else value


def _wkb(geometry: shapely.Geometry) -> str:
    """Return a geometry as text without rounding."""
    return str(shapely.to_wkb(geometry, hex=True))
