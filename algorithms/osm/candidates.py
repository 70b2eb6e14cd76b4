"""Areas that may be meant, brought into an order and into a layer."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Optional

import geopandas as gpd
import shapely
from shapely.geometry.base import BaseGeometry

from ..progress import Progress
from .names import Match, match_name
from .polygons import area_ha, crosses_antimeridian, same_area
from .settings import ATTRIBUTION, LICENCE
from .shapes import WGS84

#: Columns of the layer before the geometry.
COLUMNS = (
    "rank", "name", "display_name", "kind", "admin_level", "osm_id", "area_ha", "match",
    "same_as",
)  # fmt: skip
#: Administrative level of a state.
STATE = 2
#: Areas from this size on are no sites but regions, in hectares.
REGION = 1e6

_TURN = 360.0

BY_ID = Match(0, "OSM id")
UNKNOWN = Match(9, "")


@dataclass(frozen=True)
class Candidate:
    """One area that may be meant.

    Attributes
    ----------
    osm_id
        Such as "R123".
    name
        Its name, or empty.
    geometry
        Valid polygon or multipolygon in degrees.
    display_name
        The name with the names of what it lies in.
    kind
        What it is: the type of the boundary, or the value of place, landuse…
    admin_level
        Administrative level, or None.
    names
        Its other names.
    match
        How it was found.
    same_as
        Ids of other things that cover the same ground.
    """

    osm_id: str
    name: str
    geometry: BaseGeometry
    display_name: str = ""
    kind: str = ""
    admin_level: Optional[int] = None
    names: tuple[str, ...] = ()
    match: Match = UNKNOWN
    same_as: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """The name, or the id where it has none."""
        return self.name or f"{self.kind} {self.osm_id}".strip()


def matched(candidate: Candidate, wanted: str) -> Optional[Candidate]:
    """Return a candidate with how its names fit what was typed, None where they do not."""
    match = match_name(wanted, candidate.name, candidate.names)
    return None if match is None else dataclasses.replace(candidate, match=match)


def level(text: Any) -> Optional[int]:
    """Read an administrative level, which in the map may be any text."""
    try:
        return int(float(str(text)))
    except (ValueError, OverflowError):
        return None


def without_doubles(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Join candidates that cover the same ground; the first of them stays.

    A city that is a district of its own is in the map twice, and choosing between the two
    would mean nothing.
    """
    kept: list[Candidate] = []
    for candidate in candidates:
        for at, other in enumerate(kept):
            if other.osm_id == candidate.osm_id:
                break
            if same_area(other.geometry, candidate.geometry):
                names = (*other.names, candidate.name, *candidate.names)
                kept[at] = dataclasses.replace(
                    other,
                    name=other.name or candidate.name,
                    names=tuple(dict.fromkeys(n for n in names if n and n != other.name)),
                    same_as=(*other.same_as, candidate.osm_id),
                )
                break
        else:
            kept.append(candidate)
    return kept


def smallest_first(
    candidates: Iterable[Candidate], *, administrative_first: bool = False
) -> list[Candidate]:
    """Sort by area; around a town the park in its middle is of less interest than its bounds."""
    return sorted(
        candidates,
        key=lambda c: (administrative_first and c.admin_level is None, c.geometry.area),
    )


def nearest_first(candidates: Sequence[Candidate], point: tuple[float, float]) -> list[Candidate]:
    """Sort by distance from a point, keeping the order of those that contain it.

    Parameters
    ----------
    candidates
        In any order.
    point
        Longitude and latitude, degrees.
    """
    # Degrees of longitude shrink towards the poles, and their count begins anew at the meridian.
    shrink = math.cos(math.radians(point[1]))
    turns = (-_TURN, 0.0, _TURN)
    places = shapely.points([((point[0] + turn) * shrink, point[1]) for turn in turns])

    def away(candidate: Candidate) -> float:
        flat = shapely.transform(candidate.geometry, lambda xy: xy * (shrink, 1.0))
        return round(float(shapely.distance(places, flat).min()), 6)

    return sorted(candidates, key=away)


def frame_of(candidates: Sequence[Candidate], **origin: Any) -> gpd.GeoDataFrame:
    """Make the layer of candidates, ranked from 1 in their order.

    Parameters
    ----------
    candidates
        In their order.
    **origin
        Where and of when the data is, for `attrs["osm"]`.

    Returns
    -------
    geopandas.GeoDataFrame
        The columns of `COLUMNS`, in EPSG:4326.
    """
    rows = [
        (
            rank, c.name or None, c.display_name or c.title, c.kind or None, c.admin_level,
            c.osm_id, area_ha(c.geometry), c.match.text, ", ".join(c.same_as) or None,
        )
        for rank, c in enumerate(candidates, 1)
    ]  # fmt: skip
    frame = gpd.GeoDataFrame(
        {name: [row[k] for row in rows] for k, name in enumerate(COLUMNS)},
        geometry=gpd.GeoSeries([c.geometry for c in candidates], crs=WGS84),
        crs=WGS84,
    )
    # Levels stay whole numbers although some are missing.
    frame["admin_level"] = frame["admin_level"].astype("Int64")
    frame.attrs["osm"] = {"attribution": ATTRIBUTION, "licence": LICENCE, **origin}
    return frame


def _hectares(area: float) -> str:
    return f"{area:,.0f} ha" if area >= 1000 else f"{area:.3g} ha"


def tell(frame: gpd.GeoDataFrame, asked: str, progress: Progress) -> None:
    """Say what was found, and warn of what may be a mistake.

    Parameters
    ----------
    frame
        From `frame_of`.
    asked
        What was asked for, in words.
    progress
        Hears it.
    """
    rows = frame.astype({"admin_level": object}).where(frame.notna(), None)
    for row in rows.itertuples():
        parts = [str(row.kind or "area")]
        if row.admin_level is not None:
            parts.append(f"level {row.admin_level}")
        parts += [_hectares(row.area_ha), row.osm_id, row.match]
        progress.info(f"{row.rank}. {row.display_name}: {', '.join(parts)}")
    if len(frame) > 1:
        first = frame.iloc[0]
        progress.warn(
            f"{len(frame)} areas are listed for {asked}, ranked. Rank 1 is "
            f"{first['display_name']} ({first['osm_id']}, {_hectares(first['area_ha'])}): look "
            "whether it is the one you mean, else take another by its rank or its id."
        )
    for row in rows.itertuples():
        state = row.kind == "administrative" and row.admin_level == STATE
        if state or row.area_ha >= REGION:
            progress.warn(
                f"{row.display_name} ({row.osm_id}) is a whole {'state' if state else 'region'} "
                f"of {row.area_ha:,.0f} ha: for streets and buildings choose something smaller, "
                "such as a town or a quarter."
            )
        if crosses_antimeridian(row.geometry):
            progress.warn(
                f"{row.display_name} ({row.osm_id}) lies on both sides of the 180th meridian "
                "and is cut there: use the part on one side only."
            )
