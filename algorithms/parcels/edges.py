"""What the edges of regions and blocks are."""

from __future__ import annotations

from enum import IntEnum


class EdgeKind(IntEnum):
    """What lies along an edge of a region.

    STREET: the edge is the centre line of a street, half of whose width belongs to the region.
    FRONTAGE: the edge is the property line along an existing street.
    CLOSED: there is no street, and no access.
    """

    STREET = 0
    FRONTAGE = 1
    CLOSED = 2
