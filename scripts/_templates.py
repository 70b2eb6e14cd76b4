"""The drawings of the shipped library of templates: coordinates in metres, lots of 18 x 30 m."""

from __future__ import annotations

import math
from typing import Any

from platwright.parcels.templates import Edge, Face, Template
from shapely.geometry import Polygon, box

from _template_drawing import HEAD, LANE, LOT, STREET, THROAT, D, Pairs, W, land, line, lot, street
from _templates_other import areas, others, parcels


def rows() -> list[Template]:
    """Draw rows of parcels."""
    more = {"repeat": "x"}
    single = [lot(box(0, 0, W, D), **more)]
    double = [lot(box(0, 0, W, D), **more), lot(box(0, D, W, 2 * D), **more)]
    both = [line("street", (0, 0), (W, 0)), line("street", (0, 2 * D), (W, 2 * D))]
    cap = 20.0
    west = [lot(box(0, k * cap, D, (k + 1) * cap), 90.0) for k in range(3)]
    middle = [lot(box(D, y, D + W, y + D), **more) for y in (0, D)]
    east = [lot(box(D + W, k * cap, 2 * D + W, (k + 1) * cap), 90.0) for k in range(3)]
    length = 2 * D + W
    sides = [line("street", (0, y), (length, y)) for y in (0, 2 * D)]
    ends = [line("street", (x, 0), (x, 2 * D)) for x in (0, length)]
    one = D + W
    return [
        Template(
            "Single row", 2, "block", tuple(single), (line("street", (0, 0), (W, 0)),), **LOT,
            description="One row of parcels along a street; anything behind it.",
        ),
        Template(
            "Double row", 2, "block", tuple(double), tuple(both), **LOT,
            description="Two rows back to back between two streets.",
        ),
        Template(
            "Double row with end caps", 2, "block", (*west, *middle, *east), (*sides, *ends), **LOT,
            description="Two rows back to back; at both ends three parcels face the side street.",
        ),
        Template(
            "Double row with one end cap", 2, "block", (*west, *middle),
            (line("street", (0, 0), (one, 0)), line("street", (0, 2 * D), (one, 2 * D)),
             line("street", (0, 0), (0, 2 * D))), mirror=True, **LOT,
            description="Two rows back to back; at one end three parcels face the side street.",
        ),
        Template(
            "Two rows counted each", 2, "block",
            tuple(Face(box(0, y, W, y + D), "row", width_min=0.4, width_max=2.0, depth_min=0.7,
                       depth_max=1.5, **more) for y in (0, D)),
            tuple(both),
            probability=0.5, **LOT,
            description="Two rows whose numbers of parcels are chosen each by itself: for blocks "
            "on curves, where the outer row is longer.",
        ),
        Template(
            "Row", 2, "row", tuple(single),
            (line("street", (0, 0), (W, 0)), line("no street", (0, D), (W, D))), **LOT,
            description="A row inside another template.",
        ),
    ]  # fmt: skip


def _head(x: float, y: float, start: float, end: float) -> list[tuple[float, float]]:
    """Give points of a turning head, 15 degrees apart."""
    steps = round(abs(end - start) / 15.0)
    angles = [math.radians(start + (end - start) * k / steps) for k in range(steps + 1)]
    return [(x + HEAD * math.cos(a), y + HEAD * math.sin(a)) for a in angles]


