"""Which drawn template a region gets, if any (UP section 3)."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..roadmesh import StreetMesh, region_blocks
from ..rules import ParcelRules
from ..templates import TemplateLibrary
from ..templates.types import Template
from ..warp import Match, match_templates

#: What rows of parcels count as among templates: their energy, metres, and their probability.
ROWS = (1.0, 1.0)
#: Templates that are as likely as this are taken wherever they fit, where nothing is random.
LIKELY = 0.5
#: Streets inside a block are no longer than this: fire engines turn at their end (metres).
LONGEST = 160.0
#: Energy up to which a template is put where one is still missing, times the threshold.
FORCED = 2.0


@dataclass(frozen=True)
class TemplateRules:
    """The templates that may be used.

    Attributes
    ----------
    library
        The drawings.
    names
        Only these; None for all whose region is a block.
    threshold
        Templates are used where they fit with less energy than this, metres, see `warp.Match`.
    """

    library: TemplateLibrary
    names: tuple[str, ...] | None = None
    threshold: float = 2.0

    def templates(self) -> list[Template]:
        """Give the templates for blocks that may be used."""
        return [
            own
            for own in self.library.labelled("block")
            if self.names is None or own.name in self.names
        ]


class Chooser:
    """Chooses templates for the regions of a mesh.

    Parameters
    ----------
    asked
        The templates.
    rules
        Size of parcels.
    turning
        Radius of turning circles, metres, see `region_blocks`.
    """

    def __init__(self, asked: TemplateRules, rules: ParcelRules, turning: float) -> None:
        self.asked, self.rules, self.turning = asked, rules, turning
        self._own = {own.name: own for own in asked.templates()}
        areas = [_area(own, rules) for own in self._own.values()]
        self._largest = 2.0 * max(areas, default=0.0)

    def choose(
        self, mesh: StreetMesh, region: int, *, whole: bool, rng: np.random.Generator | None
    ) -> str:
        """Choose a template for a region, empty for none.

        Parameters
        ----------
        mesh, region
            The mesh and the number of the region.
        whole
            Whether rows of parcels would do as well, so that the region needs no street.
        rng
            Of the random choice; None takes the best.
        """
        if not self._own or mesh.polygon(region).area > self._largest:
            return ""
        free = self._free(mesh)
        matches = [m for m in self._matches(mesh, region, free) if m.energy < self.asked.threshold]
        if not matches:
            return ""
        chance = [self._own[m.template].probability for m in matches]
        if rng is None:
            return _best(matches, chance, whole=whole)
        weight = [c / max(m.energy, 0.05) for m, c in zip(matches, chance)]
        if whole:
            weight.append(ROWS[1] / ROWS[0])
        elif rng.random() > max(chance):
            return ""
        k = int(rng.choice(len(weight), p=np.array(weight) / sum(weight)))
        return matches[k].template if k < len(matches) else ""

    def missing(self, mesh: StreetMesh) -> Counter[str]:
        """Count the templates that are used less often than they must be."""
        used = Counter(mesh.labels[r] for r in mesh.regions if r in mesh.labels)
        lack = {n: own.min_uses - used[n] for n, own in self._own.items()}
        return Counter({n: count for n, count in lack.items() if count > 0})

    def force(self, mesh: StreetMesh) -> Counter[str]:
        """Put templates that are missing where they fit best; the mesh gets their names.

        Returns
        -------
        Counter of str
            What is missing still.
        """
        lack = self.missing(mesh)
        for name in sorted(lack):
            found = []
            for region in sorted(mesh.regions):
                if region not in mesh.labels:
                    matches = self._matches(mesh, region, [name])
                    found += [(m.energy, region) for m in matches[:1]]
            limit = FORCED * self.asked.threshold
            for energy, region in sorted(found)[: lack[name]]:
                if energy < limit:
                    mesh.labels[region] = name
        return self.missing(mesh)

    def _free(self, mesh: StreetMesh) -> list[str]:
        """Name the templates that may be used once more."""
        used = Counter(mesh.labels[r] for r in mesh.regions if r in mesh.labels)
        most = {n: math.inf if own.max_uses < 0 else own.max_uses for n, own in self._own.items()}
        return [n for n in self._own if used[n] < most[n] and self._own[n].probability > 0]

    def _matches(self, mesh: StreetMesh, region: int, names: Iterable[str]) -> Sequence[Match]:
        """Match a region whose land is in one piece."""
        (blocks,) = region_blocks(mesh, self.turning, [region]).values()
        chosen = list(names)
        if len(blocks) != 1 or not chosen:
            return []
        found = match_templates(blocks, self.asked.library, self.rules, names=chosen)[0]
        return [m for m in found if all(line.length <= LONGEST for line in m.streets)]


def _best(matches: Sequence[Match], chance: Sequence[float], *, whole: bool) -> str:
    """Take the template that fits best for its probability, where rows do not fit better."""
    k = min(range(len(matches)), key=lambda at: matches[at].energy / max(chance[at], 1e-6))
    if whole:
        better = matches[k].energy / max(chance[k], 1e-6) < ROWS[0] / ROWS[1]
        return matches[k].template if better else ""
    return matches[k].template if chance[k] >= LIKELY else ""


def _area(template: Template, rules: ParcelRules) -> float:
    """Area of a template once it is scaled to the parcels wished for, about, square metres."""
    own = sum(float(face.polygon.area) for face in template.faces)
    return own * rules.area / 540.0


def matched(
    names: Mapping[int, str],
    blocks: Mapping[int, Sequence],  # type: ignore[type-arg]
    asked: TemplateRules,
    rules: ParcelRules,
) -> dict[int, Match]:
    """Warp the chosen templates into the land of their regions.

    Parameters
    ----------
    names
        Name of the template of each region.
    blocks
        The land of each region.
    asked, rules
        The templates and the size of parcels.

    Returns
    -------
    dict of int to Match
        Only for regions in which the template still fits.
    """
    by_name: dict[str, list[int]] = {}
    for region, name in sorted(names.items()):
        if len(blocks[region]) == 1:
            by_name.setdefault(name, []).append(region)
    found: dict[int, Match] = {}
    for name, regions in sorted(by_name.items()):
        own = [blocks[region][0] for region in regions]
        for region, matches in zip(
            regions, match_templates(own, asked.library, rules, names=[name])
        ):
            if matches:
                found[region] = matches[0]
    return found
