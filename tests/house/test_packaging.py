"""What plugins.qgis.org demands of the zip, and what its scanners look for."""

from __future__ import annotations

import ast
import configparser
import importlib.util
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from house import ROOT, place, shipped_files, tree

REQUIRED = {
    "name", "qgisMinimumVersion", "description", "about", "version", "author", "email",
    "homepage", "repository", "tracker",
}  # fmt: skip
needs_scanners = pytest.mark.skipif(
    not all(importlib.util.find_spec(name) for name in ("bandit", "detect_secrets", "flake8_qgis")),
    reason="bandit, detect-secrets or flake8-qgis is not installed",
)


def metadata() -> configparser.SectionProxy:
    parser = configparser.ConfigParser(interpolation=None)
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read(ROOT / "metadata.txt", encoding="utf-8")
    return parser["general"]


def test_metadata_is_complete():
    general = metadata()
    assert {key for key in REQUIRED if not general.get(key)} == set()
    assert re.fullmatch(r"\d+\.\d+\.\d+", general["version"])
    assert general["hasProcessingProvider"] == "yes"
    assert general["qgisMinimumVersion"] == "3.22"
    assert (ROOT / general["icon"]).is_file()
    for key in ("homepage", "repository", "tracker"):
        assert general[key].startswith("https://github.com/platwright/platwright")


def test_one_version_everywhere():
    version = metadata()["version"]
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert f'version = "{version}"' in project
    assert f"version: {version}" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"## [{version}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_the_licence_is_the_whole_gpl():
    text = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert "GNU GENERAL PUBLIC LICENSE" in text[:200]
    assert "Version 3, 29 June 2007" in text[:200]
    assert "END OF TERMS AND CONDITIONS" in text


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("package")
    done = subprocess.run(
        [str(ROOT / "scripts" / "package"), str(folder)],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return Path(done.stdout.strip())


def test_the_zip_holds_one_folder_with_the_shipped_files(archive):
    assert archive.name == f"platwright-{metadata()['version']}.zip"
    assert archive.stat().st_size < 5_000_000
    names = zipfile.ZipFile(archive).namelist()
    assert {name.split("/")[0] for name in names} == {"platwright"}
    inside = {name.removeprefix("platwright/") for name in names}
    assert {"__init__.py", "metadata.txt", "LICENSE", "README.md", "CHANGELOG.md"} <= inside
    assert {str(p.relative_to(ROOT)) for p in shipped_files()} <= inside
    assert metadata()["icon"] in inside
    tops = {name.split("/")[0] for name in inside if "/" in name}
    assert tops == {"algorithms", "data", "plugin"}
    assert not [n for n in inside if n.endswith((".pyc", ".so")) or "__pycache__" in n]


def test_the_zip_holds_what_is_not_code(archive):
    """Pictures, models, styles and samples: everything below the shipped folders goes along."""
    inside = set(zipfile.ZipFile(archive).namelist())
    others = [
        path.relative_to(ROOT).as_posix()
        for folder in ("data", "plugin")
        for path in (ROOT / folder).rglob("*")
        if path.suffix in {".svg", ".png", ".model3", ".qml", ".qgz", ".gpkg", ".md", ".txt"}
    ]
    assert any(name.startswith("data/helsinki/") for name in others)
    assert {name for name in others if f"platwright/{name}" not in inside} == set()


def test_the_zip_is_the_same_every_time(archive, tmp_path):
    subprocess.run(
        [str(ROOT / "scripts" / "package"), str(tmp_path)], check=True, capture_output=True
    )
    assert (tmp_path / archive.name).read_bytes() == archive.read_bytes()


def gate(path: Path, *options: str) -> list[str]:
    """Return the findings of the gate of `scripts/package --check` in a zip."""
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "check_zip.py"), str(path), *options],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode in (0, 1), done.stderr
    found = done.stdout.splitlines()
    assert bool(found) == bool(done.returncode)
    return found


@needs_scanners
@pytest.mark.slow
def test_the_plugin_repository_has_nothing_to_object_to(archive):
    assert gate(archive) == []


def changed(archive: Path, folder: Path, more: dict[str, str], *, without: str = "") -> Path:
    """Copy a zip with other files, small enough for the scanners to be quick."""
    target = folder / "changed.zip"
    kept = {"platwright/__init__.py", "platwright/metadata.txt", "platwright/LICENSE",
            "platwright/plugin/icons/platwright.svg"} - {without}  # fmt: skip
    with zipfile.ZipFile(archive) as old, zipfile.ZipFile(target, "w") as new:
        for name in sorted(kept - set(more)):
            new.writestr(zipfile.ZipInfo(name), old.read(name))
        for name, text in more.items():
            new.writestr(zipfile.ZipInfo(name), text)
    return target


#: Text of a Python file, and what a scanner says of it. Put together where this file would be
#: found itself.
CODE = [
    ("assert True\n", "B101"),
    ("import pickle\n\npickle.loads(b'')\n", "B301"),
    ("PASS" + 'WORD = "Tr0ub4dor&3x"\n', "Secret Keyword"),
    ("#: " + "AKIA" + "IOSFODNN7EXAMPLQ\n", "AWS Access Key"),
    ("print(undefined)\n", "F821"),
    ("from PyQt5.QtCore import Qt\n\nprint(Qt.red)\n", "QGS103"),
    ("dialog = None\ndialog.exec_()\n", "QGS107"),
]
#: Name of a file, and what is wrong with it.
NAMES = [
    ("platwright/.hidden", "is hidden"),
    ("platwright/__pycache__/a.pyc", "is compiled"),
    ("platwright/a.DLL", "is compiled or a program"),
    ("platwright/a:b.txt", "no name on Windows"),
    ("platwright/con.txt", "no name on Windows"),
    ("platwright/license", "differ only in case"),
    ("platwright/" + "a" * 130, "longer than 130"),
    ("other/a.txt", "more than one folder"),
    ("platwright/../a.txt", "leads out of the folder"),
]


