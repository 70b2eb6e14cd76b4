"""The installer in the background of a QGIS window, whatever happens to the page it began on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Optional

from qgis.core import Qgis, QgsApplication, QgsMessageLog, QgsProcessingFeedback, QgsTask
from qgis.PyQt.QtCore import pyqtSignal

from ..algorithms.errors import CancelledError, PlatwrightError
from .progress import FeedbackProgress

_CANCELLED = "Cancelled; nothing was changed."
#: The work that is under way, so that QGIS does not lose it and there is never a second.
_running: list[InstallerTask] = []


class _Feedback(QgsProcessingFeedback):
    """Hands texts and progress on to a task."""

    def __init__(self, task: InstallerTask) -> None:
        super().__init__(False)
        self.task = task
        self.progressChanged.connect(task.setProgress)

    def setProgressText(self, text: str) -> None:
        """Show what is being done."""
        self.task.said.emit(text)
        self.pushInfo(text)

    def pushInfo(self, info: str) -> None:
        """Write a line into the log."""
        QgsMessageLog.logMessage(info, "Platwright", Qgis.MessageLevel.Info)

    def pushWarning(self, warning: str) -> None:
        """Write a warning into the log."""
        QgsMessageLog.logMessage(warning, "Platwright", Qgis.MessageLevel.Warning, False)


class InstallerTask(QgsTask):
    """Does one piece of work of the installer.

    Parameters
    ----------
    title
        What the task manager shows.
    work
        Called with a progress in a thread of its own; returns what is to be said.
    """

    said = pyqtSignal(str)
    #: Whether it went well, and the sentence to show.
    ended = pyqtSignal(bool, str)

    def __init__(self, title: str, work: Callable[[FeedbackProgress], str]) -> None:
        super().__init__(title, QgsTask.Flag.CanCancel)
        self.work = work
        self.text = _CANCELLED  # what holds where it never begins
        self.feedback = _Feedback(self)

    def run(self) -> bool:
        """Do the work; errors become the sentence to show."""
        try:
            self.text = self.work(FeedbackProgress(self.feedback))
        except CancelledError:
            self.text = _CANCELLED
        except PlatwrightError as error:
            self.text = str(error)
        except Exception as error:
            self.text = f"Something went wrong that should not ({type(error).__name__}: {error})."
        else:
            return True
        return False

    def cancel(self) -> None:
        """Stop within a second."""
        self.feedback.cancel()
        super().cancel()

    def finished(self, result: bool) -> None:
        """Tell the end, in the thread of the window."""
        if self in _running:
            _running.remove(self)
        level = Qgis.MessageLevel.Success if result else Qgis.MessageLevel.Warning
        QgsMessageLog.logMessage(self.text, "Platwright", level, False)
        self.ended.emit(bool(result), self.text)


def running() -> Optional[InstallerTask]:
    """Return the work that is under way, or None."""
    return _running[0] if _running else None


def cancel() -> None:
    """Stop the work that is under way, if any, within a second."""
    task = running()
    if task is not None:
        task.cancel()


def start(
    title: str, work: Callable[[FeedbackProgress], str], **slots: Callable[..., Any]
) -> InstallerTask:
    """Begin a piece of work.

    Parameters
    ----------
    title, work
        As of `InstallerTask`.
    slots
        What the signals of the task are connected to, by their names.
    """
    task = InstallerTask(title, work)
    for name, slot in slots.items():
        getattr(task, name).connect(slot)
    _running.append(task)
    QgsApplication.taskManager().addTask(task)
    return task
