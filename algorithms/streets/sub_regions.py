"""Designs the sub-regions between given streets one after the other (CND section 5.1, Fig. 3)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np
import shapely
from shapely.geometry import LineString

from ..errors import CancelledError, InfeasibleError, InputError, MeshError
from ..levels import COLLECTOR, LOCAL
from ..mesh import QuadMesh
from ..network.specification import Specification
from ..progress import Deadline, Progress, Share
from ..site.types import Site
from .blocks import block_size
from .drawing import draw_plan
from .exits import exits_used
from .fitting import edge_length
from .given_levels import ACROSS, Division, across
from .levels import LevelledNetwork
from .site_plan import SitePlan
from .survey import Ground
from .wishes import Whole, Wishes

#: A sub-region narrower than this share of the block width is a block by itself.
NARROW = 0.6
#: Length over which the direction of a street's end is taken (metres).
LAST = 5.0
#: A sub-region for which nothing of the length budget is left may build this much (metres).
LEAST_BUDGET = 0.001

Design = Callable[[Site, Specification, Wishes, float, Progress], SitePlan]


def design_parts(
    division: Division,
    spec: Specification,
    wishes: Wishes,
    design: Design,
    seconds: float,
    progress: Progress,
) -> list[SitePlan]:
    """Design every sub-region of a divided site, the largest first.

    Later ones may carry the streets of earlier ones on across a given street, and share what
    these left over of the length budget and of the exits by their area. New streets that meet a
    given one inside the site do not leave it there.

    Parameters
    ----------
    division
        The divided site.
    spec
        What the planner asks of the whole; levels that are given are not designed.
    wishes
        Sinks, required and forbidden places.
    design
        Designs one sub-region.
    seconds
        Time for all solving, shared by area.
    progress
        Told of stages and incumbents; asked for cancellation.

    Returns
    -------
    list of SitePlan
        One for each sub-region. A cancelled run leaves the rest without new streets.

    Raises
    ------
    CancelledError
        If the run was cancelled before the first sub-region had a design.
    """
    asked = part_specification(division, spec)
    _remarks(division, asked, progress)
    budget, exits = asked.length_budget, asked.exits
    deadline = Deadline(max(1.0, seconds), progress)
    whole = left = sum(part.polygon.area for part in division.parts)
    ends: list[tuple[tuple[float, float], tuple[float, float]]] = []
    plans: list[SitePlan] = []
    stopped = False
    for part in division.parts:
        size = part.polygon.area / left
        share = max(1.0, deadline.left * size)
        begin = 1 - left / whole
        asked = _with_budget(asked, budget, size)
        left -= part.polygon.area
        within = Share(progress, begin, 1 - left / whole)
        points = (*part.access_points, *across(division, part, ends))
        one = dataclasses.replace(part, access_points=points)
        most = None if exits is None else math.ceil(exits * size - 1e-9)
        own = _of_part(one, division, wishes, asked, most)
        this = asked
        if wishes.preferences.routes and not own.preferences.routes:
            this = dataclasses.replace(asked, traffic="out")  # the routes lead elsewhere
        plan = None
        if not stopped and not _one_block(one, division, asked):
            try:
                plan = design(one, this, own, share, within)
            except CancelledError:
                if not plans:
                    raise
                stopped = True
            except (MeshError, InfeasibleError, InputError) as error:
                if isinstance(error, InputError) and not plans:
                    raise
                progress.warn(f"{one.name} has no streets of its own: {error}")
        if plan is None:
            # cross streets are local streets
            given = division.deepest >= LOCAL
            plan = draw_plan(
                blank(one, stopped), asked, only_mesh=given or stopped, progress=within
            )
        budget = _left_of_budget(budget, plan)
        if exits is not None:
            exits = max(0, exits - exits_used(plan.network.ground, plan.network.level > 0))
        ends += _ends(plan)
        real = tuple(p for p in plan.arrivals if p.kind != ACROSS)
        plans.append(dataclasses.replace(plan, arrivals=real, division=division))
    return plans


def _remarks(division: Division, asked: Specification, progress: Progress) -> None:
    """Say what is not designed, or not asked for, because of the given streets."""
    if division.deepest >= LOCAL and not asked.cul_de_sacs:
        progress.warn(
            f"{division.site.name}: collectors and local streets are given, and no culs-de-sac "
            "are asked for: nothing is left to design. To keep some local streets and design "
            "the others, choose them as required streets."
        )
    if asked.traffic == "within" and len(division.parts) > 1:
        progress.warn(
            f"{division.site.name}: ways within the site are asked for inside each of its "
            f"{len(division.parts)} sub-regions; from one to another the given streets lead."
        )


def _with_budget(spec: Specification, budget: float | None, share: float) -> Specification:
    """Give a sub-region its share of what is left of the length budget."""
    if budget is None:
        return spec
    return dataclasses.replace(spec, length_budget=max(LEAST_BUDGET, budget * share))


def _left_of_budget(budget: float | None, plan: SitePlan) -> float | None:
    """Return what the streets of a sub-region leave of the length budget."""
    if budget is None:
        return None
    return budget - float(plan.network.ground.mesh.lengths[plan.network.level > 0].sum())


def part_specification(division: Division, spec: Specification) -> Specification:
    """Give what is asked of the sub-regions: only levels below the deepest given one."""
    levels = 1 if division.deepest >= COLLECTOR else spec.levels
    blind = spec.cul_de_sacs and not division.blind
    return dataclasses.replace(spec, levels=levels, cul_de_sacs=blind)


def _one_block(part: Site, division: Division, spec: Specification) -> bool:
    """Whether no network is to be designed: local streets are given, or nothing fits in."""
    width, _ = block_size(part.polygon)
    return division.deepest >= LOCAL or width < NARROW * spec.block_width


def _of_part(
    part: Site, division: Division, wishes: Wishes, spec: Specification, exits: int | None
) -> Wishes:
    """Keep what concerns a sub-region; required streets are cut at given ones."""
    own = wishes.of_site(part, [part, *(p for p in division.parts if p.polygon != part.polygon)])
    edge = shapely.buffer(part.polygon.boundary, LAST)
    least = 0.3 * edge_length(spec)
    lines: list[LineString] = []
    names: list[int | str] = []
    levels: list[int] = []
    for i, line in enumerate(own.required):
        inside = shapely.intersection(line, part.polygon)
        for piece in shapely.get_parts(inside):
            if shapely.length(shapely.difference(piece, edge)) > least:
                lines.append(piece)
                names.append(own.required_id(i))
                levels.append(own.required_level(i))
    # what only touches a sub-region belongs to the next one
    start = {level: _inside(lines, part, LAST) for level, lines in own.start.items()}
    routes = [
        (line, feature)
        for whole, feature in own.preferences.routes
        for line in _inside([whole], part, edge_length(spec))
    ]
    preferences = dataclasses.replace(own.preferences, routes=routes)
    given: dict[int, list[LineString]] = {street.level: [] for street in division.streets}
    for street in division.streets:
        given[street.level].append(street.line)
    return dataclasses.replace(
        own,
        required=lines,
        required_ids=names,
        required_levels=levels,
        preferences=preferences,
        start=start,
        given=given,
        whole=Whole(division.site.polygon.boundary, exits),
    )


def _inside(lines: Sequence[LineString], part: Site, least: float) -> list[LineString]:
    """Return the pieces of lines that lie in a sub-region and are longer than `least`."""
    found = shapely.get_parts(shapely.intersection(np.array(lines, dtype=object), part.polygon))
    return [piece for piece in found if piece.length > least]


def blank(site: Site, cancelled: bool = False) -> LevelledNetwork:
    """Return the network of a piece of ground for which no program is solved: no street.

    Its edge is a street for those who measure distances.
    """
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(site.polygon))[:4]
    ring = LineString([*corners, corners[0]])
    corners = corners if shapely.is_ccw(ring) else corners[::-1]
    size = float(np.hypot(*np.diff(corners, axis=0).T).mean())
    mesh = QuadMesh(corners, np.array([[0, 1, 2, 3]]), size)
    edges, vertices = len(mesh.edges), len(mesh.vertices)
    ground = Ground(
        site=site,
        mesh=mesh,
        street=np.ones(edges, dtype=np.bool_),
        barred=np.ones(edges, dtype=np.bool_),
        required=np.zeros(edges, dtype=np.bool_),
        sinks=np.ones(vertices, dtype=np.bool_),
        arrivals={},
        green_faces=frozenset(),
        forbidden=shapely.Polygon(),
        closed=np.zeros(edges, dtype=np.bool_),
    )
    return LevelledNetwork(ground, np.zeros(edges, dtype=np.int64), (), cancelled)


def _ends(plan: SitePlan) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Give ends of the designed streets, and unit vectors in which they would go on."""
    found = []
    for segment in plan.segments:
        for line in (segment.line, segment.line.reverse()):
            tip = shapely.get_coordinates(line)[-1]
            before = line.interpolate(max(0.0, line.length - LAST))
            step = tip - np.array([before.x, before.y])
            size = math.hypot(*step)
            if size > 0:
                way = (float(step[0]) / size, float(step[1]) / size)
                found.append(((float(tip[0]), float(tip[1])), way))
    return found
