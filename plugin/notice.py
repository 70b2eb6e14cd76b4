"""The one notice of a session: which Python packages are missing, with a button to get them."""

from __future__ import annotations

import contextlib
import functools
from typing import Any

from qgis.core import Qgis
from qgis.PyQt.QtCore import QTimer
from qgis.PyQt.QtWidgets import QPushButton

from . import deps
from .settings import PAGE

#: The message with its button and what that does, held here: Qt alone does not keep alive what
#: Python has connected.
_told: list[Any] = []


def tell(iface: Any, tools: Any) -> None:
    """Say in the window what is missing for which tools, once in a session.

    Parameters
    ----------
    iface
        The interface of the QGIS window.
    tools
        The tools of the provider.
    """
    if _told:
        return
    text = deps.notice((tool.displayName(), tool.needs) for tool in tools)
    if not text:
        return
    message = iface.messageBar().createMessage("Platwright", text)
    button = QPushButton("Install…")
    # The button goes with the message, so that the rest must happen after its click.
    later = functools.partial(_open_page, iface, message)
    button.clicked.connect(lambda: QTimer.singleShot(0, later))
    _told.extend((message, button, later))
    message.layout().addWidget(button)
    iface.messageBar().pushWidget(message, Qgis.MessageLevel.Warning)


def _open_page(iface: Any, message: Any) -> None:
    iface.messageBar().popWidget(message)
    iface.showOptionsDialog(iface.mainWindow(), PAGE)


def withdraw() -> None:
    """Take the notice away, since it is true no more."""
    if _told:
        # Whoever has closed it has deleted it.
        with contextlib.suppress(RuntimeError):
            _told[0].dismiss()
