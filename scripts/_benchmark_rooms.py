"""Lay floor plans and levels on meshes of the paper's sizes, and by the paper's own program.

The sizes are those of CND Fig. 9 (520 edges, 188 to 1,507 s with Gurobi on 8 cores) and Fig. 1d
(1,012 edges, 920 s), and of the levels of CND-x (657 and 782 edges, 2,958 to 4,927 s). Rules as in
the paper's Table 1: shortest corridors, zigzags cost 5, none too close, no dead ends; one exit.
Every plan is checked by equations 15 to 20. The paper's own rows are given to HiGHS for the same
time; HiGHS without and OR-Tools with this project's rows and search come before it.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass

import numpy as np
from platwright.errors import InfeasibleError
from platwright.mesh.grids import grid
from platwright.mesh.quadmesh import QuadMesh
from platwright.mip.solvers import solve_mip
from platwright.network.examples import PAPER_MESHES, cut_grid
from platwright.network.mip.reference import reference_model
from platwright.network.problem import NetworkProblem
from platwright.network.structure import structure
from platwright.rooms.program.evaluate import RoomEvaluator, faults
from platwright.rooms.program.index import RoomIndex
from platwright.rooms.program.reference import PaperRooms
from platwright.rooms.shapes import enumerate_placements, shipped_templates
from platwright.rooms.solve import solve_rooms
from platwright.rooms.types import RoomPlan, RoomProblem


@dataclass(frozen=True)
class Instance:
    """A mesh of the paper's size, what is laid on it, and the paper's seconds."""

    name: str
    kind: str
    mesh: QuadMesh
    paper: str


def instances() -> list[Instance]:
    """Return the instances."""
    office = cut_grid(16, 16, ((3, 4), (0, 0), (0, 0), (0, 0)))
    dungeon = grid(19, 20, keep=lambda i, j: not (i >= 17 and j >= 19))
    return [
        Instance("small floor, 127 edges", "floor", grid(8, 7), ""),
        Instance("office, Fig. 9", "floor", office, "188-1507"),
        Instance("large facility, Fig. 1d", "floor", PAPER_MESHES[1012](), "920"),
        Instance("level, branching", "branching", PAPER_MESHES[657](), "2958-4927"),
        Instance("level, circular", "circular", dungeon, "4927"),
        Instance("level, linear", "linear", PAPER_MESHES[657](), "2958-4927"),
    ]


def problem_of(instance: Instance) -> RoomProblem:
    """Make the problem of an instance."""
    mesh, level = instance.mesh, instance.kind != "floor"
    templates = tuple(shipped_templates("caves" if level else "basic"))
    everywhere = np.ones(len(mesh.faces), dtype=bool)
    edges = len(mesh.edges)
    sinks = np.zeros(len(mesh.vertices), dtype=bool)
    sinks[_sinks(mesh, instance.kind)] = True
    network = NetworkProblem(
        mesh=mesh,
        existing=np.zeros(edges, dtype=bool),
        candidate=~mesh.boundary_edges,
        sinks=sinks,
        length=np.ones(edges),
        required=np.zeros(edges, dtype=bool),
        edge_factor=np.ones(edges),
        dead_ends=math.inf,
        branches=math.inf if instance.kind in ("circular", "linear") else 0.0,
        zigzags=0.0 if level else 5.0,
        too_close=0.0 if level else math.inf,
    )
    placements = enumerate_placements(mesh, templates, everywhere)
    kind = "level" if level else "floor"
    return RoomProblem(kind, network, templates, placements, everywhere)


def _sinks(mesh: QuadMesh, kind: str) -> list[int]:
    """Return the middle of the lower side; of levels a place inside, or two at the border."""
    at = mesh.vertices
    inner = np.flatnonzero(~mesh.boundary_vertices)
    gates = np.flatnonzero(mesh.boundary_vertices & (mesh.valences == 3))
    if kind == "linear":
        along = at[gates].sum(axis=1)
        return [int(gates[np.argmin(along)]), int(gates[np.argmax(along)])]
    if kind == "floor":
        low = gates[at[gates, 1] == at[gates, 1].min()]
        return [int(low[np.argmin(np.abs(at[low, 0] - at[:, 0].mean()))])]
    return [int(inner[np.argmin(((at[inner] - at.mean(axis=0)) ** 2).sum(axis=1))])]


def ours(problem: RoomProblem, solver: str, seconds: float, seed: int) -> str:
    """Solve by this project's search; return a row of the table."""
    try:
        plan = solve_rooms(problem, time_limit=seconds, solver=solver, seed=seed)
    except InfeasibleError as error:
        return str(error)[:60]
    index = RoomIndex(problem)
    wrong = faults(index, plan.active, list(plan.rooms))
    return _row(plan) + (f"  WRONG: {wrong[0]}" if wrong else "")


def _row(plan: RoomPlan) -> str:
    """Return first plan, its time, best plan, its time, bound and gap."""
    (first, value), (last, best) = plan.history[0], plan.history[-1]
    near = next(when for when, found in plan.history if found <= 1.05 * best)
    return (
        f"{first:<8.1f}{value:<8.0f}{best:<8.0f}{last:<8.1f}{near:<9.1f}"
        f"{plan.bound:<7.0f}{plan.gap:<6.0%}"
    )


def paper(problem: RoomProblem, seconds: float) -> str:
    """Solve the paper's own program by HiGHS; return a row of the table."""
    index = RoomIndex(problem)
    rooms, evaluator = PaperRooms(index), RoomEvaluator(index)
    began = time.monotonic()
    model = reference_model(structure(problem.network), further=rooms.add)
    history: list[tuple[float, float]] = []

    def take(values: dict[str, float]) -> None:
        value = evaluator.objective(rooms.design(model, values))
        if math.isfinite(value):
            history.append((time.monotonic() - began, value))

    left = seconds - (time.monotonic() - began)
    found = solve_mip(model.linear, time_limit=max(1.0, left), on_incumbent=take)
    size = f"{len(model.linear.problem.variables())} variables"
    if not history:
        return f"no plan in {seconds:.0f} s ({size}), bound {found.bound:.0f}"
    (first, value), (last, best) = history[0], history[-1]
    near = next(when for when, own in history if own <= 1.05 * best)
    gap = (best - found.bound) / best
    row = f"{first:<8.1f}{value:<8.0f}{best:<8.0f}{last:<8.1f}{near:<9.1f}"
    return f"{row}{found.bound:<7.0f}{gap:<6.0%}({size})"


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="for each run")
    parser.add_argument("--only", default="", help="part of the names of instances")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--without-paper", action="store_true", help="leave the paper's out")
    given = parser.parse_args()
    for instance in instances():
        if given.only not in instance.name:
            continue
        problem = problem_of(instance)
        print(
            f"{instance.name}: {len(instance.mesh.edges)} edges, {len(instance.mesh.faces)} cells, "
            f"{len(problem.placements.faces)} placements"
            + (f"; paper {instance.paper} s" if instance.paper else "")
        )
        print("                 first s value   best    at s    5 % at s bound  gap")
        for label, solver in (("CP-SAT", "cpsat"), ("HiGHS", "highs")):
            print(f"  {label:15}{ours(problem, solver, given.seconds, given.seed)}", flush=True)
        if not given.without_paper:
            print(f"  {'paper, HiGHS':15}{paper(problem, given.seconds)}", flush=True)


if __name__ == "__main__":
    main()
