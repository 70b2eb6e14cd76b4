"""A network of roads: noded lines between junctions, and where on them names change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Tuple

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString

ROAD_GRID = 0.01
"""Road ends closer than about this meet, metres."""

CRUMB = 0.1
"""Pieces up to this length, made by rounding, do not change the name of a road, metres."""

_Label = Tuple[str, str, bool]  # name, class, whether to be kept inside


@dataclass(frozen=True)
class Section:
    """A part of a road with one name and class.

    Attributes
    ----------
    start, end
        Distances along the line, metres.
    name, kind
        Name and class, empty where unknown.
    inside
        Whether the layer says that the street is one to be kept inside a site.
    """

    start: float
    end: float
    name: str
    kind: str
    inside: bool = False


@dataclass(frozen=True)
class RoadNetwork:
    """Roads near a site, cut at junctions.

    Attributes
    ----------
    lines
        Centre lines from junction to junction, shape (n,), metres.
    names, kinds
        Name and class of the longest section of each line, shape (n,), empty where unknown.
    sections
        The sections of each line, in their order, without gaps; name, class or place change
        from one to the next.
    ends
        Node at the start and at the end of each line, shape (n, 2).
    nodes
        Positions of the nodes, shape (k, 2).
    degree
        Number of line ends at each node, shape (k,).
    """

    lines: npt.NDArray[Any]
    names: npt.NDArray[Any]
    kinds: npt.NDArray[Any]
    sections: tuple[tuple[Section, ...], ...]
    ends: npt.NDArray[np.intp]
    nodes: npt.NDArray[np.float64]
    degree: npt.NDArray[np.intp]

    def at(self, line: int, position: float) -> Section:
        """Give the section of a line at a distance from its start.

        Parameters
        ----------
        line
            Index of the line.
        position
            Distance along it, metres.

        Returns
        -------
        Section
            The last one that starts before that.
        """
        own = self.sections[line]
        before = [s for s in own if s.start < position]
        return before[-1] if before else own[0]


def build_network(
    lines: npt.NDArray[Any],
    names: npt.NDArray[Any],
    kinds: npt.NDArray[Any],
    inside: npt.NDArray[np.bool_] | None = None,
) -> RoadNetwork:
    """Node lines, merge them between junctions and find the names along the results.

    Parameters
    ----------
    lines
        Shape (n,), metres.
    names, kinds
        Name and class of each, shape (n,).
    inside
        Whether each is to be kept inside a site, shape (n,); nowhere if None.

    Returns
    -------
    RoadNetwork
        The lines cut where they meet; each part takes name and class of the line that it
        is a part of.
    """
    pieces = np.empty(0, dtype=object)
    merged = pieces
    if len(lines) > 0:
        noded = shapely.union_all(lines, grid_size=ROAD_GRID)
        pieces = shapely.get_parts(noded)
        pieces = pieces[shapely.get_type_id(pieces) == 1]
        merged = shapely.get_parts(shapely.line_merge(noded))
        merged = merged[shapely.get_type_id(merged) == 1]
        merged = _directed(merged)
        merged = merged[np.lexsort([shapely.length(merged), *shapely.bounds(merged).T])]
    if len(merged) == 0:
        none = np.empty(0, dtype=object)
        nodes = np.empty((0, 2))
        return RoadNetwork(
            none, none, none, (), np.empty((0, 2), dtype=np.intp), nodes,
            np.empty(0, dtype=np.intp),
        )  # fmt: skip
    flags = np.zeros(len(lines), dtype=bool) if inside is None else inside
    labels = _labels(pieces, lines, names, kinds, flags)
    merged, sections = _sections(merged, pieces, labels)
    nodes, ends, degree = _nodes(merged)
    longest = [max(own, key=lambda s: s.end - s.start) for own in sections]
    return RoadNetwork(
        merged,
        np.array([s.name for s in longest], dtype=object),
        np.array([s.kind for s in longest], dtype=object),
        tuple(sections),
        ends,
        nodes,
        degree,
    )


def _nodes(
    lines: npt.NDArray[Any],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Nodes at the ends of lines, the two of each line, and the degree of each node."""
    tips = np.stack([shapely.get_point(lines, 0), shapely.get_point(lines, -1)], axis=1)
    xy = np.round(shapely.get_coordinates(tips.ravel()), 3)
    nodes, inverse = np.unique(xy, axis=0, return_inverse=True)
    ends = inverse.reshape(-1, 2).astype(np.intp)
    return nodes, ends, np.bincount(ends.ravel(), minlength=len(nodes)).astype(np.intp)


