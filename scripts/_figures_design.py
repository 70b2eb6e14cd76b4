"""Design what the files in figures/ ask for, and check it independently; see figures/README.md."""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import geopandas as gpd
import networkx as nx
import numpy as np
import shapely
from platwright.measure import validate_network
from platwright.mesh.grids import grid
from platwright.network.checks.validation import check_design, design_cost, design_distances
from platwright.network.examples import paper_problem
from platwright.network.partition import patches, point_to_point
from platwright.network.problem import Design, NetworkProblem
from platwright.network.requirements.links import Link
from platwright.network.solve import solve
from platwright.network.specification import Specification
from platwright.site import prepare_sites, site_layers
from platwright.streets import Preferences, StreetPlan, Wishes, design_streets, plan_layers
from shapely.geometry import LineString, Polygon

ROOT = Path(__file__).resolve().parents[1]
FIGURES = ROOT / "figures"
#: All sites lie in Helsinki.
CRS = "EPSG:3067"
#: Width of ground along the edge of the site on which streets count as leaving it, and the least
#: way between two exits (metres).
AT_EDGE, APART = 4.0, 10.0
#: Fields of a specification that a problem on an abstract mesh has under the same name.
SHARED = (
    "weight_length", "weight_distance", "zigzags", "too_close", "dead_ends", "branches",
    "t_junctions",
)  # fmt: skip

Numbers = dict[str, float]


@dataclasses.dataclass(frozen=True)
class Abstract:
    """A design on a mesh.

    Attributes
    ----------
    problem, design
        What was asked, and what was found.
    numbers
        Its figures, in mesh edges; see `Figure`.
    title
        What differs from its neighbours in the figure.
    """

    problem: NetworkProblem
    design: Design
    numbers: Numbers
    title: str = ""


@dataclasses.dataclass(frozen=True)
class Planned:
    """A plan of a real site.

    Attributes
    ----------
    given
        Layers "site", "streets", "obstacles" as they were read, all in `CRS`.
    ground
        Layers of the prepared site.
    plan, layers
        The plan.
    wishes
        Places that the planner named, as in the file.
    numbers
        Its figures, in metres.
    colour
        What colours streets show: "level" or "distance".
    """

    given: dict[str, gpd.GeoDataFrame]
    ground: dict[str, gpd.GeoDataFrame]
    plan: StreetPlan
    layers: dict[str, gpd.GeoDataFrame]
    wishes: Mapping[str, Any]
    numbers: Numbers
    colour: str


class FigureError(Exception):
    """A design that the independent check refuses."""


def read(name: str) -> dict[str, Any]:
    """Read the file of a figure."""
    values: dict[str, Any] = json.loads((FIGURES / f"{name}.json").read_text(encoding="utf-8"))
    return values


def specifications(file: Mapping[str, Any]) -> list[Specification]:
    """Return the specification of each design of a figure."""
    common = {**file["specification"], "time_limit": float(file["seconds"])}
    return [
        Specification.from_json(json.dumps({**common, **own})) for own in file.get("variants", [{}])
    ]


def design(file: Mapping[str, Any], seconds: float | None = None) -> list[Abstract | Planned]:
    """Make the designs of a figure.

    Parameters
    ----------
    file
        What `read` returned.
    seconds
        Time for each design instead of the one in the file.

    Raises
    ------
    FigureError
        If a design is not what was asked for.
    """
    asked = specifications(file)
    if seconds is not None:
        asked = [dataclasses.replace(spec, time_limit=seconds) for spec in asked]
    if "mesh" in file:
        return [_abstract(file, spec) for spec in asked]
    return [_planned(file, spec) for spec in asked]


def problem_of(file: Mapping[str, Any], spec: Specification) -> NetworkProblem:
    """Return the problem on an abstract mesh."""
    mesh = grid(*file["mesh"]["grid"])
    rules = {name: getattr(spec, name) for name in SHARED}
    rules = {name: value for name, value in rules.items() if value is not None}
    problem = paper_problem(mesh, file["scenario"], coverage=round(spec.coverage or 2), **rules)
    if spec.traffic != "within":
        return problem
    patch = patches(mesh, (spec.patch_size or 4.0) ** 2, seed=spec.seed)
    links = point_to_point(problem, patch, tolerance=spec.detour, seed=spec.seed)
    return dataclasses.replace(problem, requirements=tuple(links))


