"""From the ground and the specification to the network problem of one street level.

Two rule sets. With the planner's rules the cells of the mesh are as wide as a block, so that
mesh lines are where streets belong; rules say which of them may be left out. With the rules as
in the paper (CND section 4) a finer mesh, coverage and local rules decide alone.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from ..levels import COLLECTOR, CUL_DE_SAC, LOCAL
from ..network import rules
from ..network.coverage import Range, coverage_balls
from ..network.problem import BoolArray, Clause, FloatArray, NetworkProblem, Pattern
from ..network.specification import FORBID, Specification
from .preferences import coverage_ranges
from .survey import Ground

#: Rules as in the paper: coverage of each level in edges of its mesh, and what a vertex without
#: it costs. Cells of the culs-de-sac are so small that a place is worth two of them, no more.
RANGES = {COLLECTOR: 2.0, LOCAL: 1.0}
UNCOVERED = {COLLECTOR: 100.0, LOCAL: 100.0, CUL_DE_SAC: 2.0}
#: What the blind end of a cul-de-sac costs: little, since a ring would be worse (mesh edges).
BLIND_END = 0.5
#: Ground further than this from every street needs a cul-de-sac (share of the block width): half
#: a block, and a bit for blocks that are a little too wide.
DEEP = 0.55
#: From this many block widths of coverage range on, blocks may be any size.
SPARSE = 1.25
#: A strip between a street and a wall is of no use below this share of the block width, and the
#: street then counts this many times its length.
THIN_STRIP, ALONG_WALL = 0.5, 2.5


@dataclass(frozen=True)
class LevelRules:
    """Weights of the planner's rules at one level, per mesh edge length.

    Penalties are what a street of that many cells would cost: a vertex without cover is worth
    building eight cells of street, and no more: rather a place that is reported than a ring
    of streets for one plot.
    """

    end: float
    bend: float
    kink: float
    carry_on: float
    too_close: float
    zigzag: float
    cover_penalty: float = 8.0
    width_penalty: float = 5.0
    small_block: float = 4.0


PLANNER = {
    COLLECTOR: LevelRules(
        end=0.8,
        bend=2.5,
        kink=0.5,
        carry_on=3.0,
        too_close=6.0,
        zigzag=5.0,
        cover_penalty=3.0,
    ),
    LOCAL: LevelRules(end=0.25, bend=1.6, kink=0.3, carry_on=3.0, too_close=0.0, zigzag=3.0),
}


@dataclass(frozen=True, eq=False)
class _Streets:
    """Which edges and vertices of a level are streets, may be, must be, and lead out."""

    existing: BoolArray
    candidate: BoolArray
    required: BoolArray
    sinks: BoolArray
    active: BoolArray


def asked_at(spec: Specification, level: int) -> Specification:
    """Give the specification of a level.

    Culs-de-sac have a coverage of their own, and may end blind for a small price.
    """
    asked, own = spec.at_level(level), spec.level_settings.get(level)
    if level != CUL_DE_SAC:
        return asked
    if own is None or own.dead_ends is None:
        asked = dataclasses.replace(asked, dead_ends=BLIND_END)
    if own is None or own.coverage is None:
        reach = DEEP * spec.block_width
        asked = dataclasses.replace(asked, coverage=reach, coverage_unit="metres")
    return asked


def level_problem(
    ground: Ground, spec: Specification, level: int, above: BoolArray
) -> NetworkProblem:
    """Build the network problem of one level, given the streets of the levels above.

    Parameters
    ----------
    ground
        What every edge of the mesh is.
    spec
        What the planner asks.
    level
        `COLLECTOR`, `LOCAL` or, with the rules as in the paper, `CUL_DE_SAC`.
    above
        Shape (e,). Streets designed already.
    """
    mesh, spec = ground.mesh, asked_at(spec, level)
    existing = ground.street | above
    sinks = ground.sinks.copy()
    if above.any() and spec.sink_mode in ("streets", "boundary"):
        # whoever reaches a street of the level above has arrived (CND section 5.1)
        sinks[mesh.edges[above].ravel()] = True
    candidate = prune_dead_ends(ground, spec, ground.free & ~existing, existing, sinks)
    required = ground.required_at(level) & ~existing
    candidate |= required
    active = np.zeros(len(mesh.vertices), dtype=np.bool_)
    active[mesh.edges[existing].ravel()] = True
    streets = _Streets(existing, candidate, required, sinks, active)
    if spec.rules == "paper":
        return _paper(ground, spec, level, streets)
    return _planner(ground, spec, level, streets)


def _planner(ground: Ground, spec: Specification, level: int, streets: _Streets) -> NetworkProblem:
    """Apply the planner's rules on a mesh whose cells are as wide as a block."""
    mesh, weights = ground.mesh, PLANNER[level]
    existing, candidate = streets.existing, streets.candidate
    usable = existing | candidate
    final = level == LOCAL or spec.levels == 1
    patterns = rules.straightness(
        mesh,
        usable,
        candidate,
        end_weight=weights.end if spec.weight_straight is None else spec.weight_straight,
        bend_weight=weights.bend if spec.weight_straight is None else spec.weight_straight,
        kink_weight=weights.kink,
    )
    directions = {v: point.direction for v, point in ground.arrivals.items()}
    carry_on = weights.carry_on if spec.weight_continue is None else spec.weight_continue
    clauses = rules.continuations(mesh, directions, candidate, carry_on) if carry_on else []
    if final:
        patterns += rules.small_blocks(
            mesh, usable, candidate, spec.block_width, weights.small_block
        )
        clauses += _block_clauses(ground, spec, usable, weights)
    else:
        longest = 1.1 * max(spec.block_length, 3 * mesh.edge_length)
        clauses += rules.block_length_windows(mesh, usable, longest, 5.0)
    return _problem(
        ground,
        spec,
        streets,
        cover_radius=1.0 if spec.coverage is None else spec.coverage,
        cover_penalty=weights.cover_penalty,
        too_close=weights.too_close if spec.too_close is None else spec.too_close,
        zigzags=weights.zigzag if spec.zigzags is None else spec.zigzags,
        patterns=patterns,
        clauses=_open(clauses, existing),
        edge_factor=along_walls(ground, spec.block_width),
        main=level == COLLECTOR,
    )


