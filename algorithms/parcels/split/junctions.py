"""Where streets arrive at the edge of a region."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from shapely.geometry import Point

from ..roadmesh import StreetMesh

Floats = npt.NDArray[np.float64]


def junctions_of(
    mesh: StreetMesh, region: int, arriving: Sequence[tuple[Floats, Floats]] = ()
) -> tuple[Floats, Floats]:
    """Find the streets that arrive at the edge of a region from outside it.

    Parameters
    ----------
    mesh, region
        The mesh and the number of the region.
    arriving
        Places and directions of existing streets at the edge of the site.

    Returns
    -------
    places
        Shape (n, 2), metres.
    directions
        Unit vectors in which the streets would go on into the region, shape (n, 2).
    """
    own = {v for ring in mesh.regions[region].rings for v in ring}
    edges = {frozenset(half) for half in mesh.regions[region].edges()}
    places: list[Floats] = []
    ways: list[Floats] = []
    for here in sorted(own):
        for there in mesh.neighbours(here):
            if mesh.edge(here, there).street >= 0 and frozenset((here, there)) not in edges:
                way = mesh.xy[here] - mesh.xy[there]
                places.append(mesh.xy[here])
                ways.append(way / (np.hypot(*way) or 1.0))
    if arriving:
        ring = mesh.polygon(region).boundary
        for place, way in arriving:
            if ring.distance(Point(place)) < 1.0:
                places.append(place)
                ways.append(way)
    return np.array(places).reshape(-1, 2), np.array(ways).reshape(-1, 2)
