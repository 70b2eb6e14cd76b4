"""Templates warped into blocks: tiling, access, counts, ranking, what stands on parcels."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError
from platwright.measure.parcel_shape import corner_deviation, rectangle_ratio
from platwright.parcels.rules import ParcelRules
from platwright.parcels.templates import (
    Edge,
    Face,
    Template,
    TemplateLibrary,
    repeated,
    scaled,
    shipped_library,
)
from platwright.parcels.templates.mesh import topology
from platwright.parcels.types import Block, Plot
from platwright.parcels.warp import furnish, match_templates
from platwright.parcels.warp.assign import all_ways, kits
from platwright.parcels.warp.batch import Batch
from platwright.parcels.warp.regions import choose_corners, outline
from platwright.progress import Silent
from shapely.geometry import LineString, MultiLineString, Point, Polygon, box

LIBRARY = shipped_library()
RULES = ParcelRules()
LABELS = sorted({t.region_label for t in LIBRARY if t.level < 3})


def match(block, name=None, rules=RULES, **more):
    """Return the matches of one template in one region."""
    if isinstance(block, Polygon):
        block = Block(block)
    if name is not None:
        more.setdefault("region_label", LIBRARY[name].region_label)
    names = None if name is None else [name]
    return match_templates([block], LIBRARY, rules, names=names, **more)[0]


def check_tiling(plots, polygon):
    """Plots fill a polygon: areas, overlaps, outline and vertices, by means of their own."""
    every = np.array([plot.polygon for plot in plots], dtype=object)
    assert shapely.is_valid(every).all()
    assert shapely.area(every).sum() == pytest.approx(polygon.area, rel=1e-6)
    assert shapely.union_all(every, grid_size=1e-6).area == pytest.approx(polygon.area, rel=1e-6)
    points = {tuple(p) for p in shapely.get_coordinates(every)}
    # every vertex of the region is one of a plot, to the last bit
    assert {tuple(p) for p in shapely.get_coordinates(polygon)} <= points
    # no plot reaches out of the region
    assert max(shapely.distance(shapely.points(list(points)), polygon)) < 1e-9
    # every edge is one of the region or shared to the last bit, run through the other way
    edges = {}
    for k, plot in enumerate(every):
        xy = [tuple(p) for p in shapely.orient_polygons(plot).exterior.coords]
        for edge in zip(xy[:-1], xy[1:]):
            assert edge not in edges
            edges[edge] = k
    lone = [edge for edge in edges if edge[::-1] not in edges]
    middles = shapely.line_interpolate_point(shapely.linestrings(lone), 0.5, normalized=True)
    assert shapely.distance(middles, polygon.exterior).max() < 1e-6
    assert sum(LineString(edge).length for edge in lone) == pytest.approx(polygon.length)


def bent(polygon, seed, strength=1.0):
    """Deform a region smoothly, turn and move it."""
    rng = np.random.default_rng(seed)
    centre = np.array(polygon.centroid.coords[0])
    k, shear = rng.uniform(-0.0012, 0.0012, 2) * strength, rng.uniform(-0.08, 0.08) * strength
    size, angle = 1 + rng.uniform(-0.07, 0.07, 2) * strength, rng.uniform(0, 2 * np.pi)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    def move(xy):
        q = (xy - centre) * size
        q = q + np.stack([k[0] * q[:, 1] ** 2 + shear * q[:, 1], k[1] * q[:, 0] ** 2], axis=1)
        return q @ turn.T + rng_offset

    rng_offset = rng.uniform(-1, 1, 2) * 5e5
    return shapely.orient_polygons(shapely.transform(shapely.segmentize(polygon, 12.0), move))


def region_of(template, counts, rules=RULES):
    """Return the outline of a template that was repeated."""
    drawn = repeated(scaled(template, rules.width, rules.depth), counts)
    mesh = topology([face.polygon for face in drawn.faces])
    z = mesh.points[mesh.outline]
    return Polygon(np.stack([z.real, z.imag], axis=1)).simplify(1e-6)


TILING = [t.name for t in LIBRARY if t.level < 3]


@pytest.mark.parametrize("name", TILING)
def test_every_template_fits_the_region_it_was_drawn_for(name):
    """Without any distortion the parcels come out as drawn."""
    template = LIBRARY[name]
    region = region_of(template, {"x": 4, "y": 3})
    block = Block(region)
    if name == "Row":  # its rear must not be a street
        rear = LineString([(0, 30), (72, 30)])
        block = Block(region, MultiLineString([rear]))
    found = match(block, name)
    assert found[0].distance < 0.02
    check_tiling(found[0].plots, region)


@settings(max_examples=40)
@given(
    st.sampled_from(TILING), st.integers(0, 10**6), st.integers(1, 7), st.integers(1, 5),
    st.sampled_from([(18, 30), (12, 26), (22, 35)]),
)  # fmt: skip
def test_bent_regions_are_tiled(name, seed, along, up, size):
    rules = ParcelRules(width=size[0], depth=size[1])
    template = LIBRARY[name]
    counts = {"x": along * (3 if "Town" in name else 1), "y": up}
    region = bent(region_of(template, counts, rules), seed)
    for found in match(region, name, rules):
        check_tiling(found.plots, region)
        assert np.isfinite(found.energy)
        assert found.energy >= 0
        for line in found.streets:
            near = [p.polygon for p in found.plots if p.use in ("street", "lane")]
            assert shapely.union_all(near).buffer(1.0).covers(line)


@settings(max_examples=25)
@given(st.integers(0, 10**6))
def test_any_region_gives_tilings_or_nothing(seed):
    """Star-shaped regions with any corners, convex and concave."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 12))
    angle = 2 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    z = rng.uniform(25, 90, n) * np.exp(1j * angle) * np.array(rng.uniform(0.5, 1.5))
    region = Polygon(np.stack([z.real, z.imag], axis=1))
    if not region.is_valid:
        return
    region = shapely.orient_polygons(region)
    for found in match(region):
        check_tiling(found.plots, region)
        open_ = region.exterior
        ways = [p.polygon for p in found.plots if p.use in ("street", "lane")]
        for plot in found.plots:
            if plot.use == "parcel":
                front = plot.polygon.exterior.intersection(open_.buffer(0.01)).length
                inner = max((plot.polygon.intersection(way).length for way in ways), default=0.0)
                assert front > 3.0 or inner > 3.0


