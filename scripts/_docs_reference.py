"""Write the reference part of the tools' pages from what the tools declare.

Run by scripts/docs in the environment with QGIS. Each page `docs/tools/<tool>.md` begins with a
head and ends with a reference, which are replaced here between their marks; what stands between
them is written by hand. A tool without a page gets one. `--check` writes nothing and names the
pages that are out of date.
"""

from __future__ import annotations

import importlib
import os
import re
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PAGES = ROOT / "docs" / "tools"
#: Around each part that is written here: its beginning and its end.
MARKS = {
    name: (
        f"<!-- {name}: written by scripts/docs from the tool itself, do not edit -->",
        f"<!-- end of the {name} -->",
    )
    for name in ("head", "reference")
}
#: What layers hold, by the names of their geometry types; what is missing here has no shapes.
SHAPES = {
    "Point": "points",
    "LineString": "lines",
    "MultiLineString": "lines of one or more parts",
    "Polygon": "polygons",
    "MultiPolygon": "polygons of one or more parts",
}
#: Where the icons lie as seen from a page.
ICONS = "../../plugin/icons"


def cell(text: str) -> str:
    """Return a text for a cell of a table."""
    return re.sub(r"\s+", " ", text).replace("|", "\\|").replace("<", "&lt;").strip()


def table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> list[str]:
    """Return the lines of a table."""
    heads = list(heads)
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return [*lines, *("| " + " | ".join(cell(text) for text in row) + " |" for row in rows), ""]


def words(text: str) -> str:
    """Return the values that an input takes with the words of choices as code."""
    return ", ".join(f"`{word}`" for word in text.split(" / ")) if " / " in text else text


def _inputs(described: Any) -> list[str]:
    lines: list[str] = []
    for heading, advanced in (("Inputs", False), ("Advanced inputs", True)):
        rows = [
            (
                f"`{own.key}`",
                own.title,
                words(own.kind) + ("; one per feature possible" if own.per_feature else ""),
                own.text,
            )
            for own in described.inputs
            if own.advanced == advanced
        ]
        if rows:
            lines += [f"### {heading}", "", *table(("key", "name", "values", "meaning"), rows)]
    return lines


def _outputs(described: Any, unit_of: Any) -> list[str]:
    lines = ["### Outputs", ""] if described.layers or described.numbers else []
    for key, kind in described.layers.items():
        shape = SHAPES.get(kind.geometry)
        what = f"layer `{key}` of {shape}" if shape else f"table `{key}`"
        lines += [f"**{kind.title}**: {what}.", ""]
        rows = [(f"`{f.name}`", f.kind, unit_of(f), f.text) for f in kind.fields]
        lines += table(("field", "kind", "unit", "meaning"), rows)
    if described.numbers:
        lines += ["**Numbers**", ""]
        lines += table(
            ("key", "meaning"), ((f"`{key}`", text) for key, text in described.numbers.items())
        )
    return lines


def _call(described: Any) -> list[str]:
    """Return how the tool is called from a command line, with its first inputs and outputs."""
    wanted = [own for own in described.inputs if not own.advanced and "Optional" not in own.text]
    given = [f"--{own.key}={_example(own)}" for own in wanted if not own.default]
    made = [f"--{key}={kind.key}.gpkg" for key, kind in list(described.layers.items())[:1]]
    lines = [f"qgis_process run platwright:{described.about.name}", *given, *made]
    return ["```", " \\\n    ".join(lines), "```", ""]


def _example(own: Any) -> str:
    return f"{own.key.lower()}.gpkg" if own.kind.startswith("layer") else "..."


def head(described: Any, group: str) -> str:
    """Return the head of a page as Markdown."""
    about = described.about
    lines = [f"# {about.title}", "", about.summary, ""]
    lines += [f"Tool `platwright:{about.name}`, group *{group}*.", ""]
    if described.picture is not None:
        lines += [f"![{about.title}](../images/tools/{described.picture.name}){{ .tool }}", ""]
        lines += [f"*{about.picture}*", ""] if about.picture else []
    return "\n".join(lines)


