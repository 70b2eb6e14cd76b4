"""A report with something of everything, made by hand."""

from __future__ import annotations

import struct
import zlib

from platwright.report import (
    Credit,
    Design,
    Figure,
    LayerRow,
    LegendEntry,
    Picture,
    Problem,
    Report,
    Run,
    Wish,
    check_targets,
    parse_targets,
)


def png(width: int = 4, height: int = 3) -> bytes:
    """Return a grey picture, written by hand."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    rows = b"".join(b"\0" + b"\x90" * width for _ in range(height))
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    parts = chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + parts


def picture(words: str = "plan") -> Picture:
    return Picture(
        title=f"{words} title", alt=f"{words} alt", png=png(), width=1000, height=800,
        ground=500.0, crs=f"{words} crs", north=2.0,
        legend=(LegendEntry(f"{words} heading"), LegendEntry(f"{words} symbol", png())),
    )  # fmt: skip


def design(name: str, length: float, angle: float | None, words: str = "plan") -> Design:
    figures = (
        Figure("TOTAL_LENGTH", f"{words} length", length, "m"),
        Figure("OBJECTIVE", "price", 40.0),
        Figure("BOUND", "bound", 36.0),
        Figure("SECONDS", "time", 2.5, "s"),
    )
    parcels = (Figure("MEAN_P_ANGLE", f"{words} angle", angle, "degrees"),)
    wishes = (Wish(f"{words} wish", f"{words} value", False), Wish("usual", "yes", True))
    return Design(
        name=name,
        pictures=(picture(words),),
        runs=(
            Run("designstreets", f"{words} tool", wishes, figures),
            Run("parcelblocks", "parcels", (), parcels),
        ),
        problems=(
            Problem(f"{words} layer", "7", f"{words} problem", f"{words} action", "warning"),
        ),
        layers=(LayerRow(f"{words} streets", f"{words} tool", 12, f"{words}.gpkg", "EPSG:1"),),
    )


def report(words: str = "plan", *names: str) -> Report:
    chosen = names or ("one", "two")
    designs = tuple(
        design(name, 1000.0 + 250.0 * at, 1.5 if at else None, words)
        for at, name in enumerate(chosen)
    )
    found = check_targets(
        parse_targets("TOTAL_LENGTH <= 1100; MEAN_P_ANGLE < 1"),
        {own.name: own.figures for own in designs},
    )
    return Report(
        title=f"{words} report", date="1 May 2030", version="9.8.7", place=f"{words} place",
        author=f"{words} author", designs=designs, targets=found,
        data=(LayerRow(f"{words} site", "", 1, "site.gpkg", "EPSG:1"),),
        credits=(
            Credit(f"{words} roads", f"{words} owner", f"{words} licence", f"{words} source",
                   "2030-01-02", ("https://example.org/licence",)),
        ),
    )  # fmt: skip
