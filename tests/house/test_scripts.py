"""The scripts: executable, sound, and clear about what they lack."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from house import ROOT

COMMANDS = [
    "setup", "demo", "test", "benchmark", "package", "docs", "tutorial", "qgis-debian13",
    "make_sample", "make_project", "make_models", "make_osm_extract", "figures", "gallery",
]  # fmt: skip
#: Files that git would take, however it is asked: text only.
TEXT = {
    ".py", ".md", ".toml", ".txt", ".cff", ".json", ".sh", ".svg", ".qml", ".yml", ".yaml", "",
}  # fmt: skip
#: Paths of one machine. Put together here so that this file does not hold them itself.
MACHINE = re.compile("|".join(["/" + name + "/" for name in ("root", "work", "home", "Users")]))
IGNORED = {
    ".git", ".venv", "demo", "artefacts", "dist", "build", "__pycache__", ".mypy_cache",
    ".ruff_cache", ".pytest_cache", ".hypothesis",
}  # fmt: skip


def tracked_files() -> list[Path]:
    """Return the files that git tracks or would track; without git, all but the ignored."""
    if shutil.which("git") and (ROOT / ".git").exists():
        done = subprocess.run(
            ["git", "-C", str(ROOT), "ls-files", "--cached", "--others", "--exclude-standard"],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if done.returncode == 0:
            found = [ROOT / line for line in done.stdout.splitlines()]
            return [path for path in found if path.is_file()]
    return [
        path
        for path in ROOT.rglob("*")
        if path.is_file() and not IGNORED & set(path.relative_to(ROOT).parts)
    ]


@pytest.mark.parametrize("name", [*(f"scripts/{n}" for n in COMMANDS), ".ci/run"])
def test_commands_are_executable(name):
    path = ROOT / name
    assert os.access(path, os.X_OK)
    first = path.read_text(encoding="utf-8").splitlines()[0]
    assert first.startswith("#!/usr/bin/env ")


def test_shell_scripts_are_sound():
    scripts = [
        path
        for path in [*(ROOT / "scripts").iterdir(), ROOT / ".ci" / "run"]
        if path.is_file()
        and (path.suffix == ".sh" or path.read_bytes().startswith(b"#!/usr/bin/env bash"))
    ]
    assert len(scripts) >= 6
    for path in scripts:
        done = subprocess.run(
            ["bash", "-n", str(path)], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        if path.suffix != ".sh":
            assert "set -euo pipefail" in path.read_text(encoding="utf-8"), path.name


def test_no_machine_paths_in_tracked_files():
    wrong = []
    for path in tracked_files():
        if path.suffix.lower() not in TEXT or path.name == "LICENSE":
            continue
        for number, line in enumerate(path.read_text("utf-8", errors="ignore").splitlines(), 1):
            if MACHINE.search(line):
                wrong.append(f"{path.relative_to(ROOT)}:{number}")
    assert not wrong, wrong


def test_no_large_file_is_tracked():
    large = [p.name for p in tracked_files() if p.stat().st_size > 3 * 1024 * 1024]
    assert not large


def test_setup_says_what_another_system_lacks(tmp_path):
    """Run with a PATH that has neither apt-get nor QGIS."""
    tools = tmp_path / "bin"
    tools.mkdir()
    for name in ("bash", "env", "cat", "cut", "dirname", "basename", "grep", "sha256sum", "id"):
        found = shutil.which(name)
        assert found is not None
        (tools / name).symlink_to(found)
    done = subprocess.run(
        ["bash", str(ROOT / "scripts" / "setup")],
        env={"PATH": str(tools), "PLATWRIGHT_VENV": str(tmp_path / "venv")},
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode != 0
    assert "not Debian 12" in done.stderr
    assert "QGIS 3.22 or later" in done.stderr
    assert not (tmp_path / "venv").exists()


def stub(folder: Path, name: str, body: str) -> None:
    """Put a program of our own in front of the system's."""
    path = folder / name
    path.write_text(f"#!/bin/sh\n{body}\n", encoding="utf-8")
    path.chmod(0o755)


def run_setup(tmp_path: Path, user: int) -> tuple[subprocess.CompletedProcess[str], str]:
    """Run setup where two packages are missing and apt-get only notes what it is asked."""
    tools, log = tmp_path / "bin", tmp_path / "apt.log"
    tools.mkdir()
    stub(tools, "apt-get", f'echo "$@" >> {log}; [ "$1" = update ] || exit 7')
    stub(tools, "dpkg-query", 'case "$*" in *" qgis"|*xauth*) exit 1;; *) printf installed;; esac')
    stub(tools, "id", f"echo {user}")
    stub(tools, "sudo", f'echo sudo >> {log}; exec "$@"')
    stub(tools, "grep", "exit 0")
    if user == 1001:
        (tools / "sudo").unlink()
        for name in ("bash", "dirname", "basename", "sha256sum", "cut", "cat"):
            (tools / name).symlink_to(str(shutil.which(name)))
    path = str(tools) if user == 1001 else f"{tools}:{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", str(ROOT / "scripts" / "setup")],
        env={"PATH": path, "PLATWRIGHT_VENV": str(tmp_path / "venv")},
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    return done, log.read_text(encoding="utf-8") if log.exists() else ""


@pytest.mark.skipif(not Path("/etc/os-release").is_file(), reason="no /etc/os-release")
def test_setup_installs_only_what_is_missing(tmp_path):
    done, log = run_setup(tmp_path, 0)
    assert done.returncode == 7
    asked = log.splitlines()
    assert asked[0].startswith("update")
    assert asked[1].split()[0] == "install"
    assert "--no-install-recommends" in asked[1]
    assert asked[1].split()[-2:] == ["qgis", "xauth"]
    assert "sudo" not in log
    assert not (tmp_path / "venv").exists()


@pytest.mark.skipif(not Path("/etc/os-release").is_file(), reason="no /etc/os-release")
@pytest.mark.parametrize("user", [1000, 1001])
def test_setup_without_being_root(tmp_path, user):
    done, log = run_setup(tmp_path, user)
    if user == 1000:  # there is sudo
        assert log.splitlines()[0] == "sudo"
        assert "qgis xauth" in log
    else:
        assert done.returncode == 1
        assert "Run as root: apt-get install --no-install-recommends qgis xauth" in done.stderr
        assert not log


def test_benchmark_names_its_choices():
    done = subprocess.run(
        [str(ROOT / "scripts" / "benchmark"), "nonsense"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode != 0
    assert "say which:" in done.stderr


def test_constraints_pin_everything_but_numpy():
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pins = dict(line.split("==") for line in lines if line and not line.startswith("#"))
    assert "numpy" not in pins
    asked = "".join(
        (ROOT / n).read_text("utf-8") for n in ("requirements.txt", "requirements-dev.txt")
    )
    names = re.findall(r"^([a-z][\w-]*)", asked, re.MULTILINE)
    assert len(names) > 10
    pinned = {name.lower().replace("_", "-") for name in pins}
    assert {name for name in names if name not in pinned} == set()