def _spike(left: float) -> tuple[list[Face], list[Edge], float]:
    """Draw a cul-de-sac and its lots, the left edge at x; the height is returned, too."""
    x0, x1 = left + D, left + D + STREET
    right, mid = x1 + D, left + D + STREET / 2
    neck, rear = 20.0, 27.0
    low = W
    yc = low + neck
    top = yc + rear
    # the throat: a curve that leaves the edge of the stem and runs into the head
    half = STREET / 2
    drop = math.sqrt((HEAD + THROAT) ** 2 - (half + THROAT) ** 2)
    yn = yc - drop
    open_ = math.degrees(math.atan2(drop, half + THROAT))
    steps = math.ceil(open_ / 15.0) + 1
    bend = [math.radians(180.0 - open_ * k / steps) for k in range(steps)]
    throat = [(half + THROAT + THROAT * math.cos(a), yn + THROAT * math.sin(a)) for a in bend]
    side = [(x + mid, y) for x, y in throat] + _head(mid, yc, -open_, 0.0)
    other = [(2 * mid - x, y) for x, y in side]
    north_east = _head(mid, yc, 0.0, 90.0)
    north_west = _head(mid, yc, 180.0, 90.0)
    wide: dict[str, Any] = {"width_min": 0.7, "width_max": 1.4, "depth_min": 0.7, "depth_max": 1.3}
    more: dict[str, Any] = {"repeat": "y"}
    circle = [*side[len(throat) :], *north_east[1:], *north_west[::-1][1:]]
    circle += other[len(throat) : -1][::-1]
    faces = [
        lot(box(left, 0, x0, low), 90.0, **more),
        lot(box(x1, 0, right, low), 90.0, **more),
        street(box(x0, 0, x1, low), 0.0, **more),
        street(box(x0, low, x1, yn), 0.0, depth_min=0.6, depth_max=1.4),
        lot([(left, low), (x0, low), *other, (left, yc)], 90.0, **wide),
        lot([(right, low), (x1, low), *side, (right, yc)], 90.0, **wide),
        lot([(left, yc), *north_west, (mid, top), (left, top)], **wide),
        lot([(right, yc), *north_east, (mid, top), (right, top)], **wide),
        Face(
            Polygon([*side, *north_east[1:], *north_west[::-1][1:], *other[:-1][::-1]]),
            "street", "rigid", tolerance=0.2,
        ),
    ]  # fmt: skip
    edges = [
        line("circle", *circle),
        line("street", (x0, 0), (x1, 0)),
        line("centre", (mid, 0), (mid, low), (mid, yn), (mid, yc)),
    ]
    return faces, edges, top


def spikes() -> list[Template]:
    """Draw cul-de-sacs."""
    faces, edges, top = _spike(0.0)
    inner, inner_edges, _ = _spike(D)
    width = 4 * D + STREET
    neck = [0.0, W, W + 20.0, top]
    strips = []
    for k, (a, b) in enumerate(zip(neck[:-1], neck[1:])):
        more = {"repeat": "y"} if k == 0 else {}
        strips += [
            lot(box(0, a, D, b), 90.0, **more),
            lot(box(width - D, a, width, b), 90.0, **more),
        ]
    outer = [line("street", (x, 0), (x, top)) for x in (0.0, width)]
    return [
        Template(
            "Cul-de-sac", 2, "block", tuple(faces), tuple(edges), **LOT,
            description="Parcels round a street that ends in a turning head; anything beside it.",
        ),
        Template(
            "Cul-de-sac with side rows", 2, "block", (*inner, *strips), (*inner_edges, *outer),
            **LOT,
            description="A cul-de-sac between two rows that face the streets on either side.",
        ),
    ]  # fmt: skip


def wedge() -> Template:
    """Draw a triangle: a green in the tip, lots at right angles to its long sides."""
    half = math.radians(13.0)
    along, inward = (math.sin(half), math.cos(half)), (-math.cos(half), math.sin(half))

    def on(s: float) -> tuple[float, float]:
        return (s * along[0], s * along[1])

    def middle(s: float) -> tuple[float, float]:
        # the last cut leans towards the base, so that the lots on both sides of it share the skew
        lean = 0.4 if s == stops[-1] else 1.0
        return (0.0, on(s)[1] + lean * s * along[0] / -inward[0] * inward[1])

    def mirrored(shape: Pairs) -> Pairs:
        return [(-x, y) for x, y in shape]

    stops = [66.0, 84.0, 102.0, 118.0]
    base = 147.0 * math.cos(half)
    corner = 147.0 * math.sin(half)
    axis = math.degrees(math.atan2(along[1], along[0]))
    more: dict[str, Any] = {"width_min": 0.6, "width_max": 1.5, "depth_min": 0.6, "depth_max": 1.4}
    faces = [land([(0, 0), on(stops[0]), middle(stops[0]), mirrored([on(stops[0])])[0]], "green")]
    for a, b in zip(stops[:-1], stops[1:]):
        shape = [on(a), on(b), middle(b), middle(a)]
        faces += [lot(shape, axis, **more), lot(mirrored(shape), 180.0 - axis, **more)]
    last = [on(stops[-1]), (corner, base), (0.0, base), middle(stops[-1])]
    faces += [lot(last, axis, **more), lot(mirrored(last), 180.0 - axis, **more)]
    sides = [
        line("street", (0, 0), (corner, base)),
        line("street", (0, 0), (-corner, base)),
        line("straight", middle(stops[0]), (0.0, base)),
    ]
    return Template(
        "Wedge", 2, "block", tuple(faces), tuple(sides), **LOT,
        description="A pointed block between two streets: a green in the tip, then parcels at "
        "right angles to the streets.",
    )  # fmt: skip


