"""What several tools do with the layers that they have made."""

from __future__ import annotations

from typing import Any


def without_frontage(problems: Any, action: str, severity: str = "warning") -> Any:
    """Return problems of sites with what a tool says itself where no road runs along the edge."""
    from ...algorithms.site.prepare import NO_FRONTAGE

    bare = problems["action"].astype(str).str.startswith(NO_FRONTAGE)
    told = problems.copy()
    told.loc[bare, "action"] = action
    told.loc[bare, "severity"] = severity
    return told


def joined(*layers: Any) -> Any:
    """Return layers of the same columns as one, without the empty ones."""
    import pandas

    full = [layer for layer in layers if len(layer)]
    return pandas.concat(full, ignore_index=True) if full else layers[0]


def without_places(table: Any) -> Any:
    """Return a table as features without geometry."""
    import geopandas

    return geopandas.GeoDataFrame(table, geometry=[None] * len(table))
