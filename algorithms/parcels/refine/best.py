"""The best plots of each block so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from ..types import Plot
from .layout import Layout, State, parts_of
from .mesh import Flags, total
from .scores import scores_and_faults

Polygons = npt.NDArray[Any]
#: How exactly plots tile their block, relative to its area.
EXACT = 1e-6


class Best:
    """Keeps the plots of each block with the best score.

    Parameters
    ----------
    layout
        The outlines.
    plots
        The plots of each block as they came.
    parcel
        Which of all plots are parcels, shape (p,).
    green
        Which are greens, shape (p,).
    """

    def __init__(
        self, layout: Layout, plots: Sequence[Sequence[Plot]], parcel: Flags, green: Flags
    ) -> None:
        self.layout, self.came, self.parcel = layout, plots, parcel
        mesh = layout.mesh
        self.block = mesh.block_of_face[: len(parcel)]
        self.polygons = np.array([p.polygon for group in plots for p in group], dtype=object)
        self.area = shapely.area(self.polygons)
        self.score, self.faults = scores_and_faults(
            self.polygons[parcel], self.block[parcel], len(mesh.sound)
        )
        self.green = green
        self.parts = parts_of(self.polygons, self.green)
        self.changed = mesh.sound & mesh.noded
        mine = self.changed[self.block]
        self.polygons[mine] = self._drawn(layout.begin(), mine)

    def _drawn(self, state: State, mine: Flags) -> Polygons:
        """Polygons of some plots in a state."""
        outside = np.zeros(len(self.layout.mesh.sound), bool)
        faces = np.concatenate([mine, outside])
        return self.layout.polygons(self.layout.place(state), faces, exact=True)

    def offer(self, state: State, blocks: Flags) -> None:
        """Take the plots of those blocks that have a better score in a state.

        Parameters
        ----------
        state
            Where things are.
        blocks
            Blocks to look at, shape (b,).
        """
        mine = blocks[self.block]
        if not mine.any():
            return
        count = len(blocks)
        block, parcel = self.block[mine], self.parcel[mine]
        drawn = self._drawn(state, mine)
        score, faults = scores_and_faults(drawn[parcel], block[parcel], count)
        change = total(block, shapely.area(drawn) - self.area[mine], count)
        whole = total(self.block, self.area, count)
        broken = total(block, ~shapely.is_valid(drawn), count) > 0
        pinched = parts_of(drawn, self.green[mine]) != self.parts[mine]
        broken |= total(block, pinched, count) > 0
        better = blocks & (score < self.score) & ~broken & (np.abs(change) <= EXACT * whole)
        chosen = better[self.block]
        self.polygons[chosen] = drawn[better[block]]
        self.score = np.where(better, score, self.score)
        self.faults = np.where(better, faults, self.faults)
        self.changed |= better

    def awkward(self) -> Flags:
        """Sound blocks with undesirable parcels, shape (b,)."""
        return self.layout.mesh.sound & (self.faults > 0)

    def plots(self) -> list[list[Plot]]:
        """Give the best plots of each block, those that did not change as they came."""
        found, first = [], 0
        for group, changed in zip(self.came, self.changed.tolist()):
            mine = self.polygons[first : first + len(group)]
            first += len(group)
            if changed:
                found.append([replace(p, polygon=polygon) for p, polygon in zip(group, mine)])
            else:
                found.append(list(group))
        return found
