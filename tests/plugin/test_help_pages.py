"""The reference pages of the documents say what the tools declare."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis


@pytest.fixture(scope="module")
def reference(root: Path):
    """Import the script that writes the pages."""
    path = root / "scripts" / "_docs_reference.py"
    spec = importlib.util.spec_from_file_location("_docs_reference", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def tools(provider, package):
    return [provider.algorithm(tool.about.name) for tool in package("plugin.tools").TOOLS]


def test_the_reference_is_up_to_date(reference, tools, package):
    made = reference.pages(tools, package("plugin.help").unit_of)
    assert [path.name for path in reference.stale(made)] == [], "Run scripts/docs --reference."
    design = made[reference.PAGES / "designstreets.md"]
    assert "| `BLOCK_WIDTH` | Block width (m) |" in design
    assert "| `dist_to_sink_m` | number | m |" in design
    assert "Computational network design from functional specifications" in design


def test_what_was_written_by_hand_stays(reference, tools, package):
    made = reference.pages(tools, package("plugin.help").unit_of)
    text = made[reference.PAGES / "designstreets.md"]
    again = reference.page(
        text.replace("## How to", "## By hand"), {"head": "# New head", "reference": "new"}
    )
    assert again.count("## By hand") == 1
    assert "# New head" in again
    assert "dist_to_sink_m" not in again
    assert reference.page(again, {"head": "# New head", "reference": "new"}) == again


def test_every_tool_has_a_part_that_was_written_by_hand(reference, tools):
    for tool in tools:
        text = (reference.PAGES / f"{tool.name()}.md").read_text(encoding="utf-8")
        between = text.partition(reference.MARKS["head"][1])[2]
        assert "## How to" in between.partition(reference.MARKS["reference"][0])[0], tool.name()


def test_texts_do_not_break_tables(reference):
    lines = reference.table(["a", "b"], [["x | y", "two\nlines <tag>"]])
    assert lines[2] == "| x \\| y | two lines &lt;tag> |"
