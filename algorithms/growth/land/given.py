"""Streets that are there already: read from a road layer, and as planar pieces."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS
from shapely.geometry import LineString, Point

from ...levels import COLLECTOR, LOCAL, MAJOR
from ...progress import Progress
from ...site.crs import layer_crs, working_crs
from ...site.repair import Problems
from ...site.roads import RoadLayer
from ..bends import bends_of
from ..types import BoolArray, FloatArray, IntArray
from .pieces import Pieces, cut_lines

#: Classes of roads, words of OpenStreetMap, by the level of the street that goes on from them;
#: numbers of classes are levels themselves, other words are local streets.
KIND_LEVEL = {
    **dict.fromkeys(("motorway", "trunk", "primary", "secondary", "1"), MAJOR),
    **dict.fromkeys(("tertiary", "unclassified", "collector", "2"), COLLECTOR),
}
#: Shorter streets have no length (metres).
NO_LENGTH = 1e-3


@dataclass(frozen=True)
class GivenStreet:
    """A street that streets may grow from and join.

    Attributes
    ----------
    line
        Centre line, metres in the working CRS.
    name, kind
        Name and road class as given, empty where unknown.
    edge
        Whether it is a new street along the edge of the ground, which the planner asked for.
    level
        1 major, 2 collector, 3 local.
    """

    line: LineString
    name: str
    kind: str
    edge: bool
    level: int


@dataclass(frozen=True, eq=False)
class GivenNetwork:
    """Streets as planar pieces, as `Ground` has them.

    Attributes
    ----------
    streets
        The streets; each line is exactly the chain of its pieces.
    nodes, ends, street, bends
        As in `Ground`.
    """

    streets: tuple[GivenStreet, ...]
    nodes: FloatArray
    ends: IntArray
    street: IntArray
    bends: BoolArray

    @property
    def degrees(self) -> IntArray:
        """Shape (n,). Number of pieces at each node."""
        return np.bincount(self.ends.ravel(), minlength=len(self.nodes)).astype(np.int64)

    @property
    def levels(self) -> IntArray:
        """Shape (e,). Level of the street of each piece."""
        own = np.array([s.level for s in self.streets], dtype=np.int64)
        return own[self.street]


def levels_of(kinds: Sequence[str]) -> list[int]:
    """Level of streets by their classes.

    Where no class is known at all every street is a collector; a street without one among others
    that have one is local, since layers that name classes name those of main roads.

    Parameters
    ----------
    kinds
        Road classes, empty where unknown.

    Examples
    --------
    >>> levels_of(["primary_link", "tertiary", "residential", ""]), levels_of(["", ""])
    ([1, 2, 3, 3], [2, 2])
    """
    if not any(kinds):
        return [COLLECTOR] * len(kinds)
    return [min(KIND_LEVEL.get(word, LOCAL) for word in _words(kind)) for kind in kinds]


def _words(kind: str) -> list[str]:
    """Give the classes that a text names; osmnx and OpenStreetMap may name several."""
    words = (word.strip(" '\"") for word in re.split("[,;]", kind.lower().strip("[]")))
    return [word.removesuffix("_link").removesuffix(".0") for word in words]


def read_roads(
    frame: gpd.GeoDataFrame, layer: str, problems: Problems, progress: Progress
) -> tuple[list[GivenStreet], list[object], CRS]:
    """Read the streets of a road layer, as they are.

    Paths, motorways, tunnels and what else is no street are passed over, as around sites.

    Parameters
    ----------
    frame
        Lines in any CRS, multipart and three-dimensional ones, too.
    layer
        Its name, for messages.
    problems
        Takes the features that cannot be used.
    progress
        Takes remarks about what is passed over.

    Returns
    -------
    tuple
        The streets, the feature that each is a part of, and their working CRS.

    Raises
    ------
    InputError
        If the layer has no CRS or the coordinates do not fit it.
    """
    own = layer_crs(frame, layer)
    geometry = np.asarray(frame.geometry.array, dtype=object)
    bounds = shapely.bounds(geometry).reshape(-1, 4)
    finite = np.isfinite(bounds).all(axis=1)
    if not finite.any():
        return [], [], own
    extent = np.r_[bounds[finite, :2].min(axis=0), bounds[finite, 2:].max(axis=0)]
    crs = working_crs(own, extent, layer)
    lines, names, kinds, rows = RoadLayer(frame, layer, progress).everywhere(crs)
    long = shapely.length(lines) > NO_LENGTH
    ids = frame.index.to_numpy()
    flat = finite & np.isin(shapely.get_type_id(geometry), (1, 5))
    flat &= shapely.length(geometry) == 0
    short = set(rows[~long].tolist()) - set(rows[long].tolist()) | set(np.flatnonzero(flat))
    for row in sorted(set(np.flatnonzero(~finite).tolist()) | short):
        what = "the road has no length" if row in short else "it has no geometry"
        place = shapely.force_2d(geometry[row]) if row in short else None
        problems.add(layer, ids[row], what, "left out", "warning", place, own)
    lines, names, kinds, rows = lines[long], names[long], kinds[long], rows[long]
    levels = levels_of(kinds.tolist())
    streets = [
        GivenStreet(LineString(line.coords), name, kind, False, level)
        for line, name, kind, level in zip(lines, names, kinds, levels)
    ]
    return streets, [ids[row] for row in rows], crs


def network(
    streets: Sequence[GivenStreet],
    features: Sequence[object],
    layer: str,
    crs: CRS,
    problems: Problems,
) -> GivenNetwork:
    """Make streets planar; none of them moves.

    Of streets on top of each other the existing one before the new, the higher and the named one
    stays. Streets that cross without a junction get one.

    Parameters
    ----------
    streets
        The streets, with lengths.
    features
        Id of the feature that each is a part of; "" where there is none.
    layer
        Name of their layer, for messages.
    crs
        Working CRS.
    problems
        Takes crossings and duplicates.
    """
    order = sorted(
        range(len(streets)),
        key=lambda k: (streets[k].edge, streets[k].level, not streets[k].name, k),
    )
    rank = np.empty(len(streets), dtype=np.int64)
    rank[order] = np.arange(len(streets))
    pieces = cut_lines([street.line for street in streets], rank)
    told = [k for k, street in enumerate(streets) if not street.edge]
    _tell_crossings(pieces, streets, features, layer, crs, problems)
    _tell_doubles(pieces, streets, [features[k] for k in told], told, layer, crs, problems)
    kept, number = _runs(pieces, streets)
    nodes, ends = pieces.nodes, pieces.ends[pieces.kept]
    used = np.zeros(len(nodes), dtype=bool)
    used[ends.ravel()] = True
    place = np.cumsum(used) - 1
    nodes, ends = nodes[used], place[ends].astype(np.int64)
    return GivenNetwork(tuple(kept), nodes, ends, number, bends_of(len(nodes), ends, number))


def _runs(pieces: Pieces, streets: Sequence[GivenStreet]) -> tuple[list[GivenStreet], IntArray]:
    """Give what is left of each street, and the number of each kept piece's street."""
    whole = np.bincount(pieces.line[~pieces.kept], minlength=len(streets)) == 0
    at = np.flatnonzero(pieces.kept)
    line = pieces.line[at]
    apart = np.r_[True, (np.diff(line) != 0) | ((np.diff(at) != 1) & ~whole[line[1:]])][: len(at)]
    number = np.cumsum(apart) - 1
    first = np.flatnonzero(apart)
    last = np.r_[first[1:], len(at)]
    left = []
    for a, b in zip(first.tolist(), last.tolist()):
        street = streets[int(line[a])]
        if not whole[line[a]]:
            chain = np.r_[pieces.ends[at[a:b], 0], pieces.ends[at[b - 1], 1]]
            street = replace(street, line=LineString(pieces.nodes[chain]))
        left.append(street)
    return left, number.astype(np.int64)


