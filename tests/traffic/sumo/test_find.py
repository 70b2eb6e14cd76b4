"""Where SUMO is looked for, and what is said where it is missing."""

from __future__ import annotations

import importlib.machinery
import os
import sys

import pytest
from platwright.errors import MissingDependencyError
from platwright.traffic.sumo import find, find_sumo, simulate


@pytest.fixture
def nowhere(monkeypatch, tmp_path):
    """A machine without SUMO."""
    monkeypatch.delenv("SUMO_HOME", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    return tmp_path


def programs(folder, names=find.PROGRAMS):
    folder.mkdir(parents=True)
    for name in names:
        path = folder / (f"{name}.exe" if os.name == "nt" else name)
        path.write_text("#!/bin/sh\n")
        path.chmod(0o755)


def test_it_says_what_to_install_and_how(nowhere, make_streets, make_demand):
    with pytest.raises(MissingDependencyError, match="pip install eclipse-sumo") as error:
        find_sumo()
    assert "SUMO_HOME" in str(error.value)
    network = make_streets([(0, 0), (200, 0)], [(0, 1)])
    with pytest.raises(MissingDependencyError):
        simulate(network, make_demand({(0, 1): 5.0}, gates=[0, 1]))


def test_it_is_found_as_the_variable_says(nowhere, monkeypatch):
    programs(nowhere / "own" / "bin")
    monkeypatch.setenv("SUMO_HOME", str(nowhere / "own"))
    found = find_sumo()
    assert found.program("sumo").parent == nowhere / "own" / "bin"
    assert found.environment()["SUMO_HOME"] == str(nowhere / "own")


def test_it_is_found_as_a_package_without_an_import(nowhere):
    programs(nowhere / "sumo" / "bin")
    (nowhere / "sumo" / "data" / "proj").mkdir(parents=True)
    (nowhere / "sumo" / "__init__.py").write_text("raise RuntimeError('imported')\n")
    importlib.machinery.PathFinder.invalidate_caches()
    found = find_sumo()
    assert found.home == nowhere / "sumo"
    assert found.environment()["PROJ_LIB"] == str(nowhere / "sumo" / "data" / "proj")
    assert "PROJ_LIB" not in os.environ or os.environ["PROJ_LIB"] != found.environment()["PROJ_LIB"]
    assert "sumo" not in sys.modules


def test_it_is_found_on_the_path_with_its_data(nowhere, monkeypatch):
    programs(nowhere / "usr" / "bin")
    (nowhere / "usr" / "share" / "sumo" / "data").mkdir(parents=True)
    monkeypatch.setenv("PATH", str(nowhere / "usr" / "bin"))
    found = find_sumo()
    assert found.home == nowhere / "usr" / "share" / "sumo"


def test_half_of_it_is_not_enough(nowhere, monkeypatch):
    programs(nowhere / "half" / "bin", ("sumo", "netconvert"))
    monkeypatch.setenv("SUMO_HOME", str(nowhere / "half"))
    with pytest.raises(MissingDependencyError):
        find_sumo()
