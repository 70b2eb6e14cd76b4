"""Street plans: the whole way from sites and a specification to streets and blocks."""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from shapely.geometry import LineString

from ..errors import CancelledError, InputError, MeshError, PlatwrightError
from ..mesh import QuadMesh, subdivide
from ..network.problem import IntArray
from ..network.specification import Specification
from ..progress import Deadline, Progress, Silent
from ..site.types import AccessPoint, Site
from .adopt import adopt_streets
from .align import Alignment, align
from .blocks import Block, blocks, reach_edge
from .fitting import block_misfit, site_meshes
from .joints import connectors, trim_ends
from .levels import LevelledNetwork, design_levels
from .make_way import make_way
from .segments import Segment, segments
from .survey import Ground, arriving_streets, survey
from .wishes import Wishes

#: Of two access points nearer than this share of the block width one is continued.
ARRIVAL_SPACING = 0.5
#: A vertex of a drawn mesh this near to an arriving street meets it (metres).
MEETS = 3.0


@dataclass(frozen=True, eq=False)
class SitePlan:
    """The street plan of one site, in its working CRS.

    Attributes
    ----------
    site
        The site.
    network
        Chosen mesh edges and how they were found.
    alignment
        Where the streets run.
    segments
        New streets between junctions.
    connectors
        Boundary vertex -> piece of street from the property line to the centre line.
    blocks
        What the streets enclose.
    arrivals
        Existing streets that could be continued.
    uncovered
        Positions of mesh vertices that no street reaches within the coverage range.
    """

    site: Site
    network: LevelledNetwork
    alignment: Alignment
    segments: tuple[Segment, ...]
    connectors: dict[int, LineString]
    blocks: tuple[Block, ...]
    arrivals: tuple[AccessPoint, ...]
    uncovered: tuple[tuple[float, float], ...]

    @property
    def continued(self) -> int:
        """How many arriving streets go on into the site."""
        level = self.network.level
        mesh = self.network.ground.mesh
        return sum(
            any(level[e] > 0 for e in mesh.vertex_edges[v]) for v in self.network.ground.arrivals
        )


@dataclass(frozen=True, eq=False)
class StreetPlan:
    """The street plans of all sites of a run.

    Attributes
    ----------
    plans
        One plan per site that could be designed.
    specification
        What was asked.
    seconds
        Wall time.
    stopped
        Why the search ended: "optimal", "gap", "time" or "cancelled".
    failures
        Sites that could not be designed, and why.
    """

    plans: tuple[SitePlan, ...]
    specification: Specification
    seconds: float
    stopped: str = field(default="optimal")
    failures: tuple[tuple[Site, PlatwrightError], ...] = ()

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


