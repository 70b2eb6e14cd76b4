"""What the tests of the house share: the Python files of the tree and their syntax trees."""

from __future__ import annotations

import ast
import functools
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: Folders that ship with the plugin.
SHIPPED = ("algorithms", "plugin")


def python_files(*folders: str) -> list[Path]:
    """Return the Python files under folders of the repository, sorted."""
    return sorted(path for folder in folders for path in (ROOT / folder).rglob("*.py"))


def shipped_files() -> list[Path]:
    """Return all Python files that ship with the plugin."""
    return [ROOT / "__init__.py", *python_files(*SHIPPED)]


@functools.cache
def tree(path: Path) -> ast.Module:
    """Return the syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"), filename=str(path))


def place(path: Path, node: ast.AST | None = None) -> str:
    """Name a place in a file, as editors read it."""
    line = getattr(node, "lineno", 1)
    return f"{path.relative_to(ROOT)}:{line}"
