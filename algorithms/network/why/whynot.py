"""Why is there no design? Places, conflicts between groups of rules, and what gives way."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from dataclasses import dataclass
from typing import Optional, Union

import numpy as np

from ...errors import CancelledError, InfeasibleError
from ...progress import Deadline, Progress
from ..checks.facts import Violation, facts_of
from ..checks.requirements import check_one
from ..cp.sat import CpOptions, full_network, run_cp
from ..evaluate import Evaluator
from ..incumbent import Incumbent
from ..problem import BoolArray, NetworkProblem
from ..search.cp_strategy import first_start
from ..search.mip_strategy import solve_by_mip
from ..search.starts import first_design
from ..structure import Structure, structure
from .conflicts import Conflicts, Keys, find_conflicts
from .groups import broken_groups, hard_groups, regroup
from .reasons import Reason, find_reasons, stock_designs, usable_edges

#: Seconds for a whole diagnosis.
SECONDS = 5.0
#: Part of it for finding conflicts and cures; the rest goes to what cures cost.
SEARCH_SHARE = 0.6
#: Part of the time left for one question whether some groups can be met together.
TRIAL_SHARE = 0.4
#: Cures whose cost is looked for at most.
CURES = 6


@dataclass(frozen=True)
class Conflict:
    """Groups of rules that no network meets together.

    Attributes
    ----------
    groups
        Keys of the groups.
    minimal
        Whether any of them given up is certain to end this contradiction.
    """

    groups: tuple[str, ...]
    minimal: bool


@dataclass(frozen=True, eq=False)
class Cure:
    """Groups of rules to give up together, and what that costs.

    Attributes
    ----------
    groups
        Keys of the groups; none is superfluous.
    count
        Violations of these groups in the design that was found.
    least
        Whether no design has fewer.
    violations
        The violations, with edges and vertices for a map.
    active
        Shape (e,). The design.
    """

    groups: tuple[str, ...]
    count: int
    least: bool
    violations: tuple[Violation, ...]
    active: BoolArray


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Why a problem has no design, and what would help.

    Attributes
    ----------
    groups
        All groups of hard rules: key -> text for a planner.
    reasons
        What is impossible in a place, found without a search.
    conflicts
        Smallest sets of groups that contradict each other.
    cures
        Smallest sets of groups to give up, those of one group first. Each is also a proof
        that a network is possible then.
    complete
        Whether these are all conflicts and cures.
    proven
        Whether it is certain that there is no design.
    text
        The same in sentences.
    """

    groups: dict[str, str]
    reasons: tuple[Reason, ...]
    conflicts: tuple[Conflict, ...]
    cures: tuple[Cure, ...]
    complete: bool
    proven: bool
    text: str


def diagnose(
    problem: NetworkProblem,
    *,
    by_cp: bool = True,
    seed: int = 1,
    seconds: float = SECONDS,
    proven: bool = True,
    progress: Optional[Progress] = None,
) -> Diagnosis:
    """Find out why a problem has no design.

    Parameters
    ----------
    problem
        A problem that has no valid design, or for which none was found.
    by_cp
        Whether CP-SAT answers; else HiGHS.
    seed
        Seed of random choices.
    seconds
        Time for all of it.
    proven
        Whether it is certain that there is no design.
    progress
        Asked for cancellation, which returns what is known.

    Returns
    -------
    Diagnosis
    """
    deadline = Deadline(seconds, progress)
    groups = hard_groups(problem)
    reasons = find_reasons(problem)
    proven = proven or bool(reasons)
    found = Conflicts()
    cures: tuple[Cure, ...] = ()
    if problem.sinks.any():
        solver = _Solver(problem, by_cp, seed, progress)
        search = Deadline(seconds * SEARCH_SHARE, progress)
        found = find_conflicts(
            groups,
            lambda kept: solver.trial(kept, TRIAL_SHARE * search.left),
            lambda active: broken_groups(problem, active)[0],
            search.passed,
            {frozenset(reason.rules) for reason in reasons},
            stock_designs(problem),
            proven,
        )
        reasons += _alone(problem, found, solver, deadline)
        cures = tuple(_cures(solver, groups, found, deadline))
    conflicts = tuple(
        Conflict(_ordered(groups, one), certain)
        for one, certain in zip(found.conflicts, found.minimal)
    )
    proven = proven or bool(conflicts)
    text = _text(groups, reasons, conflicts, cures, found.complete, proven)
    return Diagnosis(groups, tuple(reasons), conflicts, cures, found.complete, proven, text)


