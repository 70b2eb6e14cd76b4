"""Where a site has no design: the reasons as places that a map can show."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import shapely

from ..errors import InfeasibleError, InputError, PlatwrightError
from ..mesh import QuadMesh
from ..network.problem import NetworkProblem
from ..network.why.whynot import Diagnosis
from ..site.types import Site

#: No more than so many places are told of one reason.
MOST = 100


@dataclass(frozen=True)
class Place:
    """A place where something keeps a site from having a design, or what is asked from being kept.

    Attributes
    ----------
    point
        Where, in the working CRS.
    problem
        What is wrong there.
    action
        What was done about it, or could be.
    """

    point: shapely.Point
    problem: str
    action: str


class NoDesignError(InfeasibleError):
    """A site has no design, or several have none; the places say where and why.

    Attributes
    ----------
    places
        Places in the working CRS of the site; those of the first of several sites that has any.
    failures
        The sites without a design and the error of each; those of one site are this error.
    """

    def __init__(self, error: InfeasibleError, places: Sequence[Place]) -> None:
        super().__init__(str(error), error.diagnosis)
        self.places = tuple(places)
        self.failures: tuple[tuple[Site, PlatwrightError], ...] = ()


def no_design(failures: Sequence[tuple[Site, PlatwrightError]]) -> PlatwrightError:
    """Return the error of a run in which no site has a design.

    Parameters
    ----------
    failures
        The sites, at least one, and the error of each.

    Returns
    -------
    PlatwrightError
        Where one of them has places, a `NoDesignError` that holds them all; else the first.
    """
    placed = [error for _, error in failures if isinstance(error, NoDesignError)]
    if not placed:
        return failures[0][1]
    found = placed[0]
    if len(failures) > 1:
        text = " ".join(f"{site.name}: {error}" for site, error in failures)
        found = NoDesignError(InfeasibleError(text, placed[0].diagnosis), placed[0].places)
    found.failures = tuple(failures)
    return found


def located(error: InfeasibleError, problem: NetworkProblem) -> InfeasibleError:
    """Return the error of a network problem with the places that it is about.

    Parameters
    ----------
    error
        What `solve` raised.
    problem
        The problem that it was raised for.
    """
    if error.diagnosis is None:
        return error
    return NoDesignError(error, list(_places(error.diagnosis, problem.mesh)))


def _places(found: Diagnosis, mesh: QuadMesh) -> Iterator[Place]:
    """Yield the places of reasons, and of what each way out would break."""
    for reason in found.reasons:
        names = [found.groups.get(rule, rule) for rule in reason.rules]
        action = f"Give up, or give a price to: {'; '.join(names)}." if names else "See the log."
        for point in _points(mesh, reason.vertices, reason.edges):
            yield Place(point, reason.text, action)
    for cure in found.cures:
        names = [found.groups.get(rule, rule) for rule in cure.groups]
        for broken in cure.violations[:MOST]:
            for point in _points(mesh, broken.vertices, broken.edges)[:1]:
                text = f"Without '{', '.join(names)}' there is a design; here it would be broken."
                yield Place(point, text, broken.text)


def _points(mesh: QuadMesh, vertices: Sequence[int], edges: Sequence[int]) -> list[shapely.Point]:
    """Return the middles of edges, or the vertices where there are no edges."""
    if edges:
        middles = mesh.vertices[mesh.edges[list(edges)]].mean(axis=1)
        return [shapely.Point(xy) for xy in middles[:MOST]]
    return [shapely.Point(mesh.vertices[v]) for v in list(vertices)[:MOST]]


def is_proven(error: Exception) -> bool:
    """Whether an error says that what is asked cannot be, not that it was not found."""
    return isinstance(error, InputError) or getattr(error, "diagnosis", None) is not None


def rank(error: Exception) -> int:
    """Tell which of several errors says most: the least number."""
    if isinstance(error, InfeasibleError):
        return 0 if error.diagnosis is not None else 1
    return 2 if isinstance(error, InputError) else 3