@needs_scanners
def test_the_scanners_see_what_is_wrong(archive, tmp_path):
    files = {f"platwright/a{n}.py": text for n, (text, _) in enumerate(CODE)}
    found = gate(changed(archive, tmp_path, files))
    for number, (_, said) in enumerate(CODE):
        assert any(f"/a{number}.py:" in f and said in f for f in found), (said, found)


@pytest.mark.parametrize(("name", "said"), NAMES)
def test_the_gate_sees_a_bad_name(archive, tmp_path, name, said):
    found = gate(changed(archive, tmp_path, {name: ""}), "--form")
    assert any(said in finding for finding in found)


def test_the_gate_sees_what_is_no_python(archive, tmp_path):
    zipped = changed(archive, tmp_path, {"platwright/a.py": "def f(:\n"})
    assert gate(zipped, "--form")[0].startswith("platwright/a.py:1: ")


def test_the_gate_sees_missing_files(archive, tmp_path):
    zipped = changed(archive, tmp_path, {}, without="platwright/LICENSE")
    assert gate(zipped, "--form") == ["platwright/LICENSE: missing"]


def test_the_gate_sees_a_program(archive, tmp_path):
    zipped = changed(archive, tmp_path, {})
    entry = zipfile.ZipInfo("platwright/a.py")
    entry.external_attr = 0o755 << 16
    with zipfile.ZipFile(zipped, "a") as opened:
        opened.writestr(entry, "")
    assert gate(zipped, "--form") == ["platwright/a.py: executable"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("\nhomepage=", "\nhome=", "homepage missing"),
        ("\ntags=", "\nmarks=", "tags missing"),
        ("\nhomepage=https://", "\nhomepage=", "homepage is no https address"),
        ("\nicon=", "\nicon=elsewhere/", "icon is not in the zip"),
        ("\nauthor=", "\nauthor=we/", "author has a slash"),
        ("\nversion=", "\nversion=v", "version is not of the form"),
        ("\nabout=", "\nabout=100 % ", "metadata.txt"),
        ("[general]", "[generally]", "general"),
    ],
)
def test_the_gate_reads_the_metadata(archive, tmp_path, old, new, said):
    text = (ROOT / "metadata.txt").read_text(encoding="utf-8")
    assert old in text
    files = {"platwright/metadata.txt": text.replace(old, new)}
    found = gate(changed(archive, tmp_path, files), "--form")
    assert len(found) == 1
    assert said in found[0]


@pytest.mark.parametrize(("data", "said"), [(b"", "no zip"), (b"PK\5\6" + bytes(18), "empty")])
def test_the_gate_takes_no_other_file(tmp_path, data, said):
    path = tmp_path / "a.zip"
    path.write_bytes(data)
    assert gate(path) == [f"a.zip: {said}"]


def test_a_zip_that_would_be_refused_is_not_left(tmp_path):
    """In a copy of the tree, with a hidden file among the sample data."""
    copy = tmp_path / "tree"
    for name in ("algorithms", "data", "plugin", "scripts"):
        skip = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, copy / name, ignore=skip)
    for name in ("__init__.py", "metadata.txt", "LICENSE", "README.md", "CHANGELOG.md",
                 "requirements.txt"):  # fmt: skip
        shutil.copy(ROOT / name, copy / name)
    (copy / "data" / "tool.exe").write_bytes(b"MZ")
    (copy / "data" / "draft.txt~").write_bytes(b"left behind")
    (copy / "data" / ".DS_Store").write_bytes(b"left behind")
    done = subprocess.run(
        [sys.executable, str(copy / "scripts" / "build_zip.py"), str(tmp_path / "dist")],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert done.stderr.splitlines()[1:] == ["platwright/data/tool.exe: is compiled or a program"]
    assert list((tmp_path / "dist").iterdir()) == []


def test_nothing_that_scanners_refuse_in_shipped_code():
    """The commonest findings, seen without a scanner; see the next test for the scanner."""
    modules = {"pickle", "random", "subprocess", "marshal", "shelve", "telnetlib", "ftplib"}
    calls = {"eval", "exec", "__import__", "compile"}
    wrong = []
    for path in shipped_files():
        lines = path.read_text(encoding="utf-8").splitlines()
        for node in ast.walk(tree(path)):
            names: list[str] = []
            if isinstance(node, ast.Import):
                names = [alias.name.split(".")[0] for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names = [(node.module or "").split(".")[0]]
            bad = (
                isinstance(node, ast.Assert)
                or bool(modules & set(names))
                or (
                    isinstance(node, ast.Call)
                    and isinstance(node.func, ast.Name)
                    and node.func.id in calls
                )
                or (
                    isinstance(node, ast.ExceptHandler)
                    and all(isinstance(line, (ast.Pass, ast.Continue)) for line in node.body)
                )
            )
            # what the scanner is told to pass over has its reason, see below
            if bad and "# nosec" not in lines[node.lineno - 1]:
                wrong.append(f"{place(path, node)} {type(node).__name__}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.slow
def test_the_security_scanner_finds_nothing():
    pytest.importorskip("bandit", reason="bandit is not installed")
    done = subprocess.run(
        [sys.executable, "-m", "bandit", "-q", "-f", "txt",
         *(str(path) for path in shipped_files())],
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout


def test_every_exception_to_the_scanner_has_a_reason():
    wrong = [
        f"{path.relative_to(ROOT)}:{number}"
        for path in shipped_files()
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if "# nosec" in line and not re.search(r"# nosec B\d+[:\s-]+\S+", line)
    ]
    assert not wrong, wrong