def _ordered(groups: dict[str, str], some: Keys) -> tuple[str, ...]:
    """Return keys in the order of all groups."""
    return tuple(key for key in groups if key in some)


class _Solver:
    """Answers questions about parts of the rules of a problem."""

    def __init__(
        self, problem: NetworkProblem, by_cp: bool, seed: int, progress: Optional[Progress]
    ) -> None:
        self.problem, self.by_cp, self.seed, self.progress = problem, by_cp, seed, progress

    def trial(self, kept: Keys, seconds: float) -> Union[BoolArray, bool, None]:
        """Look for any network that meets some groups; see `conflicts.Trial`."""
        return self._any(_reduced(regroup(self.problem, kept)), seconds)

    def _any(self, problem: NetworkProblem, seconds: float) -> Union[BoolArray, bool, None]:
        """Look for any valid design."""
        none = np.zeros_like(problem.candidate)
        evaluator = Evaluator(problem)
        if math.isfinite(evaluator.objective(none)):
            return none
        index = structure(problem)
        if index.conflicts:
            return False
        # a relative gap of 1 is any design
        run = Incumbent(evaluator, Deadline(seconds, self.progress), gap=1.0)
        try:
            if self.by_cp:
                first_design(run, index)
                possible = run.best is not None or first_start(run, index, self.seed)
            else:
                possible = solve_by_mip(run, index, self.seed, "highs")
        except (CancelledError, InfeasibleError):
            return None
        if run.best is not None:
            return run.best
        return None if possible else False

    def alone(self, number: int, seconds: float) -> Optional[bool]:
        """Tell whether a network meets one requirement, were it the only rule."""
        one = self.problem.requirements[number]
        only = dataclasses.replace(self.problem, requirements=(one,))
        found = self._any(_reduced(regroup(only, (f"requirement:{one.kind}",))), seconds)
        return found if found is None or isinstance(found, bool) else True

    def least(self, cure: Keys, start: BoolArray, seconds: float) -> tuple[BoolArray, bool]:
        """Look for the design that breaks some groups least often, all others being met.

        Returns
        -------
        BoolArray
            Shape (e,). The design.
        bool
            Whether it is proven that none breaks them less often.
        """
        kept = hard_groups(self.problem).keys() - cure
        soft = _reduced(regroup(self.problem, kept, cure))
        index = structure(soft)
        run = Incumbent(Evaluator(soft), Deadline(seconds, self.progress), grain=1)
        run.take(start)
        # no design is without violation
        run.raise_bound(max(1.0, index.fixed))
        if run.best is not None and index.edges and not run.enough():
            with contextlib.suppress(CancelledError, InfeasibleError):
                if self.by_cp:
                    self._improve(run, index)
                else:
                    solve_by_mip(run, index, self.seed, "highs")
        best = start if run.best is None else run.best
        return best, run.closed()

    def _improve(self, run: Incumbent, index: Structure) -> None:
        """Let CP-SAT break fewer rules; without a linear relaxation it does so fastest."""
        network = full_network(index, cuts=[], ranks=True, start=run.best, check=run.wanted())
        options = CpOptions(run.deadline.left, seed=self.seed, linearization=0)

        def take(active: BoolArray) -> None:
            run.take(active)

        result = run_cp(network, options, stop=run.enough, on_solution=take)
        run.raise_bound(result.bound)


def _reduced(problem: NetworkProblem) -> NetworkProblem:
    """Take away the edges that no valid design of a problem has."""
    return dataclasses.replace(problem, candidate=usable_edges(problem))


