"""Figures of many parcels together (UP section 7)."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class ParcelFigures:
    """Figures of all parcels that are counted; NaN where there is none.

    Attributes
    ----------
    count, per_km2
        Number of parcels, and per square kilometre of ground (UP: pn).
    ground_ha
        The ground: the site or, without one, the parcels with the gaps between them up to 40 m.
    mean_area, median_area, cv_area
        Mean and median in square metres; standard deviation / mean.
    mean_frontage, mean_width, mean_depth
        Metres.
    p_angle, p_area, p_ideal, p_similarity
        Means over the parcels (UP: pangle, parea, pideal, psimilarity); degrees, ratio, ratio,
        metres.
    undesirable, undesirable_pct
        Number and share (%) with p_angle over 15 degrees or p_area over 1.2 (UP Fig. 12).
    no_access, access_pct
        Number without 3 m along a street, and share (%) of the others.
    frontage_pct
        Share (%) of all outlines that lies along streets.
    """

    count: int
    per_km2: float
    ground_ha: float
    mean_area: float
    median_area: float
    cv_area: float
    mean_frontage: float
    mean_width: float
    mean_depth: float
    p_angle: float
    p_area: float
    p_ideal: float
    p_similarity: float
    undesirable: int
    undesirable_pct: float
    no_access: int
    access_pct: float
    frontage_pct: float

    def as_dict(self) -> dict[str, float]:
        """Give the figures by name, in the order of the class."""
        return asdict(self)


def parcel_figures(values: dict[str, Floats], ground: float) -> ParcelFigures:
    """Sum up what `parcels.measure_shapes` found.

    Parameters
    ----------
    values
        Arrays of shape (n,), all measured.
    ground
        Area of the ground, square metres.
    """
    count = len(values["area_m2"])

    def mean(name: str) -> float:
        known = values[name][np.isfinite(values[name])]
        return float(known.mean()) if len(known) else math.nan

    area = values["area_m2"]
    bad, lost = int(values["undesirable"].sum()), int((values["access"] == 0).sum())
    outline = float(values["outline_m"].sum())
    return ParcelFigures(
        count=count,
        per_km2=count / (ground / 1e6) if ground > 0 else math.nan,
        ground_ha=ground / 1e4,
        mean_area=mean("area_m2"),
        median_area=float(np.median(area)) if count else math.nan,
        cv_area=float(area.std() / area.mean()) if count else math.nan,
        mean_frontage=mean("frontage_m"),
        mean_width=mean("width_m"),
        mean_depth=mean("depth_m"),
        p_angle=mean("p_angle"),
        p_area=mean("p_area"),
        p_ideal=mean("p_ideal"),
        p_similarity=mean("p_similarity"),
        undesirable=bad,
        undesirable_pct=100 * bad / count if count else math.nan,
        no_access=lost,
        access_pct=100 * (count - lost) / count if count else math.nan,
        frontage_pct=100 * float(values["frontage_m"].sum()) / outline if outline else math.nan,
    )
