"""What plugins.qgis.org demands of the zip, and what its scanners look for."""

from __future__ import annotations

import ast
import configparser
import re
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
    assert archive.stat().st_size < 25 * 1024 * 1024
    names = zipfile.ZipFile(archive).namelist()
    assert {name.split("/")[0] for name in names} == {"platwright"}
    inside = {name.removeprefix("platwright/") for name in names}
    assert {"__init__.py", "metadata.txt", "LICENSE", "README.md", "CHANGELOG.md"} <= inside
    assert {str(p.relative_to(ROOT)) for p in shipped_files()} <= inside
    assert metadata()["icon"] in inside
    tops = {name.split("/")[0] for name in inside if "/" in name}
    assert tops == {"algorithms", "plugin"}
    assert not [n for n in inside if n.endswith((".pyc", ".so")) or "__pycache__" in n]


def test_the_zip_is_the_same_every_time(archive, tmp_path):
    subprocess.run(
        [str(ROOT / "scripts" / "package"), str(tmp_path)], check=True, capture_output=True
    )
    assert (tmp_path / archive.name).read_bytes() == archive.read_bytes()


def test_nothing_that_scanners_refuse_in_shipped_code():
    """The commonest findings, seen without a scanner; see the next test for the scanner."""
    modules = {"pickle", "random", "subprocess", "marshal", "shelve", "telnetlib", "ftplib"}
    calls = {"eval", "exec", "__import__", "compile"}
    wrong = []
    for path in shipped_files():
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
            if bad:
                wrong.append(f"{place(path, node)} {type(node).__name__}")
    assert not wrong, "\n".join(wrong)


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
