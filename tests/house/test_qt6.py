"""Prepared for QGIS 4, which is built on Qt 6, by rules that need neither to run.

Whatever the plugin names of Qt must be in Qt 6 under that name, enumerations with the name of
the enumeration. Whatever it names of QGIS must be in the QGIS of this run, likewise.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Any

import pytest
import qt6

from house import ROOT, place, python_files, tree

needs_stubs = pytest.mark.skipif(
    not (qt6.STUBS / "QtCore.pyi").is_file(),
    reason="the stubs of PyQt6 are not installed: run scripts/setup",
)
FILES = [ROOT / "__init__.py", *python_files("plugin")]
#: Chains that are only reached on Qt 5 -> why.
ONLY_QT5 = {
    f"plugin/compat.py QVariant.Type.{kind}": "types of fields before QGIS 3.38, all on Qt 5"
    for kind in ("Int", "Double", "String", "Bool", "DateTime")
}


def chain(node: ast.AST) -> list[str]:
    """Return the names of `a.b.c`, or nothing if it does not begin with a name."""
    names: list[str] = []
    while isinstance(node, ast.Attribute):
        names.insert(0, node.attr)
        node = node.value
    return [node.id, *names] if isinstance(node, ast.Name) else []


def chains(module: ast.Module) -> Iterator[tuple[ast.AST, list[str]]]:
    """Yield the longest dotted chains of a file, and all bare names."""
    inner = {id(n.value) for n in ast.walk(module) if isinstance(n, ast.Attribute)}
    for node in ast.walk(module):
        if isinstance(node, (ast.Attribute, ast.Name)) and id(node) not in inner and chain(node):
            yield node, chain(node)


def imported(module: ast.Module, package: str) -> dict[str, tuple[str, list[str]]]:
    """Return what a file imports from a package: its name here -> (module, names there)."""
    found: dict[str, tuple[str, list[str]]] = {}
    for node in ast.walk(module):
        if not isinstance(node, ast.ImportFrom) or node.level:
            continue
        for alias in node.names:
            name = alias.asname or alias.name
            if node.module == package:
                found[name] = (alias.name, [])
            elif (node.module or "").startswith(f"{package}."):
                found[name] = (str(node.module).removeprefix(f"{package}."), [alias.name])
    return found


def qt_findings(module: ast.Module, path: str) -> list[tuple[ast.AST, str]]:
    """Return what a file names of Qt that Qt 6 does not have so."""
    known = imported(module, "qgis.PyQt")
    found: list[tuple[ast.AST, str]] = []
    for name, (where, names) in known.items():
        if where not in ("sip", "uic"):
            text = qt6.wrong(where, names or [name]) if names else ""
            found += [(module, text)] if text else []
    for node, parts in chains(module):
        if parts[0] not in known or f"{path} {'.'.join(parts)}" in ONLY_QT5:
            continue
        where, names = known[parts[0]]
        names = [*names, *parts[1:]]
        if where not in ("sip", "uic") and names and (text := qt6.wrong(where, names)):
            found.append((node, text))
    return found


@needs_stubs
def test_whatever_is_named_of_qt_is_in_qt_6():
    wrong = [
        f"{place(path, node)} {text}"
        for path in FILES
        for node, text in qt_findings(tree(path), str(path.relative_to(ROOT)))
    ]
    assert not wrong, "\n".join(wrong)


@needs_stubs
@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("from qgis.PyQt.QtCore import Qt\nQt.AlignLeft", "Qt.AlignLeft"),
        ("from qgis.PyQt.QtCore import Qt\nQt.AlignmentFlag.AlignLeft", ""),
        ("from qgis.PyQt.QtCore import Qt\nQt.AlignmentFlag.Left", "Qt.AlignmentFlag.Left"),
        ("from qgis.PyQt import QtCore\nQtCore.Qt.AlignLeft", "Qt.AlignLeft"),
        ("from qgis.PyQt import QtCore\nQtCore.Qt.AlignmentFlag.AlignLeft", ""),
        ("from qgis.PyQt.QtCore import QRegExp", "QtCore.QRegExp"),
        ("from qgis.PyQt.QtCore import QVariant\nQVariant.Int", "QVariant.Int"),
        ("from qgis.PyQt.QtCore import QVariant\nQVariant.Type.Int", "QVariant.Type"),
        ("from qgis.PyQt.QtCore import NULL", ""),
        ("from qgis.PyQt.QtWidgets import QDesktopWidget", "QtWidgets.QDesktopWidget"),
        ("from qgis.PyQt.QtWidgets import QAction as A\nA.Trigger", "QAction.Trigger"),
        ("from qgis.PyQt.QtWidgets import QAction\nQAction.ActionEvent.Trigger", ""),
        ("from qgis.PyQt.QtWidgets import QFrame\nQFrame.Shape.NoFrame", ""),
        # Inherited by a class of another file of stubs.
        ("from qgis.PyQt.QtWidgets import QLabel\nQLabel.Shape.NoFrame", ""),
        ("from qgis.PyQt.QtWidgets import QLabel\nQLabel.NoFrame", "QLabel.NoFrame"),
        ("from qgis.PyQt.QtWidgets import QDialog\nQDialog.exec_", "QDialog.exec_"),
        ("from qgis.PyQt.QtNetwork import QNetworkRequest as R\nR.Attribute.Nothing", "Nothing"),
    ],
)
def test_the_rule_tells_qt_5_from_qt_6(line, said):
    found = [text for _, text in qt_findings(ast.parse(line), "made.py")]
    assert bool(found) == bool(said)
    assert all(text.startswith("Qt 6 has no ") and said in text for text in found)


def test_no_other_qt_than_that_of_qgis():
    wrong = [
        place(path, node)
        for path in FILES
        for node in ast.walk(tree(path))
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        )
        if name.split(".")[0] in {"PyQt5", "PyQt6", "PySide2", "PySide6", "sip"}
    ]  # fmt: skip
    assert not wrong, wrong
    assert not [p for p in (ROOT / "plugin").rglob("*") if p.suffix in (".qrc", ".rcc")]
    assert not list((ROOT / "plugin").rglob("resources_rc.py"))


def is_enumeration(kind: type) -> bool:
    """Tell whether a class is an enumeration, Python's or one of sip's."""
    return issubclass(kind, Enum) or type(kind).__name__ == "enumtype"


def qgis_findings(module: ast.Module) -> list[tuple[ast.AST, str]]:
    """Return what a file names of QGIS that this version lacks or keeps outside its enumeration."""
    import qgis.analysis
    import qgis.core
    import qgis.gui

    known = imported(module, "qgis")
    found: list[tuple[ast.AST, str]] = []
    for node, parts in chains(module):
        where, names = known.get(parts[0], ("", []))
        if where not in ("core", "gui", "analysis"):
            continue
        thing: Any = getattr(qgis, where)
        for name in [*names, *parts[1:]]:
            above, thing = thing, getattr(thing, name, None)
            if thing is None:
                found.append((node, f"this QGIS has no {'.'.join(parts)}"))
                break
            if is_enumeration(type(thing)):
                if above is not type(thing):
                    scoped = f"{type(thing).__qualname__}.{name}"
                    found.append((node, f"{'.'.join(parts)} should be {scoped}"))
                break
            if not inspect.isclass(thing) and not inspect.ismodule(thing):
                break
    return found


@pytest.mark.qgis
def test_whatever_is_named_of_qgis_is_in_this_version_and_scoped():
    pytest.importorskip("qgis.core", reason="QGIS is not installed")
    wrong = [
        f"{place(path, node)} {text}" for path in FILES for node, text in qgis_findings(tree(path))
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.qgis
@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("from qgis.core import QgsWkbTypes\nQgsWkbTypes.Polygon", "QgsWkbTypes.Polygon should"),
        ("from qgis import core\ncore.QgsFeatureSink.FastInsert", "should be"),
        ("from qgis.core import QgsFeatureSink\nQgsFeatureSink.Flag.FastInsert", ""),
        ("from qgis.core import Qgis\nQgis.MessageLevel.Info", ""),
        ("from qgis.core import Qgis\nQgis.Info", "Qgis.Info should be"),
        ("from qgis.core import QgsFeature\nQgsFeature.nonsense", "this QGIS has no"),
        ("from qgis.core import QgsProcessing\nQgsProcessing.TEMPORARY_OUTPUT.lower", ""),
    ],
)
def test_the_rule_tells_scoped_from_unscoped(line, said):
    pytest.importorskip("qgis.core", reason="QGIS is not installed")
    found = [text for _, text in qgis_findings(ast.parse(line))]
    assert len(found) == bool(said)
    assert all(said in text for text in found)


def names_of(*modules: Any) -> set[str]:
    """Return the names of everything in modules and of what their classes themselves have."""
    found: set[str] = set()
    for one in modules:
        for name, thing in vars(one).items():
            found.add(name)
            if inspect.isclass(thing):
                found |= set(vars(thing))
    return found


def vanished() -> set[str]:
    """Return the names that Qt 5 has and neither Qt 6 nor QGIS nor Python."""
    import qgis.core
    import qgis.gui
    from PyQt5 import QtCore, QtGui, QtNetwork, QtWidgets, QtXml

    python = {name for kind in (str, list, dict, set, Path) for name in dir(kind)}
    old = names_of(QtCore, QtGui, QtNetwork, QtWidgets, QtXml)
    gone = old - qt6.all_names() - names_of(qgis.core, qgis.gui) - python
    # A class of QGIS 3.22 has one of its own.
    return gone | {"exec_"}


def own_names() -> set[str]:
    """Return the names that our classes have: methods, fields, and what is stored in `self`."""
    found: set[str] = set()
    for path in python_files("plugin", "algorithms"):
        for node in ast.walk(tree(path)):
            if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
                found.add(node.name)
            elif isinstance(node, ast.AnnAssign):
                found |= {node.target.id} if isinstance(node.target, ast.Name) else set()
            elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
                found.add(node.attr)
    return found


@needs_stubs
@pytest.mark.qgis
def test_no_method_is_called_that_qt_6_has_dropped():
    """By its bare name, since a type checker does not know what an object is here."""
    pytest.importorskip("PyQt5", reason="this is no QGIS on Qt 5")
    gone = vanished()
    assert {"exec_", "QRegExp", "QDesktopWidget"} <= gone
    assert len(gone) > 300
    gone -= own_names()
    wrong = [
        f"{place(path, node)} {node.attr}"
        for path in FILES
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Attribute) and node.attr in gone
    ]
    assert not wrong, "\n".join(wrong)


def test_qgis_4_is_not_claimed():
    """Nobody has run it there; whoever does changes this test, the metadata and the README."""
    metadata = (ROOT / "metadata.txt").read_text(encoding="utf-8")
    assert "qgisMaximumVersion=3.99" in metadata
    assert "untested on QGIS 4" in metadata
    assert "QGIS 4 is untested" in (ROOT / "README.md").read_text(encoding="utf-8")