def _alone(
    problem: NetworkProblem, found: Conflicts, solver: _Solver, deadline: Deadline
) -> list[Reason]:
    """List requirements of which each cannot be met for itself."""
    reasons = []
    for number, requirement in enumerate(problem.requirements):
        key = f"requirement:{requirement.kind}"
        if not requirement.hard or frozenset({key}) not in found.conflicts or deadline.passed():
            continue
        if solver.alone(number, TRIAL_SHARE * deadline.left) is not False:
            continue
        # with every street that may be, what is still missing can never be there
        facts = facts_of(problem, problem.candidate)
        for place in check_one(requirement, problem, facts)[:1]:
            reasons.append(
                Reason(requirement.kind, place.text, place.edges, place.vertices, (key,))
            )
    return reasons


def _cures(
    solver: _Solver, groups: dict[str, str], found: Conflicts, deadline: Deadline
) -> list[Cure]:
    """Find out what cures cost, the shortest first, in the time that is left."""
    result = []
    for i, (cure, start) in enumerate(found.cures):
        best, least = start, not cure
        todo = min(CURES, len(found.cures)) - i
        if cure and todo > 0 and not deadline.passed():
            best, least = solver.least(cure, start, deadline.left / todo)
        _, violations = broken_groups(solver.problem, best)
        result.append(Cure(_ordered(groups, cure), len(violations), least, violations, best))
    return result


def _text(
    groups: dict[str, str],
    reasons: list[Reason],
    conflicts: tuple[Conflict, ...],
    cures: tuple[Cure, ...],
    complete: bool,
    proven: bool,
) -> str:
    """Say it in sentences."""
    if any(not cure.groups for cure in cures):
        return "A street network that satisfies all rules was found while looking for reasons."
    text = "No street network satisfies all rules at once"
    if not proven:
        text = "No street network was found that satisfies all rules, and none proven impossible"
    summary = _summary(reasons)
    text += f": {'; '.join(summary)}." if summary else "."
    if any(reason.kind == "no sink" for reason in reasons):
        return f"{text} Add access points."
    if conflicts:
        text += _contradictions(groups, conflicts)
    if not cures:
        return (
            f"{text} In force are: {', '.join(groups.values()) or 'connection to the sinks only'}."
            " Check the sinks, the obstacles and the forbidden streets first."
        )
    ways = [_way(groups, cure) for cure in cures[:CURES]]
    if len(ways) == 1:
        text += f" A network becomes possible without {ways[0]}"
        text += " and in no other way." if complete else "."
    else:
        text += f" A network becomes possible without any one of these: {'; '.join(ways)}."
    return f"{text} Give it a cost instead of forbidding."


def _contradictions(groups: dict[str, str], conflicts: tuple[Conflict, ...]) -> str:
    """Say which rules contradict each other."""
    text = ""
    for certain, say in (
        (True, "Rules in conflict"),
        (False, "These rules cannot all be met, though fewer may do to see it"),
    ):
        sets = [
            ", ".join(groups[key] for key in one.groups)
            for one in conflicts
            if one.minimal == certain
        ]
        text += f" {say}: {'; and '.join(sets)}." if sets else ""
    return text


def _way(groups: dict[str, str], cure: Cure) -> str:
    """Say what is to be given up, and what that costs."""
    names = " and ".join(f"'{groups[key]}'" for key in cure.groups)
    times = "once" if cure.count == 1 else f"{cure.count} times"
    return f"{names} (broken {times}{'' if cure.least else ' or less'})"


def _summary(reasons: list[Reason]) -> list[str]:
    """Say what is impossible, with a few places only."""
    found = []
    lost = [r for r in reasons if r.kind == "uncoverable"]
    if len(lost) > 1:
        why = sorted({r.text.partition(": ")[2].rstrip(".") for r in lost})
        found.append(
            f"{len(lost)} vertices have no possible street within the coverage range (the first "
            f"is vertex {lost[0].vertices[0]}): {', or '.join(why)}"
        )
    else:
        found += [_lower(r.text) for r in lost]
    for kind in dict.fromkeys(r.kind for r in reasons if r.kind != "uncoverable"):
        mine = [r for r in reasons if r.kind == kind]
        found += [_lower(r.text) for r in mine[:3]]
        if len(mine) > 3:
            found.append(f"and {len(mine) - 3} more of that kind")
    return found


def _lower(sentence: str) -> str:
    """Make a sentence a part of another."""
    return sentence[:1].lower() + sentence[1:].rstrip(".")