def along_walls(ground: Ground, width: float) -> FloatArray:
    """Price streets that run along a wall at less than half a block width.

    Between the street and the wall no house fits: it serves one side only, and the strip is
    of no use.

    Parameters
    ----------
    ground
        The ground.
    width
        Wished block width in metres.

    Returns
    -------
    numpy.ndarray
        Shape (e,). Factors of the length.
    """
    mesh = ground.mesh
    factor = np.ones(len(mesh.edges))
    sides = mesh.lengths[mesh.face_edges]
    wall = ground.walls[mesh.face_edges]
    for k in range(4):
        # the sides next to side k lead from it to the one opposite
        across = (sides[:, (k + 1) % 4] + sides[:, (k + 3) % 4]) / 2
        strip = wall[:, (k + 2) % 4] & (across < THIN_STRIP * width)
        factor[mesh.face_edges[strip, k]] = ALONG_WALL
    return factor


def _block_clauses(
    ground: Ground,
    spec: Specification,
    usable: BoolArray,
    weights: LevelRules,
) -> list[Clause]:
    """Blocks one cell wide and no longer than asked; the longer, the dearer."""
    mesh = ground.mesh
    wide = sparse_vertices(ground, spec.block_width)
    clauses: list[Clause] = []
    for factor, penalty in ((1.0, 0.9), (1.12, 2.5), (1.35, 8.0)):
        clauses += rules.block_length_windows(mesh, usable, factor * spec.block_length, penalty)
    if wide.any():
        clauses = [c for c in clauses if not wide[mesh.edges[list(c.edges)]].all()]
    clauses += rules.block_width_corners(
        mesh,
        usable,
        ground.closed & ~usable,
        spec.block_width,
        weights.width_penalty,
        ground.green_faces | set(np.flatnonzero(wide[mesh.faces].all(axis=1)).tolist()),
    )
    return clauses


def sparse_vertices(ground: Ground, width: float) -> BoolArray:
    """Mark the vertices in areas that are to be less dense: blocks there may be any size.

    Parameters
    ----------
    ground
        The site, its mesh and the areas with a density of their own.
    width
        Wished block width in metres.

    Returns
    -------
    numpy.ndarray
        Shape (n,).
    """
    if not ground.preferences.density:
        return np.zeros(len(ground.mesh.vertices), dtype=np.bool_)
    return coverage_ranges(ground.mesh, width, ground.preferences.density) > SPARSE * width


def _paper(ground: Ground, spec: Specification, level: int, streets: _Streets) -> NetworkProblem:
    """Apply the rules of CND section 4: coverage, local rules, length and distance."""
    radius = spec.coverage
    if radius is None:
        radius = RANGES[level]
    return _problem(
        ground,
        spec,
        streets,
        cover_radius=radius,
        cover_penalty=UNCOVERED[level],
        too_close=FORBID if spec.too_close is None else spec.too_close,
        zigzags=5.0 if spec.zigzags is None else spec.zigzags,
        patterns=[],
        clauses=[],
        edge_factor=np.ones(len(ground.mesh.edges)),
        main=level == COLLECTOR,
    )


