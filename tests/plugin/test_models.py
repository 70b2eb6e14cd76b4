"""Tools inside a model, and parameters that are expressions."""

from __future__ import annotations

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import Listener, roads, site  # noqa: E402


@pytest.fixture
def model(toolbox):
    """Prepare a site, design its streets; the block width is the model's own parameter."""
    from qgis.core import (
        QgsProcessingModelAlgorithm,
        QgsProcessingModelChildAlgorithm,
        QgsProcessingModelChildParameterSource,
        QgsProcessingModelOutput,
        QgsProcessingModelParameter,
        QgsProcessingParameterFeatureSource,
        QgsProcessingParameterNumber,
    )

    source = QgsProcessingModelChildParameterSource
    made = QgsProcessingModelAlgorithm("quarter", "tests")
    for parameter in (
        QgsProcessingParameterFeatureSource("ground", "Ground"),
        QgsProcessingParameterFeatureSource("around", "Around"),
        QgsProcessingParameterNumber("width", "Width", defaultValue=60),
    ):
        made.addModelParameter(parameter, QgsProcessingModelParameter(parameter.name()))
    prepare = QgsProcessingModelChildAlgorithm("platwright:preparesite")
    prepare.setChildId("prepare")
    prepare.addParameterSources("INPUT", [source.fromModelParameter("ground")])
    prepare.addParameterSources("ROADS", [source.fromModelParameter("around")])
    made.addChildAlgorithm(prepare)
    design = QgsProcessingModelChildAlgorithm("platwright:designstreets")
    design.setChildId("design")
    design.addParameterSources("INPUT", [source.fromChildOutput("prepare", "SITE")])
    design.addParameterSources("ROADS", [source.fromChildOutput("prepare", "BOUNDARY_STREETS")])
    design.addParameterSources("BLOCK_WIDTH", [source.fromModelParameter("width")])
    design.addParameterSources("TIME_LIMIT", [source.fromExpression("1 + 1")])
    output = QgsProcessingModelOutput("streets", "Streets")
    output.setChildId("design")
    output.setChildOutputName("STREETS")
    design.setModelOutputs({"streets": output})
    made.addChildAlgorithm(design)
    return made


def run(model, **parameters):
    from qgis.core import QgsProcessingContext, QgsProcessingUtils, QgsProject

    context, said = QgsProcessingContext(), Listener()
    context.setProject(QgsProject.instance())
    destination = model.destinationParameterDefinitions()[0].name()
    results, good = model.run({**parameters, destination: "TEMPORARY_OUTPUT"}, context, said)
    if not good:
        return None, said
    made = QgsProcessingUtils.mapLayerFromString(results[destination], context)
    return context.takeResultLayer(made.id()), said


def test_a_model_of_two_tools_runs(model):
    streets, said = run(model, ground=site(), around=roads(), width=70)
    assert streets is not None, said.errors
    assert any(f["status"] == "new" for f in streets.getFeatures())


def test_an_error_inside_a_model_is_readable(model):
    streets, said = run(model, ground=site(crs=""), around=roads())
    assert streets is None
    assert any("coordinate reference system" in text for text in said.errors)
    assert not any("Traceback" in text for text in said.errors)


def test_a_number_may_be_an_expression(toolbox):
    from qgis.core import QgsProperty

    made = toolbox.run(
        "candidatemesh", INPUT=site(), EDGE_LENGTH=QgsProperty.fromExpression("25 * 2")
    )
    assert made.results["FACE_COUNT"] == 24
