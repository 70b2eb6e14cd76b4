"""What may be asked of the layout of a zone."""

from __future__ import annotations

import pytest
from platwright.buildings.rules import LayoutRules
from platwright.errors import InputError


@pytest.mark.parametrize(
    "asked",
    [
        {"weights": (0.0, 0.0, 0.0)},
        {"weights": (1.0, -1.0, 1.0)},
        {"weights": (1.0, float("nan"), 1.0)},
        {"iterations": -1},
        {"seed": -1},
        {"green_limit": 1.5},
        {"far_limit": float("nan")},
    ],
    ids=str,
)
def test_what_cannot_be_reckoned_with_is_refused(asked):
    with pytest.raises(InputError) as caught:
        LayoutRules(**asked)
    assert caught.value.remedy


def test_some_weights_may_be_none():
    assert LayoutRules(weights=(0.0, 1.0, 0.0), iterations=0, green_limit=0.0).iterations == 0
