"""Where buildings may stand at all: patches without their setback."""

from __future__ import annotations

import shapely
from shapely.geometry.base import BaseGeometry

from ..rules import LayoutRules
from ..zone import Zone

#: Footprints may reach over the setback line by this much, which is rounding (metres).
GRACE = 1e-6


def buildable(zone: Zone, rules: LayoutRules) -> tuple[BaseGeometry, ...]:
    """Return the ground of each patch that a footprint must lie in (RZ section 4.1).

    Parameters
    ----------
    zone
        The ground; obstacles are no part of its patches.
    rules
        Their setback counts from every edge of a patch.

    Returns
    -------
    tuple of geometries
        Prepared polygons, possibly of several parts or empty, one for each patch.
    """
    found = []
    for patch in zone.patches:
        inner = patch.polygon.buffer(GRACE - rules.setback_m, join_style="mitre")
        shapely.prepare(inner)
        found.append(inner)
    return tuple(found)
