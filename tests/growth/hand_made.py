"""Growths that are made by hand, so that what is right is known before anything grows."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import geopandas as gpd
import numpy as np
import shapely
from platwright.growth.grammar import Child, Grammar, Rule, State
from platwright.growth.land.ground import GivenStreet, RealGround
from platwright.growth.rules import GrowthRules
from platwright.growth.types import Ground, Growth, Start, Step
from pyproj import CRS

UTM = CRS.from_epsg(32633)
ORIGIN = np.array([500000.0, 5500000.0])
GRAMMAR = Grammar(
    "straight on",
    {State("m", "L"): (Rule(1.0, "T", (Child((0.0, 0.0), (1.0, 1.0), State("m", "L")),)),)},
)
PROBLEMS = ("layer", "feature", "problem", "action", "severity")


@dataclass
class Edge:
    """One edge by its nodes; of a street that was there where `street` is at least 0."""

    start: int
    end: int
    road: int = 1
    kind: str = "s"
    step: int = 1
    street: int = -1


def no_problems(crs: CRS) -> gpd.GeoDataFrame:
    """Make an empty layer of problems."""
    return gpd.GeoDataFrame({name: [] for name in PROBLEMS}, geometry=[], crs=crs)


def make_growth(xy: Any, edges: list[Edge], **changed: Any) -> Growth:
    """Make a growth of positions, metres from `ORIGIN`, and edges; nodes are leaves unless told.

    Nodes that only edges which were there meet have no state.
    """
    places = np.asarray(xy, dtype=float) + ORIGIN
    ends = np.array([(e.start, e.end) for e in edges], dtype=np.int64).reshape(-1, 2)
    street = np.array([e.street for e in edges], dtype=np.int64)
    given = np.ones(len(places), dtype=bool)
    given[ends[street < 0].ravel()] = False
    step = np.array([e.step if e.street < 0 else 0 for e in edges], dtype=np.int64)
    born = np.full(len(places), 9999)
    for (u, v), k in zip(ends.tolist(), step.tolist()):
        born[u], born[v] = min(born[u], k), min(born[v], k)
    last = int(step.max(initial=0))
    steps = tuple(Step(k, 2 * k, k, 100.0 * k, 154.15 * k, 1, 0.1 * k) for k in range(1, last + 1))
    columns: dict[str, Any] = {
        "xy": places,
        "road_type": np.where(given, "", "s"),
        "node_type": np.where(given, "", "L"),
        "born": born.astype(np.int64),
        "incoming_road": np.zeros(len(places), dtype=np.int64),
        "incoming": np.zeros((len(places), 2)),
        "bends": np.zeros(len(places), dtype=bool),
        "ends": ends,
        "road": np.array([e.road if e.street < 0 else 0 for e in edges], dtype=np.int64),
        "edge_type": np.array([e.kind if e.street < 0 else "" for e in edges], dtype="U1"),
        "step": step,
        "street": street,
        "steps": steps,
        "stopped": "the number of iterations is reached",
        "left_out": 0,
    }
    return Growth(**{**columns, **changed})


def make_real(
    growth: Growth,
    domain: Any = None,
    streets: tuple[GivenStreet, ...] = (),
    *,
    source_crs: CRS = UTM,
    given: int = 0,
    starts: tuple[Start, ...] = (),
    problems: gpd.GeoDataFrame | None = None,
) -> RealGround:
    """Make the ground of a growth whose first `given` nodes were there; domain from `ORIGIN`."""
    if domain is not None:
        domain = shapely.transform(domain, lambda xy: xy + ORIGIN)
    there = growth.street >= 0
    there &= (growth.ends < given).all(axis=1)
    ground = Ground(
        starts,
        domain,
        growth.xy[:given],
        growth.ends[there],
        growth.street[there],
        growth.bends[:given],
    )
    return RealGround(
        ground, UTM, source_crs, streets, no_problems(source_crs) if problems is None else problems
    )


def given_street(xy: Any, name: str = "", *, edge: bool = False, level: int = 2) -> GivenStreet:
    """Make a street that was there; positions in metres from `ORIGIN`."""
    line = shapely.LineString(np.asarray(xy, dtype=float) + ORIGIN)
    return GivenStreet(line, name, "residential", edge, level)


def rules(**changed: Any) -> GrowthRules:
    """Give rules that stop at one iteration unless told otherwise."""
    return GrowthRules(GRAMMAR, **({"iterations": 1} | changed))


def lattice(columns: int, rows: int, size: float = 100.0, seed: int | None = None) -> Growth:
    """Make a grid of streets; shaken by up to a fifth of its size where a seed is given.

    Each row and each column is a road. Edges appear from the lower left to the upper right.
    """
    across, up = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    xy = np.stack([across, up], axis=-1).reshape(-1, 2) * size
    if seed is not None:
        xy = xy + np.random.default_rng(seed).uniform(-size / 5, size / 5, xy.shape)
    node = np.arange(columns * rows).reshape(columns, rows)
    ends = np.concatenate(
        [
            np.column_stack([node[:-1].ravel(), node[1:].ravel()]),
            np.column_stack([node[:, :-1].ravel(), node[:, 1:].ravel()]),
        ]
    ).astype(np.int64)
    flat = len(node[:-1].ravel())
    road = np.concatenate([up[:-1].ravel() + 1, across[:, :-1].ravel() + 1 + rows])
    step = (across + up).ravel()[ends].max(axis=1)
    return replace(
        make_growth(xy, [Edge(0, 1)]),
        road_type=np.full(len(xy), "s"),
        node_type=np.full(len(xy), "L"),
        born=(across + up).ravel().astype(np.int64),
        ends=ends,
        road=road.astype(np.int64),
        edge_type=np.where(np.arange(len(ends)) < flat, "l", "s"),
        step=step.astype(np.int64),
        street=np.full(len(ends), -1),
        steps=tuple(
            Step(k, k, k, float(k), float(k), 1, 0.0) for k in range(1, int(step.max()) + 1)
        ),
    )
