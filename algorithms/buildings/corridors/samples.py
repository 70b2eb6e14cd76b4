"""The library of sample zones: outlines with entries, corridors and patterns of patches."""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..tables.patches import PatchChoice
from ..types import Floats

LIBRARY = Path(__file__).with_name("samples.json")


@dataclass(frozen=True)
class Street:
    """A corridor of a sample.

    Attributes
    ----------
    level
        As in `levels`.
    nodes
        Indices of the nodes that it runs through; the first is repeated at the end of a ring.
    """

    level: int
    nodes: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Sample:
    """A planned zone whose corridors can be used again (the sample graph G of RZ section 2).

    Attributes
    ----------
    name, about
        What it is called and what it is for.
    ring
        Its boundary V_p, counter-clockwise, metres, shape (n, 2).
    nodes
        Entries on the boundary, then nodes inside (V_g), metres, shape (k, 2).
    entries
        Number of entries.
    streets
        Corridors E along the nodes.
    patches
        Places in patches with the patterns planned there.
    """

    name: str
    about: str
    ring: Floats
    nodes: Floats
    entries: int
    streets: tuple[Street, ...]
    patches: tuple[tuple[tuple[float, float], PatchChoice], ...]

    @property
    def area_ha(self) -> float:
        """Area, hectares."""
        x, y = self.ring.T
        return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2e4)

    def mirrored(self) -> Sample:
        """Return the sample seen from behind, its ring counter-clockwise again."""
        flip = np.array([-1.0, 1.0])
        return replace(
            self,
            ring=(self.ring * flip)[::-1],
            nodes=self.nodes * flip,
            patches=tuple(((-x, y), choice) for (x, y), choice in self.patches),
        )


def sample_of(row: Mapping[str, Any]) -> Sample:
    """Read a sample.

    Parameters
    ----------
    row
        "name", "about", "outline" (a list of points), "entries" and "nodes" (points by name),
        "streets" (each with "level" and the names "through" which it runs) and "patches" (each
        with a point "at" and fields of `PatchChoice`).
    """
    names = [*row["entries"], *row["nodes"]]
    at = {name: k for k, name in enumerate(names)}
    places = [*row["entries"].values(), *row["nodes"].values()]
    return Sample(
        name=row["name"],
        about=row["about"],
        ring=np.array(row["outline"], dtype=float),
        nodes=np.array(places, dtype=float).reshape(-1, 2),
        entries=len(row["entries"]),
        streets=tuple(
            Street(own["level"], tuple(at[name] for name in own["through"]))
            for own in row["streets"]
        ),
        patches=tuple(
            (
                (float(own["at"][0]), float(own["at"][1])),
                PatchChoice(**{key: value for key, value in own.items() if key != "at"}),
            )
            for own in row["patches"]
        ),
    )


@functools.lru_cache(maxsize=1)
def library() -> tuple[Sample, ...]:
    """Return the samples that come with the library."""
    rows = json.loads(LIBRARY.read_text(encoding="utf-8"))["samples"]
    return tuple(sample_of(row) for row in rows)
