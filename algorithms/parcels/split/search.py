"""Splitting regions along streets until parcels fit, with second thoughts (UP section 3)."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from shapely.geometry import LineString, MultiLineString, Polygon

from ...errors import CancelledError
from ...progress import Progress, Silent
from ..edges import EdgeKind
from ..roadmesh import StreetMesh
from ..rules import ParcelRules
from .choosing import Chooser
from .cutting import cut, fit_ends, locate
from .ground import Samples, block_length, parts, sample
from .junctions import junctions_of
from .proposals import MOST_STRAIGHT, Proposal, propose, straight
from .rings import open_holes, tie
from .rules import SplitRules

Floats = npt.NDArray[np.float64]
#: Proposals that are looked at, and valid ones among which is chosen.
LOOKED_AT = 60
CHOSEN_FROM = 8
#: Second thoughts: how many streets of one region are tried, and how often in all.
TRIES = 3
SECOND_THOUGHTS = 24
#: Samples are this far apart, in parcel depths.
SPACING = 1 / 4
#: Streets that end at an edge without a street are longer than so many parcel depths.
STUB = 2.5
#: Weight of unequal halves where a long block is cut across.
BALANCE = 2.0


@dataclass
class Split:
    """What splitting led to.

    Attributes
    ----------
    mesh
        The streets and regions.
    unserved
        Regions with land too far from access that no street could be found for, and how much of
        it they have, square metres.
    """

    mesh: StreetMesh
    unserved: dict[int, float] = field(default_factory=dict)


@dataclass
class Splitter:
    """Splits the regions of a mesh.

    Parameters
    ----------
    mesh
        The mesh to begin with; it is not changed.
    rules, split
        What is asked of parcels and streets.
    arriving
        Places and directions of existing streets at the edge of the site.
    guides
        Drawn lines that a guided field follows, metres.
    seed
        The best street is always taken first for 0, else one at random by its quality.
    progress
        Told how much land is served, asked for cancellation.
    """

    mesh: StreetMesh
    rules: ParcelRules
    split: SplitRules
    arriving: Sequence[tuple[Floats, Floats]] = ()
    guides: Sequence[LineString] = ()
    seed: int = 0
    progress: Progress = field(default_factory=Silent)

    def run(self) -> Split:
        """Split every region.

        Raises
        ------
        CancelledError
            If the caller cancels.
        """
        self._start(self.mesh.copy(), self.seed)
        unserved: dict[int, float] = {}
        for region in sorted(self._mesh.regions, key=lambda r: -self._mesh.polygon(r).area):
            samples = sample(self._mesh, region, self._spacing)
            unserved.update(self._solve(region, samples))
        return Split(self._mesh, unserved)

    def again(self, mesh: StreetMesh, region: int, parts: Sequence[int], seed: int) -> Split | None:
        """Split a region otherwise than it was.

        Parameters
        ----------
        mesh
            Holds the parts of the region; it is not changed.
        region
            Number of the region that was split, see `StreetMesh.families`.
        parts
            Numbers of its parts.
        seed
            Of the random choices.

        Returns
        -------
        Split or None
            None if no street was found.
        """
        trial = mesh.copy()
        whole = trial.merge(region, parts)
        self._start(trial, seed)
        unserved = self._solve(whole, sample(trial, whole, self._spacing))
        return None if whole in self._mesh.regions else Split(self._mesh, unserved)

    def _start(self, mesh: StreetMesh, seed: int) -> None:
        """Begin with a mesh, which is changed."""
        self._rng = np.random.default_rng(seed)
        self._random = seed != 0
        asked = self.split.templates
        turning = self.split.turning_radius
        self._chooser = None if asked is None else Chooser(asked, self.rules, turning)
        self._mesh = mesh
        self._next = 1 + max((e.street for e in mesh.edges.values()), default=-1)
        self._left = SECOND_THOUGHTS
        self._spacing = SPACING * self.rules.depth
        self._area = sum(mesh.polygon(r).area for r in mesh.regions)
        self._done = 0.0

    def _solve(self, region: int, samples: Samples) -> dict[int, float]:
        """Split a region and its parts; return what stays unserved, by region."""
        self._ask()
        polygon = self._mesh.polygon(region)
        if samples.deepest <= 0:
            return self._served(polygon.area)
        for hole in open_holes(self._mesh, region):
            made = tie(self._mesh, region, hole, self._next, self.split.street_width)
            if made:
                self._next += 2
                return self._parts(made)
        deep = samples.deepest > self.split.largest_depth * self.rules.depth
        long = block_length(polygon) > self.split.max_block_length
        if self._chooser is not None and (deep or not long):
            rng = self._rng if self._random else None
            name = self._chooser.choose(self._mesh, region, whole=not deep, rng=rng)
            if name:
                self._mesh.labels[region] = name
                return self._served(polygon.area)
        if not deep and not long:
            return self._served(polygon.area)
        bare = self._split(region, samples, across=not deep)
        if bare is None:
            self._served(polygon.area)
            return {region: self._bare(samples)} if deep else {}
        return bare

    def _split(self, region: int, samples: Samples, *, across: bool) -> dict[int, float] | None:
        """Split a region along the best of some streets; None if there is no street for it."""
        found = self._proposals(region, samples, across=across)
        best: tuple[float, StreetMesh, float, dict[int, float]] | None = None
        before, done = self._mesh, self._done
        for at in range(1 if across else TRIES):
            if at and self._left <= 0:
                break
            # streets that are looked at lie in the mesh as it was
            self._mesh, self._done = before, done
            proposal = next(found, None)
            if proposal is None:
                break
            self._left -= at > 0
            if not across:
                self._mesh = before.copy()
            bare = self._try(region, samples, proposal)
            total = sum(bare.values())
            if best is None or total < best[0]:
                best = (total, self._mesh, self._done, bare)
            if total <= self.rules.area:
                break
        if best is None:
            return None
        _, self._mesh, self._done, bare = best
        return bare

    def _try(self, region: int, samples: Samples, proposal: Proposal) -> dict[int, float]:
        """Put a street in, and solve the parts."""
        number, self._next = self._next, self._next + len(proposal.lines)
        width = self.split.street_width
        more = samples.beside(MultiLineString(proposal.lines), width)
        return self._parts(cut(self._mesh, region, proposal.lines, number, width), more)

    def _parts(self, made: list[int], samples: Samples | None = None) -> dict[int, float]:
        """Solve the parts of a region, the largest first; without samples these are made."""
        bare: dict[int, float] = {}
        for part in sorted(made, key=lambda r: -self._mesh.polygon(r).area):
            if samples is None:
                own = sample(self._mesh, part, self._spacing)
            else:
                own = samples.within(self._mesh.polygon(part))
            bare.update(self._solve(part, own))
        return bare

    def _proposals(self, region: int, samples: Samples, *, across: bool) -> Iterator[Proposal]:
        """Propose streets that leave two good parts, in the order in which they are tried."""
        found = self._sound(region, samples, across=across)
        if not across and not self._random:
            return found  # they come in their order, and mostly the first will do
        some = sorted(itertools.islice(found, CHOSEN_FROM), key=lambda p: p.quality)
        return iter(self._shuffled(some) if self._random else some)

    def _sound(self, region: int, samples: Samples, *, across: bool) -> Iterator[Proposal]:
        """Yield streets that leave two good parts; across a region the evenness counts, too."""
        polygon = self._mesh.polygon(region)
        junctions = junctions_of(self._mesh, region, self.arriving)
        kinds = self._mesh.kinds(region)
        offered = propose(
            polygon, kinds, junctions, self.rules, self.split, across=across, guides=self.guides,
            seed=int(self._rng.integers(2**31)),
        )  # fmt: skip
        for proposal in _with_straight(offered, polygon, across=across):
            self._ask()
            lines = tuple(fit_ends(self._mesh, region, line, junctions) for line in proposal.lines)
            worse = self._judge(region, samples, lines, across=across)
            if worse is not None:
                yield Proposal(lines, proposal.quality + worse)

    def _judge(
        self, region: int, samples: Samples, lines: Sequence[LineString], *, across: bool
    ) -> float | None:
        """Tell how much worse a street is than its quality says, None where it cannot be."""
        polygon = self._mesh.polygon(region)
        if not self._leads_somewhere(region, lines):
            return None
        made = parts(polygon, lines) if all(line.is_simple for line in lines) else None
        if made is None or min(part.area for part in made) < 3 * self.rules.area:
            return None
        more = samples.beside(MultiLineString(lines), self.split.street_width)
        for part in made:
            if more.within(part).deepest < self.split.least_depth * self.rules.depth:
                return None
        if across:
            first, second = (part.area for part in made)
            return float(BALANCE * abs(first - second) / polygon.area)
        return 0.0

    def _leads_somewhere(self, region: int, lines: Sequence[LineString]) -> bool:
        """Tell whether a street is reached from one end at least, and is no stub at the other."""
        if len(lines) > 1:
            return True
        (line,) = lines
        blind = 0
        for xy in (line.coords[0], line.coords[-1]):
            _, (a, b), vertex = locate(self._mesh, region, np.array(xy))
            if vertex is None:
                blind += self._mesh.edge(a, b).kind == EdgeKind.CLOSED
            else:
                around = [self._mesh.edge(vertex, v) for v in self._mesh.neighbours(vertex)]
                blind += all(edge.kind == EdgeKind.CLOSED for edge in around)
        return blind == 0 or (blind == 1 and line.length > STUB * self.rules.depth)

    def _shuffled(self, found: list[Proposal]) -> list[Proposal]:
        """Bring proposals into a random order in which the better ones tend to be first."""
        if not found:
            return found
        quality = np.array([p.quality for p in found])
        spread = max(float(quality.max() - quality.min()), 1e-9)
        keys = quality / spread * 3 + self._rng.gumbel(size=len(found))
        return [found[k] for k in np.argsort(keys)]

    def _ask(self) -> None:
        """Stop where the caller wants it."""
        if self.progress.cancelled():
            msg = "cancelled while streets were laid"
            raise CancelledError(msg)

    def _served(self, area: float) -> dict[int, float]:
        """Take note of land that is done."""
        self._done += area
        self.progress.stage("Laying streets", min(1.0, self._done / self._area))
        return {}

    def _bare(self, samples: Samples) -> float:
        """Area of the land that is too far from access, square metres."""
        limit = self.split.largest_depth * self.rules.depth
        return float((samples.depth > limit).sum()) * self._spacing**2


def _with_straight(
    offered: Sequence[Proposal], polygon: Polygon, *, across: bool
) -> Iterator[Proposal]:
    """Yield the proposals that are looked at; straight streets are made only if these run out."""
    if across:
        yield from offered[: LOOKED_AT + MOST_STRAIGHT]
        return
    yield from offered[:LOOKED_AT]
    yield from straight(polygon)
