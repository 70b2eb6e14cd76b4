"""The streets and nodes of a growth as columns of a table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import shapely

from ...levels import COLLECTOR, LEVEL_NAMES, LOCAL, MAJOR, SPEEDS
from ..grammar import LARGE, MAIN, NODE_TYPES, ROAD_TYPES, SMALL, State
from ..types import Growth, IntArray
from .chains import chains
from .outward import Shapes, at_nodes, existing_edges, on_outer_edge, ways_out

if TYPE_CHECKING:
    from ..land.ground import RealGround

#: Levels of streets by road types.
LEVELS = {MAIN: MAJOR, LARGE: COLLECTOR, SMALL: LOCAL}
#: Ways out that differ by less are equal (metres).
EQUAL = 1e-6

Columns = dict[str, Any]


@dataclass(frozen=True, eq=False)
class _Streets:
    """Every street between two junctions or ends, s of them: grown ones first.

    Attributes
    ----------
    lines
        Shape (s,).
    ends
        Shape (s, 2). Nodes at the start and the end.
    edge
        Shape (s,). An edge of each.
    """

    lines: Shapes
    ends: IntArray
    edge: IntArray


def street_columns(growth: Growth, real: RealGround) -> tuple[Columns, Shapes]:
    """Give the columns of the layer "streets", in their order, and its lines.

    Grown streets are as they grew, one for each edge; pieces of a street that was there are
    merged between junctions.

    Parameters
    ----------
    growth, real
        What has grown, and where.
    """
    streets = _streets(growth)
    grown = growth.grown[streets.edge]
    given = growth.street[streets.edge]
    kind = growth.edge_type[streets.edge].tolist()
    level = np.array([LEVELS.get(k, 0) for k in kind], dtype=np.int64)
    level[~grown] = np.array([s.level for s in real.streets], dtype=np.int64)[given[~grown]]
    existing = existing_edges(growth, real)[streets.edge]
    start, end = ways_out(growth, real)[streets.ends].T
    start, end = (np.where(np.isfinite(d) & ~existing, d, np.nan) for d in (start, end))
    way = np.where(np.abs(start - end) > EQUAL, np.sign(start - end), 0.0)
    words = state_words(growth)
    columns = {
        "street_id": np.arange(1, len(grown) + 1),
        "status": np.where(existing, "existing", "new").astype(object),
        "level": level,
        "level_name": [LEVEL_NAMES[k] for k in level.tolist()],
        "road": np.where(grown, growth.road[streets.edge], np.nan),
        "road_type": [ROAD_TYPES.get(k, "") for k in kind],
        "iteration": growth.step[streets.edge],
        "length_m": shapely.length(streets.lines),
        "start_state": words[streets.ends[:, 0]],
        "end_state": words[streets.ends[:, 1]],
        "dist_to_sink_m": (start + end) / 2,
        "dist_start_m": start,
        "dist_end_m": end,
        "direction": np.where(np.isnan(way), 0.0, way).astype(np.int64),
        "speed_kmh": [SPEEDS[k] for k in level.tolist()],
        "name": ["" if k < 0 else real.streets[k].name for k in given.tolist()],
    }
    return columns, streets.lines


def node_columns(growth: Growth, real: RealGround) -> tuple[Columns, Shapes]:
    """Give the columns of the layer "nodes", in their order, and its points.

    Places where a street that was there only bends are no nodes.

    Parameters
    ----------
    growth, real
        What has grown, and where.
    """
    # a start from which nothing grew is shown, too
    kept = np.flatnonzero(~growth.bends & ((growth.degrees > 0) | (growth.node_type != "")))
    columns = {
        "node_id": np.arange(1, len(kept) + 1),
        "state": state_words(growth)[kept],
        "node_type": [NODE_TYPES.get(k, "") for k in growth.node_type[kept].tolist()],
        "road_type": [ROAD_TYPES.get(k, "") for k in growth.road_type[kept].tolist()],
        "iteration": growth.born[kept],
        "degree": growth.degrees[kept],
        "road": np.where(growth.incoming_road[kept] > 0, growth.incoming_road[kept], np.nan),
        "kind": node_kinds(growth, real)[kept],
    }
    return columns, np.asarray(shapely.points(growth.xy[kept]), dtype=object)


def state_words(growth: Growth) -> npt.NDArray[np.object_]:
    """Say the state of each node in words, shape (n,); empty for what did not grow.

    Parameters
    ----------
    growth
        What has grown.
    """
    labels = np.char.add(np.char.add(growth.road_type, " "), growth.node_type)
    names, which = np.unique(labels, return_inverse=True)
    words = []
    for name in names.tolist():
        road, node = name.split(" ", 1)
        words.append(State(road, node).words if road and node else "")
    return np.array([*words, ""], dtype=object)[which]


def node_kinds(growth: Growth, real: RealGround) -> npt.NDArray[np.object_]:
    """Say what each node is, shape (n,).

    "join" where a grown street meets an existing one, "at the edge" where it ends at the outer
    edge of the domain, or meets a new street along an edge; elsewhere "junction", "bend" (two
    streets) or "dead end", also where a street ends at an obstacle or a motorway.

    Parameters
    ----------
    growth, real
        What has grown, and where.
    """
    degree = growth.degrees
    kinds = np.full(len(growth.xy), "junction", dtype=object)
    kinds[degree == 2] = "bend"
    kinds[degree <= 1] = "dead end"
    existing = existing_edges(growth, real)
    grown = at_nodes(growth, growth.grown)
    beside = at_nodes(growth, ~growth.grown & ~existing) | on_outer_edge(growth, real)
    kinds[grown & beside] = "at the edge"
    kinds[grown & at_nodes(growth, existing)] = "join"
    return kinds


def _streets(growth: Growth) -> _Streets:
    """Put grown edges and merged pieces of the streets that were there together."""
    grown, there = np.flatnonzero(growth.grown), np.flatnonzero(~growth.grown)
    merged = chains(growth.ends[there], growth.bends)
    ends = growth.ends[grown]
    lines = np.asarray(shapely.linestrings(growth.xy[ends]), dtype=object)
    return _Streets(
        np.concatenate([lines, merged.lines(growth.xy)]),
        np.concatenate([ends, merged.ends]),
        np.concatenate([grown, there[merged.first]]),
    )
