"""Tools in the threads of QGIS, one after another in the same thread."""

from __future__ import annotations

import time

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import Listener, roads, site  # noqa: E402


def in_a_thread(toolbox, name, **parameters):
    """Run a tool as the dialog does and return whether it went well."""
    from qgis.core import (
        QgsApplication,
        QgsProcessingAlgRunnerTask,
        QgsProcessingContext,
        QgsProject,
    )
    from qgis.PyQt.QtCore import QCoreApplication

    tool, context, said = toolbox.tool(name), QgsProcessingContext(), Listener()
    context.setProject(QgsProject.instance())
    ended = []
    task = QgsProcessingAlgRunnerTask(tool, parameters, context, said)
    task.executed.connect(lambda good, results: ended.append((good, results)))
    QgsApplication.taskManager().addTask(task)
    began = time.monotonic()
    while not ended:
        assert time.monotonic() - began < 60, said.stages
        QCoreApplication.processEvents()
        time.sleep(0.01)
    assert not said.errors
    return ended[0]


def test_the_second_run_in_a_thread_works_like_the_first(toolbox):
    """Coordinate transforms lose their ground when QGIS gives a thread back and takes it again."""
    ground, around = site(), roads()
    for _ in range(4):
        good, results = in_a_thread(
            toolbox, "preparesite", INPUT=ground, ROADS=around, SITE="TEMPORARY_OUTPUT"
        )
        assert good
        assert results["SITES"] == 1
        assert results["AREA"] == pytest.approx(6.0, rel=0.01)
