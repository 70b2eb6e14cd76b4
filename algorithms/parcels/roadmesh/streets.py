"""Streets of a mesh as lines between junctions, and how they are ranked."""

from __future__ import annotations

from dataclasses import dataclass

from shapely.geometry import LineString

from ..edges import EdgeKind
from .mesh import StreetMesh


@dataclass(frozen=True)
class MeshStreet:
    """A piece of a street between two junctions.

    Attributes
    ----------
    line
        Centre line, metres.
    street
        Number of the street that it is part of.
    width
        Metres.
    ends
        Numbers of the vertices at its ends.
    fixed
        Whether it was given.
    """

    line: LineString
    street: int
    width: float
    ends: tuple[int, int]
    fixed: bool


def street_graph(mesh: StreetMesh) -> dict[int, list[int]]:
    """Neighbours of each vertex along streets."""
    found: dict[int, list[int]] = {}
    for (a, b), edge in mesh.edges.items():
        if edge.street >= 0:
            found.setdefault(a, []).append(b)
            found.setdefault(b, []).append(a)
    return found


def street_lines(mesh: StreetMesh) -> list[MeshStreet]:
    """Join the edges of streets to lines between junctions.

    Parameters
    ----------
    mesh
        The mesh. Existing streets along its outer edge are not among its streets.

    Returns
    -------
    list of MeshStreet
        In a fixed order. A junction is a vertex at which three edges of streets or of the
        site's edge meet, or where the number of the street changes.
    """
    degree = mesh.degrees()
    graph = street_graph(mesh)

    def through(v: int) -> bool:
        if degree[v] != 2 or len(graph[v]) != 2:
            return False
        a, b = graph[v]
        first, second = mesh.edge(a, v), mesh.edge(v, b)
        return (first.street, first.width) == (second.street, second.width)

    seen: set[tuple[int, int]] = set()
    found = []
    starts = [v for v in sorted(graph) if not through(v)] + sorted(graph)
    for start in starts:
        for first in graph[start]:
            if (start, first) in seen:
                continue
            chain = [start, first]
            while through(chain[-1]) and chain[-1] != start:
                a, b = graph[chain[-1]]
                chain.append(b if a == chain[-2] else a)
            seen.update(zip(chain[:-1], chain[1:]))
            seen.update(zip(chain[1:], chain[:-1]))
            edge = mesh.edge(start, first)
            found.append(
                MeshStreet(
                    LineString(mesh.xy[chain]),
                    edge.street,
                    edge.width,
                    (start, chain[-1]),
                    edge.fixed,
                )
            )
    return found


def dead_ends(mesh: StreetMesh) -> list[int]:
    """Vertices at which a street ends at an edge that is no street."""
    found = []
    graph = street_graph(mesh)
    around: dict[int, list[EdgeKind]] = {}
    for (a, b), edge in mesh.edges.items():
        for v in (a, b):
            if v in graph and len(graph[v]) == 1 and edge.street < 0:
                around.setdefault(v, []).append(edge.kind)
    for v, kinds in around.items():
        if all(kind == EdgeKind.CLOSED for kind in kinds):
            found.append(v)
    return sorted(found)