def _abstract(file: Mapping[str, Any], spec: Specification) -> Abstract:
    """Design a network on a mesh."""
    problem = problem_of(file, spec)
    found = solve(problem, time_limit=spec.time_limit, seed=spec.seed, solver=spec.solver)
    wrong = [v.text for v in check_design(problem, found.active) if v.hard]
    if wrong:
        raise FigureError(f"{file['figure']}: {'; '.join(wrong)}")
    far = design_distances(problem, found.active)
    new = set(problem.mesh.edges[found.active].ravel().tolist())
    inner = [far[v] for v in sorted(new) if not problem.sinks[v]]
    numbers = {
        "length": float(problem.length[found.active].sum()),
        "mean": float(np.mean(inner)) if inner else 0.0,
        "sum": float(np.sum(inner)),
        "farthest": max(inner, default=0.0),
        "within": _detour(problem, found, sorted(new)),
        "objective": found.objective,
        "bound": found.bound,
        "gap": found.gap,
        "seconds": found.seconds,
    }
    title = f"{spec.weight_length:g} : {spec.weight_distance:g}" if "variants" in file else ""
    return Abstract(problem, found, numbers, title)


def _detour(problem: NetworkProblem, found: Design, new: list[int]) -> float:
    """Mean of how many times longer than in the mesh the way between two junctions is."""
    mesh, streets = nx.Graph(), nx.Graph()
    mesh.add_edges_from(problem.mesh.edges[problem.candidate | problem.existing].tolist())
    streets.add_edges_from(problem.mesh.edges[found.active | problem.existing].tolist())
    least = dict(nx.all_pairs_shortest_path_length(mesh))
    ways = dict(nx.all_pairs_shortest_path_length(streets))
    pairs = [(u, v) for u, v in itertools.combinations(new, 2) if v in ways[u]]
    return float(np.mean([ways[u][v] / least[u][v] for u, v in pairs]))


def sampled(problem: NetworkProblem) -> list[int]:
    """Return the vertices between which ways have to be short."""
    links = [r for r in problem.requirements if isinstance(r, Link)]
    return sorted({v for link in links for v in (link.start, link.end)})


def given_layers(file: Mapping[str, Any]) -> dict[str, gpd.GeoDataFrame]:
    """Read the layers of a site."""
    path = ROOT / file["site"]
    if path.suffix == ".gpkg":
        layers = {n: gpd.read_file(path, layer=n) for n in ("site", "streets", "obstacles")}
    else:
        frame = gpd.read_file(path)
        layers = {n: frame[frame["layer"] == n] for n in ("site", "streets", "obstacles")}
    layers = {n: frame.to_crs(CRS).reset_index(drop=True) for n, frame in layers.items()}
    drawn = file.get("wishes", {}).get("obstacles", [])
    if drawn:
        more = gpd.GeoDataFrame(
            {"name": [o["name"] for o in drawn]},
            geometry=[Polygon(o["ring"]) for o in drawn], crs=CRS,
        )  # fmt: skip
        old = layers["obstacles"]
        both = [*old.geometry, *more.geometry]
        layers["obstacles"] = gpd.GeoDataFrame(geometry=both, crs=CRS)
    return layers


def wishes_of(file: Mapping[str, Any]) -> Wishes:
    """Return the places that a planner names."""
    given = file.get("wishes", {})
    return Wishes(
        sinks=[(x, y) for x, y in given.get("sinks", [])],
        required=[LineString(line) for line in given.get("required", [])],
        forbidden=[LineString(line) for line in given.get("forbidden", [])],
        preferences=Preferences(
            partition=[(Polygon(p), i) for i, p in enumerate(given.get("partition", []))],
            routes=[(LineString(line), i) for i, line in enumerate(given.get("routes", []))],
        ),
    )


