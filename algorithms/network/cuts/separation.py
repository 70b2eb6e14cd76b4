"""Search for component inequalities that a fractional solution violates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Optional

from .components import ComponentCut, Region, Regions, cover_cut, region_of

#: Violation below which an inequality is not worth a row.
LEAST = 1e-3
#: Neighbours of a set that are tried together with one further vertex.
PAIRS = 8
#: Loss of the first of two vertices above which the second is not tried.
STEP = 0.2


@dataclass(frozen=True)
class Point:
    """A fractional solution.

    Attributes
    ----------
    edge, vertex
        Value of each mesh edge and mesh vertex, 0 for those without a variable.
    ring, slack
        Value of the ring variable and of the coverage slack of a vertex, where there are some.
    """

    edge: Sequence[float]
    vertex: Sequence[float]
    ring: dict[int, float]
    slack: dict[int, float]

    def value(self, cut: ComponentCut) -> float:
        """Return by how much a solution violates an inequality; negative if it does not."""
        left = sum(self.vertex[u] for u in cut.vertices)
        left -= cut.share * sum(self.edge[e] for e in cut.edges)
        left += self.ring.get(cut.ring, 0.0) + self.slack.get(cut.cover, 0.0)
        return (1.0 if cut.base < 0 else self.vertex[cut.base]) - left


class Separator:
    """Finds component inequalities; sets begin as balls or single vertices and grow.

    Parameters
    ----------
    regions
        The problem.
    check
        Called often; may raise an error to end the work.

    Attributes
    ----------
    first
        The inequalities of the covered vertices.
    """

    def __init__(self, regions: Regions, check: Optional[Callable[[], None]] = None) -> None:
        self._regions = regions
        self._check: Callable[[], None] = check or (lambda: None)
        self.first: list[ComponentCut] = []
        self._seeds: list[tuple[Region, ComponentCut]] = []
        for v, ball in regions.index.cover:
            self._check()
            cut = cover_cut(regions, v, ball)
            if cut is None:
                continue
            self.first.append(cut)
            region = region_of(regions, ball)
            if region is not None and regions.no_pairs:
                self._seeds.append((region, cut))
        if regions.no_pairs:
            for u in regions.index.free:
                self._seeds.append((Region(regions, (u,), -1), ComponentCut((u,), (), base=u)))

    def find(self, point: Point) -> list[ComponentCut]:
        """Return violated inequalities, each set once, the most violated first."""
        found: dict[tuple[int, ...], tuple[float, ComponentCut]] = {}
        for seed, kind in self._seeds:
            self._check()
            region = self._grown(seed, point)
            if len(region.members) == len(seed.members):
                continue
            members = tuple(sorted(region.members))
            cut = ComponentCut(
                members, self._regions.inside(members), kind.ring, kind.cover, kind.base
            )
            violation = point.value(cut)
            if violation > LEAST and violation > found.get(members, (0.0,))[0]:
                found[members] = violation, cut
        return [cut for _, cut in sorted(found.values(), key=lambda pair: -pair[0])]

    def _grown(self, seed: Region, point: Point) -> Region:
        """Add vertices to a set while that lets y(U) - x(E(U)) fall."""
        region = seed.copy()
        while True:
            beside = self._beside(region, point)
            if not any(loss < -1e-6 and region.add(w) for loss, w in beside):
                further = self._two_more(region, beside, point)
                if further is None:
                    return region
                region = further

    def _beside(self, region: Region, point: Point) -> list[tuple[float, int]]:
        """List the neighbours of a set with what each adds to y(U) - x(E(U)), least first."""
        index = self._regions.index
        gain: dict[int, float] = {}
        for u in region.members:
            for e in index.incident[u]:
                w = index.vertex_of(e, u)
                if w not in region.members and self._regions.free[w]:
                    gain[w] = gain.get(w, 0.0) + point.edge[e]
        return sorted((point.vertex[w] - g, w) for w, g in gain.items())

    def _two_more(
        self, region: Region, beside: list[tuple[float, int]], point: Point
    ) -> Optional[Region]:
        """Add two vertices of which only the second pays, or return None."""
        index = self._regions.index
        for loss, w in beside[:PAIRS]:
            if loss > STEP:
                return None
            with_one: Optional[Region] = None
            for e in index.incident[w]:
                z = index.vertex_of(e, w)
                if z in region.members or not self._regions.free[z]:
                    continue
                links = sum(
                    point.edge[a]
                    for a in index.incident[z]
                    if index.vertex_of(a, z) in region.members
                )
                if loss + point.vertex[z] - point.edge[e] - links > -1e-4:
                    continue
                if with_one is None:
                    with_one = region.copy()
                    if not with_one.add(w):
                        break
                if with_one.add(z):
                    return with_one
        return None
