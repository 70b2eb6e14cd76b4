"""Draws a chosen network: courses, cross streets, connectors and blocks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import shapely
from shapely.geometry import LineString

from ..levels import CUL_DE_SAC
from ..network.problem import IntArray
from ..network.specification import Specification
from ..progress import Progress
from ..site.types import AccessPoint, Site
from .adopt import existing_lines
from .align import Alignment, align
from .blocks import Block, blocks, reach_edge
from .cross_streets import CrossStreet, Surroundings, cross_streets
from .culdesacs import culs_de_sac, served
from .joints import Connector, connect, connectors, trim_ends
from .levels import LevelledNetwork
from .one_way import directed_pieces
from .pieces import Piece, add_cross_streets, street_pieces
from .segments import segments
from .site_plan import SitePlan, goes_on
from .survey import Ground

#: Cross streets are drawn a breath too long for noding, so that it finds where they meet (metres).
BREATH = 0.05


def draw_plan(
    network: LevelledNetwork,
    spec: Specification,
    arrivals: Sequence[AccessPoint] = (),
    *,
    only_mesh: bool = False,
    progress: Progress | None = None,
) -> SitePlan:
    """Draw the streets and blocks of a chosen network.

    Parameters
    ----------
    network
        The chosen mesh edges.
    spec
        What the planner asked; with the planner's rules cross streets are added, and
        culs-de-sac where they are wanted.
    arrivals
        Existing streets that could be continued.
    only_mesh
        Whether streets run along mesh edges only, since somebody drew these.
    progress
        Asked for cancellation: the cross streets found by then are drawn.
    """
    ground, level = network.ground, network.level
    alignment = _aligned(ground, level, spec.junction_spacing or 0.0)
    pieces = street_pieces(ground, level, alignment)
    joints = connectors(ground, level, alignment)
    site = ground.site
    lines = [LineString(line) for line in alignment.lines.values()]
    lines += [street.line for street in (*site.boundary_streets, *site.inner_streets)]
    lines += [joint.line for joint in joints]
    lines += _edge_pieces(ground, level, alignment)
    found = blocks(site, lines)
    cross: list[CrossStreet] = []
    exits: frozenset[int] = frozenset()
    if spec.rules == "planner":
        around = _surroundings(ground, spec, pieces, joints, arrivals)
        # where no program was solved, what encloses the ground stands for its streets
        if (pieces or not network.solved) and not only_mesh and not _counted(spec):
            cross = cross_streets(found, spec, around, progress)
        if spec.cul_de_sacs and spec.length_budget is None and spec.junction_spacing is None:
            blind = _blind(site, lines, found, cross, spec, around, progress)
            cross += [street for street in blind if spec.exits is None or _inside(street, pieces)]
    if cross:
        pieces, added = add_cross_streets(pieces, cross, len(ground.mesh.vertices))
        met = _arrivals_met(cross, added)
        joints += _carried_on(site, added, met)
        if spec.sink_mode == "access":
            exits = frozenset(met)
        through = (piece.line for piece in added if piece.level != CUL_DE_SAC)
        found = blocks(site, [*lines, *map(_longer, through)])
        pieces += added
    pieces = directed_pieces(network, spec, alignment, pieces, progress)
    return SitePlan(
        site,
        network,
        alignment,
        tuple(segments(ground, pieces, joints, exits)),
        tuple(cross),
        tuple(joints),
        tuple(found),
        tuple(arrivals),
        _uncovered(network, [street for street in cross if street.blind], spec),
        spec,
    )


def _counted(spec: Specification) -> bool:
    """Whether exits, metres or junctions are counted: streets outside of the program are not."""
    limits = (spec.exits, spec.length_budget, spec.junction_spacing)
    return any(limit is not None for limit in limits)


def _aligned(ground: Ground, level: IntArray, least_gap: float) -> Alignment:
    """Pull the streets straight and trim their ends."""
    mesh = ground.mesh
    directions = {v: point.direction for v, point in ground.arrivals.items()}
    kept = np.unique(mesh.edges[ground.street & ~mesh.boundary_edges]).tolist()
    alignment = align(ground.site, mesh, level, directions, kept, ground.forbidden, least_gap)
    return trim_ends(ground, level, alignment)


def _surroundings(
    ground: Ground,
    spec: Specification,
    pieces: Sequence[Piece],
    joints: Sequence[Connector],
    arrivals: Sequence[AccessPoint],
) -> Surroundings:
    """Tell what cross streets have to know."""
    site = ground.site
    lines = [piece.line for piece in pieces]
    kept = [street.line for street in site.inner_streets]
    edge = site.polygon.boundary if spec.sink_mode == "boundary" else site.street_frontage
    streets = [*lines, *(joint.line for joint in joints), existing_lines(site), edge]
    ends = np.array([xy for line in lines for xy in (line.coords[0], line.coords[-1])])
    return Surroundings(
        shapely.union_all(np.array(streets, dtype=object)),
        np.unique(ends.reshape(-1, 2), axis=0),
        [point for point in arrivals if not goes_on(point, [*lines, *kept])],
        shapely.union(site.obstacle_union, ground.forbidden),
    )


def _blind(
    site: Site,
    lines: Sequence[LineString],
    found: Sequence[Block],
    cross: Sequence[CrossStreet],
    spec: Specification,
    around: Surroundings,
    progress: Progress | None,
) -> list[CrossStreet]:
    """Culs-de-sac into the blocks that streets and cross streets leave."""
    if cross:
        built = [street.line for street in cross]
        ends = np.array([xy for line in built for xy in line.coords])
        met = [street.arrival for street in cross if street.arrival is not None]
        around = Surroundings(
            shapely.union_all([around.streets, *built]),
            np.vstack([around.ends, ends]),
            [point for point in around.arrivals if point not in met],
            around.blocked,
        )
        found = blocks(site, [*lines, *map(_longer, built)])
    return culs_de_sac(found, spec, around, progress)


def _inside(street: CrossStreet, pieces: Sequence[Piece]) -> bool:
    """Whether a street leaves a new one, so that it needs no exit of its own."""
    start = shapely.Point(street.line.coords[0])
    return any(piece.line.distance(start) < BREATH for piece in pieces)


def _arrivals_met(cross: Sequence[CrossStreet], pieces: Sequence[Piece]) -> dict[int, AccessPoint]:
    """Junction -> the existing street that a cross street continues there."""
    met = {}
    for street in cross:
        if street.arrival is None:
            continue
        for piece in pieces:
            if math.dist(piece.line.coords[0], street.line.coords[0]) < BREATH:
                met[piece.start] = street.arrival
    return met


def _carried_on(
    site: Site, pieces: Sequence[Piece], met: Mapping[int, AccessPoint]
) -> list[Connector]:
    """Carry cross streets that end at the edge of the site on to the centre line."""
    found = []
    for piece in pieces:
        course = shapely.get_coordinates(piece.line)
        for node, line in ((piece.start, course[::-1]), (piece.end, course)):
            one = connect(site, line, node, piece.level, met.get(node)) if node < 0 else None
            if one is not None:
                found.append(one)
    return found


def _longer(line: LineString) -> LineString:
    """Draw a straight line a breath beyond both ends."""
    start, end = shapely.get_coordinates(line)[[0, -1]]
    step = (end - start) / line.length * BREATH
    return LineString([start - step, end + step])


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


def _uncovered(
    network: LevelledNetwork, blind: Sequence[CrossStreet], spec: Specification
) -> tuple[tuple[float, float], ...]:
    """Positions that are still without a street nearby after the last level."""
    if not network.solved:
        return ()
    # ground that a cul-de-sac would have served has streets on the other side of the block
    above = [s for s in network.solved if s.level != CUL_DE_SAC]
    vertices = {v for s in above for v in s.design.uncovered}
    streets = (network.level > 0) | network.ground.street
    mesh = network.ground.mesh
    active = set(mesh.edges[streets].ravel().tolist())
    near = {
        v
        for v in vertices
        if v < len(mesh.vertices)
        and any(int(u) in active for u in mesh.edges[mesh.vertex_edges[v]].ravel())
    }
    left = mesh.vertices[sorted(v for v in vertices - near if v < len(mesh.vertices))]
    left = left[~served(left, blind, spec)]
    return tuple((float(x), float(y)) for x, y in left)
