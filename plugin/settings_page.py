"""The page Platwright of QGIS's options: OpenStreetMap servers and Python packages."""

from __future__ import annotations

from typing import Optional

from qgis.core import QgsNetworkAccessManager
from qgis.gui import QgsFileWidget, QgsOptionsPageWidget, QgsOptionsWidgetFactory
from qgis.PyQt.QtGui import QIcon
from qgis.PyQt.QtWidgets import (
    QCheckBox,
    QDoubleSpinBox,
    QFormLayout,
    QGroupBox,
    QLineEdit,
    QMessageBox,
    QVBoxLayout,
    QWidget,
)

from ..algorithms.errors import InputError
from . import settings
from .icons import icon_path
from .settings_packages import PackagesBox

_LONGEST_TIMEOUT = 3600.0


class SettingsPage(QgsOptionsPageWidget):
    """What a planner sets once.

    Parameters
    ----------
    parent
        The options dialog.
    """

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName(settings.PAGE)
        self._fields: dict[str, QWidget] = {}
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        self.packages = PackagesBox(self)
        column.addWidget(self.packages)
        column.addWidget(self._osm_box())
        column.addStretch(1)

    def _osm_box(self) -> QGroupBox:
        box = QGroupBox("OpenStreetMap", self)
        form = QFormLayout(box)
        for key in ("overpass_url", "nominatim_url"):
            line = QLineEdit(box)
            line.setPlaceholderText(str(settings.OPTIONS[key].default))
            line.setClearButtonEnabled(True)
            self._add(form, key, line)
        seconds = QDoubleSpinBox(box)
        seconds.setRange(0.0, _LONGEST_TIMEOUT)
        seconds.setDecimals(0)
        seconds.setSuffix(" s")
        usual = QgsNetworkAccessManager.timeout() / 1000
        seconds.setSpecialValueText(f"As in the network settings of QGIS ({usual:g} s)")
        self._add(form, "timeout", seconds)
        folder = QgsFileWidget(box)
        folder.setStorageMode(QgsFileWidget.StorageMode.GetDirectory)
        folder.lineEdit().setPlaceholderText(str(settings.default_cache_folder()))
        self._add(form, "cache_folder", folder)
        wait = QCheckBox("Wait between requests, as the public servers ask for", box)
        self._add(form, "rate_limit", wait, labelled=False)
        offline = QCheckBox("Use only what is in the cache, never the network", box)
        self._add(form, "only_cache", offline, labelled=False)
        return box

    def _add(self, form: QFormLayout, key: str, field: QWidget, *, labelled: bool = True) -> None:
        option = settings.OPTIONS[key]
        field.setObjectName(key)
        self._fields[key] = field
        if labelled:
            form.addRow(option.title, field)
        else:
            form.addRow(field)
        try:
            self._show(key, settings.value(key))
        except InputError as error:
            self._show(key, option.default)
            field.setToolTip(str(error))
        if settings.fixed_by_environment(key):
            field.setEnabled(False)
            field.setToolTip(f"Set by the environment variable {option.variable}.")

    def _show(self, key: str, value: settings.Value) -> None:
        field = self._fields[key]
        if isinstance(field, QCheckBox):
            field.setChecked(bool(value))
        elif isinstance(field, QDoubleSpinBox):
            field.setValue(float(value))
        elif isinstance(field, QgsFileWidget):
            field.setFilePath(str(value))
        else:
            # The usual server is shown as a hint: an empty line means it.
            field.setText("" if value == settings.OPTIONS[key].default else str(value))

    def _given(self, key: str) -> settings.Value:
        field = self._fields[key]
        if isinstance(field, QCheckBox):
            return field.isChecked()
        if isinstance(field, QDoubleSpinBox):
            return field.value()
        if isinstance(field, QgsFileWidget):
            return field.filePath().strip()
        return field.text().strip()

    def apply(self) -> None:
        """Keep what the page shows; QGIS calls this on OK."""
        wrong = []
        for key in self._fields:
            if settings.fixed_by_environment(key):
                continue
            try:
                settings.save(key, self._given(key))
            except InputError as error:
                wrong.append(str(error))
        if wrong:
            text = "\n".join([*wrong, "The setting is as it was before."])
            QMessageBox.warning(self, "Platwright", text)


class SettingsPageFactory(QgsOptionsWidgetFactory):
    """Makes the page whenever QGIS opens its options."""

    def __init__(self) -> None:
        super().__init__("Platwright", QIcon(icon_path("platwright")))

    def icon(self) -> QIcon:
        """Return the picture in the list of pages."""
        return QIcon(icon_path("platwright"))

    def createWidget(self, parent: Optional[QWidget] = None) -> SettingsPage:
        """Return a fresh page."""
        return SettingsPage(parent)