def test_vertices_of_the_region_become_vertices_of_plots():
    """A street front with a vertex in the middle of a parcel, and one 10 cm off a cut."""
    region = Polygon([(0, 0), (9, -0.4), (36.1, -0.2), (72, 0), (72, 60), (0, 60)])
    found = match(region, "Double row")[0]
    check_tiling(found.plots, region)
    assert len(found.plots) == 8
    # the cut ends in the vertex rather than beside it
    assert sum((36.1, -0.2) in list(p.polygon.exterior.coords) for p in found.plots) == 2


@pytest.mark.parametrize(
    ("length", "width", "count"),
    [
        # 100 / 18 = 5.6: six of 16.7 m (factor 1.08) rather than five of 20 m (1.11)
        (100, 18, 6),
        # 81 / 18 = 4.5: four of 20.25 (1.125) are as a factor further off than five of 16.2 (1.11)
        (81, 18, 5),
        (80, 18, 4),
        (18, 18, 1),
        # 100 / 12 = 8.3
        (100, 12, 8),
    ],
)
def test_repeats_choose_their_number(length, width, count):
    rules = ParcelRules(width=width, depth=30)
    found = match(box(0, 0, length, 60), "Double row", rules)[0]
    assert len(found.plots) == 2 * count
    area = [plot.polygon.area for plot in found.plots]
    assert area == pytest.approx([length * 30 / count] * len(area), rel=1e-3)


def test_repeats_out_of_bounds_do_not_fit():
    """One repeat would have 26 m (factor 1.44), two 13 m (0.72, the nearer as a factor)."""
    assert len(match(box(0, 0, 26, 60), "Double row")[0].plots) == 4
    assert match(box(0, 0, 11, 60), "Double row", seed=1) == []


