"""The library's progress, told to Processing: stages, search states, remarks, cancel."""

from __future__ import annotations

import time
from typing import Any

from qgis.core import QgsApplication, QgsProcessingFeedback
from qgis.PyQt.QtCore import QCoreApplication, QThread

#: Least time in seconds between two lines about the same search.
SECONDS_BETWEEN_LINES = 1.0
#: Least time in seconds between two looks at signals.
SECONDS_BETWEEN_EVENTS = 0.1


class _Signals:
    """Lets an interrupt of `qgis_process` through.

    That program hears a signal only while it handles events, and a tool runs in its main
    thread. A window is left alone: there tools have a thread of their own.
    """

    def __init__(self) -> None:
        self.wanted = QgsApplication.platform() == "qgis_process"
        self.looked = 0.0

    def look(self) -> None:
        """Handle events, if that is needed here and some time has passed."""
        if not self.wanted or time.monotonic() - self.looked < SECONDS_BETWEEN_EVENTS:
            return
        self.looked = time.monotonic()
        application = QCoreApplication.instance()
        if application is not None and QThread.currentThread() == application.thread():
            QCoreApplication.processEvents()


class FeedbackProgress:
    """The `Progress` protocol of the library on top of a `QgsProcessingFeedback`.

    Parameters
    ----------
    feedback
        What Processing listens to; its `cancel` may come from any thread.
    start, end
        The part of the progress bar, as fractions, that this work fills.
    """

    def __init__(
        self, feedback: QgsProcessingFeedback, start: float = 0.0, end: float = 1.0
    ) -> None:
        self.feedback = feedback
        self.start = start
        self.end = end
        self._told = 0.0
        self._text = ""
        self._pending: Any = None
        self._signals = _Signals()

    def part(self, start: float, end: float) -> FeedbackProgress:
        """Return a progress that fills only the part from `start` to `end` of this one."""
        span = self.end - self.start
        return FeedbackProgress(self.feedback, self.start + start * span, self.start + end * span)

    def stage(self, text: str, fraction: float) -> None:
        """Show `text` and move the bar to `fraction` of this part."""
        self._flush()
        if text != self._text:
            self._text = text
            self.feedback.setProgressText(text)
        self.fraction(fraction)

    def fraction(self, fraction: float) -> None:
        """Move the bar only."""
        share = min(max(fraction, 0.0), 1.0)
        self.feedback.setProgress(100.0 * (self.start + share * (self.end - self.start)))

    def search(self, state: Any) -> None:
        """Tell the best design, the bound and the gap so far, at most once a second."""
        now = time.monotonic()
        if now - self._told < SECONDS_BETWEEN_LINES:
            self._pending = state
            return
        self._tell(state)

    def info(self, text: str) -> None:
        """Add a remark to the log."""
        self.feedback.pushInfo(text)

    def warn(self, text: str) -> None:
        """Add a warning to the log."""
        self.feedback.pushWarning(text)

    def cancelled(self) -> bool:
        """Tell whether somebody has pressed Cancel."""
        self._signals.look()
        return bool(self.feedback.isCanceled())

    def _flush(self) -> None:
        if self._pending is not None:
            self._tell(self._pending)

    def _tell(self, state: Any) -> None:
        self._pending = None
        self._told = time.monotonic()
        self.feedback.pushInfo(describe_search(state))


class QuietProgress(FeedbackProgress):
    """A progress that leaves remarks out of the log; warnings stay."""

    def info(self, text: str) -> None:
        """Leave the remark out."""


def describe_search(state: Any) -> str:
    """Return one line about a `SearchState` of the library."""
    # objectives below 1 differ in later decimals
    digits = 4 if state.incumbent is not None and abs(state.incumbent) < 1 else 1
    text = "No design yet"
    if state.incumbent is not None:
        text = f"Best design {state.incumbent:.{digits}f}"
    if state.bound is not None:
        text += f", bound {state.bound:.{digits}f}"
    if state.gap is not None:
        text += f", gap {100 * state.gap:.1f} %"
    return f"{text}, after {state.seconds:.1f} s"
