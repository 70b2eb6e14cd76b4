"""What a page tells: designs with pictures, runs, problems; targets, sources, who and when."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from .figures import Figure
from .pictures import Picture
from .solver import SolverFacts, solver_facts
from .targets import TargetResult
from .wishes import Wish

#: Tools that say nothing of how a design does, only of what was there before it.
_BEFORE = frozenset(("osmboundary", "osmlayers", "preparesite"))


@dataclass(frozen=True)
class Run:
    """One run of a tool.

    Attributes
    ----------
    tool
        Its name.
    title
        What it is called in the toolbox.
    wishes
        What was asked.
    figures
        What came out.
    """

    tool: str
    title: str
    wishes: tuple[Wish, ...] = ()
    figures: tuple[Figure, ...] = ()

    @property
    def solver(self) -> SolverFacts | None:
        """What a solver said, if one was at work."""
        return solver_facts(self.figures)


@dataclass(frozen=True)
class Problem:
    """One entry of a layer of problems: where, what, what to do, how grave."""

    layer: str
    feature: str
    problem: str
    action: str
    severity: str


@dataclass(frozen=True)
class LayerRow:
    """One layer of the page.

    Attributes
    ----------
    name
        What it is called.
    made_by
        Title of the tool that made it; empty for data.
    features
        Number of its features, or None for a raster.
    source
        File or service that it comes from, without its folder.
    crs
        Its coordinate reference system.
    """

    name: str
    made_by: str
    features: int | None
    source: str
    crs: str


@dataclass(frozen=True)
class Credit:
    """Whose the data of a layer is.

    Attributes
    ----------
    layer
        Name of the layer.
    attribution, licence, source, date
        As its metadata tell; empty where they do not.
    links
        Addresses for more, as text; the page only links to those of http and https.
    """

    layer: str
    attribution: str = ""
    licence: str = ""
    source: str = ""
    date: str = ""
    links: tuple[str, ...] = ()


@dataclass(frozen=True)
class Design:
    """One design.

    Attributes
    ----------
    name
        What it is called; no two of a report share a name.
    pictures
        Its maps; the first shows the whole plan.
    runs
        The runs that made and measured it.
    problems
        What they found wrong.
    layers
        Its layers.
    """

    name: str
    pictures: tuple[Picture, ...] = ()
    runs: tuple[Run, ...] = ()
    problems: tuple[Problem, ...] = ()
    layers: tuple[LayerRow, ...] = ()

    @property
    def figures(self) -> tuple[Figure, ...]:
        """Figures of all runs, in their order."""
        return tuple(own for run in self.telling for own in run.figures)

    @property
    def telling(self) -> tuple[Run, ...]:
        """The runs that say how the design does."""
        return tuple(run for run in self.runs if run.tool not in _BEFORE)

    def figure(self, tool: str, key: str) -> Figure | None:
        """Return a figure of a tool, or None; of two runs of a tool the first counts."""
        for run in self.telling:
            for own in run.figures:
                if run.tool == tool and own.key == key:
                    return own
        return None


@dataclass(frozen=True)
class Report:
    """Everything that a page tells.

    Attributes
    ----------
    title
        Its heading.
    date
        When it was written, as a reader writes dates.
    version
        Version of Platwright.
    place, author
        Where and who; empty for nothing.
    designs
        The designs.
    targets
        Targets held against them.
    data
        Layers of no design: what was there before.
    data_pictures
        Maps of them, where there is no design that shows them.
    credits
        Whose the data is.
    """

    title: str
    date: str
    version: str
    place: str = ""
    author: str = ""
    designs: tuple[Design, ...] = ()
    targets: tuple[TargetResult, ...] = ()
    data: tuple[LayerRow, ...] = ()
    data_pictures: tuple[Picture, ...] = ()
    credits: tuple[Credit, ...] = ()

    def compared(self) -> Iterator[tuple[Run, list[tuple[Figure, list[Figure | None]]]]]:
        """Yield, tool by tool, the figures that two designs or more have.

        Each as the figure of the first design that has it, and those of all designs in their
        order, None where one has none.
        """
        seen: set[str] = set()
        for run in (run for design in self.designs for run in design.telling):
            if run.tool in seen:
                continue
            seen.add(run.tool)
            rows = []
            for first in run.figures:
                found = [design.figure(run.tool, first.key) for design in self.designs]
                if sum(own is not None for own in found) > 1:
                    rows.append((first, found))
            if rows:
                yield run, rows
