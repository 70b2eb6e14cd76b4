"""The street rows of CND Table 1 as problems on meshes of the same number of edges.

The paper's meshes, sinks and streets are drawn, not published. What the table gives is taken as
it is: number of edges, weights, rules, dead ends; the rest is set up as follows.

* Meshes: 312, 1012 and 1200 edges are the grids of 12 x 12, 22 x 22 and 24 x 24 squares; 535,
  543, 657 and 662 are grids with their corners cut away (`examples.PAPER_MESHES`).
* Level 2: coverage of two edges. Figures 1, 2a-b, 6a-b, 6d-e and 8: the boundary is an existing
  street and a sink everywhere; 2d and 6c: a wall with one gap (top, left); 2e-g: four sinks
  inside and no street on the boundary; 7: an existing street around, sinks at its six corners
  where others meet it, and a historic place of 2 x 2 squares; 8e: a wall with three gaps, whose
  places are given; 8g: a park and a lake. 6d: a through route between two boundary vertices, all
  of it required and without branches; 8f: the same with branches.
* Level 3: every square split into four, the streets of level 2 existing, all vertices on them
  sinks, coverage of two (shorter) edges. Level 4 on the same mesh: coverage of one edge, dead
  ends allowed. Both keep the weights of their row; 1b prices T-junctions on level 4 only. The
  levels above are fixed designs, kept with the best known values, so that runs compare.
* Point-to-point rows (1b, 2c, 2g, 6e, 8h): short ways, tolerance 2, between sampled vertices of
  adjacent patches, the mesh divided into about nine; on level 2 only.
* 1d is a floor plan in the paper: its mesh stands here as a street problem, without a time.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

#: About how many patches the point-to-point rows divide their mesh into.
PATCHES = 9
#: Weights of an almost unwanted distance, "*" in the paper's table.
LITTLE = 1e-4


@dataclasses.dataclass(frozen=True)
class Row:
    """One row of the table at one level.

    Attributes
    ----------
    name
        Figure and level, for instance "6a L2".
    edges
        Number of edges that the paper gives.
    paper
        The paper's seconds, or None.
    build
        Makes the problem; given the designs of the levels above, uppermost first.
    links
        Whether the row asks for point-to-point access.
    """

    name: str
    edges: int
    paper: float | None
    build: Callable[..., Any]
    links: bool = False

    @property
    def level(self) -> int:
        """Level of streets."""
        return int(self.name[-1])

    @property
    def above(self) -> list[str]:
        """Names of the rows whose designs this one takes as given."""
        figure = self.name[:-2]
        if self.name == "3 L3":
            return ["2a L2"]
        if self.name == "3 L4":
            return ["2a L2", "3 L3"]
        return [f"{figure}L{level}" for level in range(2, self.level)]


#: Figure -> edges, lengths and distances, zigzag, too close, T, dead ends, links, seconds.
TABLE: dict[str, tuple[Any, ...]] = {
    "1a": (657, 5, 1, 5, math.inf, 0, False, False, (379, 366, 49)),
    "1b": (657, 0, 1, 5, math.inf, 10, False, True, (168, 274, 34)),
    "1c": (657, 1, 0, 5, math.inf, 0, False, False, (456, 467)),
    "1d": (1012, 1, 0, 5, math.inf, 0, False, False, (None,)),
    "2a": (312, 1, LITTLE, 5, math.inf, 0, False, False, (132,)),
    "2b": (312, 0, 1, 5, math.inf, 0, False, False, (35,)),
    "2c": (312, 0, 1, 5, math.inf, 0, False, True, (11,)),
    "2d": (312, 0, 1, 5, math.inf, 0, False, False, (24,)),
    "2e": (312, 1, LITTLE, 5, math.inf, 0, False, False, (74,)),
    "2f": (312, 0, 1, 5, math.inf, 0, False, False, (56,)),
    "2g": (312, 0, 1, 5, math.inf, 0, False, True, (26,)),
    "3": (312, 1, 0, 5, math.inf, 0, False, False, (None, 86, 2)),
    "6a": (535, 1, LITTLE, math.inf, math.inf, 0, False, False, (121, 218, 23)),
    "6b": (535, 0, 1, 5, math.inf, 0, False, False, (174, 318, 76)),
    "6c": (535, 0, 1, 5, math.inf, 0, True, False, (70, 294, 46)),
    "6d": (535, 5, 1, 5, math.inf, 0, False, False, (12, 223, 43)),
    "6e": (535, 5, 1, 5, math.inf, 0, False, True, (73, 195, 114)),
    "7": (543, 0, 1, 5, math.inf, 0, False, False, (229, 500, 1)),
    "8c": (662, 5, 1, 5, 100, 0, False, False, (390, 336, 15)),
    "8d": (662, 1, 5, 5, 100, 0, False, False, (328, 392, 10)),
    "8e": (662, 5, 1, 5, 100, 0, False, False, (370, 377, 12)),
    "8f": (662, 5, 1, 5, 100, 0, False, False, (229, 303, 4)),
    "8g": (662, 5, 1, 5, 10, 0, False, False, (128, 121, 5)),
    "8h": (662, 5, 1, 5, 100, 0, False, True, (359, 372, 8)),
}


def rows() -> Iterator[Row]:
    """Yield all rows, level by level within each figure."""
    for figure, values in TABLE.items():
        edges, seconds = values[0], values[-1]
        for level, paper in enumerate(seconds, start=2):
            if figure == "3" and level == 2:
                continue  # it is 2a
            links = bool(values[7]) and level == 2
            yield Row(f"{figure} L{level}", edges, paper, _builder(figure, level), links)


def _builder(figure: str, level: int) -> Callable[..., Any]:
    """Return the function that makes the problem of a row."""
    edges, length, distance, zigzags, close, tees, ends, links, _ = TABLE[figure]
    rules = {
        "weight_length": float(length),
        "weight_distance": float(distance),
        "zigzags": float(zigzags),
        "too_close": float(close),
        "t_junctions": float(tees if level == 4 else 0),
        "dead_ends": 0.0 if (ends and level == 2) or level == 4 else math.inf,
    }

    def build(*above: Any) -> Any:
        # the through route of 6d has branches again below the collectors
        top = _collectors("6b" if figure == "6d" and level > 2 else figure, edges, rules)
        if links and level == 2:
            return linked(top)
        return top if level == 2 else _lower(top, above, level, rules)

    return build


def _collectors(figure: str, edges: int, rules: dict[str, float]) -> Any:
    """Make a problem of level 2."""
    from platwright.network.examples import PAPER_MESHES, paper_problem

    mesh = PAPER_MESHES[edges]()
    x, y = mesh.vertices.T
    if figure in ("2e", "2f", "2g"):
        return paper_problem(mesh, "inner", **rules)
    if figure == "2d":
        return paper_problem(mesh, "one sink", **rules)
    if figure == "6c":
        return paper_problem(mesh, "one sink", exits=[_gap(mesh, 0, 8)], **rules)
    if figure == "8e":
        gaps = [_gap(mesh, 0, 9), _gap(mesh, 20, 9), _gap(mesh, 10, 18)]
        return paper_problem(mesh, "one sink", exits=gaps, **rules)
    if figure == "7":
        rim = np.flatnonzero(mesh.boundary_vertices)
        targets = [(4, 0), (14, 0), (18, 8), (15, 17), (3, 17), (0, 7)]
        exits = [int(rim[np.argmin(np.hypot(x[rim] - a, y[rim] - b))]) for a, b in targets]
        problem = paper_problem(mesh, "boundary", exits=exits, **rules)
        return _obstacle(problem, (8, 10, 7, 9))
    problem = paper_problem(mesh, "boundary", **rules)
    if figure == "8g":
        return _obstacle(_obstacle(problem, (5, 8, 5, 7)), (12, 14, 10, 14))
    if figure in ("6d", "8f"):
        return _through(problem, 9.0, branches=figure == "8f")
    return problem


def linked(problem: Any) -> Any:
    """Ask for short ways between the sampled vertices of adjacent patches."""
    from platwright.network.partition import patches, point_to_point

    mesh = problem.mesh
    links = point_to_point(problem, patches(mesh, len(mesh.faces) / PATCHES), tolerance=2.0)
    return dataclasses.replace(problem, requirements=tuple(links))


def _gap(mesh: Any, x: float, y: float) -> int:
    """Return the boundary vertex with an inner edge that is nearest to a place."""
    inner = np.zeros(len(mesh.vertices), dtype=bool)
    inner[mesh.edges[~mesh.boundary_edges].ravel()] = True
    able = np.flatnonzero(mesh.boundary_vertices & inner)
    off = mesh.vertices[able] - (x, y)
    return int(able[np.argmin(np.hypot(*off.T))])


def _obstacle(problem: Any, box: tuple[int, int, int, int]) -> Any:
    """Bar the edges at the vertices of a rectangle and ask for no coverage there."""
    x, y = problem.mesh.vertices.T
    inside = (x >= box[0]) & (x <= box[1]) & (y >= box[2]) & (y <= box[3])
    barred = inside[problem.mesh.edges].any(axis=1)
    cover = {v: ball for v, ball in problem.cover.items() if not inside[v]}
    return dataclasses.replace(problem, candidate=problem.candidate & ~barred, cover=cover)


def _through(problem: Any, column: float, *, branches: bool) -> Any:
    """Require the mesh line x = column; without branches bar all that meets it inside."""
    mesh = problem.mesh
    x = mesh.vertices[:, 0]
    on_line = x == column
    line = on_line[mesh.edges].all(axis=1) & problem.candidate
    required = problem.required | line
    if branches:
        return dataclasses.replace(problem, required=required)
    inner = on_line & ~mesh.boundary_vertices
    sides = inner[mesh.edges].any(axis=1) & ~line
    return dataclasses.replace(problem, required=required, candidate=problem.candidate & ~sides)


def _lower(top: Any, above: tuple[Any, ...], level: int, rules: dict[str, float]) -> Any:
    """Make a problem of level 3 or 4 from the problem of level 2 and the designs above."""
    from platwright.mesh import subdivide
    from platwright.network.examples import paper_problem

    fine = subdivide(top.mesh)
    parent = fine.parent_edges
    half = parent >= 0
    streets = top.existing | above[0]
    existing = np.where(half, streets[np.maximum(parent, 0)], False)
    # what is barred on level 2 stays barred: walls, obstacles, sides of a through route
    barred = ~(top.candidate | top.existing)
    open_ = np.where(half, ~barred[np.maximum(parent, 0)], True)
    blocked = np.zeros(len(fine.vertices), dtype=bool)
    ends = fine.edges[half & ~open_]
    blocked[ends.ravel()] = True
    blocked &= ~np.isin(np.arange(len(blocked)), fine.edges[existing].ravel())
    open_ &= ~blocked[fine.edges].any(axis=1) | existing
    if level == 4:
        existing = existing | above[1]
    sinks = np.zeros(len(fine.vertices), dtype=bool)
    sinks[fine.edges[existing].ravel()] = True
    coverage = 2 if level == 3 else 1
    problem = paper_problem(fine, "inner", coverage=coverage, **rules)
    return within_reach(with_streets(problem, existing, open_, sinks, blocked))


def within_reach(problem: Any) -> Any:
    """Return a problem without cover where no street can be near, as in corners behind walls."""
    from platwright.network.structure import structure

    index = structure(problem)
    able = np.zeros(len(problem.sinks), dtype=bool)
    able[problem.mesh.edges[np.array(index.usable) | problem.existing].ravel()] = True
    cover = {v: ball for v, ball in problem.cover.items() if able[list(ball)].any()}
    return dataclasses.replace(problem, cover=cover)


def with_streets(problem: Any, existing: Any, open_: Any, sinks: Any, blocked: Any) -> Any:
    """Return a problem with existing streets, barred edges, sinks and places without cover."""
    street = np.zeros(len(sinks), dtype=bool)
    street[problem.mesh.edges[existing].ravel()] = True
    cover = {
        v: ball
        for v, ball in problem.cover.items()
        if not blocked[v] and not street[list(ball)].any()
    }
    candidate = open_ & ~existing
    return dataclasses.replace(
        problem, existing=existing, candidate=candidate, sinks=sinks, cover=cover
    )
