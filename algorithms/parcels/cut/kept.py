"""Blocks that were cut before: a hierarchy of streets asks for the same ones again and again."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from threading import Lock

from ..rules import ParcelRules
from ..types import Block, Plot

#: The blocks cut last that are kept: about 20 kB each.
MOST = 1000

Key = tuple[bytes, bytes, ParcelRules]


class Kept:
    """The plots of the blocks that were cut last.

    A block gives the same plots under the same rules, whenever and with whatever others it is cut,
    so nobody can tell kept plots from fresh ones but by the time that they take.

    Parameters
    ----------
    most
        How many blocks are kept.
    """

    def __init__(self, most: int = MOST) -> None:
        self.most = most
        self._plots: OrderedDict[Key, tuple[Plot, ...]] = OrderedDict()
        self._lock = Lock()

    def find(self, block: Block, rules: ParcelRules) -> tuple[Plot, ...] | None:
        """Return the plots of a block, None if it was not cut of late."""
        with self._lock:
            return self._plots.get(_key(block, rules))

    def keep(self, block: Block, rules: ParcelRules, plots: Sequence[Plot]) -> None:
        """Remember the plots of a block; the one not asked for longest is forgotten."""
        with self._lock:
            key = _key(block, rules)
            self._plots[key] = tuple(plots)
            self._plots.move_to_end(key)
            while len(self._plots) > self.most:
                self._plots.popitem(last=False)

    def clear(self) -> None:
        """Forget all of them."""
        with self._lock:
            self._plots.clear()


def _key(block: Block, rules: ParcelRules) -> Key:
    return block.polygon.wkb, block.closed.wkb, rules
