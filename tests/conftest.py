"""What every test may use: the library under its public name, data, a place for artefacts."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parents[1]

# The same examples in every run; PLATWRIGHT_HYPOTHESIS=explore looks for new ones. No deadline:
# on a busy machine the first example, which imports and compiles, may take any time.
settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("explore", print_blob=True, deadline=None)
settings.load_profile(os.environ.get("PLATWRIGHT_HYPOTHESIS", "same"))

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
os.environ.setdefault("MPLBACKEND", "Agg")
# Several threads per process only fight each other on a busy machine.
os.environ.setdefault("OMP_NUM_THREADS", "1")


def import_library() -> None:
    """Make `platwright` mean this tree's `algorithms`, whatever else is installed."""
    folder = ROOT / "algorithms"
    spec = importlib.util.spec_from_file_location(
        "platwright", folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    if spec is None or spec.loader is None:
        msg = f"{folder} is not a package"
        raise ImportError(msg)
    module = importlib.util.module_from_spec(spec)
    sys.modules["platwright"] = module
    spec.loader.exec_module(module)


import_library()


@pytest.fixture(scope="session")
def root() -> Path:
    """Folder of the repository."""
    return ROOT


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the real test data that is not part of the repository.

    It is `../shared/data` beside the repository, or what PLATWRIGHT_TEST_DATA names. Tests
    that ask for it are skipped, visibly, where it is absent.
    """
    given = os.environ.get("PLATWRIGHT_TEST_DATA")
    folder = Path(given) if given else ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("real test data absent: set PLATWRIGHT_TEST_DATA or put it in ../shared/data")
    return folder


@pytest.fixture(scope="session")
def artefacts() -> Path:
    """Folder for pictures and other results worth looking at; ignored by git."""
    folder = Path(os.environ.get("PLATWRIGHT_ARTEFACTS", str(ROOT / "artefacts")))
    folder.mkdir(parents=True, exist_ok=True)
    return folder
