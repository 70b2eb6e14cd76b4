"""A design as plain sets, for the independent checks."""

from __future__ import annotations

from dataclasses import dataclass

from ..problem import BoolArray, NetworkProblem


@dataclass(frozen=True)
class Violation:
    """One place where a design breaks a rule.

    Attributes
    ----------
    kind
        "island", "uncovered", "dead end", "branch", "zigzag", "too close", "T-junction",
        "required", "barred", or the kind of a clause or pattern.
    text
        What is wrong, for a planner.
    edges, vertices
        Mesh edges and vertices concerned.
    hard
        Whether the rule was to hold under all circumstances.
    """

    kind: str
    text: str
    edges: tuple[int, ...] = ()
    vertices: tuple[int, ...] = ()
    hard: bool = True


@dataclass(frozen=True, eq=False)
class Facts:
    """A design as sets: nothing of it is shared with the solvers.

    Attributes
    ----------
    ends
        The two vertices of each edge.
    number
        Edge of each pair of vertices.
    chosen, existing
        Edges.
    sinks
        Vertices.
    quads
        Vertices of each face.
    """

    ends: dict[int, tuple[int, int]]
    number: dict[frozenset[int], int]
    chosen: set[int]
    existing: set[int]
    sinks: set[int]
    quads: list[list[int]]

    @property
    def on(self) -> set[int]:
        """All edges that are streets."""
        return self.chosen | self.existing

    @property
    def old(self) -> set[int]:
        """Vertices on existing streets."""
        return {v for e in self.existing for v in self.ends[e]}

    @property
    def lively(self) -> set[int]:
        """Vertices of chosen streets."""
        return {v for e in self.chosen for v in self.ends[e]}


def facts_of(problem: NetworkProblem, active: BoolArray) -> Facts:
    """Turn arrays into sets."""
    ends = {i: (int(a), int(b)) for i, (a, b) in enumerate(problem.mesh.edges)}
    return Facts(
        ends=ends,
        number={frozenset(pair): i for i, pair in ends.items()},
        chosen={i for i, on in enumerate(active) if on},
        existing={i for i, on in enumerate(problem.existing) if on},
        sinks={v for v, on in enumerate(problem.sinks) if on},
        quads=problem.mesh.faces.tolist(),
    )