def test_legs_of_an_ell_are_counted_each():
    """Legs of 60 m width, 60 + 7 x 18 m and 60 + 4 x 18 m long."""
    a, b = 60 + 7 * 18, 60 + 4 * 18
    region = Polygon([(0, 0), (a, 0), (a, 60), (60, 60), (60, b), (0, b)])
    found = match(region, "L-block")[0]
    check_tiling(found.plots, region)
    uses = [plot.use for plot in found.plots]
    assert uses.count("parcel") == 4 + 2 * 7 + 2 * 4
    assert uses.count("green") == 1


def test_rows_of_a_curved_block_are_counted_each():
    """Inner radius 66 m, rows of 30 m, a quarter: sides of 104 and 198 m, 151 m in the middle.

    The inner row is (104 + 151) / 2 / 18 = 7.1 parcels long, the outer one 9.7.
    """
    inner, outer = (
        [(r * np.cos(t), r * np.sin(t)) for t in np.linspace(0, np.pi / 2, 40)] for r in (66, 126)
    )
    region = Polygon([*outer, *inner[::-1]])
    found = match(region, "Two rows counted each")[0]
    check_tiling(found.plots, region)
    far = [p.polygon.centroid.distance(Point(0, 0)) > 96 for p in found.plots]
    assert (len(far) - sum(far), sum(far)) == (7, 10)


def test_edges_that_mean_street_do_not_lie_along_closed_land():
    """A single row along the one open side, whichever of the four it is."""
    ring = [(0, 0), (90, 0), (90, 31), (0, 31), (0, 0)]
    region = box(0, 0, 90, 31)
    for k in (0, 2):
        shut = [LineString(ring[j : j + 2]) for j in range(4) if j != k]
        block = Block(region, MultiLineString(shut))
        found = match(block)
        assert {m.template for m in found} == {"Single row"}
        front = LineString(ring[k : k + 2])
        for plot in found[0].plots:
            assert plot.polygon.intersection(front).length > 10
    everything = Block(region, MultiLineString([LineString(ring)]))
    assert match(everything) == []


def test_parcels_without_access_make_no_match():
    """Two rows, but the template does not say what its edges mean: only fronts count."""
    faces = tuple(replace(face) for face in LIBRARY["Double row"].faces)
    library = TemplateLibrary((Template("rows", faces=faces, lot_width=18, lot_depth=30),))
    region = box(0, 0, 90, 60)
    rear = MultiLineString([LineString([(0, 0), (0, 60), (90, 60), (90, 0)])])
    assert match_templates([Block(region)], library, RULES)[0]
    assert match_templates([Block(region, rear)], library, RULES)[0] == []


def test_no_street_means_no_street():
    region = box(0, 0, 90, 30)
    assert match(region, "Row") == []
    rear = MultiLineString([LineString([(0, 30), (90, 30)])])
    assert len(match(Block(region, rear), "Row")[0].plots) == 5


def test_mirror_images_are_used_where_they_may_be():
    """An L-block whose long leg is the other one: only its mirror image would do, were it fixed."""
    template = replace(
        LIBRARY["School"], name="s", region_label="block", faces=LIBRARY["School"].faces
    )
    region = shapely.orient_polygons(
        shapely.transform(
            region_of(template, {}), lambda xy: np.stack([-xy[:, 0], xy[:, 1] + 0.1 * xy[:, 0]], 1)
        )
    )
    with_, without = (
        match_templates([Block(region)], TemplateLibrary((t,)), RULES)[0]
        for t in (template, replace(template, mirror=False))
    )
    assert with_[0].energy <= without[0].energy + 1e-9
    places = {round(p.polygon.centroid.x) for m in with_ for p in m.plots if p.note == "parking"}
    assert min(places) < -65 < max(places) or len(with_) == 1


def test_what_does_not_fit_gives_no_match():
    triangle = Polygon([(0, 0), (80, 0), (40, 70)])
    assert match(triangle, "Double row") == []
    assert match(box(0, 0, 2, 1)) == []
    assert match(box(0, 0, 900, 8)) == []
    assert match_templates([], LIBRARY, RULES) == []
    assert match_templates([Block(box(0, 0, 90, 60))], LIBRARY, RULES, region_label="x") == [[]]
    holed = box(0, 0, 90, 60).difference(box(40, 25, 50, 35))
    assert match(holed) == []
    (park,) = match(holed, "Park")
    assert park.plots == [Plot(holed, "green", "", "Park")]