def pentagon() -> Template:
    """Draw a pentagon whose parcels surround a private park."""
    side, count = 100.0, 5
    radius = side / 2 / math.sin(math.pi / count)
    inner = radius - D / math.cos(math.pi / count)

    def corner(k: int, r: float) -> complex:
        angle = math.radians(-90.0 - 36.0 + 72.0 * k)
        return r * complex(math.cos(angle), math.sin(angle))

    def pairs(*points: complex) -> Pairs:
        return [(z.real, z.imag) for z in points]

    faces = [land(pairs(*[corner(k, inner) for k in range(count)]), "green", tolerance=2.0)]
    for k in range(count):
        a, b = corner(k, radius), corner(k + 1, radius)
        c, d = corner(k, inner), corner(k + 1, inner)
        along = (b - a) / side
        foot = a + ((c - a) * along.conjugate()).real * along
        length = abs(d - c)
        stops = [length * j / 3 for j in range(4)]
        axis = math.degrees(math.atan2(along.imag, along.real))
        for s, t in zip(stops[:-1], stops[1:]):
            shape = pairs(foot + s * along, foot + t * along, c + t * along, c + s * along)
            faces.append(lot(shape, axis))
        before = corner(k - 1, radius)
        back = (before - a) / side
        other = a + ((c - a) * back.conjugate()).real * back
        faces.append(lot(pairs(a, foot, c, other), axis))
    ring = pairs(*[corner(k, radius) for k in (*range(count), 0)])
    return Template(
        "Pentagon with a private park", 2, "block", tuple(faces), (line("street", *ring),), **LOT,
        description="Parcels all around, facing outwards, and a park in the middle that belongs "
        "to them.",
    )  # fmt: skip


def ell() -> Template:
    """Draw a block round a corner: two legs of two rows each."""
    e, half = 2 * D, D
    right, top = e + W, e + W
    x, y = {"repeat": "x"}, {"repeat": "y"}
    faces = [
        *(lot(box(20.0 * k, 0, 20.0 * (k + 1), half)) for k in range(3)),
        lot(box(0, half, half, e), 90.0, width_min=0.4),
        land(box(half, half, e, e), "green", tolerance=2.0),
        lot(box(e, 0, right, half), **x), lot(box(e, half, right, e), **x),
        lot(box(0, e, half, top), 90.0, **y), lot(box(half, e, e, top), 90.0, **y),
    ]  # fmt: skip
    streets = [
        line("street", (0, top), (0, 0), (right, 0)),
        line("street", (right, e), (e, e), (e, top)),
    ]
    return Template(
        "L-block", 2, "block", tuple(faces), tuple(streets), mirror=True, **LOT,
        description="Two double rows that meet at a corner; a pocket park where no street reaches.",
    )  # fmt: skip


def townhouses() -> Template:
    """Draw two rows of townhouses with a lane between their gardens."""
    width, depth = 6.0, 27.0
    more: dict[str, Any] = {"repeat": "x", "depth_min": 0.7, "depth_max": 1.4}
    top = 2 * depth + LANE
    faces = [
        lot(box(0, 0, width, depth), **more),
        lot(box(0, depth + LANE, width, top), **more),
        street(box(0, depth, width, depth + LANE), 90.0, "lane", repeat="x"),
    ]
    edges = [
        line("street", (0, 0), (width, 0)), line("street", (0, top), (width, top)),
        line("street", (0, depth), (0, depth + LANE)),
        line("street", (width, depth), (width, depth + LANE)),
        line("centre", (0, depth + LANE / 2), (width, depth + LANE / 2)),
    ]  # fmt: skip
    return Template(
        "Townhouses with a rear lane", 2, "block", tuple(faces), tuple(edges),
        probability=0.3, **LOT,
        description="Townhouses a third of a parcel wide on both sides; a lane behind them.",
    )  # fmt: skip


def apartments() -> Template:
    """Draw plots of apartment houses round a court."""
    width, height, depth, cut = 90.0, 72.0, 18.0, 30.0
    faces = [land(box(depth, depth, width - depth, height - depth), "court", tolerance=2.0)]
    for y in (0.0, height - depth):
        faces += [lot(box(k * cut, y, (k + 1) * cut, y + depth)) for k in range(3)]
    for x in (0.0, width - depth):
        faces.append(lot(box(x, depth, x + depth, height - depth), 90.0))
    ring = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height), (0.0, 0.0)]
    return Template(
        "Apartment court", 2, "block", tuple(faces), (line("street", *ring),),
        probability=0.2, **LOT,
        description="Eight plots of apartment houses round a shared court.",
    )  # fmt: skip


def drawings() -> list[Template]:
    """Draw them all."""
    return [
        *rows(), *spikes(), wedge(), pentagon(), ell(), townhouses(), apartments(), *others(),
        *areas(), *parcels(),
    ]  # fmt: skip
