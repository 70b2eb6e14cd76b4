"""Street plans: the whole way from sites and a specification to streets and blocks."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence

import numpy as np

from ..errors import CancelledError, InfeasibleError, InputError, MeshError, PlatwrightError
from ..mesh import QuadMesh, subdivide
from ..network.problem import STOPS, IntArray
from ..network.specification import FORBID, Specification
from ..progress import Deadline, Held, Progress, Share, Silent
from ..site.types import AccessPoint, BoundaryStreet, Site
from .adopt import adopt_streets
from .drawing import draw_plan
from .earlier import check_start, mesh_of_start
from .fitting import (
    GOOD_ENOUGH,
    edge_length,
    mesh_choices,
    plan_misfit,
    same_mesh,
    street_misfit,
)
from .given_levels import divide
from .levels import LevelledNetwork, design_levels
from .limits import or_limits, why_blind
from .make_way import make_way
from .site_plan import SitePlan, StreetPlan
from .sub_regions import design_parts
from .survey import Ground, arriving_streets, survey
from .why_not import is_proven, no_design, rank
from .wishes import Wishes

#: Of two access points nearer than this share of the block width one is continued.
ARRIVAL_SPACING = 0.5
#: A site of more than this many blocks is not left without any street; what an end that is blind
#: then costs (mesh edge lengths).
LARGE, CUL_DE_SAC_PRICE = 3.0, 1.0
#: Largest site, in squares of the edge length of its mesh.
MOST_CELLS = 1500.0
#: Where roads run along less than this share of the edge, the planner is told.
FEW_ROADS = 0.4
#: A vertex of a drawn mesh this near to an arriving street meets it (metres).
MEETS = 3.0


def design_streets(
    sites: Sequence[Site],
    specification: Specification | Callable[[Site], Specification],
    *,
    wishes: Wishes | Callable[[Site], Wishes] | None = None,
    mesh: Callable[[Site], QuadMesh | None] | None = None,
    progress: Progress | None = None,
) -> StreetPlan:
    """Design the streets of sites.

    Parameters
    ----------
    sites
        Prepared sites.
    specification
        What the streets should do, or a function that gives the specification of a site; the
        time limit is that of the first, for all sites together.
    wishes
        Sinks, required and forbidden places and given streets, or a function that gives those
        of a site.
    mesh
        Gives a drawn or edited mesh of a site, in its working CRS; None or a None result
        makes one.
    progress
        Told of stages and incumbents; asked for cancellation several times a second.

    Returns
    -------
    StreetPlan
        One plan per site, or per sub-region where given streets divide a site. A cancelled run
        returns the best design so far.

    Raises
    ------
    InputError
        If a sink, required street or other wish contradicts the site.
    MeshError
        If a site is too small or too thin for the block width.
    InfeasibleError
        If hard rules contradict each other.

        With several sites each of these is kept in `StreetPlan.failures` and the others are
        designed; it is raised where none could be: as a `NoDesignError` with the failures of all
        sites where one of them has places to show.
    CancelledError
        If the run was cancelled before there was a design.
    """
    progress = progress or Silent()
    if not sites:
        raise InputError("There is no site.", "Give at least one polygon.")
    started = time.monotonic()
    specs = [specification(s) if callable(specification) else specification for s in sites]
    run = _Run(sites, specs, wishes, mesh, progress)
    run.design()
    if not run.plans and run.failures:
        raise no_design(run.failures)
    if progress.cancelled():
        run.stopped = "cancelled"
    reasons = [run.stopped, *(plan.network.stopped for plan in run.plans)]
    return StreetPlan(
        tuple(run.plans),
        specs[0],
        time.monotonic() - started,
        min(reasons, key=STOPS.index),
        tuple(run.failures),
    )


class _Run:
    """Designs site after site; one bad site must not cost the others."""

    def __init__(
        self,
        sites: Sequence[Site],
        specs: Sequence[Specification],
        wishes: Wishes | Callable[[Site], Wishes] | None,
        mesh: Callable[[Site], QuadMesh | None] | None,
        progress: Progress,
    ) -> None:
        self.sites, self.specs = sites, specs
        self.wishes, self.mesh, self.progress = wishes, mesh, progress
        self.plans: list[SitePlan] = []
        self.failures: list[tuple[Site, PlatwrightError]] = []
        self.stopped = "optimal"

    def design(self) -> None:
        """Design all sites; each gets its share of the time by its area."""
        deadline = Deadline(self.specs[0].time_limit, self.progress)
        whole = area = sum(site.polygon.area for site in self.sites)
        for i, (site, spec) in enumerate(zip(self.sites, self.specs)):
            seconds = max(1.0, deadline.left * site.polygon.area / area)
            begin = 1 - area / whole
            area -= site.polygon.area
            part = Share(self.progress, begin, 1 - area / whole)
            try:
                self.plans += self._one(site, spec, seconds, part)
            except CancelledError:
                if not self.plans:
                    raise
                left = len(self.sites) - i
                self.progress.warn(f"Cancelled: {left} of {len(self.sites)} sites have no design.")
                self.stopped = "cancelled"
                return
            except PlatwrightError as error:
                self.failures.append((site, error))
                if len(self.sites) > 1:
                    self.progress.warn(f"{site.name}: {error}")

    def _one(
        self, site: Site, spec: Specification, seconds: float, progress: Progress
    ) -> list[SitePlan]:
        own = self.wishes(site) if callable(self.wishes) else self.wishes
        own = own.of_site(site, self.sites) if own is not None else None
        mesh = self.mesh(site) if self.mesh is not None else None
        if own is not None and any(own.given.values()):
            plans = _by_parts(site, spec, own, mesh, seconds, progress)
            if plans:
                return plans
        share = site.street_frontage.length / site.polygon.exterior.length
        if spec.sink_mode == "streets" and share < FEW_ROADS:
            progress.warn(
                f"{site.name}: roads run along {100 * share:.0f} % of its edge only, and streets "
                "leave the site only there. If they may end at its other sides, too, let the "
                "whole boundary be the exit; if roads there were missed, raise the snap distance."
            )
        if self.progress.cancelled():
            raise CancelledError("Cancelled before the first design.")
        _check_size(site, spec)
        return [plan_site(site, spec, own, mesh, seconds, progress)]


def _by_parts(
    site: Site,
    spec: Specification,
    wishes: Wishes,
    mesh: QuadMesh | None,
    seconds: float,
    progress: Progress,
) -> list[SitePlan]:
    """Design the sub-regions between given streets; nothing where none lies in the site."""
    division = divide(site, wishes, progress)
    if division is None:
        progress.warn(f"{site.name}: no given street lies in it; all levels are designed.")
        return []
    if mesh is not None:
        # its lines are where they were drawn: the given streets are streets inside
        kept = tuple(BoundaryStreet(street.line) for street in division.streets)
        whole = dataclasses.replace(site, inner_streets=(*site.inner_streets, *kept))
        division = dataclasses.replace(division, parts=(whole,))

    def design(
        part: Site, asked: Specification, own: Wishes, time: float, told: Progress
    ) -> SitePlan:
        if told.cancelled():
            raise CancelledError("Cancelled before the first design.")
        _check_size(part, asked)
        return plan_site(part, asked, own, mesh, time, told, is_part=True)

    return design_parts(division, spec, wishes, design, seconds, progress)


def _check_size(site: Site, spec: Specification) -> None:
    """Refuse what would take hours: a whole municipality is no neighbourhood."""
    most = MOST_CELLS * edge_length(spec) ** 2
    if site.polygon.area > most:
        raise InputError(
            f"The site covers {site.area_ha:.0f} ha; streets are designed for up to "
            f"{most / 1e4:.0f} ha at once.",
            "See whether the right polygon is chosen, split it, or ask for larger blocks.",
            layer=site.name,
            feature=site.feature,
        )


def plan_site(
    site: Site,
    spec: Specification,
    wishes: Wishes | None = None,
    mesh: QuadMesh | None = None,
    seconds: float = 30.0,
    progress: Progress | None = None,
    *,
    is_part: bool = False,
) -> SitePlan:
    """Design the streets of one site; parameters as in `design_streets`.

    A sub-region of a site may do without streets: then nothing is said of it.
    """
    progress = progress or Silent()
    deadline = Deadline(max(1.0, seconds), progress)
    plan = _best_plan(site, spec, wishes, mesh, deadline, progress)
    if plan.network.level.any():
        return plan
    if progress.cancelled() and not plan.segments:
        # There may be streets yet: nothing is said of why there are none.
        raise CancelledError("Cancelled before the first design.")
    if site.polygon.area <= LARGE * spec.block_width * spec.block_length:
        if not plan.segments and not is_part:
            progress.warn(
                f"{site.name}: no street is needed: the site is no larger than a few blocks of "
                f"{spec.block_width:g} m x {spec.block_length:g} m. Ask for smaller blocks."
            )
        return plan
    if spec.dead_ends == FORBID and not progress.cancelled():
        again = dataclasses.replace(spec, dead_ends=CUL_DE_SAC_PRICE)
        try:
            other = _best_plan(site, again, wishes, mesh, deadline, progress)
        except CancelledError:
            if not plan.segments:
                raise
            return plan
        plan = other if other.network.level.any() else plan
    if plan.segments:
        progress.warn(
            f"{site.name}: no street leads through, {why_blind(spec)}. Streets that "
            "end blind are allowed instead, as culs-de-sac."
        )
    else:
        progress.warn(
            f"{site.name}: no street can be designed: obstacles, or sides without a road, cut "
            f"the site off{or_limits(spec)}. Take obstacles out that may be crossed, add roads, "
            "raise the snap distance, or let the whole boundary be the exit."
        )
    return plan


def _best_plan(
    site: Site,
    spec: Specification,
    wishes: Wishes | None,
    mesh: QuadMesh | None,
    deadline: Deadline,
    progress: Progress,
) -> SitePlan:
    """Design the streets on several meshes, or the given one, and keep the best plan."""
    arrivals = arriving_streets(site, ARRIVAL_SPACING * spec.block_width)
    held = Held(progress)  # nobody needs to hear of meshes that are not taken
    if mesh is not None:
        given = _met(mesh, arrivals)
        choices: list[Callable[[], QuadMesh]] = [lambda: given]
    else:
        own = wishes or Wishes()
        exits = own.sinks if spec.sink_mode == "points" else ()
        choices = mesh_choices(site, spec, arrivals, held, own.required, exits)
    earlier = [line for own in wishes.start.values() for line in own] if wishes else []
    if wishes is not None and earlier:
        check_start(site, earlier, wishes.start_layer)
        choices = [mesh_of_start(choices, earlier)]
    tried: list[QuadMesh] = []
    best: tuple[float, SitePlan] | None = None
    kept, failures = list[str](), list[Exception]()
    for i, make in enumerate(choices):
        if best is not None and (best[0] < GOOD_ENOUGH or deadline.passed()):
            break
        held.take()
        part = Share(held, i / len(choices), (i + 1) / len(choices))
        left = max(1.0, deadline.left / (len(choices) - i))
        try:
            which = f" {i + 1} of at most {len(choices)}" if len(choices) > 1 else ""
            part.stage(f"{site.name}: candidate mesh{which}", 0.05)
            one = make()
            if any(same_mesh(one, other) for other in tried):
                continue
            tried.append(one)
            network = _network_on(site, spec, one, arrivals, wishes, left, part)
            part.stage(f"{site.name}: drawing streets and blocks", 0.92)
            plan = draw_plan(network, spec, arrivals, only_mesh=mesh is not None, progress=part)
        except (MeshError, InfeasibleError, InputError) as error:
            # what cannot be had on this mesh may be had on another, but hardly on a third
            failures.append(error)
            if best is None and (deadline.passed() or sum(map(is_proven, failures)) > 1):
                break
            continue
        except CancelledError:
            if best is None:
                raise
            break
        score = _misfit(plan, spec)
        if best is None or score < best[0] - 1e-9:
            best, kept = (score, plan), held.take()
    for text in held.take() if best is None else kept:
        progress.warn(text)
    if best is None:
        if not failures:
            raise MeshError(f"No candidate mesh could be made of {site.name}.")
        raise min(failures, key=rank)
    return best[1]


def _met(mesh: QuadMesh, arrivals: Sequence[AccessPoint]) -> QuadMesh:
    """Tell which arriving streets the vertices of a given mesh meet."""
    edge = np.flatnonzero(mesh.boundary_vertices & (mesh.valences > 2))
    attracted = dict(mesh.attracted)
    for i, point in enumerate(arrivals):
        gaps = np.hypot(*(mesh.vertices[edge] - point.xy).T)
        v = int(edge[gaps.argmin()]) if len(edge) else -1
        if v >= 0 and gaps.min() < MEETS and v not in attracted:
            attracted[v] = i
    return dataclasses.replace(mesh, attracted=attracted)


def _network_on(
    site: Site,
    spec: Specification,
    mesh: QuadMesh,
    arrivals: Sequence[AccessPoint],
    wishes: Wishes | None,
    seconds: float,
    progress: Progress,
) -> LevelledNetwork:
    """Choose the streets of one site on one mesh."""
    progress.stage(f"{site.name}: reading the ground", 0.3)
    required = wishes.required if wishes is not None else ()
    mesh, adopted = adopt_streets(mesh, site, required)
    mesh = make_way(mesh, site)
    ground = survey(site, mesh, spec, attracted=arrivals, wishes=wishes, adopted=adopted)
    refine = _refiner(site, spec, arrivals, wishes) if spec.rules == "paper" else None
    return design_levels(ground, spec, seconds=seconds, refine=refine, progress=progress)


def _misfit(plan: SitePlan, spec: Specification) -> float:
    """How far a plan is from what was asked."""
    missed = 1 - plan.continued / len(plan.arrivals) if plan.arrivals else 0.0
    drawn = plan.alignment
    streets = [drawn.positions[way] for way in drawn.chains]
    streets += [np.asarray(street.line.coords) for street in plan.cross_streets]
    return plan_misfit(plan.blocks, spec, missed, len(plan.uncovered)) + street_misfit(
        streets, plan.site.polygon.area, spec
    )


def _refiner(
    site: Site, spec: Specification, arrivals: Sequence[AccessPoint], wishes: Wishes | None
) -> Callable[[Ground, IntArray], tuple[Ground, IntArray]]:
    """Make the step to the mesh of half the edge length (CND section 5.1, Fig. 3)."""

    def refine(ground: Ground, level: IntArray) -> tuple[Ground, IntArray]:
        fine = subdivide(ground.mesh, site.polygon)
        kept = ground.street & ~ground.mesh.boundary_edges
        adopted = np.where(fine.parent_edges >= 0, kept[fine.parent_edges], False)
        finer = survey(site, fine, spec, attracted=arrivals, wishes=wishes, adopted=adopted)
        children = np.where(fine.parent_edges >= 0, level[fine.parent_edges], 0)
        # a street that was chosen on the coarse mesh is one, whatever the finer one sees
        barred = finer.barred & (children == 0)
        return dataclasses.replace(finer, barred=barred), children

    return refine
