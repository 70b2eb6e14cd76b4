"""First designs for any sinks: mesh lines at even distances, then without what is not needed.

Where all of the boundary is a sink, straight lines from sink to sink are a network at once
(`chords`). Elsewhere lines of both directions are laid over the mesh, every s-th of them, so that
they cross and hang together; ends that lead nowhere are cut off. With s = 2 k + 1 such a grid
covers all within k edges. Then streets between two junctions are taken away one after the other
as long as that makes the design better.
"""

from __future__ import annotations

import math
from collections import defaultdict, deque

import numpy as np

from ..evaluate import Evaluator
from ..incumbent import Incumbent, slight
from ..problem import BoolArray
from ..structure import Structure
from .chords import LONGEST, chord_start, follow

#: Up to this many edges times trials are spent on taking streets away.
PRUNING = 120_000
#: Up to this many usable edges several starts are made.
MANY = 1500
#: Distances between lines that are tried, in edges, at most.
WIDEST = 9


def first_design(run: Incumbent, index: Structure) -> list[BoolArray]:
    """Take a design of straight lines if there is a valid one, and better ones made from it.

    Parameters
    ----------
    run
        The run.
    index
        The problem.

    Returns
    -------
    list of BoolArray
        Valid designs from which searches may start, best first; each shape (e,).
    """
    pool: list[tuple[float, BoolArray]] = []
    for active in straight_designs(run, index):
        if run.enough():
            break
        less = prune(index, run.evaluator, active, run)
        run.take(less)
        pool.append((run.evaluator.objective(less), less))
    return [active for _, active in sorted(pool, key=lambda entry: entry[0])]


def straight_designs(run: Incumbent, index: Structure) -> list[BoolArray]:
    """Return the valid designs of straight lines, which the run takes."""
    check = run.wanted()
    found: list[BoolArray] = []
    if any(index.root[v] and mine for v, mine in enumerate(index.incident)):
        active = chord_start(index, min(LONGEST, run.deadline.left))
        if active is not None and math.isfinite(run.evaluator.objective(active)):
            run.take(active)
            run.report()
            found.append(active)
    check()
    # on large meshes one start is as many as there is time for
    if run.best is None or len(index.edges) <= MANY:
        found += _grids(run, index)
    return found


def _grids(run: Incumbent, index: Structure) -> list[BoolArray]:
    """Return the valid grids of lines, those with the widest squares first."""
    lines = Lines(index)
    reach = index.problem.cover_radius or 2
    found: list[BoolArray] = []
    for spacing in range(min(2 * reach + 1, WIDEST), 1, -1):
        if run.enough() or (found and len(index.edges) > MANY):
            break
        for shift in range(2):
            active = lines.every(spacing, shift)
            if math.isfinite(run.evaluator.objective(active)):
                run.take(active)
                run.report()
                found.append(active)
                break
    return found