def reference(described: Any, unit_of: Any) -> str:
    """Return the reference of a tool as Markdown."""
    lines = ["## Reference", ""]
    for text in described.about.paragraphs:
        lines += [text, ""]
    lines += [*_inputs(described), *_outputs(described, unit_of)]
    lines += ["### On the command line", "", *_call(described)]
    if described.references:
        lines += ["### References", "", *(f"- {text}" for text in described.references), ""]
    return "\n".join(lines)


def page(old: str, parts: dict[str, str]) -> str:
    """Return a page with its parts replaced, or a new one."""
    for name, text in parts.items():
        begin, end = MARKS[name]
        if begin not in old:
            old = f"{old}{begin}\n{end}\n\n"
        before, _, rest = old.partition(begin)
        _, _, after = rest.partition(end)
        old = f"{before}{begin}\n\n{text}\n{end}{after}"
    return old.rstrip() + "\n"


def index(tools: Iterable[Any]) -> str:
    """Return the table of all tools."""
    lines = [
        "# Tools",
        "",
        "They are in the Processing toolbox under *Platwright*, in the order of the work, and run "
        "in models, in batch and with `qgis_process` alike. Lengths are metres whatever the "
        "coordinate reference system of the layers. Outputs are ordinary layers, all of them "
        "written or none. [Styles, groups and presets](../styles.md) are described apart.",
        "",
    ]
    groups: dict[str, list[Any]] = {}
    for tool in tools:
        groups.setdefault(tool.group(), []).append(tool)
    for group in sorted(groups):
        rows = [
            (
                f"![]({ICONS}/{Path(tool.svgIconPath()).name}){{ .icon }}",
                f"[{tool.displayName()}]({tool.name()}.md)",
                tool.shortDescription(),
            )
            for tool in groups[group]
        ]
        lines += [f"## {group}", "", *table(("", "tool", "what it does"), rows)]
    return "\n".join(lines)


def pages(tools: Iterable[Any], unit_of: Any) -> dict[Path, str]:
    """Return the text of each page as it should be.

    Parameters
    ----------
    tools
        The tools of the provider, with their parameters declared.
    unit_of
        `plugin.help.unit_of`.
    """
    tools = list(tools)
    made = {PAGES / "index.md": index(tools)}
    for tool in tools:
        path = PAGES / f"{tool.name()}.md"
        old = path.read_text(encoding="utf-8") if path.is_file() else ""
        told = tool.described()
        made[path] = page(
            old, {"head": head(told, tool.group()), "reference": reference(told, unit_of)}
        )
    return made


def stale(made: dict[Path, str]) -> list[Path]:
    """Return the pages whose files say something else, and those of tools that are no more."""
    wrong = [
        path
        for path, text in made.items()
        if not path.is_file() or path.read_text(encoding="utf-8") != text
    ]
    return sorted({*wrong, *(path for path in PAGES.glob("*.md") if path not in made)})


def _tools(folder: str) -> tuple[list[Any], Any]:
    """Return the tools of this tree and `unit_of`; `folder` stands for QGIS's plugin folder."""
    (Path(folder) / "platwright_docs").symlink_to(ROOT, target_is_directory=True)
    sys.path.insert(0, folder)
    tools = importlib.import_module("platwright_docs.plugin.tools").TOOLS
    unit_of = importlib.import_module("platwright_docs.plugin.help").unit_of
    made = [tool() for tool in tools]
    for tool in made:
        tool.initAlgorithm()
    return made, unit_of


def main() -> None:
    """Write the pages, or check them."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    from qgis.core import QgsApplication

    application = QgsApplication([], False)
    with tempfile.TemporaryDirectory() as folder:
        made = pages(*_tools(folder))
    wrong = stale(made)
    if "--check" not in sys.argv:
        for path, text in made.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
    for path in wrong:
        verb = "out of date" if "--check" in sys.argv or path not in made else "written"
        print(f"{path.relative_to(ROOT)}: {verb}")
    del application
    if "--check" in sys.argv and wrong:
        sys.exit(1)


if __name__ == "__main__":
    main()
