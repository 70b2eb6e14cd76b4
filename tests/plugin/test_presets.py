"""Kinds of neighbourhood, and block sizes that every site has of its own."""

from __future__ import annotations

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import FailedError, Listener, RefusedError, box, layer, roads, site  # noqa: E402

#: Two sites of the same size, far enough apart to be two.
TWO = [box(0, 0, 300, 200), box(500, 0, 300, 200)]


def design(toolbox, **parameters):
    return toolbox.run("designstreets", TIME_LIMIT=1, **parameters)


def settings(toolbox, package, **parameters):
    """Return the specification that parameters stand for, without a run."""
    from qgis.core import QgsProcessingContext

    tool = toolbox.tool("designstreets")
    request = package("plugin.request").Request(tool, parameters, QgsProcessingContext())
    return package("plugin.tools.rules").specification(request)


@pytest.mark.parametrize(
    ("given", "width", "length", "straight"),
    [
        ({}, 72, 150, None),
        ({"PRESET": "city blocks"}, 72, 150, None),
        ({"PRESET": "garden suburb"}, 90, 240, 0.2),
        ({"PRESET": "dense grid"}, 80, 80, None),
        # What is given counts, also where it is what another preset has.
        ({"PRESET": "garden suburb", "BLOCK_WIDTH": 72}, 72, 240, 0.2),
        ({"PRESET": "garden suburb", "WEIGHT_STRAIGHT": 3}, 90, 240, 3),
        ({"PRESET": "campus", "BLOCK_LENGTH": 150}, 130, 150, None),
    ],
)
def test_a_preset_says_what_empty_numbers_are(toolbox, package, given, width, length, straight):
    found = settings(toolbox, package, **given)
    assert (found.block_width, found.block_length) == (width, length)
    assert found.weight_straight == straight


def test_what_a_model_leaves_empty_is_as_the_preset_says(toolbox, package):
    from qgis.core import NULL

    for empty in (None, "", NULL):
        found = settings(toolbox, package, PRESET="campus", BLOCK_WIDTH=empty)
        assert found.block_width == 130


def test_the_dialog_says_what_an_empty_block_size_is(toolbox, package):
    tool = toolbox.tool("designstreets")
    definition = tool.parameterDefinition("BLOCK_WIDTH")
    assert definition.description() == "Block width (m), not set: by kind"
    assert package("plugin.parameters").title(definition) == "Block width (m)"


def test_presets_set_numbers_that_the_tool_takes(toolbox, package):
    presets = package("plugin.presets")
    tool = toolbox.tool("designstreets")
    for word, preset in presets.PRESETS.items():
        for key, value in preset.values.items():
            definition = tool.parameterDefinition(key)
            # Only a number that may be empty can be left to a preset.
            assert definition.defaultValue() is None
            assert definition.minimum() <= value <= definition.maximum()
        assert preset.values["BLOCK_WIDTH"] <= preset.values["BLOCK_LENGTH"]
        assert f"{word}: {preset.text}" in tool.parameterDefinition("PRESET").help()


def test_the_log_tells_what_the_preset_set_and_what_it_did_not(toolbox):
    said = design(toolbox, INPUT=site(), ROADS=roads(), PRESET="dense grid", BLOCK_LENGTH=120).said
    assert "Preset 'dense grid' sets: Block width (m) 80." in said.infos
    assert (
        "Preset 'dense grid' would set, but other values are given: Block length (m) 80."
        in said.infos
    )


def test_a_length_that_does_not_fit_the_preset_is_refused(toolbox):
    with pytest.raises(RefusedError, match="Give both"):
        design(toolbox, INPUT=site(), PRESET="city blocks", BLOCK_WIDTH=200)
    with pytest.raises(RefusedError, match="Give both"):
        design(toolbox, INPUT=site(), PRESET="campus", BLOCK_LENGTH=100)


def two_sites(widths, lengths=(None, None)):
    return layer(
        TWO,
        name="two",
        fields="field=width:double&field=length:double",
        values=[list(row) for row in zip(widths, lengths)],
    )


def field(name):
    from qgis.core import QgsProperty

    return QgsProperty.fromField(name)


