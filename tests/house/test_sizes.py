"""Small files and functions; where one must be larger, this file says why."""

from __future__ import annotations

import ast

from house import ROOT, place, python_files, tree

FILE_LINES = 400
FUNCTION_LINES = 60
#: Path of a larger file -> why.
LARGE_FILES: dict[str, str] = {}
#: Path and name of a larger function -> why.
LARGE_FUNCTIONS: dict[str, str] = {}

FOLDERS = ("algorithms", "plugin", "scripts")


def lines_of(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Count the lines of a function, its docstring left out."""
    size = (function.end_lineno or function.lineno) - function.lineno + 1
    first = function.body[0]
    if ast.get_docstring(function) is not None:
        size -= (first.end_lineno or first.lineno) - first.lineno + 1
    return size


def test_files_are_small():
    sizes = {
        str(path.relative_to(ROOT)): len(path.read_text(encoding="utf-8").splitlines())
        for path in python_files(*FOLDERS, "tests")
    }
    large = {p: n for p, n in sizes.items() if n > FILE_LINES and not p.startswith("tests/")}
    assert set(large) == set(LARGE_FILES), large
    assert {p for p, n in sizes.items() if n > 2 * FILE_LINES} == set()


def test_functions_are_small():
    large = {
        f"{place(path, node)} {node.name}": lines_of(node)
        for path in python_files(*FOLDERS)
        for node in ast.walk(tree(path))
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))
        and lines_of(node) > FUNCTION_LINES
        and f"{path.relative_to(ROOT)} {node.name}" not in LARGE_FUNCTIONS
    }
    assert not large, large
