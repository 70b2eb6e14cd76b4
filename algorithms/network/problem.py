"""The neutral form of a network problem: what model, search and validation all read.

A street network is a set of edges of a quad mesh. Everything that a planner asks is turned
into six kinds of data: which edges exist, may or must be chosen; where the sinks are; costs of
edges; degree rules; *patterns* (a cost if some edges are on and others off); *clauses* (at
least one edge of a set is on). The solvers know nothing of blocks, levels or sites.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..mesh.quadmesh import QuadMesh

if TYPE_CHECKING:
    from .requirements.base import Requirement

BoolArray = npt.NDArray[np.bool_]
FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


#: Why a search ended, the least final reason first: `effort` where its work was done, without any
#: clock.
STOPS = ("cancelled", "time", "effort", "gap", "optimal")


@dataclass(frozen=True)
class Pattern:
    """A cost that is due when all edges of `on` are active and none of `off` is.

    Existing edges count as active. `weight` may be infinite: the pattern is forbidden.
    """

    on: tuple[int, ...]
    off: tuple[int, ...]
    weight: float
    kind: str = ""


@dataclass(frozen=True)
class Clause:
    """At least one of `edges` is active (existing ones count), or `penalty` is due.

    An infinite penalty makes the clause hard. `kind` says why it is there, for reports.
    """

    edges: tuple[int, ...]
    penalty: float = math.inf
    kind: str = ""


@dataclass(frozen=True, eq=False)
class NetworkProblem:
    """A street network problem on a quad mesh with n vertices and e edges (CND section 4).

    Attributes
    ----------
    mesh
        The candidate mesh.
    existing
        Shape (e,). Edges that are streets already: active, free of cost, exempt from rules.
    candidate
        Shape (e,). Edges that may be chosen; never existing ones.
    sinks
        Shape (n,). Vertices where traffic leaves; all of them count as connected.
    length
        Shape (e,). Length of each edge in units of the mesh's edge length (or 1 each, for
        distances in hops).
    required
        Shape (e,). Candidate edges that must be chosen.
    weight_length, weight_distance
        CND lambda_L and lambda_D. The length term is weight_length * edge_factor * length of
        each chosen edge; the distance term is weight_distance times the sum over active
        vertices that are neither sinks nor touched by existing edges of the shortest network
        distance to a sink.
    edge_factor
        Shape (e,). Factor on the length cost of each edge (1 where nothing is known).
    cover
        For each vertex that must be covered and is not covered by existing streets: the
        vertices of which at least one must be active. Keys are vertex indices.
    cover_radius
        Radius in edges of the balls in `cover`, or None where they are metric.
    cover_penalty
        Cost of each vertex left uncovered; infinite for a hard rule.
    dead_ends, branches, zigzags, too_close, t_junctions
        Cost per violation; infinite forbids, 0 allows. The definitions are those of CND 4.3:
        dead end = active vertex, not a sink and not on an existing street, with one active
        edge; branch = such a vertex with three or more active edges; zigzag = two opposite
        turns over one edge; too close = two opposite edges of one quad both active;
        T-junction = vertex of valence 4 with exactly three active edges.
    patterns, clauses
        Further rules, see `Pattern` and `Clause`.
    requirements
        What is asked of the network as a whole, see `requirements.base.Requirement`.
    """

    mesh: QuadMesh
    existing: BoolArray
    candidate: BoolArray
    sinks: BoolArray
    length: FloatArray
    required: BoolArray
    edge_factor: FloatArray
    weight_length: float = 1.0
    weight_distance: float = 0.0
    cover: dict[int, tuple[int, ...]] = field(default_factory=dict)
    cover_radius: int | None = None
    cover_penalty: float = math.inf
    dead_ends: float = math.inf
    branches: float = 0.0
    zigzags: float = 0.0
    too_close: float = 0.0
    t_junctions: float = 0.0
    patterns: Sequence[Pattern] = ()
    clauses: Sequence[Clause] = ()
    requirements: Sequence[Requirement] = ()


@dataclass(frozen=True, eq=False)
class Design:
    """A chosen network.

    Attributes
    ----------
    active
        Shape (e,). Chosen edges; existing ones are not among them.
    objective
        Value of the objective, exact, including penalties.
    bound
        Proven lower bound of the objective (equal to `objective` where optimal).
    seconds
        Wall time of the search.
    stopped
        One of `STOPS`.
    distance
        Shape (n,). Shortest network distance to a sink in units of `NetworkProblem.length`,
        infinite where a vertex is not on the network.
    uncovered
        Vertices left without coverage.
    broken_clauses
        Indices into `NetworkProblem.clauses` of the soft clauses that do not hold.
    history
        (seconds, objective) of every improvement.
    """

    active: BoolArray
    objective: float
    bound: float
    seconds: float
    stopped: str
    distance: FloatArray
    uncovered: tuple[int, ...] = ()
    broken_clauses: tuple[int, ...] = ()
    history: tuple[tuple[float, float], ...] = ()

    @property
    def gap(self) -> float:
        """Relative gap (objective - bound) / objective."""
        if self.objective <= 0:
            return 0.0
        return max(0.0, (self.objective - self.bound) / self.objective)
