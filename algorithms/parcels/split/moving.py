"""Streets of a layout moved so that its parcels become better, never worse (UP section 6)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from ...errors import CancelledError
from ...progress import Progress, Share
from ..improve import optimise_mesh
from ..roadmesh import StreetMesh
from ..rules import ParcelRules
from .cells import Cell, fill_regions
from .rules import SplitRules

#: So often the streets are moved; each time those around regions that it made worse stay.
ROUNDS = 3
#: Places that differ by less from one round to the next are the same (metres).
SETTLED = 0.02
#: Regions that cost so much more afterwards are worse (see `cells.costs_of`).
WORSE = 0.5


def optimised(
    mesh: StreetMesh,
    cells: dict[int, Cell],
    rules: ParcelRules,
    split: SplitRules,
    seed: int,
    progress: Progress,
) -> tuple[StreetMesh, dict[int, Cell]]:
    """Move all streets so that rows fit better, and keep what costs least.

    UP moves all streets once. Here the parcels are cut anew and those regions that got worse
    keep their streets in the next round, so that the others gain.

    Parameters
    ----------
    mesh, cells
        The layout, its parcels not refined.
    rules, split
        What is asked of parcels and streets.
    seed
        Of whatever is random.
    progress
        Told of the rounds; where the caller cancels, the best so far is kept.

    Returns
    -------
    mesh, cells
        The same where nothing was better.
    """
    best, best_cells = mesh, cells
    last, last_cells = mesh, cells
    held: set[int] = set()
    for k in range(ROUNDS):
        share = Share(progress, k / ROUNDS, (k + 1) / ROUNDS)
        try:
            moved = optimise_mesh(_holding(mesh, held), rules, progress=Share(share, 0.0, 0.5))
            moved = _settled(_released(moved, mesh), last)
            found = dict(last_cells)
            changed = _changed(last, moved)
            found.update(
                fill_regions(
                    moved, changed, rules, turning=split.turning_radius,
                    templates=split.templates, seed=seed,
                    refine=False, progress=Share(share, 0.5, 1.0),
                )
            )  # fmt: skip
        except CancelledError:
            break
        if _cost(found) < _cost(best_cells):
            best, best_cells = moved, found
        last, last_cells = moved, found
        worse = {r for r in found if found[r].cost > cells[r].cost + WORSE}
        if not worse - held:
            break
        held |= worse
    return best, best_cells


def _settled(moved: StreetMesh, last: StreetMesh) -> StreetMesh:
    """Leave what went nearly where it was in the round before there, so that plots stay, too."""
    if moved.regions == last.regions:
        near = np.hypot(*(moved.xy - last.xy).T) < SETTLED
        moved.xy = np.where(near[:, None], last.xy, moved.xy)
    return moved


def _cost(cells: Mapping[int, Cell]) -> float:
    return sum(cell.cost for cell in cells.values())


def _changed(before: StreetMesh, after: StreetMesh) -> list[int]:
    """Find the regions whose outline is another."""
    return [
        r
        for r in sorted(after.regions)
        if after.regions[r] != before.regions[r]
        or any((after.xy[list(g)] != before.xy[list(g)]).any() for g in after.regions[r].rings)
    ]


def _holding(mesh: StreetMesh, regions: Collection[int]) -> StreetMesh:
    """Give a copy in which the streets around some regions stay where they are."""
    held = mesh.copy()
    for region in regions:
        for a, b in held.regions[region].edges():
            held.set_edge(a, b, replace(held.edge(a, b), fixed=True))
    return held


def _released(moved: StreetMesh, mesh: StreetMesh) -> StreetMesh:
    """Give the edges of a moved mesh back what they were."""
    for key, edge in mesh.edges.items():
        if key in moved.edges:
            moved.edges[key] = edge
    return moved
