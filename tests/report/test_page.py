"""The page, read back by a parser that knows nothing of it."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.report import report_page
from report_browser import opened, program
from report_made import png, report
from report_reading import cells, fetched, parsed

HOSTILE = [
    "<script>alert(1)</script>", '"><img src=http://evil.example/x onerror=alert(1)>',
    "</style><style>@import 'http://evil.example/';", "' onmouseover='x", "a & b < c > d",
    "</title></head><body>", "<!-- ", "]]>", "&lt;b&gt;", "javascript:alert(1)",
    "${x} {y} %s {{z}}", "\u202egnp.exe", "nul\x00 \ud800", "ćÄ漢字 🏘",
]  # fmt: skip


@pytest.fixture(scope="module")
def page():
    return report_page(report())


@pytest.fixture(scope="module")
def read(page):
    return parsed(page)


def table_of(read, caption):
    (found,) = [own for own in read.all("table") if caption in own.all("caption")[0].text]
    return cells(found)


def test_the_page_is_html5_in_english_with_a_title(page, read):
    assert page.startswith('<!DOCTYPE html>\n<html lang="en">')
    assert [own.text for own in read.all("title")] == ["plan report"]
    assert [own.text for own in read.all("h1")] == ["plan report"]
    head = read.all("head")[0]
    assert {"charset": "utf-8"} in [own.attributes for own in head.all("meta")]


def test_nothing_is_fetched_and_nothing_runs(page, read):
    addresses = fetched(read)
    assert len(addresses) >= 4
    assert all(own.startswith("data:image/png;base64,") for own in addresses)
    assert not read.all("script")
    style = read.all("style")[0].text
    assert "url(" not in style
    assert "@import" not in style
    (policy,) = [
        own.attributes["content"]
        for own in read.all("meta")
        if own.attributes.get("http-equiv") == "Content-Security-Policy"
    ]
    assert "default-src 'none'" in policy
    # addresses of the web are in plain links only
    links = {own.attributes["href"] for own in read.all("a")}
    outside = set(re.findall(r"https?://[^\s\"'<]+", page))
    assert outside <= links
    assert "https://example.org/licence" in links


def test_ids_are_unique_and_links_inside_have_an_end(read):
    ids = [own.attributes["id"] for own in read.every() if "id" in own.attributes]
    assert len(ids) == len(set(ids))
    inside = [own.attributes["href"] for own in read.all("a")]
    inside = [own[1:] for own in inside if own.startswith("#")]
    assert inside
    assert set(inside) <= set(ids)
    named = [own.attributes["aria-labelledby"] for own in read.all("section")]
    assert set(named) <= set(ids)


def test_pictures_have_texts_and_tables_have_heads(read):
    for own in read.all("img"):
        assert "alt" in own.attributes
    assert any(own.attributes["alt"] == "plan alt" for own in read.all("img"))
    for own in read.all("svg"):
        assert own.attributes["role"] == "img"
        assert own.attributes["aria-label"]
    for own in read.all("table"):
        assert own.all("caption")[0].text
        assert {head.attributes["scope"] for head in own.all("th")} <= {"col", "row", "colgroup"}
        for row in own.all("tbody")[0].all("tr"):
            assert row.all("th")


def test_headings_leave_no_level_out(read):
    levels = [int(own.name[1]) for own in read.every() if re.fullmatch("h[1-6]", own.name)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(b - a <= 1 for a, b in zip(levels, levels[1:]))


def test_every_figure_is_there_with_its_unit(read):
    rows = table_of(read, "Figures of the designs")
    assert ["plan length", "★ 1,000 m (best)", "1,250 m"] in rows
    # one that only one design knows is no match for nothing
    assert ["plan angle", "not known", "1.5 degrees"] in rows
    assert ["price", "40", "40"] in rows


def test_targets_say_met_in_words(read):
    rows = table_of(read, "Figures against their targets")
    assert rows[1] == ["plan length", "at most 1,100 m", "1,000 m ✓ met", "1,250 m ✗ not met"]
    assert rows[2] == ["plan angle", "less than 1 degrees", "not known", "1.5 degrees ✗ not met"]
    assert "1 of 4 targets are met" in read.text


def test_the_solver_is_told_with_a_bar_of_the_gap(read):
    # (40 - 36) / 40
    assert "Gap10.0 %" in read.text
    (bar, _) = [own for own in read.all("svg") if own.attributes.get("class") == "bar"]
    proven, gap = (float(own.attributes["width"]) for own in bar.all("rect")[:2])
    assert gap / (proven + gap) == pytest.approx(0.1, abs=1e-3)


def test_the_scale_bar_is_as_long_as_it_says(read):
    (marks, _) = [own for own in read.all("svg") if "Scale bar" in own.attributes["aria-label"]]
    assert "100 m" in marks.text
    halves = [own for own in marks.all("rect") if own.attributes.get("stroke")]
    # 1000 pixels are 500 m
    assert sum(float(own.attributes["width"]) for own in halves) == pytest.approx(200.0)


def test_wishes_problems_layers_and_sources_are_told(read):
    assert ["plan wish", "plan value"] in table_of(
        parsed(report_page(report("plan", "a"))), "asked"
    )
    text = read.text
    for words in ("plan problem", "plan action", "plan owner", "plan licence", "1 warning",
                  "plan place · plan author · 1 May 2030", "Platwright 9.8.7"):  # fmt: skip
        assert words in text


def test_one_design_is_not_compared():
    read = parsed(report_page(report("plan", "alone")))
    assert "comparison" not in {own.attributes.get("id") for own in read.all("section")}
    assert "The plan: alone" in read.text


def test_many_designs_are_parted_for_the_sheet():
    names = [f"d{number}" for number in range(12)]
    read = parsed(report_page(report("plan", *names)))
    found = [own for own in read.all("caption") if "Figures of the designs" in own.text]
    assert [own.text.rpartition(",")[2].strip() for own in found] == [
        "designs 1 to 5", "designs 6 to 10", "designs 11 to 12",
    ]  # fmt: skip


def test_an_empty_report_is_a_page():
    from platwright.report import Report

    read = parsed(report_page(Report(title="", date="", version="")))
    assert "No layers of data" in read.text


def checked(words):
    """Check that words of anybody change nothing of the page but its texts."""
    usual = parsed(report_page(report("plan")))
    page = report_page(report(words))
    page.encode("utf-8")
    read = parsed(page)
    shape = [(own.name, sorted(own.attributes)) for own in read.every()]
    assert shape == [(own.name, sorted(own.attributes)) for own in usual.every()]
    assert all(own.startswith("data:image/png;base64,") for own in fetched(read))
    for own in read.all("a"):
        assert own.attributes["href"].startswith(("#", "https://"))
    return read


@pytest.mark.parametrize("words", HOSTILE)
def test_hostile_words_stay_words(words):
    read = checked(words)
    told = re.sub("[\x00\ud800]", "\ufffd", words).replace("\u202e", "")
    assert " ".join(f"{told} report".split()) == " ".join(read.all("h1")[0].text.split())


@given(st.text(alphabet=st.characters(codec=None), max_size=40))
def test_any_words_stay_words(words):
    checked(words)


@given(st.lists(st.sampled_from(["<", ">", "&", '"', "'", "/", "!", "-", "script", "\n"])))
def test_any_markup_stays_words(pieces):
    words = "".join(pieces)
    read = checked(words)
    assert " ".join(words.split()) in " ".join(read.all("h1")[0].text.split())


def test_links_of_other_kinds_are_words():
    from dataclasses import replace

    base = report()
    links = ("javascript:alert(1)", "file:///etc/passwd", "data:text/html,x", "http://a.example")
    credit = replace(base.credits[0], links=links)
    read = parsed(report_page(replace(base, credits=(credit,))))
    found = {own.attributes["href"] for own in read.all("a")}
    assert "http://a.example" in found
    assert not {own for own in found if own.startswith(("javascript", "file", "data"))}
    assert "javascript:alert(1)" in read.text


needs_browser = pytest.mark.skipif(
    program() is None, reason="no Chromium here: apt-get install chromium-headless-shell"
)


@needs_browser
def test_a_browser_opens_it_without_a_complaint_or_a_request(tmp_path):
    path = tmp_path / "report.html"
    path.write_text(report_page(report(HOSTILE[1])), encoding="utf-8")
    shot = tmp_path / "shot.png"
    said, asked = opened(path, tmp_path, f"--screenshot={shot}", "--window-size=1200,1600")
    assert said == []
    assert asked == []
    assert shot.read_bytes().startswith(b"\x89PNG")


@needs_browser
def test_the_browser_would_have_told(tmp_path):
    """A page that asks and complains is found out: the test above can fail."""
    path = tmp_path / "bad.html"
    path.write_text(
        "<!DOCTYPE html><img src='http://127.0.0.1:9/x.png'><script>console.error('oh')</script>"
    )
    said, asked = opened(path, tmp_path, "--dump-dom")
    assert any("oh" in own for own in said)
    assert any("127.0.0.1:9" in own for own in asked)


@needs_browser
def test_it_prints_as_sheets_of_a4(tmp_path):
    path, sheet = tmp_path / "report.html", tmp_path / "report.pdf"
    path.write_text(report_page(report()), encoding="utf-8")
    opened(path, tmp_path, f"--print-to-pdf={sheet}", "--no-pdf-header-footer")
    data = sheet.read_bytes()
    assert data.startswith(b"%PDF")
    boxes = re.findall(rb"/MediaBox ?\[ ?([\d. ]+)\]", data)
    # each design begins a sheet of its own
    assert len(boxes) >= 3
    for box in boxes:
        wide, high = (float(own) for own in box.split()[2:])
        assert (wide, high) == pytest.approx((595.3, 841.9), abs=1.0)


def test_the_picture_of_these_tests_is_one():
    assert png().startswith(b"\x89PNG")
