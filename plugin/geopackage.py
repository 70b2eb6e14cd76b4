"""GeoPackages below the level of QGIS: opening them, and their tables and journal."""

from __future__ import annotations

import contextlib
from typing import Any


def open_dataset(path: str, *, change: bool = False) -> Any:
    """Return a file as a dataset of OGR, or None where it cannot be read.

    Parameters
    ----------
    path
        The file.
    change
        Whether it is to be changed.
    """
    from osgeo import ogr

    # Other plugins may have told OGR to raise errors instead of returning None.
    with contextlib.suppress(RuntimeError):
        return ogr.Open(path, int(change))
    return None


def parts(source: str) -> tuple[str, str]:
    """Return the path of a data source and the table in it; empty where none is named."""
    path, *options = source.split("|")
    named = [o.split("=", 1)[1] for o in options if o.startswith("layername=")]
    return path, named[0] if named else ""


def table_of(source: str) -> str:
    """Return the table that a data source means: that which it names, or the first; or empty."""
    path, name = parts(source)
    if name or not path.lower().endswith(".gpkg"):
        return name
    dataset = open_dataset(path)
    first = dataset.GetLayer(0) if dataset is not None else None
    return first.GetName() if first is not None else ""


def end_journal(path: str) -> None:
    """Take a GeoPackage out of the journal mode "WAL", in which saving styles leaves it.

    In that mode it does not open from a read-only folder or a share. Where somebody else has it
    open, it stays as it is.
    """
    dataset = open_dataset(path, change=True)
    if dataset is None:
        return
    with contextlib.suppress(RuntimeError):
        answer = dataset.ExecuteSQL("PRAGMA journal_mode = delete")
        if answer is not None:
            dataset.ReleaseResultSet(answer)
