"""The installer of Python packages as a tool, for runs without a window."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterFile,
)

from ...algorithms.errors import InputError
from .. import compat, deps, installer, installer_folder, parameters
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..request import Request
from ..tool import Tool

#: Inputs for what may be left away: the key in `installer.EXTRAS`, and what it is for.
_EXTRAS = {
    "OPENSTREETMAP": ("OpenStreetMap", "What the OpenStreetMap tools need (osmnx)."),
    "ORTOOLS": ("OR-Tools", "A solver that designs faster."),
    "PBF": ("PBF", "Reads OpenStreetMap files from the disk (osmium)."),
    "SUMO": (
        "SUMO",
        "The traffic simulator Eclipse SUMO (EPL 2.0) for Simulate traffic. It is large: 160 MB "
        "are downloaded in addition, which take 500 MB on the disk.",
    ),
}


class InstallDependencies(Tool):
    """Installs, tries out or removes the Python packages that the other tools need."""

    about = About(
        name="installdependencies",
        title="Install Python packages",
        group="setup",
        tags=("install", "dependencies", "python", "pip", "offline", "setup", "platwright"),
        summary="Installs, tries out or removes the Python packages that the other tools need.",
        paragraphs=(
            "They go into a folder of their own in the QGIS profile. What QGIS has stays as it "
            "is: its own numpy, scipy, pandas and matplotlib are used and never replaced. About "
            "150 MB are downloaded, which take 430 MB on the disk; the index and the proxy are "
            "those of pip's settings and of QGIS.",
            "Without a network: fill a folder of wheels on another computer with the same system "
            "and Python (pip download --only-binary=:all: -r requirements.txt numpy==VERSION; the "
            "file is in the plugin's folder, the version is that of QGIS's numpy), and name it "
            "here.",
            "In a window the same is done in Settings > Options > Platwright. Start QGIS again "
            "where a tool has run before.",
        ),
    )
    layers: ClassVar = {}
    numbers: ClassVar = {"PACKAGES": "Number of packages that work"}
    texts: ClassVar = {"FOLDER": "Folder with the packages"}
    needs = ()

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield what to do, from where, what beside the necessary, and the consent."""
        yield parameters.choice(
            "ACTION",
            "What to do",
            "Without packages install them first; test tries them out in a fresh process.",
            {
                "install": "get and try out what is missing",
                "test": "try out what is there",
                "remove": "delete what was installed here",
            },
            default="install",
        )
        yield _yes_or_no(
            "CONSENT",
            "I agree that packages are installed",
            "Nothing is downloaded or installed unless this is ticked (CONSENT=true).",
            default=False,
        )
        for key, (extra, text) in _EXTRAS.items():
            yield _yes_or_no(key, f"With {extra}", text, default=extra in installer.USUAL)
        wheels = QgsProcessingParameterFile(
            "WHEELS", "Folder of wheels", compat.FOLDER, "", None, True
        )
        wheels.setHelp(
            "Packages are taken from the .whl files of this folder, without any network. Optional."
        )
        yield wheels

    def check(self, request: Request) -> None:
        """Refuse to install without consent, or from a folder that is not there."""
        if request.word("ACTION") != "install":
            return
        wheels = self._wheels(request)
        if wheels is not None and not wheels.is_dir():
            raise InputError(f"There is no folder {wheels}.", "Choose the folder of wheels.")
        if not self._is_on(request, "CONSENT"):
            where = f"the folder {wheels}" if wheels else "the package index that pip uses"
            raise InputError(
                f"Python packages would be taken from {where} and put into "
                f"{installer_folder.base()}. Nothing is installed without your consent.",
                "Tick 'I agree that packages are installed' (CONSENT=true).",
            )

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Do what was asked."""
        action = request.word("ACTION")
        if action == "remove":
            progress.info(installer.remove())
            return self._result({"PACKAGES": 0, "FOLDER": ""})
        if action == "test":
            outcome = installer.test(progress)
        else:
            chosen = [extra for key, (extra, _) in _EXTRAS.items() if self._is_on(request, key)]
            outcome = installer.install(progress, chosen, self._wheels(request))
            self._tell(outcome, progress)
        folder = str(outcome.folder or "")
        return self._result({"PACKAGES": len(outcome.versions), "FOLDER": folder})

    def _is_on(self, request: Request, key: str) -> bool:
        return bool(self.parameterAsBoolean(request.parameters, key, request.context))

    def _wheels(self, request: Request) -> Path | None:
        given = self.parameterAsFile(request.parameters, "WHEELS", request.context)
        return Path(given) if given else None

    @staticmethod
    def _tell(outcome: installer.Outcome, progress: FeedbackProgress) -> None:
        if outcome.installed:
            entries = ", ".join(f"{name} {version}" for name, version in outcome.installed.items())
            progress.info(f"Installed in {outcome.folder}: {entries}.")
        if deps.in_use():
            progress.warn(installer.RESTART)

    @staticmethod
    def _result(values: dict[str, float | str]) -> Result:
        return Result(
            crs=QgsCoordinateReferenceSystem(),
            layers={},
            numbers=values,  # type: ignore[arg-type]  # texts go the same way
            keep=True,
        )


def _yes_or_no(
    key: str, title: str, help_text: str, *, default: bool
) -> QgsProcessingParameterDefinition:
    definition = QgsProcessingParameterBoolean(key, title, default, True)
    definition.setHelp(f"{help_text} Optional.")
    return definition
