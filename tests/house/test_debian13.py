"""The script that makes a Debian 13 for the tests: what it refuses and what it leaves alone."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from house import ROOT

SCRIPT = ROOT / "scripts" / "qgis-debian13"


def run(folder: Path, *words: str, **more: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", str(SCRIPT), *words],
        env={**os.environ, "PLATWRIGHT_DEBIAN13": str(folder), **more},
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip


def mark(folder: Path) -> Path:
    """Return the file by which the script knows its own."""
    return folder / "platwright.edition"


def tools(folder: Path, user: int) -> str:
    """Make a PATH of the tools that the script uses, with a user of our choice."""
    made = folder / "bin"
    made.mkdir()
    names = {"bash", "basename", "cat", "dirname", "df", "tail", "tr", "mkdir", "flock", "rm",
             "realpath", "grep", "ls", "git", "tar"}  # fmt: skip
    for name in names:
        (made / name).symlink_to(str(shutil.which(name)))
    (made / "id").write_text(f"#!/bin/sh\necho {user}\n")
    (made / "id").chmod(0o755)
    return str(made)


def test_without_a_word_it_explains_itself(tmp_path):
    done = run(tmp_path)
    assert done.returncode == 2
    assert "scripts/qgis-debian13 build" in done.stderr
    assert "PLATWRIGHT_DEBIAN13" in done.stderr


def test_the_state_of_none_half_and_whole(tmp_path):
    folder = tmp_path / "debian13"
    assert run(folder, "state").returncode == 1
    folder.mkdir()
    mark(folder).touch()
    done = run(folder, "state")
    assert done.returncode == 1
    assert done.stdout == f"absent: {folder}\n"
    mark(folder).write_text("1\n")
    done = run(folder, "state")
    assert done.returncode == 0
    assert done.stdout == f"ready: {folder}\n"
    mark(folder).write_text("0\n")
    assert run(folder, "state").returncode == 1


@pytest.mark.parametrize("word", ["build", "test", "remove"])
def test_it_asks_for_root(tmp_path, word):
    done = run(tmp_path / "debian13", word, PATH=tools(tmp_path, 1000))
    assert done.returncode == 1
    assert "run it as root" in done.stderr
    assert not (tmp_path / "debian13").exists()


def test_it_names_the_program_that_is_missing(tmp_path):
    done = run(tmp_path / "debian13", "build", PATH=tools(tmp_path, 0))
    assert done.returncode == 1
    assert "apt-get install debootstrap" in done.stderr
    assert not (tmp_path / "debian13").exists()


def test_it_removes_only_what_it_has_made(tmp_path):
    folder = tmp_path / "photographs"
    folder.mkdir()
    (folder / "one.jpg").write_text("")
    path = tools(tmp_path, 0)
    done = run(folder, "remove", PATH=path)
    assert done.returncode == 1
    assert "not a system that this script made" in done.stderr
    assert (folder / "one.jpg").exists()

    made = tmp_path / "debian13"
    (made / "srv").mkdir(parents=True)
    mark(made).touch()
    # Whatever a link leads to stays.
    (made / "srv" / "data").symlink_to(folder)
    assert run(made, "remove", PATH=path).returncode == 0
    assert not made.exists()
    assert (folder / "one.jpg").exists()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may mount")
@pytest.mark.skipif(shutil.which("unshare") is None, reason="unshare is not installed")
def test_it_removes_nothing_through_a_mount(tmp_path):
    """As if somebody else had mounted their data there; in a name space that ends with us."""
    made, data = tmp_path / "debian13", tmp_path / "data"
    (made / "srv").mkdir(parents=True)
    mark(made).touch()
    data.mkdir()
    (data / "one.jpg").write_text("")
    done = subprocess.run(
        ["unshare", "--mount", "--propagation", "private", "bash", "-c",
         f"mount --bind {data} {made}/srv && bash {SCRIPT} remove"],
        env={**os.environ, "PLATWRIGHT_DEBIAN13": str(made)},
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    if done.stderr.startswith(("unshare:", "mount:")):
        pytest.skip(f"nothing can be mounted here: {done.stderr}")
    assert done.returncode == 1
    assert "something is mounted below" in done.stderr
    assert (data / "one.jpg").exists()


@pytest.mark.parametrize(
    ("ci", "state", "status", "said", "code"),
    [
        ("", 0, 0, "skipped outside CI", 0),
        ("true", 1, 0, "SKIPPED, scripts/qgis-debian13 build makes it", 0),
        ("true", 0, 0, "asked: test -m not slow and not qgis -k some", 0),
        ("true", 0, 5, "asked: test -m not slow and not qgis -k some", 0),
        ("true", 0, 1, "asked: test -m not slow and not qgis -k some", 1),
    ],
)
def test_scripts_test_goes_there_in_ci_and_says_so_elsewhere(
    tmp_path, ci, state, status, said, code
):
    """With stubs for everything else that it calls."""
    scripts = tmp_path / "scripts"
    scripts.mkdir()
    for name in ("test", "_lib.sh"):
        shutil.copy(ROOT / "scripts" / name, scripts / name)
    stubs = {
        scripts / "setup": "exit 0",
        scripts / "qgis-debian13": f'[ "$1" != state ] || exit {state}\n'
        f'echo "asked: $*" >&2\nexit {status}',
        tmp_path / "venv" / "bin" / "python": "exit 0",
        tmp_path / "bin" / "id": "echo 0",
    }
    for path, body in stubs.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#!/bin/sh\n{body}\n", encoding="utf-8")
        path.chmod(0o755)
    done = subprocess.run(
        [str(scripts / "test"), "-k", "some"],
        env={"PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}", "CI": ci,
             "PLATWRIGHT_VENV": str(tmp_path / "venv")},
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert said in done.stdout + done.stderr
    assert done.returncode == code
