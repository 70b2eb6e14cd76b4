"""Second thoughts: regions with poor parcels are put together again and split otherwise (UP 3)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ...progress import Progress
from ..roadmesh import StreetMesh
from .cells import Cell, fill_regions
from .search import Splitter

#: Only regions of up to so many parts are put together.
MOST_PARTS = 6
#: What land for one parcel costs where parcels are good (see `cells.costs_of`).
FAIR = 5.0
#: Regions that cost no more than this above it are left alone, and less is no gain.
WORTH, LEAST_GAIN = 15.0, 1.0
#: So many in a row that are no better are enough.
PATIENCE = 8

#: A region that was split, and its parts.
Family = tuple[int, tuple[int, ...]]


@dataclass
class Backtracker:
    """Splits poor regions otherwise, and keeps what costs less.

    Parameters
    ----------
    splitter
        What split the site; it knows which regions came from which.
    mesh
        The mesh that it made.
    cells
        Every region of the mesh with its plots, not refined, so that ways to split it are
        compared as they are cut.
    seed
        Of the random choices.
    """

    splitter: Splitter
    mesh: StreetMesh
    cells: dict[int, Cell]
    seed: int = 0

    def run(self, tries: int, progress: Progress) -> int:
        """Try up to so many other ways, the poorest regions first.

        Parameters
        ----------
        tries
            At most so many regions are split anew.
        progress
            Told how far it is, asked for cancellation; what is better by then is kept.

        Returns
        -------
        int
            How many regions are better now.
        """
        better = in_vain = 0
        self._excess: dict[int, float] = {}
        tried: dict[Family, int] = {}
        for at in range(tries):
            if progress.cancelled():
                break
            progress.stage("Splitting poor regions otherwise", at / tries)
            family = self._poorest(tried)
            if family is None:
                break
            tried[family] = tried.get(family, 0) + 1
            found = self._again(family, seed=self.seed + 7919 * tried[family] + at)
            better += found
            in_vain = 0 if found else in_vain + 1
            if in_vain == PATIENCE:
                break
        return better

    def _poorest(self, tried: Mapping[Family, int]) -> Family | None:
        """Find the region whose parts lack most, for the effort that it takes."""
        best: tuple[float, Family] | None = None
        for family in self.mesh.families(MOST_PARTS):
            parts = family[1]
            excess = sum(self._lacks(part) for part in parts)
            gain = excess / (1 + tried.get(family, 0)) ** 2 / len(parts) ** 0.5
            if excess > WORTH and (best is None or gain > best[0]):
                best = (gain, family)
        return None if best is None else best[1]

    def _lacks(self, region: int) -> float:
        """Return by how much a region costs more than where parcels are good; numbers last."""
        if region not in self._excess:
            area = float(self.mesh.polygon(region).area)
            fair = FAIR * area / self.splitter.rules.area
            self._excess[region] = self.cells[region].cost - fair
        return self._excess[region]

    def _again(self, family: Family, seed: int) -> bool:
        """Split a region otherwise; tell whether that is better."""
        region, parts = family
        before = sum(self.cells[part].cost for part in parts)
        trial = self.splitter.again(self.mesh, region, parts, seed)
        if trial is None:
            return False
        made = [part for part in trial.mesh.regions if part not in self.mesh.regions]
        cells = fill_regions(
            trial.mesh, made, self.splitter.rules, refine=False,
            turning=self.splitter.split.turning_radius, templates=self.splitter.split.templates,
        )  # fmt: skip
        if sum(cell.cost for cell in cells.values()) >= before - LEAST_GAIN:
            return False
        self.mesh = trial.mesh
        for part in parts:
            del self.cells[part]
        self.cells.update(cells)
        return True
