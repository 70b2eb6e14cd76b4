"""Which corners of a region belong to which of a template, and how often it repeats (UP 4.1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from ..rules import ParcelRules
from ..templates.repeat import Cell, cells, scaled
from ..templates.types import Template
from .batch import Task
from .form import NO_STREET, STREET, Form, form, mirrored
from .regions import SAMPLES, Outline, Sides, choose_corners, sides, turned

Floats = npt.NDArray[np.float64]
Points = npt.NDArray[np.complex128]
#: Matches whose sides are off by more on average are not tried (logarithm of the factor).
FARTHEST = float(np.log(1.6))
#: Nor are those with one side that is off by more.
FARTHEST_SIDE = float(np.log(2.6))
#: How many ways of laying a template into a region are tried.
WAYS = 2
#: Length along an edge that may be of the other meaning (metres, and as part of the edge).
SLACK, SLACK_SHARE = 1.0, 0.08


@dataclass
class Kit:
    """A template for the planner's parcels, with the forms made of it so far.

    Attributes
    ----------
    template
        Scaled to the rules.
    stretches
        What repeats in it.
    base, slopes
        Lengths of the sides without any repeat, shape (k,), and what one repeat of each kind adds,
        shape (kinds, k).
    solve
        Times lengths of sides: the numbers of repeats that fit them best, shape (kinds, k).
    symmetry
        By how many sides the template can be turned to look the same.
    forms
        By number of repeats.
    """

    template: Template
    stretches: list[Cell]
    base: Floats
    slopes: Floats
    solve: Floats
    symmetry: tuple[int, ...] = ()
    forms: dict[tuple[int, ...], Form] = field(default_factory=dict)

    def form(self, counts: tuple[int, ...]) -> Form:
        """Return the form for a number of repeats.

        Parameters
        ----------
        counts
            How often, for each of the stretches.
        """
        if counts not in self.forms:
            names = [cell.name for cell in self.stretches]
            self.forms[counts] = form(self.template, dict(zip(names, counts)))
        return self.forms[counts]

    @property
    def once(self) -> Form:
        """The form with one repeat of each kind."""
        return self.form((1,) * len(self.stretches))


def kits(template: Template, rules: ParcelRules) -> tuple[Kit, ...]:
    """Scale a template to the planner's parcels; its mirror image, too, where that will do.

    Parameters
    ----------
    template
        As drawn.
    rules
        What parcels are asked for.
    """
    return _kits(template, rules.width, rules.depth)


@lru_cache(maxsize=512)
def _kits(template: Template, width: float, depth: float) -> tuple[Kit, ...]:
    """Keep what was made of a template: a layout asks for it again and again."""
    found = []
    for drawn in (template, *([mirrored(template)] if template.mirror else [])):
        kit = Kit(scaled(drawn, width, depth), [], np.zeros(0), *np.zeros((2, 0, 0)))
        kit.stretches = cells(kit.template)
        one = kit.once.lengths
        slopes = []
        for k in range(len(kit.stretches)):
            counts = tuple(1 + (j == k) for j in range(len(kit.stretches)))
            slopes.append(kit.form(counts).lengths - one)
        kit.slopes = np.array(slopes).reshape(len(kit.stretches), len(one))
        kit.solve = np.linalg.pinv(kit.slopes.T) if slopes else kit.slopes
        kit.base = one - kit.slopes.sum(axis=0)
        kit.symmetry = symmetry(kit.once, kit.template)
        found.append(kit)
    return tuple(found)


def symmetry(once: Form, template: Template) -> tuple[int, ...]:
    """Find by how many sides a template can be turned to look the same.

    Parameters
    ----------
    once
        The template with one repeat of each kind.
    template
        Its drawing.
    """
    z = once.points[once.ring]
    corners = z[once.t == 0]
    middles = np.array([p.centroid.coords[0] for p in (f.polygon for f in template.faces)])
    centres = middles[:, 0] + 1j * middles[:, 1]
    kinds = [(f.label, f.repeat, f.tolerance, round(f.polygon.area, 1)) for f in template.faces]
    ends = (z + np.roll(z, -1)) / 2.0
    found = []
    for shift in range(1, len(corners)):
        to = np.roll(corners, -shift)
        turn = (to[1] - to[0]) / (corners[1] - corners[0])

        def moved(p: Points, turn: complex = turn, to: Points = to) -> Points:
            return np.asarray(to[0] + (p - corners[0]) * turn)

        same = bool(np.allclose(moved(corners), to, atol=0.01))
        if same:
            apart = np.abs(moved(centres)[:, None] - centres[None, :])
            partner = apart.argmin(axis=1)
            same = apart.min(axis=1).max() < 0.01
            same = same and all(kinds[k] == kinds[p] for k, p in enumerate(partner))
        if same:
            apart = np.abs(moved(ends)[:, None] - ends[None, :])
            same = apart.min(axis=1).max() < 0.01
            same = same and np.array_equal(once.meaning[apart.argmin(axis=1)], once.meaning)
        if same:
            found.append(shift)
    return tuple(found)


def ways(
    kit: Kit, region: Outline, memo: dict[tuple[int, int], Sides | None]
) -> list[tuple[float, Task]]:
    """Find the ways of laying a template into a region, least distorted first.

    Parameters
    ----------
    kit
        The template.
    region
        The region.
    memo
        Sides of the region by numbers of convex and concave corners; filled.

    Returns
    -------
    list
        Mean factor by which sides are off, its logarithm, and the task.
    """
    signs = kit.once.signs
    wanted = int((signs > 0).sum()), int((signs < 0).sum())
    if wanted not in memo:
        corners = choose_corners(region, *wanted) if len(signs) else None
        memo[wanted] = None if corners is None else sides(region, corners)
    of = memo[wanted]
    if of is None:
        return []
    # all turns of the region's sides at once
    size = len(signs)
    turn = (np.arange(size)[:, None] + np.arange(size)) % size
    fits = (of.signs[turn] == signs).all(axis=1)
    asked = of.lengths[turn]
    found = []
    tried: set[int] = set()
    for shift in np.flatnonzero(fits).tolist():
        if any((shift + same) % size in tried for same in kit.symmetry):
            continue
        tried.add(shift)
        counts = repeats(kit, asked[shift])
        if counts is None:
            continue
        off, worst = distortion(kit, counts, asked[shift])
        if off < FARTHEST and worst < FARTHEST_SIDE:
            found.append((off, shift, counts))
    found.sort(key=lambda way: (way[0], way[1]))
    best: list[tuple[float, Task]] = []
    for off, shift, counts in found:
        made = kit.form(counts)
        if allows(made, of.shut_table[turn[shift]], asked[shift]):
            best.append((off, Task(made, turned(of, shift), off)))
        if len(best) == WAYS:
            break
    return best


def repeats(kit: Kit, asked: Floats) -> tuple[int, ...] | None:
    """Choose how often each stretch repeats.

    Parameters
    ----------
    kit
        The template.
    asked
        Lengths of the sides of the region in the order of the template's, shape (k,), metres.

    Returns
    -------
    tuple of int or None
        The numbers whose lengths of one repeat are nearest to the ideal as a factor; None where
        that is out of bounds.
    """
    if not kit.stretches:
        return ()
    real: list[float] = (kit.solve @ (asked - kit.base)).tolist()
    counts = []
    for number, cell in zip(real, kit.stretches):
        if number <= 0:
            return None
        low = max(1, int(number))
        count = low if number / low <= (low + 1) / number else low + 1
        if not cell.least <= cell.ideal * number / count <= cell.most:
            return None
        counts.append(count)
    return tuple(counts)


def distortion(kit: Kit, counts: tuple[int, ...], asked: Floats) -> tuple[float, float]:
    """Measure by how much the sides of a template are off.

    Parameters
    ----------
    kit, counts
        The template and its repeats.
    asked
        Lengths of the sides of the region, shape (k,).

    Returns
    -------
    mean, worst
        Of the logarithms of the factors, the mean weighted by length.
    """
    own = kit.base + np.asarray(counts, float) @ kit.slopes if counts else kit.base
    factor = np.abs(np.log(asked / np.maximum(own, 1e-6)))
    return float((factor * own).sum() / own.sum()), float(factor.max())


def allows(made: Form, shut: Floats, lengths: Floats) -> bool:
    """Tell whether every edge of a template lies where its meaning allows.

    Parameters
    ----------
    made
        The template.
    shut
        Length without access along each side, sampled, shape (k, SAMPLES).
    lengths
        Lengths of the sides, shape (k,).
    """
    tells = np.flatnonzero(made.meaning)
    if not len(tells) or (not (made.meaning == NO_STREET).any() and not shut[:, -1].any()):
        return True
    side = made.side[tells]
    follow = np.append(made.side[1:], -1)
    ends = np.where(follow == made.side, np.append(made.t[1:], 1.0), 1.0)[tells]
    begin = made.t[tells]
    closed = _read(shut, side, ends) - _read(shut, side, begin)
    whole = (ends - begin) * lengths[side]
    wrong = np.where(made.meaning[tells] == STREET, closed, whole - closed)
    return bool((wrong <= SLACK + SLACK_SHARE * whole).all())


def _read(table: Floats, row: npt.NDArray[np.int64], t: Floats) -> Floats:
    """Interpolate rows of a table of samples."""
    f = t * (SAMPLES - 1)
    k = np.minimum(f.astype(np.int64), SAMPLES - 2)
    a = table[row, k]
    return np.asarray(a + (table[row, k + 1] - a) * (f - k))


def all_ways(
    library: Mapping[str, tuple[Kit, ...]], region: Outline
) -> list[tuple[str, float, Task]]:
    """Lay every template into a region, see `ways`.

    Parameters
    ----------
    library
        Templates by name, with mirror images.
    region
        The region.
    """
    memo: dict[tuple[int, int], Sides | None] = {}
    found: list[tuple[str, float, Task]] = []
    for name, made in library.items():
        every = [way for kit in made for way in ways(kit, region, memo)]
        every.sort(key=lambda way: way[0])
        found.extend((name, off, task) for off, task in every[:WAYS])
    return found
