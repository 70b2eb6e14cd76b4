"""Tables that a command writes into a page of the documentation."""

from __future__ import annotations

import re
from pathlib import Path


def write(page: Path, key: str, lines: list[str], by: str = "scripts/gallery") -> None:
    """Put a table into the page, between its marks.

    Parameters
    ----------
    page, key, lines
        The page, the name of the table in its marks, and the table.
    by
        The command that writes it, as its mark says.

    Raises
    ------
    ValueError
        If the marks are not in the page.
    """
    text = page.read_text(encoding="utf-8")
    begin, end = f"<!-- figures {key}: written by {by} -->", f"<!-- end {key} -->"
    pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    body = "\n".join([begin, "", *lines, "", end])
    text, count = pattern.subn(lambda _: body, text)
    if count != 1:
        msg = f"{page.name} has no place for the figures of {key}"
        raise ValueError(msg)
    page.write_text(text, encoding="utf-8")