def _problem(
    ground: Ground,
    spec: Specification,
    streets: _Streets,
    *,
    cover_radius: float,
    cover_penalty: float,
    too_close: float,
    zigzags: float,
    patterns: list[Pattern],
    clauses: list[Clause],
    edge_factor: FloatArray,
    main: bool,
) -> NetworkProblem:
    """Fill in what both rule sets share."""
    mesh = ground.mesh
    ranges = cover_ranges(ground, spec, cover_radius, main=main)
    able = np.zeros(len(mesh.vertices), dtype=np.bool_)
    able[mesh.edges[streets.candidate].ravel()] = True
    balls = coverage_balls(mesh, needs_cover(ground), streets.active, **ranges)
    cover = {v: tuple(u for u in ball if able[u]) for v, ball in balls.items()}
    return NetworkProblem(
        mesh=mesh,
        existing=streets.existing,
        candidate=streets.candidate,
        sinks=streets.sinks,
        length=mesh.lengths / mesh.edge_length,
        required=streets.required,
        edge_factor=edge_factor if ground.prices is None else edge_factor * ground.prices,
        weight_length=spec.weight_length,
        weight_distance=spec.weight_distance,
        cover={v: ball for v, ball in cover.items() if ball},
        cover_radius=round(cover_radius) if "edges" in ranges else None,
        cover_penalty=cover_penalty,
        dead_ends=spec.dead_ends,
        branches=spec.branches,
        zigzags=zigzags,
        too_close=too_close,
        t_junctions=spec.t_junctions,
        patterns=tuple(patterns),
        clauses=tuple(clauses),
    )


def cover_ranges(
    ground: Ground, spec: Specification, radius: float, *, main: bool = False
) -> dict[str, Range]:
    """Return the coverage range as `coverage_balls` takes it.

    Where the density differs by area the range is metric everywhere.

    Parameters
    ----------
    ground
        The site, its mesh and the areas with a density of their own.
    spec
        Says in what the range is measured.
    radius
        The range that holds where no area has its own, in the unit of the specification, or in
        mesh edges where that gives none.
    main
        Whether streets of a main level are designed: the streets between them make an area dense,
        so its own range counts where it is the wider one only.
    """
    unit = spec.coverage_unit if spec.coverage is not None else "edges"
    density = ground.preferences.density
    if not density:
        return {unit: radius}
    metres = radius * ground.mesh.edge_length if unit == "edges" else radius
    own = "metres" if unit == "edges" else unit
    ranges = coverage_ranges(ground.mesh, metres, density)
    return {own: np.maximum(ranges, metres) if main else ranges}


def _open(clauses: list[Clause], existing: BoolArray) -> list[Clause]:
    """Leave out clauses that existing streets satisfy already."""
    return [c for c in clauses if not any(existing[e] for e in c.edges)]


def needs_cover(ground: Ground) -> list[int]:
    """Vertices from which a street must be near: not at walls, in tips or on obstacles.

    At a wall there is nobody on the other side; in a tip (a corner vertex with no inner edge
    of its own) the streets along both sides are near enough.
    """
    mesh = ground.mesh
    skip = np.zeros(len(mesh.vertices), dtype=np.bool_)
    skip[mesh.edges[ground.walls].ravel()] = True
    skip |= mesh.boundary_vertices & (mesh.valences == 2)
    green = np.zeros(len(mesh.vertices), dtype=np.int64)
    faces_at = np.bincount(mesh.faces.ravel(), minlength=len(green))
    if ground.green_faces:
        green = np.bincount(mesh.faces[sorted(ground.green_faces)].ravel(), minlength=len(green))
    skip |= green == faces_at
    return [int(v) for v in np.flatnonzero(~skip)]


def prune_dead_ends(
    ground: Ground,
    spec: Specification,
    candidate: BoolArray,
    existing: BoolArray,
    sinks: BoolArray,
) -> BoolArray:
    """Take out candidate edges that could only be dead ends, where these are forbidden."""
    keep = candidate.copy()
    if spec.dead_ends != FORBID:
        return keep
    mesh = ground.mesh
    ends = sinks.copy()
    ends[mesh.edges[existing].ravel()] = True
    while True:
        degree = np.bincount(mesh.edges[keep].ravel(), minlength=len(mesh.vertices))
        stub = (degree == 1) & ~ends
        dead = keep & stub[mesh.edges].any(axis=1)
        if not dead.any():
            return keep
        keep &= ~dead