def _tell_crossings(
    pieces: Pieces,
    streets: Sequence[GivenStreet],
    features: Sequence[object],
    layer: str,
    crs: CRS,
    problems: Problems,
) -> None:
    for i, j, node in pieces.crossings.tolist():
        if streets[i].edge or streets[j].edge:
            continue
        other = "itself" if features[i] == features[j] else _call(streets[j], features[j])
        what = f"the road crosses {other} without a junction"
        todo = "a junction there; should it be a bridge, leave one of the roads out"
        problems.add(layer, features[i], what, todo, "info", Point(pieces.nodes[node]), crs)


def _call(street: GivenStreet, feature: object) -> str:
    return " ".join(["the road", street.name, f"({feature})" if feature != "" else ""]).strip()


def _tell_doubles(
    pieces: Pieces,
    streets: Sequence[GivenStreet],
    features: Sequence[object],
    told: Sequence[int],
    layer: str,
    crs: CRS,
    problems: Problems,
) -> None:
    size = np.hypot(*(pieces.nodes[pieces.ends[:, 1]] - pieces.nodes[pieces.ends[:, 0]]).T)
    doubled = np.bincount(pieces.line, weights=size * ~pieces.kept, minlength=len(streets))
    for feature, k in zip(features, told):
        if doubled[k] > NO_LENGTH and feature != "":
            what = f"the road lies on another one over {doubled[k]:.0f} m"
            place = streets[k].line
            problems.add(layer, feature, what, "taken once", "info", place, crs)
