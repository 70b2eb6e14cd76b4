"""Installs the Python packages of the tools into the user's profile, by consent only.

What Python of QGIS has is taken from there; pip is asked first what is missing, then puts just
that into a new folder. QGIS's own numpy, pandas, scipy and matplotlib are never doubled: a
second numpy in one process breaks QGIS's bindings. The new folder is tried out in a fresh
process that is made like one of QGIS, and only then takes the place of the old one.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import json
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Optional

from qgis.PyQt.QtCore import QLockFile

from . import deps, installer_folder, settings
from .guard import LAYERS, PACKAGES, SOLVERS, SUN, version_tuple
from .installer_errors import pip_sentence
from .installer_process import (
    Ended,
    InstallError,
    find_pip,
    find_python,
    run,
    temporary_folder,
)
from .progress import FeedbackProgress

#: Packages that may be left away, by the name of what they are for.
EXTRAS: dict[str, tuple[str, ...]] = {
    "OpenStreetMap": ("requests", "osmnx"),
    "OR-Tools": ("ortools",),
    "PBF": ("osmium",),
    "SUMO": ("sumo",),
}
#: Those that are installed unless the planner says otherwise; SUMO is larger than all the rest.
USUAL = ("OpenStreetMap", "OR-Tools", "PBF")
#: Packages of which QGIS must have one only.
SINGLE = ("numpy", "pandas", "scipy", "matplotlib")
#: Said where this QGIS has loaded packages that are not those in force any more.
RESTART = "Start QGIS again, since a tool has run before."
#: Room that an installation needs at most (bytes), and what SUMO needs in addition.
ROOM = 800_000_000
ROOM_OF_SUMO = 700_000_000

_INVENTORY = (
    "import importlib.metadata as m, json; "
    "print(json.dumps({str(d.metadata['Name']).lower(): d.version for d in m.distributions()}))"
)
#: The first pip that can say what it would do.
_PIP_WITH_REPORT = (22, 2)
_NUMPY_OF_PANDAS_3 = (1, 26, 0)
_NOT_TAKEN = (
    "The packages were not taken into use; what was there before is unchanged. Please report it."
)
_INSTALL_AFRESH = "Install the packages afresh; if that does not help, please report it."
_GUARD = Path(__file__).with_name("guard.py")


@dataclass(frozen=True)
class Outcome:
    """What an installation or a trial came to.

    Attributes
    ----------
    versions
        Packages that the tools can use, with their versions.
    folder
        The folder of our own, or None where QGIS has everything itself.
    installed
        Names and versions of what is in that folder.
    """

    versions: dict[str, str]
    folder: Optional[Path]
    installed: dict[str, str] = field(default_factory=dict)


def names(extras: Iterable[str] = tuple(EXTRAS)) -> tuple[str, ...]:
    """Return the packages that are wanted: the necessary ones and those of some extras."""
    wanted = {*LAYERS, *SOLVERS, *SUN}
    wanted.update(name for extra in extras for name in EXTRAS[extra])
    return tuple(name for name in PACKAGES if name in wanted)


def install(
    progress: FeedbackProgress,
    extras: Iterable[str] = USUAL,
    wheels: Optional[Path] = None,
) -> Outcome:
    """Install what is missing; the caller has asked the planner.

    Parameters
    ----------
    progress
        Told what is done; asked whether to stop.
    extras
        Keys of `EXTRAS`.
    wheels
        Folder of wheels to install from without a network, or None for pip's package index.

    Raises
    ------
    InstallError
        It failed; what was installed before stays in force.
    CancelledError
        The planner cancelled; likewise.
    """
    wanted = names(extras)
    if wheels is not None and not any(wheels.glob("*.whl")):
        msg = f"The folder {wheels} holds no wheels (files that end with .whl)."
        raise InstallError(msg)
    with _locked(), temporary_folder() as temporary:
        _check_room(ROOM + ("sumo" in wanted) * ROOM_OF_SUMO)
        progress.stage("Looking for Python and pip", 0.0)
        python = find_python(progress)
        pip = find_pip(python, temporary, progress)
        has = _inventory(python, progress)
        folder = installer_folder.new()
        try:
            _fill(folder, pip, wanted, has, wheels, temporary, progress)
            progress.stage("Trying the packages out", 0.9)
            versions = _try_out(python, folder, wanted, progress, _NOT_TAKEN)
            found = _installed(folder)
            installer_folder.put_in_force(folder, {"installed": found, "extras": sorted(extras)})
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        installer_folder.tidy()
    progress.stage("Done", 1.0)
    return Outcome(versions, folder, found)


def test(progress: FeedbackProgress) -> Outcome:
    """Try the packages out that the tools would use, in a fresh process.

    Raises
    ------
    InstallError
        Something is missing or does not work.
    """
    lacking = deps.missing_text(names(()))
    if lacking:
        raise InstallError(lacking.replace("This tool needs", "The tools need"))
    wanted = [name for name in names() if deps.look(name).version]
    progress.stage("Trying the packages out", 0.1)
    python = find_python(progress)
    folder = installer_folder.current()
    folders = deps.folders()
    # An empty path adds nothing to what Python of QGIS has.
    first = Path(folders[0]) if folders else None
    versions = _try_out(python, first, wanted, progress, _INSTALL_AFRESH)
    progress.stage("Done", 1.0)
    return Outcome(versions, folder, _installed(folder) if folder else {})


def remove() -> str:
    """Remove all that was installed; return what is to be said of it."""
    text = "The packages are removed."
    if not installer_folder.base().is_dir():
        return text
    with _locked():
        if not installer_folder.remove():
            text = "The packages are not used any more; files in use go with the next installation."
    return f"{text} {RESTART}" if deps.in_use() else text


@contextlib.contextmanager
def _locked() -> Iterator[None]:
    """Hold the folder of our own, so that no other QGIS changes it meanwhile."""
    base = installer_folder.base()
    try:
        base.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=base):
            pass
    except OSError as error:
        msg = (
            f"The folder {base} cannot be written ({error.strerror or error}). Check the rights "
            "on the QGIS profile and the room on its disk."
        )
        raise InstallError(msg) from error
    lock = QLockFile(str(base / "install.lock"))
    lock.setStaleLockTime(0)  # whoever is dead holds no lock
    if not lock.tryLock(100):
        msg = "Another QGIS is installing packages right now. Wait for it and try again."
        raise InstallError(msg)
    try:
        yield
    finally:
        lock.unlock()


def _check_room(room: int) -> None:
    base = installer_folder.base()
    free = shutil.disk_usage(base).free
    if free < room:
        msg = (
            f"The disk of {base} has {free // 1_000_000} MB left, and {room // 1_000_000} MB "
            "are needed. Make room and try again."
        )
        raise InstallError(msg)


def _inventory(python: str, progress: FeedbackProgress) -> dict[str, str]:
    """Return names and versions of all that Python of QGIS has by itself."""
    ended = run([python, "-c", _INVENTORY], progress)
    try:
        return dict(json.loads(ended.output.strip().splitlines()[-1]))
    except (ValueError, IndexError) as error:
        msg = f"The Python of QGIS ({python}) does not say which packages it has: {ended.output}"
        raise InstallError(msg) from error


def _fill(
    folder: Path,
    pip: list[str],
    wanted: tuple[str, ...],
    has: dict[str, str],
    wheels: Optional[Path],
    temporary: Path,
    progress: FeedbackProgress,
) -> None:
    """Let pip put into a folder what QGIS does not have."""
    constraints = temporary / "constraints.txt"
    # What a distributor adds to a version (1.24.2+dfsg) is unknown to the index.
    pins = {name: has[name].split("+")[0] for name in SINGLE if name in has}
    numpy = version_tuple(pins.get("numpy", "99"))
    if "pandas" not in pins and numpy < _NUMPY_OF_PANDAS_3:
        # Known beforehand, this saves pip from downloading every pandas 3 to find it out.
        pins["pandas"] = "2.*"
    constraints.write_text("".join(f"{n}=={v}\n" for n, v in pins.items()), encoding="utf-8")
    common = ["--only-binary=:all:", "-c", str(constraints), "--progress-bar", "off"]
    if wheels is not None:
        common += ["--no-index", "--find-links", str(wheels)]
    runner = _Pip(pip, common, wheels, progress)
    asked = [PACKAGES[name].requirement for name in wanted]
    if runner.version() >= _PIP_WITH_REPORT:
        progress.stage("Asking pip what is missing", 0.05)
        asked = ["--no-deps", *runner.resolve(asked, temporary / "report.json")]
    if asked == ["--no-deps"]:
        progress.info("QGIS has everything already.")
        return
    progress.stage("Downloading and installing", 0.45)
    runner.expected = len(asked)
    runner.install(asked, folder)
    _drop_doubles(folder, has)


class _Pip:
    """Calls pip and tells its steps.

    Parameters
    ----------
    pip, common, wheels, progress
        How pip is called, what every call gets, where wheels are, and who is told.
    """

    def __init__(
        self, pip: list[str], common: list[str], wheels: Optional[Path], progress: FeedbackProgress
    ) -> None:
        self.pip = pip
        self.common = common
        self.wheels = wheels
        self.progress = progress
        self.expected = 25
        self.seen = 0
        self.span = (0.05, 0.45)
        self.more = {}
        proxy = self._proxy()
        if proxy:
            # Not on the command line, which every user of the computer may read.
            self.more["PIP_PROXY"] = proxy

    def _proxy(self) -> str:
        """Return QGIS's proxy, unless the user has told pip another."""
        if self.wheels is not None:
            return ""
        proxy = settings.proxy_for("https://pypi.org/simple")
        told = run([*self.pip, "config", "list"], self.progress).output if proxy else ""
        return "" if re.search(r"(^|\.)proxy=", told, re.MULTILINE) else proxy

    def version(self) -> tuple[int, ...]:
        """Return the version of pip."""
        output = run([*self.pip, "--version"], self.progress).output
        found = re.search(r"pip (\d+)\.(\d+)", output)
        return (int(found.group(1)), int(found.group(2))) if found else (0, 0)

    def resolve(self, asked: list[str], report: Path) -> list[str]:
        """Return what pip would install beside what is there, as exact requirements."""
        self._call(["install", "--dry-run", "--report", str(report), *self.common, *asked])
        entries = json.loads(report.read_text(encoding="utf-8"))["install"]
        return [f"{e['metadata']['name']}=={e['metadata']['version']}" for e in entries]

    def install(self, asked: list[str], folder: Path) -> None:
        """Install into a folder."""
        self.seen, self.span = 0, (0.45, 0.88)
        self._call(["install", "--target", str(folder), *self.common, *asked])

    def _call(self, words: list[str]) -> Ended:
        ended = run([*self.pip, *words], self.progress, self._hear, **self.more)
        if ended.code != 0:
            for line in ended.output.splitlines()[-15:]:
                self.progress.info(line)
            raise InstallError(pip_sentence(ended.output, self.wheels))
        return ended

    def _hear(self, line: str) -> None:
        text = line.strip()
        if re.match(r"(Downloading|Using cached|Processing|Installing collected)\b", text):
            self.progress.info(text)
        if text.startswith(("Collecting ", "Processing ")):
            self.seen += 1
            start, end = self.span
            share = min(self.seen / self.expected, 1.0)
            self.progress.fraction(start + share * (end - start))