def design_streets(
    sites: Sequence[Site],
    specification: Specification,
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
        What the streets should do.
    wishes
        Sinks, required and forbidden places, or a function that gives those of a site.
    mesh
        Gives a drawn or edited mesh of a site, in its working CRS; None or a None result
        makes one.
    progress
        Told of stages and incumbents; asked for cancellation several times a second.

    Returns
    -------
    StreetPlan
        One plan per site. A cancelled run returns the best design so far.

    Raises
    ------
    InputError
        If a sink, required street or other wish contradicts the site.
    MeshError
        If a site is too small or too thin for the block width.
    InfeasibleError
        If hard rules contradict each other.

        With several sites each of these is kept in `StreetPlan.failures` and the others are
        designed; it is raised where none could be.
    CancelledError
        If the run was cancelled before there was a design.
    """
    progress = progress or Silent()
    if not sites:
        raise InputError("There is no site.", "Give at least one polygon.")
    started = time.monotonic()
    deadline = Deadline(specification.time_limit, progress)
    area = sum(site.polygon.area for site in sites)
    plans: list[SitePlan] = []
    failures: list[tuple[Site, PlatwrightError]] = []
    stopped = "optimal"
    for site in sites:
        try:
            own = wishes(site) if callable(wishes) else wishes
            own = own.of_site(site, sites) if own is not None else None
            share = deadline.left * site.polygon.area / max(area, 1e-9)
            area -= site.polygon.area
            given = mesh(site) if mesh is not None else None
            if progress.cancelled():
                raise CancelledError("Cancelled before the first design.")
            plans.append(plan_site(site, specification, own, given, max(1.0, share), progress))
        except CancelledError:
            if not plans:
                raise
            left = len(sites) - len(plans) - len(failures)
            progress.warn(f"Cancelled: {left} of {len(sites)} sites have no design.")
            stopped = "cancelled"
            break
        except PlatwrightError as error:
            if len(sites) == 1:
                raise
            # one bad site must not cost the others
            progress.warn(f"{site.name}: {error}")
            failures.append((site, error))
    if not plans and failures:
        raise failures[0][1]
    if progress.cancelled():
        stopped = "cancelled"
    order = ("cancelled", "time", "gap", "optimal")
    reasons = [stopped, *(plan.network.stopped for plan in plans)]
    return StreetPlan(
        tuple(plans),
        specification,
        time.monotonic() - started,
        min(reasons, key=order.index),
        tuple(failures),
    )


def plan_site(
    site: Site,
    spec: Specification,
    wishes: Wishes | None = None,
    mesh: QuadMesh | None = None,
    seconds: float = 30.0,
    progress: Progress | None = None,
) -> SitePlan:
    """Design the streets of one site; parameters as in `design_streets`."""
    progress = progress or Silent()
    deadline = Deadline(max(1.0, seconds), progress)
    progress.stage(f"{site.name}: candidate mesh", 0.05)
    arrivals = arriving_streets(site, ARRIVAL_SPACING * spec.block_width)
    if mesh is not None:
        meshes = [_met(mesh, arrivals)]
    else:
        required = wishes.required if wishes is not None else ()
        meshes = site_meshes(site, spec, arrivals, progress, required)
    best: tuple[float, SitePlan] | None = None
    for i, one in enumerate(meshes):
        if best is not None and deadline.passed():
            break
        left = max(1.0, deadline.left / (len(meshes) - i))
        if len(meshes) > 1:
            progress.stage(f"{site.name}: mesh {i + 1} of {len(meshes)}", 0.2 + 0.15 * i)
        try:
            plan = _plan_on(site, spec, one, arrivals, wishes, left, progress)
        except CancelledError:
            if best is None:
                raise
            break
        score = _misfit(plan, spec) if len(meshes) > 1 else 0.0
        if best is None or score < best[0] - 1e-9:
            best = score, plan
    if best is None:
        raise MeshError(f"No candidate mesh could be made of {site.name}.")
    if not best[1].segments:
        progress.warn(
            f"{site.name}: no street is needed: the site is no larger than a few blocks of "
            f"{spec.block_width:g} m x {spec.block_length:g} m. Ask for smaller blocks."
        )
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


def _plan_on(
    site: Site,
    spec: Specification,
    mesh: QuadMesh,
    arrivals: Sequence[AccessPoint],
    wishes: Wishes | None,
    seconds: float,
    progress: Progress,
) -> SitePlan:
    """Design the streets of one site on one mesh."""
    progress.stage(f"{site.name}: reading the ground", 0.3)
    required = wishes.required if wishes is not None else ()
    mesh, adopted = adopt_streets(mesh, site, required)
    mesh = make_way(mesh, site)
    ground = survey(site, mesh, spec, attracted=arrivals, wishes=wishes, adopted=adopted)
    refine = _refiner(site, spec, arrivals, wishes) if spec.rules == "paper" else None
    network = design_levels(ground, spec, seconds=seconds, refine=refine, progress=progress)
    progress.stage(f"{site.name}: drawing streets and blocks", 0.92)
    return draw_plan(network, arrivals)


def _misfit(plan: SitePlan, spec: Specification) -> float:
    """How far a plan is from what was asked; compares plans of one site on several meshes."""
    missed = 1 - plan.continued / len(plan.arrivals) if plan.arrivals else 0.0
    wrong = block_misfit(plan.blocks, spec.block_width, spec.block_length)
    return wrong + 0.4 * missed + 0.02 * len(plan.uncovered)


def draw_plan(network: LevelledNetwork, arrivals: Sequence[AccessPoint] = ()) -> SitePlan:
    """Draw the streets and blocks of a chosen network."""
    ground, level = network.ground, network.level
    directions = {v: point.direction for v, point in ground.arrivals.items()}
    mesh = ground.mesh
    kept = np.unique(mesh.edges[ground.street & ~mesh.boundary_edges]).tolist()
    alignment = align(ground.site, mesh, level, directions, kept, ground.forbidden)
    alignment = trim_ends(ground, level, alignment)
    joints = connectors(ground, level, alignment)
    lines = [LineString(line) for line in alignment.lines.values()]
    lines += [street.line for street in (*ground.site.boundary_streets, *ground.site.inner_streets)]
    lines += joints.values()
    found = blocks(ground.site, [*lines, *_edge_pieces(ground, level, alignment)])
    return SitePlan(
        ground.site,
        network,
        alignment,
        tuple(segments(ground, level, alignment)),
        joints,
        tuple(found),
        tuple(arrivals),
        _uncovered(network),
    )


def _edge_pieces(ground: Ground, level: IntArray, alignment: Alignment) -> list[LineString]:
    """Short pieces from street ends to the true outline of the site, for blocks."""
    mesh = ground.mesh
    pieces = []
    for v in np.flatnonzero(mesh.boundary_vertices).tolist():
        for e in mesh.vertex_edges[v].tolist():
            if level[e] == 0:
                continue
            line = alignment.lines[e]
            line = line if mesh.edges[e, 1] == v else line[::-1]
            piece = reach_edge(ground.site, tuple(line[-1]), tuple(line[-2]))
            if piece.length > 0:
                pieces.append(piece)
    return pieces


def _uncovered(network: LevelledNetwork) -> tuple[tuple[float, float], ...]:
    """Positions that are still without a street nearby after the last level."""
    if not network.solved:
        return ()
    vertices = {v for s in network.solved for v in s.design.uncovered}
    streets = (network.level > 0) | network.ground.street
    mesh = network.ground.mesh
    active = set(mesh.edges[streets].ravel().tolist())
    near = {
        v
        for v in vertices
        if v < len(mesh.vertices)
        and any(int(u) in active for u in mesh.edges[mesh.vertex_edges[v]].ravel())
    }
    return tuple(
        (float(x), float(y))
        for x, y in mesh.vertices[sorted(v for v in vertices - near if v < len(mesh.vertices))]
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
