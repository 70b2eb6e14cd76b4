"""Answers of earlier requests, kept as osmnx keeps them, so that each can use the other's.

A file per answer, named by the SHA-1 hash of the address of the request.
"""

from __future__ import annotations

import contextlib
import datetime
import hashlib
import json
import os
import tempfile
from pathlib import Path
from typing import Any


class CorruptedAnswerError(Exception):
    """A kept answer cannot be read; the text names the file."""


class AnswerCache:
    """A folder with answers.

    Parameters
    ----------
    folder
        Made when the first answer is kept; None keeps nothing.
    """

    def __init__(self, folder: Path | None) -> None:
        self.folder = folder

    def path(self, request: str) -> Path | None:
        """Return the file of the answer to a request.

        Parameters
        ----------
        request
            Its whole address, parameters in their order.
        """
        if self.folder is None:
            return None
        # Not for safety: the name that osmnx gives.
        digest = hashlib.sha1(request.encode(), usedforsecurity=False).hexdigest()
        return Path(self.folder) / f"{digest}.json"

    def read(self, request: str) -> tuple[Any, datetime.date] | None:
        """Return the answer to a request and the day it was kept, or None where there is none.

        Raises
        ------
        CorruptedAnswerError
            The file is there but cannot be read.
        """
        path = self.path(request)
        try:
            if path is None or not path.is_file():
                return None
            data = json.loads(path.read_text(encoding="utf-8"))
            moment = datetime.datetime.fromtimestamp(path.stat().st_mtime, datetime.timezone.utc)
        except (OSError, ValueError) as error:
            msg = f"The kept answer {path} cannot be read"
            raise CorruptedAnswerError(msg) from error
        return data, moment.date()

    def write(self, request: str, data: Any) -> None:
        """Keep an answer; the file is whole or not there.

        Raises
        ------
        OSError
            The folder cannot be written to.
        """
        path = self.path(request)
        if path is None:
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, suffix=".part")
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                json.dump(data, file)
            Path(name).replace(path)
        finally:
            with contextlib.suppress(FileNotFoundError):
                Path(name).unlink()
