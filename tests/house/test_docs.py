"""The documents: nothing that is generated is out of date, no link leads nowhere."""

from __future__ import annotations

import importlib.util
import re
import sys
from types import ModuleType

import pytest

from house import ROOT

DOCS = ROOT / "docs"


def script(name: str) -> ModuleType:
    """Import a script of the repository by its path."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "scripts" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def hook():
    return script("_docs_hook")


@pytest.fixture(scope="module")
def texts(hook):
    """Every page of the site by its path in it, with what it says outside of code."""
    kept = {
        path.relative_to(DOCS).as_posix(): path.read_text(encoding="utf-8")
        for path in DOCS.rglob("*.md")
    }
    pages = {**kept, **hook.virtual_pages()}
    return {path: hook.CODE.sub("", text) for path, text in pages.items()}


def anchors(text: str) -> set[str]:
    """Return the anchors of a page's headings, as Markdown makes them."""
    found = set()
    for heading in re.findall(r"^#+ +(.*)$", text, re.MULTILINE):
        plain = re.sub(r"[^\w\s-]", "", heading.lower()).strip()
        found.add(re.sub(r"[-\s]+", "-", plain))
    return found


def broken(page: str, target: str, texts: dict[str, str], hook: ModuleType) -> bool:
    """Tell whether a link of a page leads nowhere."""
    if re.match(r"^\w+:", target):
        return False
    path, _, anchor = target.partition("#")
    place = (DOCS / page).parent.joinpath(path).resolve() if path else DOCS / page
    inside = place.relative_to(DOCS).as_posix() if DOCS in place.parents else ""
    if inside in texts:
        return bool(anchor) and anchor not in anchors(texts[inside])
    return not (place.is_file() and ROOT in place.parents)


def test_no_link_and_no_picture_is_broken(texts, hook):
    assert len(texts) > 15
    wrong = [
        f"{page}: {target}"
        for page, text in texts.items()
        for _, target, _ in hook.LINK.findall(text)
        if broken(page, target, texts, hook)
    ]
    assert not wrong, wrong


def test_a_broken_link_would_be_found(texts, hook):
    assert broken("index.md", "nowhere.md", texts, hook)
    assert broken("index.md", "method.md#no-such-heading", texts, hook)
    assert broken("index.md", "../../outside.md", texts, hook)
    assert not broken("index.md", "method.md#the-program", texts, hook)
    assert not broken("tools/index.md", "../../plugin/icons/site.svg", texts, hook)


def test_every_page_is_linked_or_in_the_navigation(texts, hook):
    listed = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    known = set(re.findall(r"[\w/]+\.md", listed)) | set(hook.tool_pages().values())
    known |= {page for page in texts if page.startswith("library/")} | {"tools/index.md"}
    for page, text in texts.items():
        for _, target, _ in hook.LINK.findall(text):
            place = (DOCS / page).parent.joinpath(target.partition("#")[0]).resolve()
            if DOCS in place.parents:
                known.add(place.relative_to(DOCS).as_posix())
    assert set(texts) <= known


def test_links_out_of_the_documents_hold_in_the_site(hook):
    page = "tools/designstreets.md"
    assert hook.site_link("../styles.md#presets", page) == "../styles.md#presets"
    assert hook.site_link("../../plugin/icons/x.svg", page) == "../images/icons/x.svg"
    assert hook.site_link("../../CHANGELOG.md", page) == "../changelog.md"
    assert hook.site_link("../LICENSE", "data.md") == f"{hook.REPOSITORY}/LICENSE"
    assert hook.site_link("https://example.org/a.md", page) == "https://example.org/a.md"


def test_every_room_of_the_library_has_a_page(hook):
    rooms = {path.parent.name for path in (ROOT / "algorithms").glob("*/__init__.py")}
    assert set(hook.rooms()) == rooms
    pages = hook.virtual_pages()
    for room in rooms:
        assert f"::: platwright.{room}" in pages[f"library/{room}.md"]
        assert f"]({room}.md)" in pages["library/index.md"]


def test_the_picture_of_the_rooms_is_up_to_date():
    rooms = script("_docs_rooms")
    assert rooms.PICTURE.read_text(encoding="utf-8") == rooms.picture(), (
        "Run scripts/docs --reference."
    )
    graph = rooms.imports()
    assert "network" in graph["streets"]
    assert "measure" not in graph["streets"]
    assert graph["mesh"] <= {"site"}


def test_no_screenshot_is_missing_or_left_over():
    tutorial = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    folder = DOCS / "images" / "tutorial"
    kept = {path.name for path in folder.glob("*")} if folder.is_dir() else set()
    shown = set(re.findall(r"images/tutorial/([\w.-]+\.png)", tutorial))
    assert shown == kept


def test_what_builds_the_site_is_pinned():
    lines = (ROOT / "requirements-docs.txt").read_text(encoding="utf-8").splitlines()
    pins = [line for line in lines if line and not line.startswith("#")]
    assert len(pins) > 5
    assert all(re.fullmatch(r"[\w.-]+==[\w.]+", line) for line in pins), pins
