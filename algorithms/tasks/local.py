"""Work in processes of their own on this machine."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import subprocess  # nosec B404: it starts nothing but the Python program of this library
import sys
import tempfile
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Optional

from .ledger import ExecutorError, Ledger
from .wire import ROOT

#: Seconds between two looks at whether to stop.
POLL = 0.1
#: So much is told of what a process wrote last (characters).
LAST_WORDS = 300
_PROGRAM = Path(__file__).with_name("process.py")
_LIBRARY = Path(__file__).absolute().parents[1]


def plain_python() -> str:
    """Return a Python program of the version that runs here.

    Raises
    ------
    ExecutorError
        There is none: `sys.executable` is another program that has Python in it, and nothing
        lies where Python should.
    """
    major, minor = sys.version_info[:2]
    names = [f"python{major}.{minor}", f"python{major}", "python"]
    folders = [Path(prefix) / "bin" for prefix in (sys.prefix, sys.exec_prefix, sys.base_prefix)]
    if os.name == "nt":
        names = ["python.exe", "python3.exe"]
        folders = [folder.parent for folder in folders]
    own = [Path(sys.executable)] if sys.executable else []
    places = [*own, *(folder / name for folder in folders for name in names)]
    for place in places:
        if place.stem.lower().startswith("python") and place.is_file():
            return str(place)
    msg = f"No Python {major}.{minor} was found below {sys.prefix}. Name one, or work serially."
    raise ExecutorError(msg)


@dataclass(frozen=True)
class Processes:
    """Does pieces at the same time in processes on this machine.

    A process that ends before its answer is replaced, and its piece begun again. Cancelling ends
    all processes at once; what is done is kept.

    Attributes
    ----------
    workers
        How many work at the same time.
    python
        The Python program; None for that of this process. Inside QGIS this process is none:
        the plugin finds one.
    folders
        Where its packages are, first ones first; None for where those of this process are.
    environment
        Environment variables that it has in addition. By default numerical libraries use one
        thread in each process, since several on busy cores are in each other's way.
    """

    workers: int = 2
    python: Optional[str] = None
    folders: Optional[Sequence[str]] = None
    environment: Mapping[str, str] = field(default_factory=lambda: {"OMP_NUM_THREADS": "1"})

    def run(self, ledger: Ledger) -> None:
        """Do the work; see `Executor.run`."""
        command = self._command()
        events: queue.SimpleQueue[tuple[_Worker, str, Any]] = queue.SimpleQueue()
        crew: set[_Worker] = set()
        try:
            while ledger.left and not ledger.progress.cancelled():
                while ledger.waiting and len(crew) < max(1, self.workers):
                    crew.add(_Worker(command, {**os.environ, **self.environment}, events))
                self._give(ledger, crew)
                with contextlib.suppress(queue.Empty):
                    _handle(ledger, crew, *events.get(timeout=POLL))
        finally:
            for worker in crew:
                worker.kill()

    def _command(self) -> list[str]:
        folders = list(sys.path) if self.folders is None else list(self.folders)
        setting = {
            "root": str(_LIBRARY),
            "folders": [str(Path(one).absolute()) for one in folders],
        }
        return [self.python or plain_python(), str(_PROGRAM), json.dumps(setting)]

    def _give(self, ledger: Ledger, crew: set[_Worker]) -> None:
        """Give a piece to each process that waits for one."""
        for worker in crew:
            if worker.number is None:
                worker.number = ledger.take()
                if worker.number is not None:
                    worker.inbox.put(ledger.orders[worker.number])


class _Worker:
    """One process, and the thread that talks to it.

    Parameters
    ----------
    command
        The program and its words.
    environment
        All its environment variables.
    events
        Where what it says goes: itself, what it is, and what it holds.

    Attributes
    ----------
    number
        The piece that it works on, or None.
    inbox
        Takes its orders, None to end.
    ready
        Whether it could begin at all.
    """

    def __init__(
        self,
        command: Sequence[str],
        environment: Mapping[str, str],
        events: queue.SimpleQueue[tuple[_Worker, str, Any]],
    ) -> None:
        self.number: Optional[int] = None
        self.ready = False
        self.inbox: queue.SimpleQueue[Optional[str]] = queue.SimpleQueue()
        self._events = events
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed by `kill`
        try:
            # no shell is involved, and the program is a Python
            self._process = subprocess.Popen(  # noqa: S603  # nosec B603: no shell
                list(command),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                env=dict(environment),
                cwd=tempfile.gettempdir(),
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        except OSError as error:
            self._errors.close()
            msg = f"{command[0]} could not be started ({error.strerror or error})."
            raise ExecutorError(msg) from error
        self._thread = threading.Thread(target=self._talk, name="worker", daemon=True)
        self._thread.start()

    def _talk(self) -> None:
        """Pass orders on and what is said about them back, until the process ends."""
        # it may end while it is spoken to, or in the middle of a line
        with contextlib.suppress(OSError, ValueError):
            self._converse()
        self._events.put((self, "ended", None))

    def _converse(self) -> None:
        stdin, stdout = self._process.stdin, self._process.stdout
        if stdin is None or stdout is None:
            return
        for line in stdout:
            ((kind, what),) = json.loads(line).items()
            if kind == "ready":
                self.ready = True
            else:
                self._events.put((self, kind, what))
            if kind not in ("ready", "answer"):
                continue
            order = self.inbox.get()
            if order is None:
                return
            stdin.write(order.encode() + b"\n")
            stdin.flush()

    def last_words(self) -> str:
        """Return how it ended, and what it wrote last."""
        code = self._process.wait()
        self._errors.seek(0)
        text = self._errors.read().decode("utf-8", "replace").strip()[-LAST_WORDS:]
        how = f"signal {-code}" if code < 0 else f"code {code}"
        return f"{how}: {text}" if text else how

    def kill(self) -> None:
        """End it now."""
        self._process.kill()
        self._process.wait()
        self.inbox.put(None)
        self._thread.join(1.0)
        for stream in (self._process.stdin, self._process.stdout, self._errors):
            if stream is not None:
                # what was still to be written has nobody to read it
                with contextlib.suppress(OSError):
                    stream.close()


def _handle(ledger: Ledger, crew: set[_Worker], worker: _Worker, kind: str, what: Any) -> None:
    """Take note of what a process said."""
    number = worker.number
    if kind == "said" and number is not None:
        ledger.hear(number, what)
    elif kind == "answer" and number is not None:
        worker.number = None
        ledger.answer(number, what)
    elif kind == "unable":
        msg = (
            f"A process of its own cannot load {ROOT.rpartition('.')[2]} ({what}). Install its "
            "packages for that Python, or work serially."
        )
        raise ExecutorError(msg)
    elif kind == "ended":
        words = worker.last_words()
        crew.discard(worker)
        worker.kill()
        if number is not None:
            ledger.lose(number, f"Its process ended without an answer ({words}).")
