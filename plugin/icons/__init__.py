"""Pictures of the provider and of the tools, legible on light and on dark ground."""

from __future__ import annotations

from pathlib import Path


def icon_path(*names: str) -> str:
    """Return the path of the first picture among `names` that exists, or of the provider's."""
    folder = Path(__file__).parent
    paths = (folder / f"{name}.svg" for name in (*names, "platwright"))
    return str(next(path for path in paths if path.is_file()))
