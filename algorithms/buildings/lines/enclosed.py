"""Enclosed pattern: buildings along the edge of the patch, a courtyard in the middle."""

from __future__ import annotations

from shapely.geometry import Polygon

from .draft import Draft
from .need import Need, turn_between
from .sides import beside, middle_of, outward_azimuth, sides_of


def enclosed_lines(need: Need) -> list[Draft]:
    """Draw lines along the edge of a patch, façades parallel to it (RZ Table 3, enclosed).

    The balconies of a side look out or into the courtyard, whichever is nearer to the equator;
    of two that are alike, into the courtyard, so that the shadow falls on the street. Deep
    patches get further rings, at the spacing of the sun.

    Parameters
    ----------
    need
        The patch and what is asked of it.

    Returns
    -------
    list of Draft
        Ring by ring from outside.
    """
    drafts: list[Draft] = []
    spacing = float(need.pitch.max())
    for part in need.parts:
        _, radius = middle_of(part)
        depth, rank = need.deepest / 2, 0
        while rank == 0 or radius >= depth + need.deepest / 2 + spacing / 2:
            drafts += ring_lines(need, part, depth, rank)
            depth, rank = depth + spacing + need.deepest / 2, rank + 1
    return drafts


def ring_lines(need: Need, part: Polygon, depth: float, rank: int) -> list[Draft]:
    """Draw the lines at a depth inside a piece of ground, façades parallel to its edge."""
    found: list[Draft] = []
    whole = Polygon(part.exterior)
    for inner in getattr(shape := whole.buffer(-depth, join_style="mitre"), "geoms", [shape]):
        for side in sides_of(inner.exterior):
            out = outward_azimuth(side)
            inwards = (out + 180.0) % 360.0
            sun = wished_azimuth(need)
            better = turn_between(out, sun) < turn_between(inwards, sun) - 1.0
            found += beside(need, side, out if better else inwards, rank)
    return found


def wished_azimuth(need: Need) -> float:
    """Give the azimuth that balconies should look to: wished for the patch, or of the equator."""
    wish = need.patch.facing_deg
    return need.zone.equator_deg if wish is None else wish
