"""Pictures of the provider and of each group of tools."""

from __future__ import annotations

from pathlib import Path


def icon_path(name: str) -> str:
    """Return the path of the picture `name`, or of the provider's where there is none."""
    folder = Path(__file__).parent
    path = folder / f"{name}.svg"
    return str(path if path.is_file() else folder / "platwright.svg")
