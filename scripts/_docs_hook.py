"""What mkdocs cannot do by itself: pages from outside docs/, the list of pages, mathematics.

mkdocs calls the functions `on_...`; the tests use the rest, which needs no mkdocs.
"""

from __future__ import annotations

import ast
import html
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
REPOSITORY = "https://github.com/platwright/platwright/blob/main"
#: Pictures of the plugin that pages show: folder in the repository -> folder in the site.
PICTURES = {"plugin/icons": "images/icons"}


def rooms() -> list[str]:
    """Return the rooms of the library, in the order of the work where it is known."""
    order = ("site", "osm", "mesh", "network", "streets", "measure")
    found = [path.parent.name for path in (ROOT / "algorithms").glob("*/__init__.py")]
    return sorted(found, key=lambda name: (order.index(name) if name in order else 99, name))


def tool_pages() -> dict[str, str]:
    """Return the pages of the tools by their titles, in the order of their table."""
    index = DOCS / "tools" / "index.md"
    text = index.read_text(encoding="utf-8") if index.is_file() else ""
    return {
        title: f"tools/{name}" for title, name in re.findall(r"\[([^\]]+)\]\((\w+\.md)\)", text)
    }


def room_page(room: str) -> str:
    """Write the page of a room of the library."""
    return f"# platwright.{room}\n\n::: platwright.{room}\n"


def common_page() -> str:
    """Write the page of what every room uses."""
    return (
        "# Errors and progress\n\n::: platwright.errors\n\n::: platwright.progress\n    options:\n"
        "      filters: ['!^_']\n"
    )


def library_page() -> str:
    """Write the first page of the library."""
    rows = []
    for room in rooms():
        path = ROOT / "algorithms" / room / "__init__.py"
        text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        rows.append(f"| [`platwright.{room}`]({room}.md) | {text.split(chr(10))[0]} |")
    return "\n".join(
        [
            "# Library",
            "",
            "`pip install .` in the repository installs the library alone, as `platwright`: "
            "GeoDataFrames in, GeoDataFrames out, no QGIS. Lengths are metres.",
            "",
            "| room | what it does |",
            "|---|---|",
            *rows,
            "| [`platwright.errors`, `platwright.progress`](common.md) | What every room uses. |",
            "",
            "```python",
            "import geopandas as gpd",
            "from platwright.network.specification import Specification",
            "from platwright.site import prepare_sites",
            "from platwright.streets import design_streets, plan_layers",
            "",
            'data = "data/helsinki/helsinki_yard.gpkg"',
            "site, roads, obstacles = (",
            '    gpd.read_file(data, layer=name) for name in ("site", "streets", "obstacles")',
            ")",
            "prepared = prepare_sites(site, roads, obstacles)",
            "plan = design_streets(prepared.sites, Specification(block_width=72, "
            "block_length=150))",
            'plan_layers(plan)["streets"].to_file("streets.gpkg")',
            "```",
            "",
        ]
    )


def virtual_pages() -> dict[str, str]:
    """Return the pages that are made and not kept, by their path in the site."""
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    pages = {f"library/{room}.md": room_page(room) for room in rooms()}
    return {
        "library/index.md": library_page(),
        "library/common.md": common_page(),
        **pages,
        "changelog.md": changelog,
    }


def site_link(target: str, page: str) -> str:
    """Return where a link of a page leads in the site.

    Links to files outside docs/ hold in the repository; in the site pictures of the plugin have
    a place of their own, and everything else is looked up in the repository.
    """
    if re.match(r"^(\w+:|#)", target):
        return target
    path, _, anchor = target.partition("#")
    place = (DOCS / page).parent.joinpath(path).resolve()
    if DOCS in place.parents or not place.is_relative_to(ROOT):
        return target
    inside = place.relative_to(ROOT)
    if inside.as_posix() == "CHANGELOG.md":
        return "../" * page.count("/") + "changelog.md"
    folder = PICTURES.get(inside.parent.as_posix())
    if folder is not None:
        return "../" * page.count("/") + f"{folder}/{inside.name}"
    return f"{REPOSITORY}/{inside.as_posix()}" + (f"#{anchor}" if anchor else "")


LINK = re.compile(r"(!?\[[^\]]*\]\()([^)\s]+)(\))")
CODE = re.compile(r"(```.*?```|`[^`\n]*`)", re.DOTALL)


def on_config(config: Any) -> Any:
    """Put the pages of tools and rooms into the navigation."""
    lists = {
        "tools/": ["tools/index.md", *({title: page} for title, page in tool_pages().items())],
        "library/": [
            "library/index.md",
            *(f"library/{r}.md" for r in rooms()),
            "library/common.md",
        ],
    }
    config.nav = [
        {title: lists.get(value, value) if isinstance(value, str) else value}
        for entry in config.nav
        for title, value in entry.items()
    ]
    return config


def on_files(files: Any, config: Any) -> Any:
    """Add the pages and pictures that lie elsewhere."""
    from mkdocs.structure.files import File

    for path, text in virtual_pages().items():
        files.append(File.generated(config, path, content=text))
    pictures = [
        (path, f"{folder}/{path.name}")
        for source, folder in PICTURES.items()
        for path in sorted((ROOT / source).iterdir())
        if path.suffix in (".png", ".svg")
    ]
    for path, place in [*pictures, (ROOT / "plugin/icons/platwright.svg", "images/icon.svg")]:
        files.append(File.generated(config, place, abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Turn links that leave docs/ to where they lead in the site."""
    return LINK.sub(
        lambda found: found[1] + site_link(found[2], page.file.src_uri) + found[3], markdown
    )


def on_page_content(content: str, **_: Any) -> str:
    """Write formulas as MathML, which browsers draw without a script."""
    from latex2mathml.converter import convert

    def formula(found: re.Match[str]) -> str:
        text = html.unescape(found[2])
        display = "block" if text.startswith("\\[") else "inline"
        return convert(text[2:-2].strip(), display=display)

    return re.sub(r'<(span|div) class="arithmatex">(.*?)</\1>', formula, content, flags=re.DOTALL)
