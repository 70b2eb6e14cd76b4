"""Whoever cancels is told what was going on."""

from __future__ import annotations

import pytest
from platwright.errors import CancelledError
from platwright.growth.layers import growth_layers
from platwright.progress import Silent

from .hand_made import lattice, make_real, rules


class Later(Silent):
    """Cancels at a certain question."""

    def __init__(self, asked):
        self.left = asked

    def cancelled(self):
        self.left -= 1
        return self.left < 0


@pytest.mark.parametrize(
    ("asked", "work"), [(0, "the layers of streets were collected"), (6, "the blocks were drawn")]
)
def test_layers_of_streets_do_not_speak_of_sites(asked, work):
    growth = lattice(3, 3)
    with pytest.raises(CancelledError, match=f"while {work}"):
        growth_layers(growth, make_real(growth), rules(), Later(asked))