class Lines:
    """The mesh lines of a problem and which of them run side by side.

    Parameters
    ----------
    index
        The problem.

    Attributes
    ----------
    lines
        Usable edges of each line, in order; every usable edge is in one line.
    beside
        For each line, those next to it.
    """

    def __init__(self, index: Structure) -> None:
        self.index = index
        self.lines: list[list[int]] = []
        of_edge = np.full(len(index.ends), -1, dtype=np.int64)
        for edge in index.edges:
            if of_edge[edge] >= 0:
                continue
            u, v = index.ends[edge]
            ahead, _ = follow(index, edge, v, through=True)
            back: list[int] = []
            if not (ahead and ahead[-1] == edge):
                back, _ = follow(index, edge, u, through=True)
                ahead = [edge, *ahead]
            line = [*reversed(back), *ahead]
            of_edge[line] = len(self.lines)
            self.lines.append(line)
        pairs = of_edge[index.problem.mesh.opposite_pairs()]
        pairs = np.unique(np.sort(pairs[(pairs >= 0).all(axis=1)], axis=1), axis=0)
        self.crooked = {a for a, b in pairs.tolist() if a == b}
        self.beside: dict[int, list[int]] = defaultdict(list)
        for a, b in pairs.tolist():
            if a != b:
                self.beside[a].append(b)
                self.beside[b].append(a)
        self._covers = self._coverage()

    def _coverage(self) -> list[set[int]]:
        """Return what each line covers, as positions in `index.cover`."""
        covered_by: dict[int, list[int]] = defaultdict(list)
        for i, (_, ball) in enumerate(self.index.cover):
            for u in ball:
                covered_by[u].append(i)
        ends = self.index.ends
        return [{i for e in line for v in ends[e] for i in covered_by[v]} for line in self.lines]

    def every(self, spacing: int, shift: int = 0) -> BoolArray:
        """Lay every `spacing`-th line over the mesh, and more where something is left uncovered.

        Parameters
        ----------
        spacing
            Distance of lines side by side, in lines.
        shift
            Which line to begin with where no sink says so.
        """
        depth: dict[int, int] = {}
        chosen: list[int] = []
        for first in self._seeds(shift):
            if first in depth:
                continue
            depth[first] = 0
            queue = deque([first])
            while queue:
                a = queue.popleft()
                if depth[a] % spacing == 0 and self._fits(a, chosen):
                    chosen.append(a)
                for b in self.beside[a]:
                    if b not in depth:
                        depth[b] = depth[a] + 1
                        queue.append(b)
        self._fill(chosen)
        active = np.zeros(len(self.index.ends), dtype=bool)
        for a in chosen:
            active[self.lines[a]] = True
        return connected(self.index, active)

    def _seeds(self, shift: int) -> list[int]:
        """Return the lines in the order in which they may be the first of their direction."""
        sinks, ends = self.index.problem.sinks, self.index.ends
        exits = [sum(bool(sinks[v]) for e in line for v in ends[e]) for line in self.lines]
        order = sorted(range(len(self.lines)), key=lambda a: (-exits[a], -len(self.lines[a]), a))
        some = [a for a in order if exits[a]]
        return some[shift:] + some[:shift] + [a for a in order if not exits[a]]

    def _fits(self, a: int, chosen: list[int]) -> bool:
        """Tell whether a line keeps a distance from those that are chosen."""
        return a not in self.crooked and not set(self.beside[a]) & set(chosen)

    def _fill(self, chosen: list[int]) -> None:
        """Add lines until all that lines can cover is covered."""
        taken = set(chosen)
        barred = {b for a in chosen for b in self.beside[a]} | self.crooked | taken
        missing = set(range(len(self.index.cover)))
        for a in chosen:
            missing -= self._covers[a]
        while missing:
            able = [a for a in range(len(self.lines)) if a not in barred]
            best = max(able, key=lambda a: len(self._covers[a] & missing), default=-1)
            if best < 0 or not self._covers[best] & missing:
                return
            chosen.append(best)
            barred |= {best, *self.beside[best]}
            missing -= self._covers[best]


def connected(index: Structure, active: BoolArray) -> BoolArray:
    """Return the part of a design that leads to sinks, without ends that lead nowhere."""
    kept = active.copy()
    degree = np.bincount(index.problem.mesh.edges[kept].ravel(), minlength=len(index.incident))
    stack = [v for v in np.flatnonzero(degree == 1).tolist() if index.two[v]]
    while stack:
        v = stack.pop()
        for e in index.incident[v]:
            if kept[e]:
                kept[e] = False
                for w in index.ends[e]:
                    degree[w] -= 1
                    if degree[w] == 1 and index.two[w]:
                        stack.append(w)
    reached = {v for v, root in enumerate(index.root) if root}
    queue = deque(v for v in reached if index.incident[v])
    while queue:
        v = queue.popleft()
        for e in index.incident[v]:
            w = index.vertex_of(e, v)
            if kept[e] and w not in reached:
                reached.add(w)
                queue.append(w)
    for e in np.flatnonzero(kept).tolist():
        kept[e] = index.ends[e][0] in reached
    return kept


def chains(index: Structure, active: BoolArray) -> list[list[int]]:
    """List the streets between junctions, sinks and ends, longest first."""
    on = active.tolist()
    at = [[e for e in mine if on[e]] for mine in index.incident]
    stops = [len(mine) != 2 or index.root[v] for v, mine in enumerate(at)]
    seen: set[int] = set()
    found: list[list[int]] = []
    for v, mine in enumerate(at):
        for e in mine if stops[v] else ():
            if e in seen:
                continue
            chain, here = [e], index.vertex_of(e, v)
            while not stops[here]:
                a, b = at[here]
                chain.append(b if chain[-1] == a else a)
                here = index.vertex_of(chain[-1], here)
            seen.update(chain)
            found.append(chain)
    return sorted(found, key=lambda chain: (-len(chain), chain))


def prune(
    index: Structure, evaluator: Evaluator, active: BoolArray, run: Incumbent | None = None
) -> BoolArray:
    """Take streets away as long as the design becomes better.

    Parameters
    ----------
    index
        The problem.
    evaluator
        Judges designs.
    active
        Shape (e,). A valid design.
    run
        Asked whether to stop; None for never.
    """
    best, value = active.copy(), evaluator.objective(active)
    left = PRUNING // max(1, len(index.ends))
    improved = True
    while improved and left > 0:
        improved = False
        for chain in chains(index, best):
            if left <= 0 or not best[chain].all():
                continue
            if run is not None and run.enough():
                return best
            left -= 1
            tried = best.copy()
            tried[chain] = False
            tried = connected(index, tried)
            found = evaluator.objective(tried)
            if math.isfinite(found) and found < value - slight(found):
                best, value, improved = tried, found, True
    return best