def _planned(file: Mapping[str, Any], spec: Specification) -> Planned:
    """Design the streets of a real site."""
    given = given_layers(file)
    obstacles = given["obstacles"] if len(given["obstacles"]) else None
    snap = float(file.get("snap_distance", 30.0))
    # a closed region: its edge is a wall but for the given sinks
    roads = given["streets"].iloc[:0] if file.get("walled") else given["streets"]
    prepared = prepare_sites(given["site"], roads, obstacles, snap_distance=snap)
    ground = site_layers(prepared)
    plan = design_streets(prepared.sites, spec, wishes=wishes_of(file))
    layers = {n: frame.to_crs(CRS) for n, frame in plan_layers(plan).items()}
    ground = {n: frame.to_crs(CRS) for n, frame in ground.items()}
    _check(file, spec, ground, layers, snap)
    _check_mesh(file, plan)
    numbers = plan.numbers
    return Planned(
        given, ground, plan, layers, file.get("wishes", {}),
        {
            "length": numbers["TOTAL_LENGTH"],
            "mean": numbers["MEAN_DISTANCE"],
            "farthest": numbers["MAX_DISTANCE"],
            "exits": float(len(exits(layers["streets"], ground["site"]))),
            "objective": numbers["OBJECTIVE"],
            "bound": numbers["BOUND"],
            "gap": numbers["ACHIEVED_GAP"],
            "seconds": numbers["SECONDS"],
        },
        file.get("colour", "level"),
    )  # fmt: skip


def exits(streets: gpd.GeoDataFrame, site: gpd.GeoDataFrame) -> list[shapely.Point]:
    """Return where new streets cross or reach the edge of a site, from their geometry alone."""
    edge = shapely.union_all(site.geometry.boundary.to_numpy()).buffer(AT_EDGE)
    new = shapely.union_all(streets[streets["status"] != "existing"].geometry.to_numpy())
    found: list[shapely.Point] = []
    for part in shapely.get_parts(shapely.line_merge(new.intersection(edge))):
        if all(part.distance(other) > APART for other in found):
            found.append(part.centroid)
    return found


def _check(
    file: Mapping[str, Any],
    spec: Specification,
    ground: dict[str, gpd.GeoDataFrame],
    layers: dict[str, gpd.GeoDataFrame],
    snap: float,
) -> None:
    """Let the independent check of street layers judge a plan."""
    required = [LineString(line) for line in file.get("wishes", {}).get("required", [])]
    blind = any(own.dead_ends == 0 for own in spec.level_settings.values()) or spec.cul_de_sacs
    streets = layers["streets"]
    if spec.sink_mode == "points":
        # given sinks lie between the junctions of existing streets, where a layer has no nodes:
        # the distances are checked on the mesh
        streets = streets.drop(columns="dist_to_sink_m")
    sinks = layers["junctions"].query("is_sink") if file.get("walled") else None
    report = validate_network(
        streets,
        site=ground["site"],
        obstacles=ground["site_obstacles"],
        boundary_streets=ground["boundary_streets"] if sinks is None else None,
        sinks=sinks,
        required=gpd.GeoDataFrame(geometry=required, crs=CRS) if required else None,
        dead_ends=0.0 if blind else spec.dead_ends,
        snap_distance=snap,
    )
    wrong = report.problems[report.problems["severity"] == "error"]
    if len(wrong):
        raise FigureError(f"{file['figure']}: {'; '.join(wrong['text'])}")


def _check_mesh(file: Mapping[str, Any], plan: StreetPlan) -> None:
    """Let the independent check of networks judge every program of a plan, and its cost."""
    for solved in (s for own in plan.plans for s in own.network.solved):
        problem, found = solved.problem, solved.design
        wrong = [v.text for v in check_design(problem, found.active) if v.hard]
        if not math.isclose(design_cost(problem, found.active), found.objective, abs_tol=1e-6):
            wrong.append("its cost is not what the search says")
        if wrong:
            raise FigureError(f"{file['figure']}: {'; '.join(wrong)}")
