"""A zone is laid out: lines, buildings, ways out, and what lies between (RZ Fig. 2)."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence

from ..errors import CancelledError
from ..progress import Progress, Share, Silent
from .details import lay_details
from .layout import Finding, Layout, PathPlan
from .lines import control_lines
from .paths.plan import plan_paths
from .place.groups import groups_of
from .place.optimise import place_optimised
from .place.score import score
from .place.staged import place_staged
from .remarks import shortfalls
from .rules import LayoutRules
from .shape import footprints, residences
from .sun import check_sun, shaded, shadow_polygons, sun_hours
from .tables import check_indices
from .types import BuildingType, Placements
from .zone import ControlLine, Zone

#: Of the time for placing buildings, so much may go into the first plan where it is improved.
FIRST = 0.25


def lay_out(
    zone: Zone,
    types: Sequence[BuildingType],
    rules: LayoutRules,
    progress: Progress | None = None,
) -> Layout:
    """Lay out a residential zone (RZ sections 3 and 4).

    Parameters
    ----------
    zone
        The ground with its corridors and patches, of `corridors.zone_of_site`.
    types
        Kinds of buildings.
    rules
        What is asked; the method "staged" is RZ Table 1, "optimise" improves what that finds.
    progress
        Told of stages, of the objective as it falls, and asked for cancellation; a cancelled run
        keeps the best plan so far.

    Returns
    -------
    Layout

    Raises
    ------
    InputError
        If the indices cannot be met by these types, or the sun rule has no sun here.
    """
    begun = time.monotonic()
    kinds = tuple(types)
    listener = progress if progress is not None else Silent()
    doubts = [
        *check_indices(kinds, rules, zone.polygon.area),
        *check_sun(zone, rules.sun),
    ]
    for doubt in doubts:
        listener.warn(doubt)
    listener.stage("Drawing control lines", 0.0)
    lines = control_lines(zone, kinds, rules)
    placed = _placed(zone, kinds, rules, lines, listener)
    listener.stage("Planning paths", 0.85)
    # A cancelled run keeps its buildings, so their paths are planned all the same.
    try:
        watched = None if listener.cancelled() else listener
        placed, plan, findings = _with_paths(zone, kinds, rules, lines, placed, watched)
    except CancelledError:
        placed, plan, findings = _with_paths(zone, kinds, rules, lines, placed, None)
    listener.stage("Green, trees and parking", 0.93)
    layout = _finished(zone, kinds, rules, placed, plan)
    return dataclasses.replace(
        layout,
        seconds=time.monotonic() - begun,
        findings=(*findings, *shortfalls(layout, rules)),
    )


def nothing_built(
    zone: Zone, types: Sequence[BuildingType], rules: LayoutRules, why: Finding
) -> Layout:
    """Return the layout of a zone that nothing can be built in, all of it green.

    Parameters
    ----------
    zone, types, rules
        What was asked.
    why
        The reason, which becomes its only finding.
    """
    kinds = tuple(types)
    placed = Placements.empty()
    plan = plan_paths(zone, kinds, rules, (), placed)
    return dataclasses.replace(_finished(zone, kinds, rules, placed, plan), findings=(why,))


def _finished(
    zone: Zone,
    types: tuple[BuildingType, ...],
    rules: LayoutRules,
    placed: Placements,
    plan: PathPlan,
) -> Layout:
    """Add to buildings and paths what lies between, and what they are like."""
    return Layout(
        zone=zone,
        types=types,
        placements=placed,
        group=groups_of(types, placed),
        sun_hours=sun_hours(zone, types, placed, rules.sun),
        shadows=tuple(shadow_polygons(zone, types, placed, rules.sun)),
        paths=plan,
        details=lay_details(zone, types, rules, placed, plan),
        score=score(zone, types, rules, placed, plan),
        method=rules.method,
        seed=rules.seed,
        seconds=0.0,
    )


def _placed(
    zone: Zone,
    types: tuple[BuildingType, ...],
    rules: LayoutRules,
    lines: tuple[ControlLine, ...],
    progress: Progress,
) -> Placements:
    """Place buildings by the method that is asked."""
    if not lines:
        return Placements.empty()
    if rules.method == "staged":
        return place_staged(zone, types, rules, lines, Share(progress, 0.05, 0.85))
    quick = dataclasses.replace(rules, time_limit=FIRST * rules.time_limit)
    first = place_staged(zone, types, quick, lines, Share(progress, 0.05, 0.25))
    if progress.cancelled():
        return first
    left = dataclasses.replace(rules, time_limit=(1 - FIRST) * rules.time_limit)
    return place_optimised(zone, types, left, lines, first, Share(progress, 0.25, 0.85))


def _with_paths(
    zone: Zone,
    types: tuple[BuildingType, ...],
    rules: LayoutRules,
    lines: tuple[ControlLine, ...],
    placed: Placements,
    progress: Progress | None,
) -> tuple[Placements, PathPlan, tuple[Finding, ...]]:
    """Plan the paths; buildings without a way out, or still in the shade, are given up."""
    findings: list[Finding] = []
    plan = plan_paths(zone, types, rules, lines, placed, progress)
    for _ in range(3):
        dark = shaded(zone, types, placed, rules.sun) & residences(types, placed)
        lost = dark | ~plan.reached
        if not lost.any():
            break
        for shape, in_shade in zip(footprints(types, placed)[lost], dark[lost]):
            what = "stands in the shade" if in_shade else "has no way out to a street"
            findings.append(
                Finding(f"A building here {what}.", "It was left out.", "warning", shape)
            )
        placed = placed.take(~lost)
        plan = plan_paths(zone, types, rules, lines, placed, progress)
    return placed, plan, tuple(findings)
