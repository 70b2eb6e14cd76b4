"""Write screenshots as small pictures: no wider than 1200 pixels, 256 colours.

Usage: _small_pictures.py SHOTS TARGET. Pictures in TARGET that have no screenshot are deleted.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import Any

from PIL import Image

WIDEST, COLOURS = 1200, 256
#: All pictures together (bytes).
MOST = 1_500_000


def palette(picture: Image.Image) -> Image.Image:
    """Return the commonest colours of a picture as they are, so that no legend changes."""
    counted = picture.getcolors(picture.width * picture.height) or []
    common = [colour for _, colour in sorted(counted, reverse=True)[:COLOURS]]
    made = Image.new("P", (1, 1))
    made.putpalette([part for colour in common for part in colour])
    return made


def saved(figure: Any, path: Path, most: int, dpi: int = 100) -> Path:
    """Write a figure of matplotlib with as many colours as fit, and close it.

    Raises
    ------
    ValueError
        If the file has more than `most` bytes.
    """
    import matplotlib.pyplot as plt

    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=dpi, facecolor=figure.get_facecolor())
    plt.close(figure)
    picture = Image.open(buffer).convert("RGB")
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.quantize(palette=palette(picture), dither=Image.Dither.NONE).save(path, optimize=True)
    if path.stat().st_size > most:
        message = f"{path.name} has {path.stat().st_size} bytes, more than {most}."
        raise ValueError(message)
    return path


def main() -> None:
    """Turn all of them."""
    shots, target = (Path(name) for name in sys.argv[1:3])
    found = sorted(shots.glob("*.png"))
    for path in target.glob("*.png"):
        path.unlink()
    for path in found:
        with Image.open(path) as opened:
            picture = opened.convert("RGB")
        if picture.width > WIDEST:
            picture = picture.resize((WIDEST, round(picture.height * WIDEST / picture.width)))
        picture.quantize(palette=palette(picture), dither=Image.Dither.NONE).save(
            target / path.name, optimize=True
        )
    total = sum((target / path.name).stat().st_size for path in found)
    print(f"{len(found)} pictures, {total / 1000:.0f} kB")
    if total > MOST:
        sys.exit(f"more than {MOST / 1000:.0f} kB")


if __name__ == "__main__":
    main()
