"""What a cancel says depends on what was going on."""

from __future__ import annotations

import time

import numpy as np
import pytest
import shapely
from platwright.errors import CancelledError
from platwright.progress import Silent
from platwright.site.watch import CHUNK, aside, ask, in_chunks


class Cancelled(Silent):
    def cancelled(self):
        return True


POINTS = shapely.points(np.zeros((3, 2)))


@pytest.mark.parametrize(
    "call",
    [
        lambda **work: ask(Cancelled(), *work.values()),
        lambda **work: in_chunks(shapely.get_x, POINTS, Cancelled(), **work),
        lambda **work: aside(shapely.union_all, POINTS, Cancelled(), **work),
    ],
)
def test_a_cancel_names_the_work(call):
    with pytest.raises(CancelledError, match=r"^Cancelled while the sites were prepared\.$"):
        call()
    with pytest.raises(CancelledError, match=r"^Cancelled while lines were counted\.$"):
        call(work="lines were counted")


def test_a_cancel_during_a_long_operation_names_the_work():
    class Later(Silent):
        asked = 0

        def cancelled(self):
            self.asked += 1
            return self.asked > 1

    many = shapely.points(np.zeros((CHUNK + 1, 2)))
    with pytest.raises(CancelledError, match="while lines were joined"):
        aside(lambda _: time.sleep(0.5), many, Later(), work="lines were joined")