def test_matches_are_sorted_and_named():
    found = match(box(0, 0, 150, 61))
    energies = [m.energy for m in found]
    assert energies == sorted(energies)
    assert {m.template for m in found} >= {"Double row", "Double row with end caps"}
    for m in found:
        assert all(plot.template for plot in m.plots)
    assert {m.template for m in match(box(0, 0, 150, 61), "Double row")} == {"Double row"}


def test_centre_lines_of_cul_de_sacs_begin_at_the_street():
    region = bent(region_of(LIBRARY["Cul-de-sac"], {"y": 3}), 5)
    found = match(region, "Cul-de-sac")[0]
    (line,) = found.streets
    ends = [region.exterior.distance(p) for p in line.boundary.geoms]
    assert min(ends) < 1e-6
    assert max(ends) > 20
    (street,) = [plot for plot in found.plots if plot.use == "street"]
    assert street.polygon.buffer(0.05).covers(line)
    # the stem keeps its width of 15 m within 1 m, the head its radius of 11 m
    middle = line.interpolate(0.35, normalized=True)
    assert 2 * street.polygon.exterior.distance(middle) == pytest.approx(15, abs=1.0)
    assert shapely.maximum_inscribed_circle(street.polygon).length == pytest.approx(11, abs=0.6)


def test_streets_between_blocks_have_centre_lines():
    region = bent(region_of(LIBRARY["Blocks side by side"], {"x": 3}), 8)
    found = match(region, "Blocks side by side", seed=2)[0]
    check_tiling(found.plots, region)
    across = [line for line in found.streets if line.length > 110]
    assert len(across) == 3


def test_the_same_seed_gives_the_same_and_another_may_not():
    region = region_of(LIBRARY["Blocks side by side"], {"x": 5})
    runs = [match(region, "Blocks side by side", seed=seed)[0] for seed in (1, 1, 2, 3)]
    assert runs[0] == runs[1]
    assert len({tuple(p.template for p in run.plots) for run in runs}) > 1


def test_other_blocks_do_not_change_a_match():
    """Flat arrays of many matches must not leak into each other."""
    regions = [bent(box(0, 0, 60 + 9 * k, 62), k) for k in range(12)]
    together = match_templates([Block(r) for r in regions], LIBRARY, RULES, names=["Double row"])
    for region, found in zip(regions, together):
        alone = match(region, "Double row")
        assert [m.energy for m in alone] == pytest.approx([m.energy for m in found])
        for a, b in zip(alone, found):
            for p, q in zip(a.plots, b.plots):
                assert p.polygon.equals_exact(q.polygon, 1e-6)


def test_rounded_corners_are_corners():
    region = box(0, 0, 120, 60).buffer(-6).buffer(6, quad_segs=4)
    found = outline(Block(region))
    corners = choose_corners(found, 4, 0)
    assert corners is not None
    assert len(match(region, "Double row")[0].plots) == 14


def test_closed_lines_may_end_in_the_middle_of_an_edge():
    """The lower side is closed from x = 50 to 90 m, and the upper one from 20 to 30 m."""
    shut = MultiLineString([[(50, 0), (90, 0)], [(30, 60), (20, 60)]])
    region = outline(Block(box(0, 0, 90, 60), shut))
    start = region.at[:-1][region.points == 0][0]  # box begins at its lower right
    whole = region.at[-1]

    def closed(a, b):
        ends = [(start + x) % whole for x in (a, b)]
        return np.diff(np.interp(ends, region.at, region.shut))[0] % region.shut[-1]

    assert region.shut[-1] == pytest.approx(50)
    assert closed(0, 49.9) == pytest.approx(0, abs=1e-6)
    assert closed(60, 70) == pytest.approx(10)
    assert closed(150.1, 209.9) == pytest.approx(0, abs=1e-6)
    assert closed(212, 218) == pytest.approx(6)
    found = match(Block(box(0, 0, 90, 60), shut), "Apartment court")
    assert found == []


