"""What must not move when streets are smoothed, and what may only slide.

Existing streets, the points that the planner fixes and dead ends keep their place. Where a
street ends at the edge of the site its end slides along that (design notes, section 7).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import shapely

from ..network.problem import BoolArray, FloatArray
from .angles import leg_directions, legs_at
from .smooth_graph import StreetNet

#: A street end this near to the edge of the site lies on it (metres).
ON_EDGE = 1.0
#: The edge of the site is straight where it strays less than this (metres).
STRAIGHT = 0.01
#: Share of a straight piece, at each of its ends, that stays free of sliding ends.
MARGIN = 0.05
#: An end whose cosine with the square to the edge is above this should be square (about 40
#: degrees off).
NEARLY_SQUARE = 0.77
#: A roundabout fills this share of the circle around it, whose radius is at most the second
#: figure (metres).
ROUND, ROUND_RADIUS = 0.85, 40.0
#: Pieces of the edge of the site are shorter than this only in curves (metres).
SHORT = 2.0


@dataclass(frozen=True, eq=False)
class Anchors:
    """What holds the streets.

    Attributes
    ----------
    held
        Shape (e,). Edges that keep their course.
    fixed
        Shape (n,). Nodes that keep their place.
    rails
        Node -> the two ends (2, 2) of the straight piece along which it slides, metres.
    tangents
        Node -> unit vector in which its one leg leaves, to be kept.
    ground
        The site, whose inside alone may change; None where there is none.
    """

    held: BoolArray
    fixed: BoolArray
    rails: dict[int, FloatArray] = field(default_factory=dict)
    tangents: dict[int, FloatArray] = field(default_factory=dict)
    ground: shapely.Geometry | None = None

    def outside(self, xy: FloatArray) -> BoolArray:
        """Tell which positions are not inside the site, shape (k,); nowhere without one."""
        if self._inner is None or not len(xy):
            return np.zeros(len(xy), dtype=bool)
        return ~np.asarray(shapely.contains_xy(self._inner, xy))

    @cached_property
    def _inner(self) -> shapely.Geometry | None:
        """The site without its edge."""
        if self.ground is None:
            return None
        inner = self.ground.buffer(-ON_EDGE / 2)
        shapely.prepare(inner)
        return inner


def find_anchors(
    net: StreetNet,
    held: BoolArray,
    *,
    site: shapely.Geometry | None = None,
    slide: bool = True,
) -> Anchors:
    """Find what holds a network.

    Parameters
    ----------
    net
        The streets; its marks are nodes to be fixed.
    held
        Shape (e,). Edges that keep their course, such as existing streets.
    site
        The site. Streets outside it, and along its edge, stay where they are.
    slide
        Whether ends may slide along the edge of the site.

    Returns
    -------
    Anchors
        All of it.
    """
    held = held | roundabouts(net)
    fixed = np.zeros(len(net.nodes), dtype=bool)
    fixed[net.ends[held].ravel()] = True
    degree = net.degrees
    ends = degree == 1
    fixed |= ends
    bare = Anchors(held, fixed, ground=site)
    fixed |= bare.outside(net.nodes)
    marked = np.zeros(len(net.nodes), dtype=bool)
    marked[net.marks[net.marks >= 0]] = True
    rails: dict[int, FloatArray] = {}
    if slide and site is not None and not site.is_empty:
        of_held = np.zeros(len(net.nodes), dtype=bool)
        of_held[net.ends[held].ravel()] = True
        rails = _edge_rails(net, site, ends & ~marked & ~of_held)
    away = leg_directions(net.lines) if len(net.lines) else np.zeros((0, 2))
    at = legs_at(net)
    tangents = {v: away[at[v][0]] for v in np.flatnonzero(marked & ends).tolist()}
    tangents |= _square_ends(away, {v: at[v][0] for v in rails}, rails)
    fixed |= marked
    fixed[list(rails)] = False
    return Anchors(held, fixed, rails, tangents, site)


def roundabouts(net: StreetNet) -> BoolArray:
    """Tell which edges are of small round rings, shape (e,).

    As the streets that meet there run straight on, half a roundabout each, they would pull it
    flat.
    """
    found = np.zeros(len(net.lines), dtype=bool)
    faces = shapely.get_parts(shapely.polygonize(net.lines))
    radius = shapely.minimum_bounding_radius(faces)
    round_ = (radius < ROUND_RADIUS) & (shapely.area(faces) > ROUND * np.pi * radius**2)
    if round_.any():
        rings = shapely.buffer(shapely.boundary(faces[round_]), STRAIGHT)
        edge, _ = shapely.STRtree(rings).query(net.lines, predicate="covered_by")
        found[edge] = True
    return found


def _edge_rails(
    net: StreetNet, site: shapely.Geometry, candidates: BoolArray
) -> dict[int, FloatArray]:
    """Straight pieces of the edge of the site at which streets end."""
    which = np.flatnonzero(candidates)
    if not len(which):
        return {}
    rings = shapely.get_parts(shapely.boundary(shapely.simplify(site, STRAIGHT)))
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    same = np.flatnonzero(ring[1:] == ring[:-1])
    a, b = xy[same], xy[same + 1]
    long = np.hypot(*(b - a).T) >= SHORT
    pieces = np.stack([a[long], b[long]], axis=1)
    if not len(pieces):
        return {}
    tree = shapely.STRtree(shapely.linestrings(pieces))
    k, piece = tree.query_nearest(
        shapely.points(net.nodes[which]), max_distance=ON_EDGE, all_matches=False
    )
    return {int(v): _shrunk(*pieces[p]) for v, p in zip(which[k].tolist(), piece.tolist())}


def _square_ends(
    away: FloatArray, legs: dict[int, int], rails: dict[int, FloatArray]
) -> dict[int, FloatArray]:
    """Directions of ends at the edge of the site: square to it, where they nearly are."""
    found = {}
    for v, leg in legs.items():
        along = rails[v][1] - rails[v][0]
        normal = np.array([-along[1], along[0]]) / (np.hypot(*along) or 1.0)
        lean = float(normal @ away[leg])
        if abs(lean) > NEARLY_SQUARE:
            found[v] = normal if lean > 0 else -normal
    return found


def _shrunk(a: FloatArray, b: FloatArray) -> FloatArray:
    """Take a margin off both ends of a straight piece."""
    step = MARGIN * (b - a)
    return np.array([a + step, b - step])
