"""Which groups of rules contradict each other: all smallest sets of them, and all cures.

A *conflict* is a set of groups that no network satisfies although it satisfies any of its
proper subsets; a *cure* is a set of groups, none of them superfluous, without which a network
is possible. Cures are exactly the minimal hitting sets of all conflicts (R. Reiter, A theory of
diagnosis from first principles, 1987), so that the two are found together: every hitting set of
the conflicts known so far is a cure or leads to another conflict.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Optional

from ..problem import BoolArray

Keys = frozenset[str]

#: Tells whether a network satisfies a set of groups: the network, False if there is none, or
#: None if that is not known.
Trial = Callable[[Keys], "BoolArray | bool | None"]


@dataclass(eq=False)
class Conflicts:
    """What is known about the contradictions between groups.

    Attributes
    ----------
    conflicts
        Sets of groups that cannot be met together.
    minimal
        For each of them, whether it is certain that every proper subset can be met.
    cures
        Sets of groups without which a network is possible, each with that network.
    complete
        Whether all of both are known, and all of them are minimal.
    """

    conflicts: list[Keys] = field(default_factory=list)
    minimal: list[bool] = field(default_factory=list)
    cures: list[tuple[Keys, BoolArray]] = field(default_factory=list)
    complete: bool = False


class _Known:
    """Trials whose answers are kept, and with them those of all sub- and supersets."""

    def __init__(
        self, trial: Trial, breaks: Callable[[BoolArray], Keys], every: Keys, seen: list[Keys]
    ) -> None:
        self.trial, self.breaks, self.every = trial, breaks, every
        self.met: list[tuple[Keys, BoolArray]] = []
        self.unmet: list[Keys] = list(seen)
        self.unknown: set[Keys] = set()

    def ask(self, groups: Keys) -> Optional[bool]:
        """Tell whether a network satisfies all of the groups; None if that is not known."""
        if any(groups <= kept for kept, _ in self.met):
            return True
        if any(bad <= groups for bad in self.unmet):
            return False
        if groups in self.unknown:
            return None
        found = self.trial(groups)
        if found is None:
            self.unknown.add(groups)
            return None
        if isinstance(found, bool):
            self.unmet.append(groups)
            return False
        self.take(found, groups)
        return True

    def take(self, network: BoolArray, groups: Keys = frozenset()) -> None:
        """Note a network; it may satisfy more groups than it was asked for."""
        self.met.append(((self.every - self.breaks(network)) | groups, network))

    def network(self, groups: Keys) -> BoolArray:
        """Return a network that satisfies the groups; there must be one."""
        return next(active for kept, active in self.met if groups <= kept)


def find_conflicts(
    groups: Iterable[str],
    trial: Trial,
    breaks: Callable[[BoolArray], Keys],
    over: Callable[[], bool],
    seen: Iterable[Keys] = (),
    networks: Iterable[BoolArray] = (),
    proven: bool = True,
) -> Conflicts:
    """Find conflicts and cures of a problem without any valid design.

    Parameters
    ----------
    groups
        Keys of all groups; they cannot be met together. The first are given up first where
        there is a choice.
    trial
        See `Trial`.
    breaks
        Tells the groups that a network breaks.
    over
        Tells that time is up; what is known by then is returned. Every conflict and every cure
        is one then, too, but a conflict may not be minimal.
    seen
        Sets of groups that are known already to be impossible together.
    networks
        Networks that may satisfy some groups; they save questions.
    proven
        Whether it is certain that no network satisfies all groups. If it is not, and does not
        become so, there are no conflicts in the result, and a cure may be an empty set: its
        network satisfies everything.

    Returns
    -------
    Conflicts
        Cures with few groups come first.
    """
    order = list(groups)
    every = frozenset(order)
    sets = sorted({one for one in seen if one <= every}, key=lambda one: (len(one), sorted(one)))
    known = _Known(trial, breaks, every, [every, *sets] if proven else sets)
    result = Conflicts()
    if not every or over():
        return result
    for network in networks:
        known.take(network)
    if not proven:
        # asked already, for as long as there was time
        known.unknown.add(every)
    for one in sets or [every]:
        if not any(conflict <= one for conflict in result.conflicts):
            _shrink(one, order, known, result, over)
    _follow(order, known, result, over)
    if not result.complete and not over():
        # what was not answered in a part of the time may be in the rest
        known.unknown &= {every}
        _follow(order, known, result, over)
    _collect(known, result)
    _drop_supersets(result)
    if not known.unmet:
        result.conflicts, result.minimal = [], []
    return result


def _collect(known: _Known, result: Conflicts) -> None:
    """Add the cures that networks met on the way turn out to be."""
    cures = {cure for cure, _ in result.cures}
    for kept, network in known.met:
        cure = known.every - kept
        # all groups together are taken to be impossible even if that is not proven
        bad = [known.every, *known.unmet]
        superfluous = [key for key in cure if not any(one <= kept | {key} for one in bad)]
        if cure not in cures and not superfluous:
            cures.add(cure)
            result.cures.append((cure, network))
    result.cures.sort(key=lambda found: len(found[0]))
    if result.cures and not result.cures[0][0]:
        # a network that satisfies everything
        result.cures, result.complete = result.cures[:1], False


def _follow(order: list[str], known: _Known, result: Conflicts, over: Callable[[], bool]) -> None:
    """Follow every hitting set of the conflicts to a cure or to another conflict."""
    rank = {key: i for i, key in enumerate(order)}
    done = {cure for cure, _ in result.cures}
    blocked = False
    while not over():
        hitting = [h for h in _hitting_sets(result.conflicts) if h not in done]
        if not hitting:
            result.complete = not blocked and all(result.minimal)
            return
        cure = min(hitting, key=lambda h: (len(h), sorted(rank[key] for key in h)))
        rest = known.every - cure
        answer = known.ask(rest)
        if answer is False:
            _shrink(rest, order, known, result, over)
            continue
        done.add(cure)
        if answer is None:
            blocked = True
        else:
            result.cures.append((cure, known.network(rest)))


def _drop_supersets(result: Conflicts) -> None:
    """Leave out conflicts that another one is part of; they were not reduced for lack of time."""
    kept = [
        (one, certain)
        for one, certain in zip(result.conflicts, result.minimal)
        if not any(other < one for other in result.conflicts)
    ]
    result.conflicts = [one for one, _ in kept]
    result.minimal = [certain for _, certain in kept]


def _shrink(
    start: Keys, order: list[str], known: _Known, result: Conflicts, over: Callable[[], bool]
) -> None:
    """Reduce a set that cannot be met to a conflict, and note that."""
    left, certain = start, True
    for key in order:
        if key not in left:
            continue
        answer = None if over() else known.ask(left - {key})
        if answer is False:
            left -= {key}
        elif answer is None:
            certain = False
    if left < start:
        known.unmet.append(left)
    result.conflicts.append(left)
    result.minimal.append(certain)


def _hitting_sets(sets: list[Keys]) -> list[Keys]:
    """Return all minimal sets that share an element with each of the sets (Berge).

    Examples
    --------
    >>> found = _hitting_sets([frozenset("ab"), frozenset("bc")])
    >>> sorted("".join(sorted(s)) for s in found)
    ['ac', 'b']
    """
    found: list[Keys] = [frozenset()]
    for one in sets:
        grown = {h for h in found if h & one}
        grown |= {h | {key} for h in found if not h & one for key in one}
        found = [h for h in grown if not any(other < h for other in grown)]
    return found