def test_every_site_may_have_its_own_block_width(toolbox):
    run = design(toolbox, INPUT=two_sites([60.0, 100.0]), BLOCK_WIDTH=field("width"))
    assert any("blocks of 60 m x 150 m" in text for text in run.said.infos)
    assert any("blocks of 100 m x 150 m" in text for text in run.said.infos)
    blocks = run.rows("BLOCKS")
    small, large = (
        [row["area_m2"] for row in blocks if row["site_id"] == site_id] for site_id in (1, 2)
    )
    assert len(small) > len(large) > 1
    assert [row["street_id"] for row in run.rows("STREETS")] == list(
        range(1, len(run.rows("STREETS")) + 1)
    )
    assert run.results["VIOLATIONS"] == 0


@pytest.mark.parametrize("text", ["field:width", "expression: 2 * width - 60"])
def test_a_command_line_may_name_the_field(toolbox, text):
    run = design(toolbox, INPUT=two_sites([60.0, 60.0]), BLOCK_WIDTH=text)
    assert any("blocks of 60 m x 150 m" in said for said in run.said.infos)
    with pytest.raises(RefusedError):
        design(toolbox, INPUT=two_sites([60.0, 60.0]), BLOCK_WIDTH="fields:width")


def test_a_site_without_a_value_takes_that_of_the_preset(toolbox):
    run = design(toolbox, INPUT=two_sites([100.0, None]), BLOCK_WIDTH=field("width"))
    assert any("blocks of 100 m x 150 m" in text for text in run.said.infos)
    assert any("blocks of 72 m x 150 m" in text for text in run.said.infos)


def test_a_joined_site_takes_the_mean_by_area(toolbox):
    from qgis.core import QgsProperty

    # Two parcels that adjoin: 200 m and 100 m wide, so 60 counts twice as much as 90.
    parcels = layer(
        [box(0, 0, 200, 200), box(200, 0, 100, 200)],
        fields="field=width:double",
        values=[[60.0], [90.0]],
    )
    run = design(toolbox, INPUT=parcels, BLOCK_WIDTH=QgsProperty.fromExpression('"width" + 0'))
    assert any("blocks of 70 m x 150 m" in text for text in run.said.infos)


def test_the_values_of_each_site_are_stored_with_the_layers(toolbox, package, tmp_path):
    from qgis.core import QgsVectorLayer

    path = tmp_path / "streets.gpkg"
    design(toolbox, INPUT=two_sites([60.0, 100.0]), BLOCK_WIDTH=field("width"), STREETS=str(path))
    stored = package("plugin.record").read_record(QgsVectorLayer(str(path), "s", "ogr"))
    read = package("algorithms.network.specification").Specification.from_json
    assert [read(stored["specification"], key).block_width for key in (1, 2)] == [60, 100]


@pytest.mark.parametrize("value", [-5.0, 1e9])
def test_a_bad_value_is_named_by_its_feature(toolbox, value):
    with pytest.raises(FailedError, match=r"two.*feature 2"):
        design(toolbox, INPUT=two_sites([60.0, value]), BLOCK_WIDTH=field("width"))


def test_one_bad_site_does_not_cost_the_other(toolbox):
    tiny = layer(
        [box(0, 0, 300, 200), box(500, 0, 4, 4)],
        fields="field=width:double",
        values=[[70.0], [90.0]],
    )
    run = design(toolbox, INPUT=tiny, BLOCK_WIDTH=field("width"))
    assert {row["site_id"] for row in run.rows("BLOCKS")} >= {1}
    assert any(text.startswith("Site 2: The site (0.00 ha") for text in run.said.warnings)
    assert any("too small" in row["problem"] for row in run.rows("PROBLEMS"))


def test_cancel_says_which_sites_have_no_design(toolbox):
    listener = Listener(cancel_at="Site 2: reading the ground")
    run = design(
        toolbox,
        INPUT=two_sites([60.0, 100.0]),
        BLOCK_WIDTH=field("width"),
        listener=listener,
    )
    assert {row["site_id"] for row in run.rows("BLOCKS")} == {1}
    assert "Cancelled: 1 of 2 sites have no design." in listener.warnings


def test_a_cancelled_search_gives_no_wrong_reason(toolbox):
    listener = Listener(cancel_at="Best design")
    run = design(toolbox, INPUT=layer(TWO[:1]), BLOCK_WIDTH=60, listener=listener)
    assert run.results == {}
    assert not [text for text in listener.warnings if "no street leads through" in text]
