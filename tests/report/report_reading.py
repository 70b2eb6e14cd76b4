"""Reads a page as a browser would, by the parser of Python; nothing of the writer is used."""

from __future__ import annotations

from dataclasses import dataclass, field
from html.parser import HTMLParser
from typing import Any

EMPTY = {"img", "meta", "br", "link", "hr", "input", "source"}
#: Attributes that make a browser fetch something.
FETCHED = {"src", "srcset", "poster", "data", "background", "action", "formaction", "ping"}


@dataclass
class Element:
    name: str
    attributes: dict[str, str | None]
    children: list[Any] = field(default_factory=list)

    @property
    def text(self) -> str:
        return "".join(own if isinstance(own, str) else own.text for own in self.children)

    def all(self, name: str) -> list[Element]:
        found = [self] if self.name == name else []
        for own in self.children:
            if isinstance(own, Element):
                found += own.all(name)
        return found

    def every(self) -> list[Element]:
        found = [self]
        for own in self.children:
            if isinstance(own, Element):
                found += own.every()
        return found


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.root = Element("document", {})
        self.open = [self.root]

    def handle_starttag(self, tag, attrs):
        names = [key for key, _ in attrs]
        assert len(names) == len(set(names)), f"an attribute of {tag} twice"
        element = Element(tag, dict(attrs))
        self.open[-1].children.append(element)
        if tag not in EMPTY:
            self.open.append(element)

    def handle_endtag(self, tag):
        assert self.open[-1].name == tag, f"</{tag}> ends <{self.open[-1].name}>"
        self.open.pop()

    def handle_data(self, data):
        self.open[-1].children.append(data)

    def handle_comment(self, data):  # noqa: ARG002
        raise AssertionError("a comment")


def parsed(page: str) -> Element:
    """Return a page as elements; unbalanced elements fail."""
    reader = _Reader()
    reader.feed(page)
    reader.close()
    assert [own.name for own in reader.open] == ["document"]
    return reader.root


def fetched(page: Element) -> list[str]:
    """Return every address that a browser would fetch by itself."""
    found = []
    for own in page.every():
        found += [v or "" for k, v in own.attributes.items() if k in FETCHED]
        if own.name in ("link", "base", "use", "image"):
            found += [v or "" for k, v in own.attributes.items() if k.endswith("href")]
    return found


def cells(table: Element) -> list[list[str]]:
    """Return the texts of a table, row by row, blanks put together."""
    return [
        [" ".join(own.text.split()) for own in row.children if isinstance(own, Element)]
        for row in table.all("tr")
    ]
