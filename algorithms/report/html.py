"""Pieces of HTML that cannot hold anything unescaped: text goes in as text, pieces as pieces."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Union

#: Elements that have no end.
_EMPTY = frozenset(("img", "meta", "br", "link", "hr"))
#: Characters that no document may hold; half of a pair of surrogates cannot even be written.
_STRANGE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff]")


@dataclass(frozen=True)
class Html:
    """A piece of HTML, complete in itself.

    Attributes
    ----------
    markup
        Its text.
    """

    markup: str


#: What goes into an element: pieces as they are, texts escaped.
Content = Union[Html, str]


def clean(words: str) -> str:
    """Return a text without the characters that HTML must not hold.

    Signs that turn the direction of writing are taken out, too: a name that has them could
    rearrange what stands around it.
    """
    return re.sub("[\u202a-\u202e\u2066-\u2069]", "", _STRANGE.sub("\ufffd", words))


def text(words: str) -> Html:
    """Return a text as a piece."""
    return Html(html.escape(clean(words), quote=True))


def tag(name: str, /, *content: Content, **attributes: str | int | None) -> Html:
    """Return an element.

    Parameters
    ----------
    name
        Its name.
    content
        What is in it, in order.
    attributes
        Its attributes, escaped; None for those that it has not. Underscores stand for hyphens,
        one at the end for nothing, so that `class_` is `class`.

    Examples
    --------
    >>> tag("p", "a < b", tag("b", "!"), class_="note").markup
    '<p class="note">a &lt; b<b>!</b></p>'
    """
    inside = "".join(own.markup if isinstance(own, Html) else text(own).markup for own in content)
    words = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{text(str(value)).markup}"'
        for key, value in attributes.items()
        if value is not None
    )
    return Html(f"<{name}{words}>" if name in _EMPTY else f"<{name}{words}>{inside}</{name}>")


def joined(pieces: Iterable[Content]) -> Html:
    """Return pieces one after the other, each on a line of its own."""
    return Html(
        "\n".join(own.markup if isinstance(own, Html) else text(own).markup for own in pieces)
    )


def table(
    caption: str,
    heads: Sequence[Content],
    rows: Iterable[Sequence[Content]],
    numbers: Iterable[int] = (),
) -> Html:
    """Return a table whose first column names its rows.

    Parameters
    ----------
    caption
        What it shows; readers on screen readers hear it first.
    heads
        Names of the columns.
    rows
        Cells of each row; a row of one cell is a heading over the whole width.
    numbers
        Columns that hold numbers.
    """
    right = set(numbers)
    made = [_row(row, len(heads), right) for row in rows]
    top = [tag("th", own, scope="col", class_="n" if at in right else None)
           for at, own in enumerate(heads)]  # fmt: skip
    return tag(
        "div",
        tag(
            "table",
            tag("caption", caption),
            tag("thead", tag("tr", *top)),
            tag("tbody", joined(made)),
        ),
        class_="wide",
        role="region",
        aria_label=caption,
        tabindex=0,
    )


def _row(row: Sequence[Content], columns: int, right: set[int]) -> Html:
    if len(row) == 1 and columns > 1:
        return tag("tr", tag("th", row[0], colspan=columns, scope="colgroup", class_="group"))
    first, *others = row
    cells = [
        tag("td", own, class_="n" if at in right else None) for at, own in enumerate(others, 1)
    ]
    return tag("tr", tag("th", first, scope="row"), *cells)
