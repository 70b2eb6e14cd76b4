"""What has grown as a graph of networkx, with the names that CitySprout gives."""

from __future__ import annotations

from collections.abc import Mapping

import networkx as nx
import numpy as np

from ..grammar import LARGE, MAIN, SMALL
from ..types import Growth

#: Weight of the edges of each road type (CS Table 3), for drawing; existing streets have that
#: of main roads.
WEIGHTS: Mapping[str, float] = {MAIN: 1.0, LARGE: 0.5, SMALL: 0.25, "": 1.0}


def to_networkx(growth: Growth) -> nx.Graph:
    """Give what has grown, with the streets that were there, as a graph.

    Attributes of nodes and edges have the names of CS Tables 2 and 3; lengths are metres here,
    not hectometres. Nodes are numbered as in `growth`, bends of existing streets included.

    Parameters
    ----------
    growth
        What has grown.

    Returns
    -------
    networkx.Graph
        Nodes with roadType ("m", "l", "s"; empty for what was there), nodeType ("Start", "L",
        "T", "B", "K", "BOUNDARY"; empty likewise), pos (x, y), incEdge (unit vector in which the
        node was reached, (0, 0) where unknown) and incRoadNumber (0 for none). Edges with weight
        (`WEIGHTS`), boundaryBox (least x, least y, greatest x, greatest y), roadNumber (0 for
        what was there) and, beyond CitySprout, length and iteration (0 for what was there).

    Examples
    --------
    >>> import numpy as np
    >>> from platwright.growth.types import Growth
    >>> one = np.ones(1, dtype=np.int64)
    >>> growth = Growth(
    ...     np.array([[0.0, 0.0], [0.0, 300.0]]), np.array(["m", "m"]), np.array(["T", "L"]),
    ...     np.array([0, 1]), np.array([0, 1]), np.array([[0.0, 1.0], [0.0, 1.0]]),
    ...     np.zeros(2, dtype=bool), np.array([[0, 1]]), one, np.array(["m"]), one, -one,
    ...     (), "the number of iterations is reached", 0,
    ... )
    >>> graph = to_networkx(growth)
    >>> graph.nodes[1]["nodeType"], graph.edges[0, 1]["roadNumber"], graph.edges[0, 1]["length"]
    ('L', 1, 300.0)
    """
    graph = nx.Graph()
    columns = {
        "roadType": growth.road_type.tolist(),
        "nodeType": growth.node_type.tolist(),
        "pos": [tuple(at) for at in growth.xy.tolist()],
        "incEdge": [tuple(way) for way in growth.incoming.tolist()],
        "incRoadNumber": growth.incoming_road.tolist(),
    }
    rows = (dict(zip(columns, values)) for values in zip(*columns.values()))
    graph.add_nodes_from(enumerate(rows))
    at = growth.xy[growth.ends]
    columns = {
        "weight": [WEIGHTS[kind] for kind in growth.edge_type.tolist()],
        "boundaryBox": [tuple(b) for b in np.hstack([at.min(axis=1), at.max(axis=1)]).tolist()],
        "roadNumber": growth.road.tolist(),
        "length": growth.lengths.tolist(),
        "iteration": growth.step.tolist(),
    }
    rows = (dict(zip(columns, values)) for values in zip(*columns.values()))
    graph.add_edges_from((u, v, row) for (u, v), row in zip(growth.ends.tolist(), rows))
    return graph
