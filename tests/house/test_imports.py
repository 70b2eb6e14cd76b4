"""The import rule: rooms import leftwards only, the library knows no QGIS."""

from __future__ import annotations

import ast
import graphlib
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from house import ROOT, SHIPPED, place, python_files, shipped_files, tree

#: Which other rooms each room of `algorithms` may import. Errors and progress are everyone's.
MAY_IMPORT = {
    # Programs of any room: it knows solvers and nothing else.
    "mip": set(),
    "site": set(),
    "mesh": {"site"},
    "network": {"site", "mesh"},
    "streets": {"site", "mesh", "network"},
    "city": {"site", "mesh", "network", "streets", "tasks"},
    # Brings data in, and knows nothing of designs.
    "osm": {"site"},
    # Reads results, so it must not know how they came about.
    "measure": {"site"},
    # Both measure by pure functions of geometry there what they make.
    "growth": {"site", "measure"},
    "parcels": {"site", "measure"},
    "buildings": {"site", "measure", "parcels"},
    # Where independent work is done: it knows not what the work is.
    "tasks": set(),
    "explore": {"site", "mesh", "network", "streets", "measure", "tasks"},
    # Writes what it is told: it knows no geometry.
    "report": set(),
    "rooms": {"site", "mesh", "network"},
    # Reads results; what it says rests on the geometry of streets alone.
    "traffic": {"site", "measure"},
}
COMMON = {"errors", "levels", "mip", "progress"}
#: The same for the rooms inside `network`, those on the left first; files beside them that only
#: say what is asked (`problem`, `structure`...) are everyone's.
NETWORK = ("oneway", "cuts", "cp", "requirements", "mip", "bounds", "checks", "search", "why")
#: For those inside `growth`,
GROWTH = ("grammars", "land", "grow", "layers")
#: for those inside `buildings`,
BUILDINGS = (
    "tables", "sun", "corridors", "lines", "paths", "place", "details", "layers", "export",
)  # fmt: skip
#: for those inside `rooms`,
ROOMS = ("shapes", "floors", "program", "search", "why", "layers", "levels", "tiled")
#: and for those inside `parcels`.
PARCELS = (
    "templates",
    "warp",
    "cut",
    "halving",
    "refine",
    "fill",
    "field",
    "roadmesh",
    "improve",
    "split",
)
#: Packages that the library may use; they are declared in pyproject.toml.
DECLARED = {
    "geopandas", "highspy", "networkx", "numpy", "ortools", "pandas", "pulp", "pvlib", "pyproj",
    "scipy", "shapely",
}  # fmt: skip
#: Packages that the library may use where they happen to be installed.
OPTIONAL = {"gmsh", "osmium", "osmnx", "requests"}


def imports(path: Path) -> Iterator[tuple[ast.AST, int, str]]:
    """Yield (node, level, dotted name) of everything that a file imports anywhere."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            yield from ((node, 0, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            names = [base] if base else [alias.name for alias in node.names]
            yield from ((node, node.level, name) for name in names)


def for_types_only(path: Path) -> set[int]:
    """Return the lines of a file that only a type checker reads."""
    return {
        line
        for node in ast.walk(tree(path))
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }


def target(path: Path, level: int, name: str) -> tuple[str, ...]:
    """Resolve a relative import to a path inside the repository, as parts."""
    package = path.relative_to(ROOT).parts[:-1]
    return (*package[: len(package) - level + 1], *(name.split(".") if name else ()))


def test_the_tree_has_shipped_files():
    assert len(shipped_files()) > 20


def test_only_relative_imports_inside_the_shipped_packages():
    wrong = [
        place(path, node)
        for path in shipped_files()
        for node, level, name in imports(path)
        if level == 0 and name.split(".")[0] in {*SHIPPED, "platwright"}
    ]
    assert not wrong, "QGIS chooses the folder's name, so import relatively: " + ", ".join(wrong)


def test_the_library_knows_no_qgis_and_no_plugin():
    wrong = []
    for path in python_files("algorithms"):
        for node, level, name in imports(path):
            outside = level > 0 and target(path, level, name)[0] != "algorithms"
            if outside or name.split(".")[0] in {"qgis", "PyQt5", "PyQt6", "osgeo", "processing"}:
                wrong.append(place(path, node))
    assert not wrong, ", ".join(wrong)


def test_the_library_uses_only_declared_packages():
    known = DECLARED | OPTIONAL | set(sys.stdlib_module_names) | {"__future__"}
    wrong = [
        f"{place(path, node)} {name}"
        for path in python_files("algorithms")
        for node, level, name in imports(path)
        if level == 0 and name.split(".")[0] not in known
    ]
    assert not wrong, ", ".join(wrong)


def test_rooms_import_only_leftwards():
    wrong = []
    for path in python_files("algorithms"):
        room = path.relative_to(ROOT / "algorithms").parts[0]
        if room.endswith(".py"):
            continue
        assert room in MAY_IMPORT, f"say in this test what the new room {room} may import"
        for node, level, name in imports(path):
            if level == 0:
                continue
            parts = target(path, level, name)
            to = parts[1] if len(parts) > 1 else ""
            if to not in {room, *MAY_IMPORT[room], *COMMON}:
                wrong.append(f"{place(path, node)} imports {to or 'the package itself'}")
    assert not wrong, ", ".join(wrong)


@pytest.mark.parametrize(
    ("name", "order"),
    [
        ("network", NETWORK),
        ("growth", GROWTH),
        ("parcels", PARCELS),
        ("buildings", BUILDINGS),
        ("rooms", ROOMS),
    ],
)
def test_rooms_inside_a_room_import_only_leftwards(name, order):
    folder = ROOT / "algorithms" / name
    rooms = {path.parent.name for path in folder.rglob("*.py") if path.parent != folder}
    assert rooms <= set(order)
    wrong = []
    for path in python_files(f"algorithms/{name}"):
        room = path.relative_to(folder).parts[0]
        skip = for_types_only(path)
        for node, level, imported in imports(path):
            parts = target(path, level, imported) if level else ()
            if room not in rooms or len(parts) < 3 or parts[1] != name:
                continue
            later = order[order.index(room) + 1 :]
            if parts[2] in later and node.lineno not in skip:
                wrong.append(f"{place(path, node)} imports {parts[2]}")
    assert not wrong, ", ".join(wrong)


@pytest.mark.parametrize("folder", SHIPPED)
def test_no_circular_imports(folder):
    modules = {path.relative_to(ROOT).with_suffix("").parts for path in python_files(folder)}
    packages = {m[:-1] for m in modules if m[-1] == "__init__"}
    graph: dict[tuple[str, ...], set[tuple[str, ...]]] = {}
    for path in python_files(folder):
        own = path.relative_to(ROOT).with_suffix("").parts
        for node in tree(path).body:
            if not isinstance(node, ast.ImportFrom) or not node.level:
                continue
            base = target(path, node.level, node.module or "")
            for alias in node.names:
                inner = (*base, alias.name)
                found = inner if inner in modules else (*inner, "__init__")
                if found not in modules:
                    found = (*base, "__init__") if base in packages else base
                if found in modules and found != own:
                    graph.setdefault(own, set()).add(found)
    assert graph, f"no relative import found in {folder}"
    graphlib.TopologicalSorter(graph).prepare()
