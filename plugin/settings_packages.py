"""The part of the settings page that shows and installs the Python packages."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Optional

from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtGui import QColor
from qgis.PyQt.QtWidgets import (
    QAbstractItemView,
    QCheckBox,
    QFileDialog,
    QGroupBox,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QMessageBox,
    QProgressBar,
    QPushButton,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from . import deps, guard, installer, installer_folder, installer_task, notice
from .progress import FeedbackProgress

_COLUMNS = ("Package", "For", "Version", "From", "State")
_ROW = 22
_GREEN, _RED, _GREY = "#2e7d32", "#c62828", "#757575"
_EXTRA_TEXTS = {
    "OpenStreetMap": "OpenStreetMap (to get streets and buildings)",
    "OR-Tools": "OR-Tools (designs faster)",
    "PBF": "PBF (reads .osm.pbf files)",
    "SUMO": "SUMO (simulates traffic, 500 MB)",
}


class PackagesBox(QGroupBox):
    """What is there, and buttons to install, try out and remove it.

    Parameters
    ----------
    parent
        The settings page.
    """

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__("Python packages", parent)
        column = QVBoxLayout(self)
        self.summary = QLabel(self)
        self.summary.setWordWrap(True)
        column.addWidget(self.summary)
        self.table = self._make_table()
        column.addWidget(self.table)
        self.extras = self._make_extras(column)
        self.buttons = self._make_buttons(column)
        row = QHBoxLayout()
        self.bar = QProgressBar(self)
        self.bar.setRange(0, 100)
        self.cancel = QPushButton("Cancel", self)
        row.addWidget(self.bar, 1)
        row.addWidget(self.cancel)
        column.addLayout(row)
        self.status = QLabel(self)
        self.status.setWordWrap(True)
        self.status.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        column.addWidget(self.status)
        self.cancel.clicked.connect(installer_task.cancel)
        task = installer_task.running()
        self._busy(task is not None)
        self.refresh()
        if task is not None:
            task.said.connect(self.status.setText)
            task.progressChanged.connect(self._advance)
            task.ended.connect(self._ended)

    def _make_table(self) -> QTableWidget:
        table = QTableWidget(0, len(_COLUMNS), self)
        table.setHorizontalHeaderLabels(list(_COLUMNS))
        table.verticalHeader().hide()
        table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        table.setAlternatingRowColors(True)
        table.verticalHeader().setDefaultSectionSize(_ROW)
        # All rows are seen at once, with the heading.
        table.setMinimumHeight(_ROW * (len(guard.PACKAGES) + 2))
        header = table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setStretchLastSection(True)
        return table

    def _make_extras(self, column: QVBoxLayout) -> dict[str, QCheckBox]:
        row = QHBoxLayout()
        row.addWidget(QLabel("Beside the necessary:", self))
        boxes = {}
        chosen = installer_folder.record().get("extras", list(installer.USUAL))
        for name in installer.EXTRAS:
            boxes[name] = QCheckBox(_EXTRA_TEXTS[name], self)
            boxes[name].setChecked(name in chosen)
            row.addWidget(boxes[name])
        row.addStretch(1)
        column.addLayout(row)
        return boxes

    def _make_buttons(self, column: QVBoxLayout) -> dict[str, QPushButton]:
        row = QHBoxLayout()
        texts: dict[str, tuple[str, Callable[[], None]]] = {
            "install": ("Install…", self.install),
            "wheels": ("Install from folder…", self.install_from_folder),
            "test": ("Test", self.test),
            "remove": ("Remove", self.remove),
        }
        made = {}
        for name, (text, slot) in texts.items():
            made[name] = QPushButton(text, self)
            made[name].setObjectName(name)
            made[name].clicked.connect(slot)
            row.addWidget(made[name])
        row.addStretch(1)
        column.addLayout(row)
        return made

    def refresh(self) -> None:
        """Show what is there now."""
        needed = installer.names(())
        self.table.setRowCount(len(guard.PACKAGES))
        for row, (name, package) in enumerate(guard.PACKAGES.items()):
            found = deps.look(name)
            wanted = deps.missing((name,))
            if not found.version:
                state, colour = ("missing", _RED) if name in needed else ("not installed", _GREY)
            elif wanted:
                state, colour = f"needs {package.requirement[len(package.install) :]}", _RED
            else:
                state, colour = "ready", _GREEN
            entries = (package.install, package.purpose, found.version, found.place, state)
            for column, text in enumerate(entries):
                item = QTableWidgetItem(text)
                if column == len(_COLUMNS) - 1:
                    item.setForeground(QColor(colour))
                self.table.setItem(row, column, item)
        lacking = deps.missing(needed)
        self.summary.setText(
            f"{len(lacking)} of {len(needed)} necessary packages are missing."
            if lacking
            else "All necessary packages are there."
        )
        if not self.bar.isVisibleTo(self):
            self.buttons["remove"].setEnabled(bool(installer_folder.record()))

    def install(self) -> None:
        """Ask for consent and install from pip's package index."""
        where = "from the package index that pip uses (usually pypi.org), about 150 MB,"
        if self._consent(where):
            self._begin_install(None)

    def install_from_folder(self) -> None:
        """Ask for a folder of wheels and for consent, and install from it."""
        folder = QFileDialog.getExistingDirectory(self, "Folder of wheels (.whl)")
        if folder and self._consent(f"from the folder {folder}"):
            self._begin_install(Path(folder))

    def _consent(self, where: str) -> bool:
        button = QMessageBox.StandardButton
        answer = QMessageBox.question(
            self,
            "Install Python packages",
            f"Python packages will be taken {where} and put into {installer_folder.base()}.\n\n"
            "The packages of QGIS itself are not changed. Install them?",
            button.Yes | button.No,
            button.No,
        )
        return answer == button.Yes

    def _begin_install(self, wheels: Optional[Path]) -> None:
        chosen = [name for name, box in self.extras.items() if box.isChecked()]

        def work(progress: FeedbackProgress) -> str:
            outcome = installer.install(progress, chosen, wheels)
            text = f"{len(outcome.versions)} packages are ready."
            return f"{text} {installer.RESTART}" if deps.in_use() else text

        self._start("Install Python packages for Platwright", work)

    def test(self) -> None:
        """Try the packages out in a fresh process."""

        def work(progress: FeedbackProgress) -> str:
            return f"{len(installer.test(progress).versions)} packages work."

        self._start("Test Python packages of Platwright", work)

    def remove(self) -> None:
        """Ask, and delete what was installed."""
        button = QMessageBox.StandardButton
        question = f"Delete the packages in {installer_folder.base()}?"
        if QMessageBox.question(self, "Remove Python packages", question) == button.Yes:
            self._start("Remove Python packages of Platwright", lambda _: installer.remove())

    def _start(self, title: str, work: Callable[[FeedbackProgress], str]) -> None:
        self._busy(True)
        self.status.setText("")
        installer_task.start(
            title,
            work,
            said=self.status.setText,
            progressChanged=self._advance,
            ended=self._ended,
        )

    def _advance(self, percent: float) -> None:
        self.bar.setValue(int(percent))

    def _busy(self, busy: bool) -> None:
        self.bar.setVisible(busy)
        self.cancel.setVisible(busy)
        for widget in (*self.buttons.values(), *self.extras.values()):
            widget.setEnabled(not busy)

    def _ended(self, good: bool, text: str) -> None:
        self._busy(False)
        self.refresh()
        if not deps.missing(installer.names(())):
            notice.withdraw()
        self.status.setText(text)
        self.status.setStyleSheet(f"color: {_GREEN if good else _RED}")