def test_corners_can_be_told():
    region = box(0, 0, 90, 60)
    marked = outline(Block(region), [(Point(0, 0), "regular")])
    assert choose_corners(marked, 4, 0) is None
    assert choose_corners(marked, 3, 0).tolist() == [
        k for k, xy in enumerate(region.exterior.coords[:-1]) if xy != (0, 0)
    ]
    bow = Polygon([(0, 0), (45, -4), (90, 0), (90, 60), (0, 60)])
    assert choose_corners(outline(Block(bow)), 5, 0) is None
    assert choose_corners(outline(Block(bow), [(Point(45, -4), "convex")]), 5, 0) is not None


class Stopped(Silent):
    def cancelled(self) -> bool:
        return True


def test_cancel():
    with pytest.raises(CancelledError):
        match_templates([Block(box(0, 0, 90, 60))], LIBRARY, RULES, progress=Stopped())
    with pytest.raises(CancelledError):
        furnish([Plot(box(0, 0, 18, 30))], LIBRARY, RULES, progress=Stopped())


def quads(length, height, count, seed=1):
    """Give random quads with bowed long sides: corners off by 4 m, bows up to 12 m."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        size = length * rng.uniform(0.9, 1.15), height * rng.uniform(0.9, 1.12)
        x = np.linspace(0, size[0], 15)
        bow = rng.uniform(-12, 12) * np.sin(np.pi * x / size[0])
        xy = np.concatenate(
            [np.stack([x, bow], 1), np.stack([x, size[1] + bow * rng.uniform(0.6, 1.4)], 1)[::-1]]
        )
        u, v = xy[:, 0] / size[0], np.repeat([0.0, 1.0], 15)
        corner = rng.normal(0, 4, (4, 2))
        parts = [(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v]
        xy = xy + sum(w[:, None] * c for w, c in zip(parts, corner))
        polygon = Polygon(xy)
        if polygon.is_valid:
            found.append(Block(polygon))
    return found


def distances(name, blocks, iterations):
    made = {name: kits(LIBRARY[name], RULES)}
    ways = [all_ways(made, outline(block)) for block in blocks]
    tasks = [found[0][2] for found in ways if found]
    return Batch(tasks, 0.45, 2.2).run(iterations).energy(tasks)


def test_warping_beats_the_initial_map():
    """UP Fig. 6: 1.99 m by mean value coordinates, 1.20 m warped, -40 %."""
    blocks = quads(144, 60, 60)
    before, after = (distances("Double row", blocks, n) for n in (0, 30))
    assert len(after) >= 58
    assert after.mean() < 0.6 * before.mean()
    blocks = quads(75, 83, 60)
    before, after = (distances("Cul-de-sac", blocks, n) for n in (0, 30))
    assert after.mean() < 0.9 * before.mean()


def test_double_rows_in_random_quads_are_good():
    blocks = quads(144, 60, 120)
    found = match_templates(blocks, LIBRARY, RULES, names=["Double row"])
    plots = np.array([p.polygon for m in found if m for p in m[0].plots], dtype=object)
    assert len(plots) > 1700
    assert corner_deviation(plots).mean() <= 2.4
    assert rectangle_ratio(plots).mean() <= 1.055


@pytest.mark.slow
def test_a_thousand_matches_a_second_on_one_core():
    """Measured in time of the processor; a quarter of it on a busy machine is still a pass."""
    blocks = quads(75, 83, 300)
    match_templates(blocks[:3], LIBRARY, RULES, names=["Cul-de-sac"])
    start = time.process_time()
    found = match_templates(blocks, LIBRARY, RULES, names=["Cul-de-sac"])
    rate = sum(map(len, found)) / (time.process_time() - start)
    assert rate > 250


# what stands on parcels


def row(count, use="parcel"):
    return [Plot(box(18 * k, 0, 18 * k + 18, 30), use) for k in range(count)]


def test_houses_stand_on_parcels():
    plots = row(6)
    behind = Plot(box(0, 30, 108, 40), "green")
    found = furnish([*plots, behind], LIBRARY, RULES, seed=4)
    assert {thing.parcel for thing in found} == set(range(6))
    for k, plot in enumerate(plots):
        own = [thing for thing in found if thing.parcel == k]
        check_tiling([Plot(thing.polygon) for thing in own], plot.polygon)
        (house,) = [thing for thing in own if thing.label == "house"]
        # as drawn: 10.5 x 11 m, 6 m behind the street, which is at y = 0
        assert house.polygon.area == pytest.approx(10.5 * 11, rel=0.02)
        assert house.polygon.bounds[1] == pytest.approx(6, abs=0.2)
        drive = next(thing for thing in own if thing.label == "driveway")
        assert drive.polygon.bounds[1] == pytest.approx(0, abs=1e-9)


def test_fronts():
    """A lane behind: the front is the street; with a closed outside the lane; else no house."""
    parcel = Plot(box(0, 0, 18, 30))
    sides = [Plot(box(-18, 0, 0, 30), "green"), Plot(box(18, 0, 36, 30), "green")]
    lane = Plot(box(-18, 30, 36, 36), "lane")

    def house(plots, **more):
        found = furnish(plots, LIBRARY, RULES, seed=1, **more)
        return [thing.polygon.centroid.y for thing in found if thing.label == "house"]

    assert house([parcel, *sides, lane]) == pytest.approx([11.5], abs=0.3)
    shut = LineString([(-18, 0), (36, 0)])
    assert house([parcel, *sides, lane], closed=shut) == pytest.approx([18.5], abs=0.3)
    assert house([parcel, *sides, replace(lane, use="street")]) == pytest.approx([18.5], abs=0.3)
    assert house([parcel, *sides, replace(lane, use="court")], closed=shut) == []


def test_furnishing_is_repeatable_and_leaves_out_what_has_no_room():
    plots = [*row(8), Plot(box(200, 0, 203, 5)), Plot(Point(300, 0).buffer(15)), Plot(HOLED)]
    first, again, other = (furnish(plots, LIBRARY, RULES, seed=s) for s in (1, 1, 2))
    assert first == again
    assert [thing.template for thing in first] != [thing.template for thing in other]
    assert {thing.parcel for thing in first} == set(range(8))
    assert furnish([], LIBRARY, RULES) == []
    assert furnish(row(3, "green"), LIBRARY, RULES) == []


HOLED = box(400, 0, 418, 30).difference(box(405, 10, 408, 12))


def test_alignments_hold_in_the_result():
    """Faces whose common edge is told to stay straight, and one that is told to stay a circle."""
    faces = (
        Face(box(0, 0, 30, 20)), Face(box(30, 0, 60, 20)),
        Face(box(0, 20, 30, 40)), Face(box(30, 20, 60, 40)),
    )  # fmt: skip
    line = Edge(LineString([(0, 20), (60, 20)]), "straight")
    plain = Template("plain", faces=faces)
    library = TemplateLibrary((plain, replace(plain, name="straight", edges=(line,))))
    region = shapely.transform(
        shapely.segmentize(box(0, 0, 60, 40), 5),
        lambda xy: np.stack([xy[:, 0], xy[:, 1] + 0.006 * (xy[:, 0] - 30) ** 2], 1),
    )
    region = shapely.orient_polygons(region)
    off = {}
    for name in ("plain", "straight"):
        found = match_templates([Block(region)], library, RULES, names=[name])[0][0]
        check_tiling(found.plots, region)
        inner = shapely.get_coordinates([p.polygon for p in found.plots])
        # the vertex that all four share, against the ends of the two cuts beside it
        points, count = np.unique(inner[:], axis=0, return_counts=True)
        middle = points[count >= 4][0]
        ends = [
            p for p, c in zip(points, count)
            if c == 2 and abs(p[1] - middle[1]) < 12 and min(abs(p[0]), abs(p[0] - 60)) < 1
        ]  # fmt: skip
        off[name] = max(e[1] for e in ends) - middle[1]
    assert off["straight"] <= off["plain"] + 1e-9
