"""The paper's own rows for rooms, kept for tests and benchmarks (CND eq. 15-17, CND-x 19-20)."""

from __future__ import annotations

from ...network.mip.model import NetworkModel
from .linear import LinearRooms


class PaperRooms(LinearRooms):
    """Rooms as the paper writes them: one row per placement instead of one per edge."""

    def _floor(self, model: NetworkModel) -> None:
        """Add equations 16 and 17."""
        placements = self.index.problem.placements
        for r, room in enumerate(self.room):
            inner = [(model.edge[e], 1.0) for e in placements.inner[r] if e in model.edge]
            count = float(len(inner))
            if inner:
                model.linear.row([*inner, (room, count)], high=count)
            rim = [(model.edge[e], 1.0) for e in placements.rim[r] if e in model.edge]
            model.linear.row([*rim, (room, -1.0)], low=0.0)

    def _level(self, model: NetworkModel) -> None:
        """Add equations 19 and 20."""
        placements = self.index.problem.placements
        for r, room in enumerate(self.room):
            inner = [(model.edge[e], 1.0) for e in placements.inner[r] if e in model.edge]
            model.linear.row([*inner, (room, -1.0)], low=0.0)
            rim = [(model.edge[e], 1.0) for e in placements.rim[r] if e in model.edge]
            count = float(len(rim))
            if rim:
                model.linear.row([*rim, (room, count)], high=count)
