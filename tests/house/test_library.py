"""The library by itself: no QGIS, documented examples that hold, installable with pip."""

from __future__ import annotations

import doctest
import importlib
import re
import subprocess
import sys
import zipfile

import pytest

from house import ROOT, python_files

MODULES = [
    ".".join(("platwright", *path.relative_to(ROOT / "algorithms").with_suffix("").parts))
    .removesuffix(".__init__")
    for path in python_files("algorithms")
]  # fmt: skip
PACKAGES = sorted(
    ".".join(("platwright", *path.parent.relative_to(ROOT / "algorithms").parts))
    for path in python_files("algorithms")
    if path.name == "__init__.py"
)

WITHOUT_QGIS = """
import importlib, pathlib, sys, types
for name in ("qgis", "PyQt5", "PyQt6", "osgeo"):
    sys.modules[name] = None
package = types.ModuleType("platwright")
package.__path__ = [sys.argv[1]]
sys.modules["platwright"] = package
for name in sys.argv[2:]:
    importlib.import_module(name)
print(len(sys.argv) - 2)
"""


def test_every_module_imports_where_qgis_is_blocked():
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_QGIS, str(ROOT / "algorithms"), *MODULES],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) == len(MODULES) > 10


@pytest.mark.parametrize("name", MODULES)
def test_examples_in_docstrings(name):
    result = doctest.testmod(
        importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE
    )
    assert result.failed == 0


def test_there_are_examples():
    found = sum(
        len(doctest.DocTestFinder(exclude_empty=True).find(importlib.import_module(name)))
        for name in MODULES
    )
    assert found > 5


def test_pyproject_lists_every_package():
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    listed = re.search(r"\[tool\.setuptools\]\s*packages = \[(.*?)\]", text, re.DOTALL)
    assert listed is not None
    assert sorted(re.findall(r'"([\w.]+)"', listed.group(1))) == PACKAGES


def test_every_folder_of_the_library_is_a_package():
    folders = {path.parent for path in python_files("algorithms")}
    assert [f for f in sorted(folders) if not (f / "__init__.py").is_file()] == []


@pytest.mark.slow
def test_pip_builds_the_library_without_the_plugin(tmp_path):
    source = tmp_path / "source"
    source.mkdir()
    for name in ("algorithms", "plugin", "pyproject.toml", "README.md", "LICENSE"):
        (source / name).symlink_to(ROOT / name)
    done = subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation",
         "--no-cache-dir", "-q", "-w", str(tmp_path), str(source)],
        capture_output=True, text=True, timeout=300, check=False, cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    (wheel,) = tmp_path.glob("platwright-*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    code = {n for n in names if ".dist-info/" not in n}
    expected = {
        f"platwright/{p.relative_to(ROOT / 'algorithms')}" for p in python_files("algorithms")
    }
    grammars = (ROOT / "algorithms" / "growth" / "grammars").glob("*.json")
    tables = (ROOT / "algorithms" / "buildings" / "tables").glob("*.csv")
    shapes = (ROOT / "algorithms" / "rooms" / "shapes").glob("*.json")
    data = {
        "platwright/py.typed",
        "platwright/parcels/templates/library.gpkg",
        "platwright/buildings/corridors/samples.json",
        *(f"platwright/growth/grammars/{path.name}" for path in grammars),
        *(f"platwright/buildings/tables/{path.name}" for path in tables),
        *(f"platwright/rooms/shapes/{path.name}" for path in shapes),
    }
    assert code == expected | data
    assert any(n.endswith("licenses/LICENSE") for n in names)

    target = tmp_path / "installed"
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "--no-deps", "-q", "-t", str(target), str(wheel)],
        check=True, timeout=300, capture_output=True,
    )  # fmt: skip
    program = "import platwright.measure as m; print(m.__file__)"
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={"PYTHONPATH": str(target)},
        check=False,
    )
    assert done.stdout.startswith(str(target)), done.stderr
