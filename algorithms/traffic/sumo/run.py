"""Runs the programs of SUMO: one at a time, in a folder that goes with the run."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess  # nosec B404: it starts nothing but the programs of SUMO
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Optional

from ...errors import CancelledError, InputError, PlatwrightError
from ...progress import Deadline, Progress
from .find import Sumo

#: Nothing is looked up on the network.
_QUIET = ("--xml-validation", "never")
_POLL = 0.1
#: How much of what a program wrote is told where it failed.
_LAST_WORDS = 600
# The log may end within a number.
_STEP = re.compile(r"Step #(\d+\.\d\d)")


class SimulationError(PlatwrightError):
    """A program of SUMO failed; the text says what it said."""


@contextlib.contextmanager
def scratch() -> Iterator[Path]:
    """Give a folder that is removed whatever happens."""
    folder = Path(tempfile.mkdtemp(prefix="platwright-sumo-"))
    try:
        yield folder
    finally:
        # On Windows files stay in use for a moment after their program was ended.
        for _ in range(20):
            shutil.rmtree(folder, ignore_errors=True)
            if not folder.exists():
                break
            time.sleep(0.1)


class Runner:
    """Runs programs of SUMO in a folder.

    Parameters
    ----------
    sumo
        Where it is.
    folder
        Where the programs run; file names are relative to it.
    progress
        Asked ten times a second whether to stop.
    deadline
        When all of it must be done.
    """

    def __init__(self, sumo: Sumo, folder: Path, progress: Progress, deadline: Deadline) -> None:
        self._sumo, self._folder, self._progress = sumo, folder, progress
        self._deadline = deadline

    def run(
        self,
        program: str,
        arguments: Sequence[str],
        on_time: Optional[Callable[[float], None]] = None,
    ) -> str:
        """Run a program to its end and return what it said.

        Parameters
        ----------
        program
            One of `find.PROGRAMS`.
        arguments
            Its words.
        on_time
            Told the simulated second, as the program tells it.

        Raises
        ------
        CancelledError
            The caller cancelled; the program is ended.
        InputError
            The time limit is reached; likewise.
        SimulationError
            The program could not be started, or failed.
        """
        said = self._folder / f"{program}.log"
        with said.open("wb") as log:
            process = self._start(program, arguments, log)
            try:
                while process.poll() is None:
                    self._ask(program)
                    if on_time is not None:
                        _tell(said, on_time)
                    time.sleep(_POLL)
            finally:
                _end(process)
        text = said.read_text("utf-8", "replace")
        if process.returncode:
            msg = f"The program {program} of SUMO failed: {_words(text)}"
            raise SimulationError(msg)
        return text

    def _start(self, program: str, arguments: Sequence[str], log: Any) -> subprocess.Popen[bytes]:
        path = self._sumo.program(program)
        flags = getattr(subprocess, "CREATE_NO_WINDOW", 0)
        try:
            # no shell is involved, and the program is one of SUMO
            return subprocess.Popen(  # noqa: S603  # nosec B603: no shell
                [str(path), *arguments, *_QUIET],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=dict(self._sumo.environment()),
                cwd=self._folder,
                creationflags=flags,
                # a group of its own, so that whatever it starts ends with it
                start_new_session=os.name != "nt",
            )
        except OSError as error:
            msg = f"{path} could not be started ({error.strerror or error}). Install SUMO afresh."
            raise SimulationError(msg) from error

    def _ask(self, program: str) -> None:
        if self._progress.cancelled():
            raise CancelledError
        if self._deadline.left <= 0:
            raise InputError(
                f"The simulation was not done after {self._deadline.seconds:.0f} s (in the "
                f"program {program}).",
                "Raise the time limit, or lower the demand, the hours or the iterations.",
            )


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a program, and what it started, at once; wait until it is gone."""
    if process.poll() is None:
        # it may end by itself right now
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if os.name == "nt":
                process.kill()
            else:
                os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _tell(said: Path, on_time: Callable[[float], None]) -> None:
    """Tell the last simulated second that the log names."""
    with said.open("rb") as file:
        file.seek(max(0, said.stat().st_size - 2000))
        steps = _STEP.findall(file.read().decode("utf-8", "replace"))
    if steps:
        on_time(float(steps[-1]))


def _words(text: str) -> str:
    """Return what a program said of its failure."""
    lines = [line.strip() for line in text.splitlines() if line.startswith("Error")]
    return (" ".join(lines) or text.strip())[:_LAST_WORDS] or "it said nothing."
