"""The examples in the documentation of the room are true."""

from __future__ import annotations

import doctest
import importlib

import pytest

MODULES = ("grids", "polysquare", "quadmesh", "quality", "subdivide")


@pytest.mark.parametrize("name", MODULES)
def test_examples(name):
    module = importlib.import_module(f"platwright.mesh.{name}")
    result = doctest.testmod(module)
    assert result.attempted > 0
    assert result.failed == 0