def _drop_doubles(folder: Path, has: dict[str, str]) -> None:
    """Delete from a folder what QGIS has in the same version, and whatever it must have once."""
    for record in list(importlib.metadata.distributions(path=[str(folder)])):
        name = str(record.metadata["Name"]).lower()
        if name not in has or (has[name] != record.version and name not in SINGLE):
            continue
        for file in record.files or ():
            if ".." not in file.parts:
                (folder / file).unlink(missing_ok=True)
    _drop_empty(folder)


def _drop_empty(folder: Path) -> None:
    for place in sorted(folder.rglob("*"), key=lambda path: len(path.parts), reverse=True):
        if place.is_dir() and not any(place.iterdir()):
            place.rmdir()


def _installed(folder: Path) -> dict[str, str]:
    records = importlib.metadata.distributions(path=[str(folder)])
    return dict(sorted((str(r.metadata["Name"]), r.version) for r in records))


def _try_out(
    python: str,
    folder: Optional[Path],
    wanted: Iterable[str],
    progress: FeedbackProgress,
    remedy: str,
) -> dict[str, str]:
    """Import packages in a fresh process as QGIS would; return their versions.

    `remedy` ends the error where they do not work.
    """
    answer = _ask_guard(python, "like-qgis", folder, wanted, progress)
    if answer["error"]:
        clash = answer["error"]
        answer = _ask_guard(python, "alone", folder, wanted, progress)
        if not answer["error"]:
            progress.warn(
                f"{clash} By themselves the packages work: in this QGIS the tools run in a "
                "process of their own."
            )
    if answer["error"]:
        msg = f"The trial failed: {answer['error']} {remedy}"
        raise InstallError(msg)
    for name, version in answer["versions"].items():
        progress.info(f"{PACKAGES[name].install} {version} works")
    return dict(answer["versions"])


def _ask_guard(
    python: str,
    how: str,
    folder: Optional[Path],
    wanted: Iterable[str],
    progress: FeedbackProgress,
) -> dict[str, Any]:
    """Run `guard` as a program and return its answer."""
    ended = run([python, str(_GUARD), how, str(folder or ""), *wanted], progress)
    try:
        return dict(json.loads(ended.output.strip().splitlines()[-1]))
    except (ValueError, IndexError):
        return {"error": f"The trial ended by itself (code {ended.code}). {ended.output[-300:]}"}
