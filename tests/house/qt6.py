"""The interface of Qt 6 as the type stubs of PyQt6 tell it; nothing of it is imported."""

from __future__ import annotations

import ast
import functools
import re
import sys
from pathlib import Path

#: Where `scripts/setup` puts them, beside the environment and not on its path.
STUBS = Path(sys.prefix) / "qt6" / "PyQt6"

#: Names that `qgis.PyQt` adds on Qt 6 to where Qt 5 has them
#: (https://github.com/qgis/QGIS/blob/master/python/PyQt/PyQt/QtWidgets.py.in).
MOVED = {("QtWidgets", "QAction"): "QtGui", ("QtWidgets", "QShortcut"): "QtGui"}
#: What `qgis.PyQt` adds by itself.
ADDED = {("QtCore", "NULL")}


def parse(path: Path) -> ast.Module:
    """Return the syntax tree of a file of stubs."""
    text = path.read_text(encoding="utf-8")
    # A few of them say "*args, /", which Python does not take.
    return ast.parse(re.sub(r"(\*\w+: [\w.]+), /", r"\1", text), filename=str(path))


@functools.cache
def module(name: str) -> dict[str, ast.stmt]:
    """Return what a module of PyQt6 defines at its top, by name; empty if there is no module."""
    path = STUBS / f"{name}.pyi"
    if not path.is_file():
        return {}
    found: dict[str, ast.stmt] = {}
    for node in parse(path).body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            found[node.name] = node
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            found[node.target.id] = node
        elif isinstance(node, ast.Assign):
            found |= {t.id: node for t in node.targets if isinstance(t, ast.Name)}
    return found


def lookup(where: str, name: str) -> tuple[str, ast.stmt] | None:
    """Return the module and the definition of a name, or None."""
    where = MOVED.get((where, name), where)
    node = module(where).get(name)
    return None if node is None else (where, node)


def is_enumeration(node: ast.stmt) -> bool:
    """Tell whether a class is an enumeration."""
    return isinstance(node, ast.ClassDef) and any(
        isinstance(base, ast.Attribute) and ast.unparse(base).startswith("enum.")
        for base in node.bases
    )


def member(where: str, node: ast.ClassDef, name: str) -> tuple[str, ast.stmt] | None:
    """Return the module and the definition of a class's member, its own or inherited."""
    for line in node.body:
        if isinstance(line, (ast.ClassDef, ast.FunctionDef)) and line.name == name:
            return where, line
        targets = line.targets if isinstance(line, ast.Assign) else [getattr(line, "target", None)]
        if any(isinstance(t, ast.Name) and t.id == name for t in targets):
            return where, line
    for base in node.bases:
        parts = ast.unparse(base).split(".")
        above = lookup(parts[0], parts[1]) if len(parts) == 2 else lookup(where, parts[0])
        if above is not None and isinstance(above[1], ast.ClassDef):
            found = member(above[0], above[1], name)
            if found is not None:
                return found
    return None


def wrong(where: str, names: list[str]) -> str:
    """Say what Qt 6 lacks of a chain such as ["Qt", "AlignmentFlag", "AlignLeft"], or nothing."""
    if (where, names[0]) in ADDED:
        return ""
    found = lookup(where, names[0])
    if found is None:
        return f"Qt 6 has no {where}.{names[0]}"
    for depth, name in enumerate(names[1:], 1):
        place, node = found
        if not isinstance(node, ast.ClassDef):
            return ""  # what a function or a signal gives back
        if is_enumeration(node) and name in ("name", "value"):
            return ""
        found = member(place, node, name)
        if found is None:
            return f"Qt 6 has no {'.'.join(names[: depth + 1])}"
    return ""


def all_names() -> set[str]:
    """Return every name of a class, a method, a signal or a member anywhere in PyQt6."""
    found: set[str] = set()
    for path in STUBS.glob("Q*.pyi"):
        for node in ast.walk(parse(path)):
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
                found.add(node.name)
            elif isinstance(node, ast.Assign):
                found |= {t.id for t in node.targets if isinstance(t, ast.Name)}
            elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                found.add(node.target.id)
    return found
