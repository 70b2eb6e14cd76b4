"""The ground of a residential zone: corridors, patches, and the lines that buildings follow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, Polygon

from .types import DIRECT, RESIDENCE, ROWS


@dataclass(frozen=True)
class Corridor:
    """A street that cuts the zone into patches or runs along its edge (RZ's upper grade of road).

    Attributes
    ----------
    line
        Centre line, working CRS, metres.
    width_m
        From property line to property line, metres.
    level
        Level of the street (`algorithms/levels.py`).
    name
        Name, empty where unknown.
    edge
        True for an existing street along the edge of the zone, outside of it.
    """

    line: LineString
    width_m: float
    level: int
    name: str = ""
    edge: bool = False


@dataclass(frozen=True)
class Patch:
    """Ground between corridors, planned in one pattern.

    Attributes
    ----------
    polygon
        The ground without street space and without obstacles; may have holes.
    access
        The parts of its ring that border on street space: where paths may end (exits of RZ).
    residences, facilities
        Building patterns of the two uses, 0 to 5 (`BUILDING_PATTERNS`); 0 leaves that use out.
    paths
        Path pattern, 1 to 3 (`PATH_PATTERNS`).
    path_direction
        1 or 0: same or opposite, inside or outside (RZ Table 3).
    facing_deg
        Wished azimuth of the balconies, degrees clockwise from grid north; None for the side of
        the equator.
    feature
        Id of the patch feature that this came from, None where corridors made it.
    """

    polygon: Polygon
    access: MultiLineString
    residences: int = ROWS
    facilities: int = ROWS
    paths: int = DIRECT
    path_direction: int = 1
    facing_deg: float | None = None
    feature: int | str | None = None


@dataclass(frozen=True)
class Zone:
    """A residential zone, ready for buildings.

    Attributes
    ----------
    name, feature, site_id
        How messages and layers call it, as of `site.Site`.
    polygon
        The whole zone, working CRS, metres: FAR and densities refer to its area.
    crs, source_crs
        Working CRS and the CRS of the input.
    latitude, longitude
        Of its centroid, degrees (north and east positive).
    convergence_deg
        Azimuth of grid north seen from true north, degrees clockwise: true azimuth = grid
        azimuth + convergence.
    corridors
        Streets inside and along the edge.
    patches
        Ground between them; may be empty where nothing is left.
    obstacles
        What nothing may be built on.
    """

    name: str
    feature: int | str
    polygon: Polygon
    crs: CRS
    source_crs: CRS
    latitude: float
    longitude: float
    convergence_deg: float
    corridors: Sequence[Corridor]
    patches: Sequence[Patch]
    obstacles: Sequence[Polygon] = ()
    site_id: int = 1

    @property
    def equator_deg(self) -> float:
        """Grid azimuth of the equator's side, degrees: south on the northern hemisphere."""
        true = 180.0 if self.latitude >= 0 else 0.0
        return (true - self.convergence_deg) % 360.0


@dataclass(frozen=True)
class ControlLine:
    """A straight line along which buildings of a pattern stand (RZ section 3.2).

    Lines of a patch form a tree: leaves carry buildings, the others say how paths run.

    Attributes
    ----------
    start, end
        Ends, metres. Centres of buildings lie on the line.
    facing_deg
        Azimuth of the balconies of buildings on it, degrees clockwise from grid north. Façades
        need not be parallel to the line (towers in a ring all face the sun); where they are
        (`along`), neighbours may border upon each other.
    patch
        Index of the patch.
    use
        "residence" or "facility".
    parent
        Index of its parent in the list of lines, -1 for a root.
    leaf
        Whether buildings stand on it.
    spacing_m
        Least distance between centres along the line, 0 for no wish (dotted towers).
    order
        Placement order: smaller first.
    mirror
        Index of the line that mirrors it in a symmetrical pattern, -1 for none. Position
        t of this line (from its start) is that of t on the other.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    facing_deg: float
    patch: int
    use: str = RESIDENCE
    parent: int = -1
    leaf: bool = True
    spacing_m: float = 0.0
    order: int = 0
    mirror: int = -1

    @property
    def length(self) -> float:
        """Length, metres."""
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]))

    @property
    def along(self) -> bool:
        """Tell whether façades are parallel to the line, so that neighbours can touch."""
        bearing = np.degrees(np.arctan2(self.end[0] - self.start[0], self.end[1] - self.start[1]))
        turn = (bearing - self.facing_deg) % 180.0
        return bool(abs(turn - 90.0) < 0.01)