def _directed(lines: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Give lines directions that do not hang on the input's; loops keep their junction."""
    result: npt.NDArray[Any] = shapely.normalize(lines)
    _, ends, degree = _nodes(lines)
    # normalizing would turn a loop until it starts at its lowest point
    for k in np.flatnonzero(shapely.is_closed(lines) & (degree[ends[:, 0]] > 2)):
        xy = shapely.get_coordinates(lines[k]).tolist()
        result[k] = LineString(xy if xy[1] <= xy[-2] else xy[::-1])
    return result


def _labels(
    pieces: npt.NDArray[Any],
    lines: npt.NDArray[Any],
    names: npt.NDArray[Any],
    kinds: npt.NDArray[Any],
    inside: npt.NDArray[np.bool_],
) -> list[_Label]:
    """Label each piece as the line that it is a part of; of several the best known one."""
    labels: list[_Label] = list(zip(names.tolist(), kinds.tolist(), inside.tolist()))

    def better_first(k: int) -> tuple[bool, bool, bool, str, str]:
        name, kind, kept = labels[k]
        return (not name, not kind, not kept, name, kind)

    rank = np.empty(len(lines), dtype=np.intp)
    rank[sorted(range(len(lines)), key=better_first)] = np.arange(len(lines))
    middle = shapely.line_interpolate_point(pieces, 0.5, normalized=True)
    tree = shapely.STRtree(lines)
    source = np.zeros(len(pieces), dtype=np.intp)
    asked, found = tree.query_nearest(middle, all_matches=False)
    source[asked] = found
    asked, found = tree.query(middle, predicate="dwithin", distance=ROAD_GRID)
    order = np.lexsort((rank[found], asked))
    piece, first = np.unique(asked[order], return_index=True)
    source[piece] = found[order][first]
    return [labels[k] for k in source.tolist()]


def _sections(
    lines: npt.NDArray[Any], pieces: npt.NDArray[Any], labels: list[_Label]
) -> tuple[npt.NDArray[Any], list[tuple[Section, ...]]]:
    """Find the sections of lines made of labelled pieces; rings may get another start."""
    middle = shapely.line_interpolate_point(pieces, 0.5, normalized=True)
    owner = np.zeros(len(pieces), dtype=np.intp)
    asked, found = shapely.STRtree(lines).query_nearest(middle, all_matches=False)
    owner[asked] = found
    lengths = shapely.length(pieces)
    where = shapely.line_locate_point(lines[owner], middle)
    runs: list[list[tuple[float, _Label]]] = [[] for _ in lines]
    for k in np.lexsort((where, owner)).tolist():
        runs[owner[k]].append((float(lengths[k]), labels[k]))
    _, ends, degree = _nodes(lines)
    free_ring = shapely.is_closed(lines) & (degree[ends[:, 0]] == 2)
    lines = lines.copy()
    result = []
    for k, run in enumerate(runs):
        joined = _joined(run)
        if free_ring[k] and len(joined) > 1 and joined[0][1] == joined[-1][1]:
            first, label = joined.pop(0)
            joined[-1] = (joined[-1][0] + first, label)
            lines[k] = _turned(lines[k], first)
        cuts = np.concatenate([[0.0], np.cumsum([length for length, _ in joined])])
        cuts[-1] = lines[k].length
        result.append(tuple(
            Section(float(a), float(b), *label)
            for a, b, (_, label) in zip(cuts[:-1], cuts[1:], joined)
        ))  # fmt: skip
    return lines, result


def _joined(run: list[tuple[float, _Label]]) -> list[tuple[float, _Label]]:
    """Join neighbours with the same label, and crumbs with what comes before."""
    proper = [label for length, label in run if length > CRUMB]
    last = proper[0] if proper else run[0][1]
    result: list[tuple[float, _Label]] = []
    for length, label in run:
        label = label if proper and length > CRUMB else last
        if result and label == last:
            result[-1] = (result[-1][0] + length, label)
        else:
            result.append((length, label))
        last = label
    return result


def _turned(ring: LineString, start: float) -> LineString:
    """Let a ring start at the vertex that lies at a distance along it."""
    xy = shapely.get_coordinates(ring)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    k = int(np.argmin(np.abs(along - start)))
    return LineString(np.concatenate([xy[k:-1], xy[:k], xy[k : k + 1]]))
