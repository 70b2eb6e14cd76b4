"""Counts of parcels by classes of a measure, the same classes for every layer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Measure:
    """A measure, as a histogram shows it.

    Attributes
    ----------
    name
        Field of the parcels.
    title, unit
        What a planner reads.
    bounds
        Lower bounds of the classes; the last class is open.
    limit
        Above this a parcel is undesirable, or None.
    """

    name: str
    title: str
    unit: str
    bounds: tuple[float, ...]
    limit: float | None = None


#: Classes that do not depend on the layer, so that designs can be held against each other.
MEASURES = (
    Measure(
        "area_m2",
        "Area",
        "m2",
        (0, 100, 200, 300, 400, 500, 600, 700, 800, 900, 1000, 1500, 2000, 5000, 10_000),
    ),
    Measure("p_angle", "Corners off 90 degrees", "degrees", (0, 1, 2, 3, 5, 7.5, 10, 15, 30), 15),
    Measure(
        "p_area",
        "Smallest rectangle / area",
        "",
        (1, 1.01, 1.02, 1.05, 1.1, 1.15, 1.2, 1.5, 2),
        1.2,
    ),
    Measure("p_ideal", "Area against the ideal", "", (1, 1.05, 1.1, 1.2, 1.3, 1.5, 2, 3, 5)),
    Measure(
        "p_similarity",
        "Distance from the ideal parcel",
        "m",
        (0, 0.1, 0.25, 0.5, 0.75, 1, 1.5, 2, 3, 5),
    ),
    Measure("frontage_m", "Frontage", "m", (0, 3, 6, 9, 12, 15, 18, 21, 24, 30, 40, 60)),
    Measure("width_m", "Width", "m", (0, 3, 6, 9, 12, 15, 18, 21, 24, 30, 40, 60)),
    Measure("depth_m", "Depth", "m", (0, 10, 15, 20, 25, 30, 35, 40, 50, 60, 80)),
)


@dataclass(frozen=True, eq=False)
class Histogram:
    """Counts of one measure.

    Attributes
    ----------
    measure
        What is counted.
    counts
        Number of values in each class, shape (k,); a class holds its lower bound.
    mean
        Of all values, NaN for none.
    """

    measure: Measure
    counts: npt.NDArray[np.int64]
    mean: float

    def labels(self) -> list[str]:
        """Name the classes."""
        bounds = self.measure.bounds
        named = [f"{low:g} to {high:g}" for low, high in zip(bounds, bounds[1:])]
        return [*named, f"{bounds[-1]:g} and more"]


def histogram(values: Floats, measure: Measure) -> Histogram:
    """Count values by the classes of a measure.

    Parameters
    ----------
    values
        Shape (n,). NaN is left out; what lies below the first bound by rounding counts there.
    measure
        Its classes.
    """
    known = values[~np.isnan(values)]
    bounds = np.asarray(measure.bounds, dtype=float)
    place = np.clip(np.searchsorted(bounds, known, side="right") - 1, 0, None)
    finite = known[np.isfinite(known)]
    mean = float(finite.mean()) if len(finite) else float("nan")
    return Histogram(measure, np.bincount(place, minlength=len(bounds)), mean)


def histogram_rows(found: list[Histogram]) -> Mapping[str, list[object]]:
    """Give histograms as the columns of a table, one row for each class.

    Parameters
    ----------
    found
        The histograms.

    Returns
    -------
    dict
        Columns measure, unit, bin_from, bin_to (NaN for the open class), count, share_pct.
    """
    rows: dict[str, list[object]] = {
        name: [] for name in ("measure", "unit", "bin_from", "bin_to", "count", "share_pct")
    }
    for one in found:
        bounds = [*one.measure.bounds, float("nan")]
        whole = max(int(one.counts.sum()), 1)
        for low, high, count in zip(bounds, bounds[1:], one.counts.tolist()):
            entry = (one.measure.name, one.measure.unit, low, high, count, 100 * count / whole)
            for column, value in zip(rows.values(), entry):
                column.append(value)
    return rows
