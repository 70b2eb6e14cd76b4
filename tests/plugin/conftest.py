"""The plugin as QGIS sees it: under a folder name of somebody's choice, its provider running."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

#: No name that the code could know.
FOLDER = "odd_Name_7"

# The helpers beside this file are imported by their bare name.
sys.path.insert(0, str(Path(__file__).parent))


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave files for QGIS unread in a run without it, unless named: reading takes seconds."""
    here = Path(__file__).parent
    named = any(
        here in (path := Path(arg.split("::")[0]).resolve(), *path.parents) for arg in config.args
    )
    if named or collection_path.suffix != ".py" or "not qgis" not in config.option.markexpr:
        return None
    text = collection_path.read_text(encoding="utf-8")
    return True if re.search(r"^pytestmark = (\[[^]]*)?pytest\.mark\.qgis", text, re.M) else None


@pytest.fixture(scope="session")
def plugin_folder(tmp_path_factory: pytest.TempPathFactory, root: Path) -> Path:
    """Make a plugin folder as in a QGIS profile, with this repository under an odd name."""
    pytest.importorskip("qgis.core", reason="QGIS is not installed")
    folder = tmp_path_factory.mktemp("plugins")
    (folder / FOLDER).symlink_to(root, target_is_directory=True)
    return folder


@pytest.fixture(scope="session")
def package(plugin_folder: Path) -> Iterator[Callable[[str], ModuleType]]:
    """Import modules by their name below the plugin's folder."""
    sys.path.insert(0, str(plugin_folder))
    yield lambda name: importlib.import_module(f"{FOLDER}.{name}")
    sys.path.remove(str(plugin_folder))


@pytest.fixture(scope="session")
def provider(package: Callable[[str], ModuleType], qgis_processing: None) -> Iterator[Any]:
    """Bring the provider up, as `classFactory` and `initProcessing` do."""
    plugin = importlib.import_module(FOLDER).classFactory(None)
    plugin.initProcessing()
    yield plugin.provider
    plugin.unload()


@pytest.fixture(scope="session")
def toolbox(provider: Any) -> Any:
    """Run the tools and read back what they made; see `support.Toolbox`."""
    from support import Toolbox

    return Toolbox()
