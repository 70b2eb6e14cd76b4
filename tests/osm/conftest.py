"""The local server and a listener for what is said, for all tests of the room."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from platwright.osm import OsmSettings

pytest.importorskip("requests")
pytest.importorskip("osmium")

from server import SHIPPED, Server


class Listener:
    """Takes note of what is said, and cancels after some seconds, questions, or at a word."""

    def __init__(
        self,
        seconds: float | None = None,
        word: str | None = None,
        questions: float | None = None,
    ) -> None:
        self.start = time.monotonic()
        self.seconds = seconds
        self.word = word
        self.questions = questions
        self.asked = 0
        self.said: list[str] = []
        self.warnings: list[str] = []
        self.stages: list[str] = []
        self.cancelled_at: float | None = None

    def stage(self, text: str, fraction: float) -> None:
        assert 0.0 <= fraction <= 1.0
        self.stages.append(text)

    def search(self, state: Any) -> None:
        raise AssertionError(state)

    def info(self, text: str) -> None:
        self.said.append(text)

    def warn(self, text: str) -> None:
        self.warnings.append(text)

    def cancelled(self) -> bool:
        heard = self.word is not None and any(self.word in text for text in self.stages)
        late = self.seconds is not None and time.monotonic() - self.start > self.seconds
        self.asked += 1
        enough = self.questions is not None and self.asked > self.questions
        if (heard or late or enough) and self.cancelled_at is None:
            self.cancelled_at = time.monotonic()
        return self.cancelled_at is not None


@pytest.fixture
def listener() -> Listener:
    return Listener()


@pytest.fixture(scope="session")
def server() -> Iterator[Server]:
    """Play Nominatim and Overpass from the extract that comes with the repository."""
    with Server() as running:
        yield running


@pytest.fixture
def settings(server: Server) -> Callable[..., OsmSettings]:
    """Make settings that lead to the server, or to broken answers of it.

    They are patient, for busy machines; tests of silence give a time of their own.
    """

    def make(broken: str = "", **more: Any) -> OsmSettings:
        given = {"rate_limit": False, "timeout": 30.0, **server.addresses(broken), **more}
        return OsmSettings(**given)

    return make


@pytest.fixture(scope="session")
def extract() -> Path:
    """Path of that extract: eastern Monaco."""
    return SHIPPED
