"""Runs other programs for the installer and the worker: finds Python and pip, can be cancelled.

Inside QGIS `sys.executable` is QGIS itself, or any Python that comes first on the path, so the
Python that belongs to QGIS is looked for below `sys.prefix`. Programs are run by Qt, which opens
no window on Windows and passes words on as they are: no shell is involved.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, Optional

from qgis.core import QgsApplication
from qgis.PyQt.QtCore import QProcess, QProcessEnvironment

from ..algorithms.errors import CancelledError, PlatwrightError
from .progress import FeedbackProgress

#: Names the Python of QGIS where it is at an unusual place.
PYTHON_VARIABLE = "PLATWRIGHT_PYTHON"

_POLL_MS = 100
_WHO_ARE_YOU = "import json, sys; print(json.dumps([*sys.version_info[:2], sys.maxsize]))"
#: Settings of pip that would send packages elsewhere than we say.
_NOT_FOR_PIP = ("PIP_TARGET", "PIP_PREFIX", "PIP_ROOT", "PIP_DRY_RUN", "PIP_REPORT")


class InstallError(PlatwrightError):
    """Packages could not be installed; the text says why and what to do."""


class Ended(NamedTuple):
    """How a program ended.

    Attributes
    ----------
    code
        Its exit code; -1 where it crashed.
    output
        All that it wrote.
    """

    code: int
    output: str


def environment(more: Mapping[str, str]) -> QProcessEnvironment:
    """Return the environment of this process, with changes for quiet Python programs."""
    made = QProcessEnvironment.systemEnvironment()
    for name in _NOT_FOR_PIP:
        made.remove(name)
    fixed = {
        "PYTHONIOENCODING": "utf-8",
        "PYTHONUNBUFFERED": "1",
        "PIP_USER": "0",
        "PIP_REQUIRE_VIRTUALENV": "0",
        "PIP_NO_INPUT": "1",
        "PIP_DISABLE_PIP_VERSION_CHECK": "1",
    }
    for name, text in {**fixed, **more}.items():
        made.insert(name, text)
    return made


def run(
    program: Sequence[str],
    progress: FeedbackProgress,
    on_line: Optional[Callable[[str], None]] = None,
    **more_environment: str,
) -> Ended:
    """Run a program to its end and return what it wrote.

    Parameters
    ----------
    program
        The program and its words.
    progress
        Asked ten times a second whether to stop.
    on_line
        Called with each line as it is written.
    more_environment
        Environment variables.

    Raises
    ------
    CancelledError
        The program was stopped because the planner cancelled.
    InstallError
        The program could not be started.
    """
    process = QProcess()
    process.setProcessChannelMode(QProcess.ProcessChannelMode.MergedChannels)
    process.setProcessEnvironment(environment(more_environment))
    # Not the current folder, whose files could be taken for modules.
    process.setWorkingDirectory(tempfile.gettempdir())
    process.start(program[0], list(program[1:]))
    if not process.waitForStarted(10000):
        msg = f"{program[0]} could not be started ({process.errorString()})."
        raise InstallError(msg)
    process.closeWriteChannel()
    said: list[str] = []
    rest = b""
    while True:
        running = process.state() != QProcess.ProcessState.NotRunning
        if running and progress.cancelled():
            stop(process)
            raise CancelledError
        if running and not process.waitForReadyRead(_POLL_MS):
            process.waitForFinished(1)
        rest += bytes(process.readAllStandardOutput())
        *lines, rest = rest.split(b"\n")
        if not running and rest:
            lines.append(rest)
            rest = b""
        for line in lines:
            said.append(line.decode("utf-8", "replace").rstrip())
            if on_line is not None:
                on_line(said[-1])
        if not running:
            break
    crashed = process.exitStatus() == QProcess.ExitStatus.CrashExit
    return Ended(-1 if crashed else process.exitCode(), "\n".join(said))


def stop(process: QProcess) -> None:
    """End a program now."""
    process.kill()
    process.waitForFinished(1000)


@contextlib.contextmanager
def temporary_folder() -> Iterator[Path]:
    """Give a folder that is deleted at the end, as far as a program that was stopped lets it.

    It does not lie below the folder for temporary layers of Processing, which a project may
    clear.
    """
    folder = Path(tempfile.mkdtemp(prefix="platwright_"))
    try:
        yield folder
    finally:
        # What Windows still holds must not hide why a run ended.
        shutil.rmtree(folder, ignore_errors=True)


def candidates() -> Iterator[Path]:
    """Yield the places where the Python of QGIS may be, the likeliest first."""
    given = os.environ.get(PYTHON_VARIABLE)
    if given:
        yield Path(given)
        return
    major, minor = sys.version_info[:2]
    prefixes = [Path(sys.prefix), Path(sys.exec_prefix), Path(sys.base_prefix)]
    if sys.platform == "win32":
        folders = [*prefixes, *(p / "bin" for p in prefixes)]
        folders += [p.parent.parent / "bin" for p in prefixes]
        names = ["python.exe", "python3.exe"]
    else:
        # On a Mac the bundle of QGIS has its Python beside its own programs.
        bundle = Path(QgsApplication.prefixPath())
        folders = [p / "bin" for p in (*prefixes, bundle, bundle.parent / "Frameworks")]
        names = [f"python{major}.{minor}", f"python{major}", "python"]
    for folder in dict.fromkeys(folders):
        for name in names:
            yield folder / name


def find_python(progress: FeedbackProgress) -> str:
    """Return the Python program that belongs to QGIS: of the same version, never QGIS itself.

    Raises
    ------
    InstallError
        There is none.
    """
    wanted = [*sys.version_info[:2], sys.maxsize]
    for place in candidates():
        if not place.is_file() or place.stem.lower().startswith("qgis"):
            continue
        ended = run([str(place), "-c", _WHO_ARE_YOU], progress)
        try:
            answer = json.loads(ended.output.strip().splitlines()[-1])
        except (ValueError, IndexError):
            answer = None
        if ended.code == 0 and answer == wanted:
            return str(place)
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    msg = (
        f"The Python {version} of this QGIS was not found as a program below {sys.prefix}. "
        f"Set the environment variable {PYTHON_VARIABLE} to it, or install the packages with "
        "another Python of the same version and name their folder in PLATWRIGHT_DEPS."
    )
    raise InstallError(msg)


def find_pip(python: str, temporary: Path, progress: FeedbackProgress) -> list[str]:
    """Return how pip is called: that of QGIS's Python, or one in a temporary environment.

    Parameters
    ----------
    python
        The Python of QGIS.
    temporary
        A folder that outlives the use of pip.
    progress
        Asked whether to stop.

    Raises
    ------
    InstallError
        There is no pip and none can be made.
    """
    if run([python, "-m", "pip", "--version"], progress).code == 0:
        return [python, "-m", "pip"]
    progress.info("This Python has no pip; one is made for this installation only.")
    place = temporary / "pip"
    # It sees what QGIS has, so that nothing of that is installed again.
    ended = run([python, "-m", "venv", "--system-site-packages", str(place)], progress)
    made = place / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    if ended.code == 0 and run([str(made), "-m", "pip", "--version"], progress).code == 0:
        return [str(made), "-m", "pip"]
    msg = (
        f"The Python of QGIS ({python}) has no pip, and none could be made. Install one of the "
        "packages python3-pip or python3-venv (sudo apt install python3-pip) or ask who looks "
        "after this computer, then try again."
    )
    raise InstallError(msg)
