"""What each tool says of itself: help with a picture, presets, icons; declared once."""

from __future__ import annotations

import html
import re
from pathlib import Path

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

#: Largest picture (bytes).
MOST = 60_000
#: Tools that make something that can be drawn.
DRAWN = {
    "osmboundary", "osmlayers", "preparesite", "candidatemesh", "designstreets", "smoothstreets",
    "validatenetwork", "parcelblocks", "splitsite", "optimiselayout", "resplitlayout",
    "growstreets", "measurestreets", "layoutresidential", "exploretradeoffs",
    "designcity", "assigntraffic", "simulatetraffic",
    "designfloor", "designgamelevel",
}  # fmt: skip
#: Grounds of QGIS's light and dark themes.
GROUNDS = ("#ffffff", "#efefef", "#323232", "#2b2b2b")


@pytest.fixture
def tools(provider):
    return list(provider.algorithms())


def test_at_most_eight_basic_inputs(tools):
    for tool in tools:
        basic = [own.key for own in tool.described().inputs if not own.advanced]
        assert len(basic) <= 8, (tool.name(), basic)


def test_the_help_shows_a_picture_that_exists(tools):
    from qgis.PyQt.QtCore import QUrl
    from qgis.PyQt.QtGui import QImage

    assert {t.name() for t in tools} >= DRAWN
    for tool in tools:
        sources = re.findall(r'<img src="([^"]+)"', tool.shortHelpString())
        assert len(sources) == 1 or tool.name() not in DRAWN
        for source in sources:
            path = Path(QUrl(source).toLocalFile())
            assert path.stem == tool.name()
            assert path.stat().st_size < MOST
            # As wide as the panel of a dialog that was not made wider.
            assert QImage(str(path)).width() == 216
            assert f"<i>{html.escape(tool.about.picture)}</i>" in tool.shortHelpString()
            assert tool.about.picture.endswith(".")


def test_no_picture_is_left_over(tools, package):
    pictures = {p.stem for p in package("plugin.help").PICTURES.glob("*.png")}
    assert pictures <= {t.name() for t in tools}


def test_every_length_area_and_speed_has_a_unit(tools, package):
    unit_of = package("plugin.help").unit_of
    units = {}
    for tool in tools:
        for kind in tool.layers.values():
            for field in kind.fields:
                if field.kind == "number":
                    units[field.name] = unit_of(field)
    assert units["length_m"] == units["dist_to_sink_m"] == "m"
    assert units["area_m2"] == "m²"
    assert units["area_ha"] == "ha"
    assert units["speed_kmh"] == "km/h"
    assert (units["p_angle"], units["p_similarity"]) == ("degrees", "m")
    assert (units["sun_hours"], units["facing_deg"]) == ("h", "degrees")
    # What has none is a pure number, or has its unit in a field of its own.
    assert {name for name, unit in units.items() if not unit} <= {
        "scaled_jacobian", "levels", "p_area", "p_ideal", "bin_from", "bin_to",
        "score", "quality", "div", "db", "ds", "ct", "compactness", "sinuosity", "betweenness",
        "closeness", "far", "density", "x", "y", "objective", "bound", "gap",
        "flow_ahead", "flow_back", "v_c",
    }  # fmt: skip


def test_references_are_known(tools, package):
    known = package("plugin.help").REFERENCES
    for tool in tools:
        assert set(tool.about.references) <= set(known)
    (design,) = [t for t in tools if t.name() == "designstreets"]
    assert "ACM Transactions on Graphics" in design.shortHelpString()


def test_values_of_inputs_are_described(toolbox):
    told = {own.key: own for own in toolbox.tool("designstreets").described().inputs}
    assert told["INPUT"].kind == "layer (polygon)"
    assert told["FORBIDDEN"].kind == "layer (line or polygon)"
    assert told["BLOCK_WIDTH"].kind == "number, at least 10, at most 2000"
    assert told["SEED"].kind == "whole number, at least 0, at most 2147483647"
    assert told["SOLVER"].kind == "automatic / CP-SAT / HiGHS"
    assert [key for key, own in told.items() if own.per_feature] == ["BLOCK_WIDTH", "BLOCK_LENGTH"]


def test_texts_of_the_help_are_escaped(package):
    help_ = package("plugin.help")
    about = help_.About("x", "X", "site", (), "a < b & c", ("<script>",))
    text = help_.help_html(help_.describe(about, [], {}, {"A": "<b>"}))
    assert "a &lt; b &amp; c" in text
    assert "<script>" not in text
    assert "&lt;b&gt;" in text


def test_a_terminal_reads_plain_lines(toolbox, package, monkeypatch):
    from qgis.core import QgsApplication

    tool = toolbox.tool("designstreets")
    monkeypatch.setattr(QgsApplication, "platform", staticmethod(lambda: "qgis_process"))
    text = tool.shortHelpString()
    assert not re.search("</?[a-z]+>", text)
    assert max(len(line) for line in text.splitlines()) <= 88
    assert "  dist_to_sink_m (number): shortest way to leave the site" in text
    assert "ACM Transactions on Graphics" in text


def luminance(colour):
    def linear(part):
        return part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4

    return (
        0.2126 * linear(colour.redF())
        + 0.7152 * linear(colour.greenF())
        + 0.0722 * linear(colour.blueF())
    )


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("ground", GROUNDS)
def test_icons_can_be_seen_on_light_and_dark_ground(package, ground):
    """Of each icon at least an eighth of its square stands out (contrast 2.2 and more)."""
    from qgis.PyQt.QtCore import QRectF
    from qgis.PyQt.QtGui import QColor, QImage, QPainter
    from qgis.PyQt.QtSvg import QSvgRenderer

    folder = Path(package("plugin.icons").__file__).parent
    paths = sorted(folder.glob("*.svg"))
    assert len(paths) >= 6
    for path in paths:
        drawing = QSvgRenderer(str(path))
        assert drawing.isValid(), path.name
        image = QImage(48, 48, QImage.Format.Format_ARGB32)
        image.fill(QColor(ground))
        painter = QPainter(image)
        drawing.render(painter, QRectF(0, 0, 48, 48))
        painter.end()
        seen = sum(
            contrast(image.pixelColor(x, y), QColor(ground)) > 2.2
            for x in range(48)
            for y in range(48)
        )
        assert seen > 48 * 48 / 8, (path.name, ground, seen)


def test_a_tool_has_its_icon_or_that_of_its_group(package):
    icon_path = package("plugin.icons").icon_path
    assert Path(icon_path("candidatemesh", "site")).name == "candidatemesh.svg"
    assert Path(icon_path("preparesite", "site")).name == "site.svg"
    assert Path(icon_path("no such tool", "no such group")).name == "platwright.svg"
