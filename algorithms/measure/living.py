"""Living structure: how many substructures there are, and on how many levels.

Livability is L = S x H, the number of substructures S times the levels of their hierarchy H
(Jiang and de Rijke 2021, "Structural beauty: a structure-based computational approach to
quantifying the beauty of an image", Journal of Imaging 7, 78: abstract). H is the ht-index of the
substructures. Those of a street network are its natural streets (as in de Rijke, Macassa, Sandberg
and Jiang 2020, "Living structure as an empirical measurement of city morphology", ISPRS
International Journal of Geo-Information 9, 677); their size is the number of others that they meet,
or their length. L grows with the number of streets: compare networks of like size, or L per square
kilometre.

The recursive approach (Jiang and de Rijke 2023, "Living images: a recursive approach to computing
the structural beauty of images or the livingness of space", Annals of the AAG) takes every part
that can be split for a substructure and splits it in turn, until none of the parts has a minority
of large values. In images the parts are connected regions; here they are sets of values, as in the
example of ten numbers in the Living Textbook (University of Twente): 5 parts on 3 levels, 15.

What CitySprout publishes under the name of a living metric is another thing, and has functions of
its own: how alike the ranks of roads are that meet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import rankdata

from .graph import FloatArray, IntArray
from .headtail import SHARE, above_mean, head_tail_breaks, ht_levels


@dataclass(frozen=True, eq=False)
class LivingStructure:
    """The living structure of a set of values.

    Attributes
    ----------
    substructures
        S: how many values there are.
    hierarchy
        H: levels of their hierarchy, the ht-index; 0 without values.
    breaks
        Values between the levels, ascending, H - 1 of them.
    levels
        Shape (S,). Level of each value, from 1 for the many small ones.
    parts
        Number of substructures by the recursive approach: all values together, and the head and
        the tail of every part that has a minority of large values.
    depth
        How deep those parts lie in each other, at most.
    """

    substructures: int
    hierarchy: int
    breaks: FloatArray
    levels: IntArray
    parts: int
    depth: int

    @property
    def livability(self) -> int:
        """L = S x H (Jiang and de Rijke 2021)."""
        return self.substructures * self.hierarchy

    @property
    def recursive_livability(self) -> int:
        """The same by the recursive approach (Jiang and de Rijke 2023): parts x depth."""
        return self.parts * self.depth


def living_structure(values: npt.ArrayLike, share: float = SHARE) -> LivingStructure:
    """Measure the living structure of sizes, such as the connectivity of natural streets.

    Parameters
    ----------
    values
        Shape (n,). Sizes of the substructures, finite.
    share
        See `head_tail_breaks`.

    Examples
    --------
    >>> ten = living_structure([1 / k for k in range(1, 11)])
    >>> ten.hierarchy, ten.livability, ten.parts, ten.recursive_livability
    (3, 30, 5, 15)
    """
    own = np.asarray(values, dtype=float).ravel()
    breaks = head_tail_breaks(own, share)
    parts, depth = _nested(np.sort(own), share)
    return LivingStructure(
        len(own),
        len(breaks) + 1 if len(own) else 0,
        breaks,
        ht_levels(own, breaks),
        parts,
        depth,
    )


def _nested(ascending: FloatArray, share: float) -> tuple[int, int]:
    """Count the parts of values that are split at their means again and again, and their depth."""
    if not len(ascending):
        return 0, 0
    parts, depth = 0, 0
    todo = [(ascending, 1)]
    while todo:
        part, level = todo.pop()
        parts, depth = parts + 1, max(depth, level)
        head = int(above_mean(part, float(part.mean())).sum())
        if 0 < head <= share * len(part):
            todo += [(part[:-head], level + 1), (part[-head:], level + 1)]
    return parts, depth


def likeness(pairs: IntArray, score: npt.ArrayLike, decay: float = 1.0) -> FloatArray:
    """How alike in rank each road is to the roads that it meets (CitySprout's second metric).

    The mean over the roads that it meets of exp(-decay x difference in rank / (r - 1)). A road
    that is met at several nodes counts as often. Roads of equal score share the mean of their
    ranks, where CitySprout numbers them on in the order of its data.

    Parameters
    ----------
    pairs
        Shape (k, 2). Positions of roads that meet, one pair per node: see `natural.meetings`, with
        roads numbered from 0 without gaps.
    score
        Shape (r,). What roads are ranked by. CitySprout: the number of shortest paths between all
        nodes that run along each edge, added up over the edges of the road.
    decay
        How fast unlikeness counts, at least 0.

    Returns
    -------
    array
        Shape (r,), from 0 to 1; NaN for roads that meet no other.
    """
    rank, pairs = _ranks(score), np.asarray(pairs)
    apart = np.abs(rank[pairs[:, 0]] - rank[pairs[:, 1]]) / max(len(rank) - 1, 1)
    alike = np.repeat(np.exp(-decay * apart), 2)
    total = np.bincount(pairs.ravel(), alike, minlength=len(rank))
    met = np.bincount(pairs.ravel(), minlength=len(rank))
    return np.where(met > 0, total / np.maximum(met, 1), np.nan)


def living_v2(pairs: IntArray, score: npt.ArrayLike, decay: float = 1.0) -> float:
    """Mean likeness of all roads that meet another: CitySprout's living metric, second version.

    Parameters
    ----------
    pairs, score, decay
        See `likeness`.

    Returns
    -------
    float
        From 0 to 1, where 1 is all roads of one rank; NaN if no roads meet.
    """
    own = likeness(pairs, score, decay)
    met = own[~np.isnan(own)]
    return float(met.mean()) if len(met) else float("nan")


def living_v1(pairs: IntArray, score: npt.ArrayLike, reach: float = 5.0) -> float:
    """Mean number of roads met that are near in rank: CitySprout's living metric, first version.

    Its window is not symmetric (5 ranks below, 4 above), ours is.

    Parameters
    ----------
    pairs, score
        See `likeness`; a road that is met at several nodes counts once here.
    reach
        Largest difference in rank that is near.

    Returns
    -------
    float
        At least 0; NaN without roads.
    """
    rank = _ranks(score)
    if not len(rank):
        return float("nan")
    met = np.unique(np.sort(np.asarray(pairs), axis=1), axis=0)
    near = np.abs(rank[met[:, 0]] - rank[met[:, 1]]) <= reach
    return 2.0 * int(near.sum()) / len(rank)


def _ranks(score: npt.ArrayLike) -> FloatArray:
    """Ranks from 1, ascending; of equal scores their mean."""
    return np.asarray(rankdata(np.asarray(score, dtype=float)), dtype=float)
