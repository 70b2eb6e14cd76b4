"""The stages of the mesher, one by one, on shapes with known answers."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from platwright.mesh.build import Row, build_draft, plan_rows
from platwright.mesh.cells import fill_lattice
from platwright.mesh.clean import clean_site, polygons_of
from platwright.mesh.directions import Labels, alternatives, label_ring, label_table, main_axis
from platwright.mesh.facing import find_facing
from platwright.mesh.foreign import foreign_edges
from platwright.mesh.grids import grid
from platwright.mesh.lattice import LatticeRing, _Program, _size_cost, solve_lattice
from platwright.mesh.overlap import overlap_cuts
from platwright.mesh.relax import Smoother, line_triples
from platwright.mesh.rings import Ring, find_corners, place_stations, polygon_rings

NOWHERE = np.zeros((0, 2))
NONE = np.zeros(0, dtype=int)
L_SHAPE = shapely.Polygon([(0, 0), (400, 0), (400, 200), (200, 200), (200, 400), (0, 400)])


def labelled(polygon, h, weight=(0.2, 0.05)):
    rings = polygon_rings(polygon)
    stations, _ = place_stations(rings, h, NOWHERE, NONE)
    axis = main_axis(rings)
    tables = [
        label_table(ring, marks, h, axis, outer=i == 0)
        for i, (ring, marks) in enumerate(zip(rings, stations))
    ]
    labels = [label_ring(table, [weight])[0][1] for table in tables]
    return rings, stations, tables, labels


# ---------------------------------------------------------------- rings
def test_ring_by_arc_length():
    ring = Ring([(0, 0), (4, 0), (4, 3), (0, 3), (0, 0)])
    assert ring.length == 14
    assert ring.at([0, 5, 14, 15, -1]).tolist() == [[0, 0], [4, 1], [0, 0], [1, 0], [0, 1]]
    points, tangents = ring.walk(np.array([1.0, 5.0, 13.0, 14.0, -1.0]))
    assert points.tolist() == [[1, 0], [4, 1], [0, 1], [0, 0], [0, 1]]
    assert tangents.tolist() == [[1, 0], [0, 1], [0, -1], [1, 0], [0, -1]]
    assert ring.part(3, 8).tolist() == [[3, 0], [4, 0], [4, 3], [3, 3]]
    assert ring.part(13, 15).tolist() == [[0, 1], [0, 0], [1, 0]]
    assert ring.gap(13, 1) == 2
    arc, distance = ring.project(np.array([[5.0, 1.0]]))
    assert (arc.tolist(), distance.tolist()) == ([5.0], [1.0])


def test_corners_of_an_l():
    arc, turn = find_corners(polygon_rings(L_SHAPE)[0], 100)
    assert len(arc) == 6
    assert np.degrees(turn) == pytest.approx([90, 90, 90, -90, 90, 90])


def test_holes_have_the_site_on_their_left():
    holed = shapely.box(0, 0, 400, 400) - shapely.box(100, 100, 300, 300)
    _, hole = polygon_rings(holed)
    _, turn = find_corners(hole, 50)
    assert np.degrees(turn) == pytest.approx([-90] * 4)


def test_given_points_become_stations_and_near_ones_are_lost():
    rings = polygon_rings(shapely.box(0, 0, 400, 400))
    points = np.array([[150.0, 0], [170, 0], [0.5, 0], [400, 210]])
    (stations,), lost = place_stations(rings, 100, points, np.arange(4))
    assert lost == [1]
    assert sorted(stations.point.tolist()) == [-1, -1, -1, 0, 2, 3]
    assert len(stations.arc) == 6


# ---------------------------------------------------------------- cleaning
def test_cleaning_keeps_a_plain_shape():
    clean = clean_site(L_SHAPE, 72, 1 / 6, NOWHERE)
    assert clean.moved < 1e-6
    assert len(clean.parts) == 1


def test_cleaning_closes_slots_and_drops_small_holes():
    slotted = shapely.box(0, 0, 400, 400) - shapely.box(195, 100, 205, 400)
    slotted -= shapely.box(50, 50, 70, 70)
    (part,) = clean_site(slotted, 72, 1 / 6, NOWHERE).parts
    assert part.area == pytest.approx(160000, rel=1e-3)


def test_cleaning_cuts_necks():
    bell = shapely.union_all(
        [shapely.box(0, 0, 200, 200), shapely.box(200, 95, 300, 105), shapely.box(300, 0, 450, 200)]
    )
    clean = clean_site(bell, 72, 1 / 6, NOWHERE)
    assert [round(p.area, -2) for p in clean.parts] == [40000, 30000]


def test_sharp_tips_are_cut_unless_kept():
    kite = shapely.Polygon([(0, 0), (600, -80), (600, 80)])
    (cut,) = clean_site(kite, 72, 1 / 6, NOWHERE).parts
    assert cut.bounds[0] > 50
    (kept,) = clean_site(kite, 72, 1 / 6, np.array([[0.0, 0.0]])).parts
    assert kept.bounds[0] < cut.bounds[0]


def test_nothing_is_left_of_a_thread():
    assert clean_site(shapely.box(0, 0, 2000, 5), 72, 1 / 6, NOWHERE).parts == ()


def test_polygons_of_collections():
    mixed = shapely.GeometryCollection(
        [shapely.Point(0, 0), shapely.MultiPolygon([shapely.box(0, 0, 1, 1)]), L_SHAPE]
    )
    assert [p.area for p in polygons_of(mixed)] == [120000, 1]


# ---------------------------------------------------------------- directions
def test_directions_of_an_l():
    _, _, _, (labels,) = labelled(L_SHAPE, 100)
    corners = labels.turn != 0
    assert labels.turn[corners].tolist() == [1, 1, 1, -1, 1, 1]
    assert np.unique(labels.direction).tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize("angle", [0, 20, 44, 71])
def test_directions_do_not_depend_on_rotation(angle):
    turned = shapely.affinity.rotate(L_SHAPE, angle)
    _, _, _, (labels,) = labelled(turned, 100)
    assert sorted(labels.turn[labels.turn != 0].tolist()) == [-1, 1, 1, 1, 1, 1]


def test_turns_add_up_round_outer_rings_and_holes():
    holed = shapely.Point(0, 0).buffer(300) - shapely.Point(20, 0).buffer(90)
    _, _, _, labels = labelled(holed, 60)
    assert [int(label.turn.sum()) for label in labels] == [4, -4]


def test_alternatives_differ_and_are_sorted():
    _, _, (table,), (labels,) = labelled(L_SHAPE, 100)
    others = alternatives(table, (0.05, 0.05), labels)
    assert len(others) >= 3
    costs = [cost for cost, _ in others]
    assert costs == sorted(costs)
    assert all(other.key() != labels.key() for _, other in others)
    assert all(other.turn.sum() == 4 for _, other in others)


def test_main_axis_follows_the_longest_sides():
    turned = shapely.affinity.rotate(shapely.box(0, 0, 500, 100), 20, origin=(0, 0))
    assert np.degrees(main_axis(polygon_rings(turned))) == pytest.approx(20)


# ---------------------------------------------------------------- lattice
def test_facing_sides_of_a_rectangle():
    rings, _, _, labels = labelled(shapely.box(0, 0, 500, 300), 100)
    facing = find_facing(rings, labels, 100)
    assert len(facing.pieces) == 2
    assert sorted(facing.distance.tolist()) == pytest.approx([3, 5])
    assert sorted(facing.width.tolist()) == pytest.approx([6, 10])
    assert facing.fractions == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("width", "height", "steps"), [(500, 300, (5, 3)), (345, 170, (3, 2)), (60, 1000, (1, 10))]
)
def test_whole_numbers_of_a_rectangle(width, height, steps):
    rings, _, _, labels = labelled(shapely.box(0, 0, width, height), 100)
    (ring,), _ = solve_lattice(rings, labels, 100, find_facing(rings, labels, 100))
    per_axis = [int(ring.steps[labels[0].direction % 2 == d].sum()) // 2 for d in (0, 1)]
    assert tuple(per_axis) == steps


@pytest.mark.parametrize(
    ("line", "costs"),
    [
        # a valley, and beyond its ends the same slopes
        ([(1.0, 4.0), (2.0, 1.0), (4.0, 2.0)], {0: 7, 1: 4, 2: 1, 3: 1.5, 4: 2, 8: 4}),
        # rising from its first point: down to 0 on its left, and no further
        ([(1.0, 1.0), (2.0, 3.0), (3.0, 6.0)], {-5: 0, 0: 0, 1: 1, 2: 3, 4: 9}),
        # the same the other way round, and from 0
        ([(-2.0, 3.0), (-1.0, 1.0)], {-3: 5, -2: 3, -1: 1, 0: 0, 6: 0}),
        ([(2.0, 0.0), (3.0, 2.0)], {-1: 0, 2: 0, 3: 2, 5: 6}),
        ([(0.0, 1.0), (2.0, 1.0)], {-3: 1, 1: 1, 7: 1}),
        ([(1.0, 1e-31), (2.0, 3.0)], {-3: 0, 1: 0, 2: 3}),
    ],
)
@pytest.mark.parametrize("shift", [0.0, 1.0])
def test_cost_along_a_convex_line(line, costs, shift):
    for place, cost in costs.items():
        program = _Program()
        x = program.column(place - shift, place - shift, whole=True)
        program.convex({x: 1.0}, line, shift)
        values, total = program.solve()
        assert values[x] == place - shift
        assert total == pytest.approx(cost)


@pytest.mark.parametrize("target", [0.2, 0.8, 1.0, 1.5, 4.4, 30.0])
def test_cost_of_sizes_is_convex_and_least_at_the_asked_one(target):
    places, costs = np.array(_size_cost(target, 2.0)).T
    slopes = np.diff(costs) / np.diff(places)
    assert (np.diff(slopes) >= -1e-12).all()
    assert abs(places[costs.argmin()] - max(1, target)) <= 0.5
    near = np.abs(places - target) <= min(1, target)
    assert costs[near] == pytest.approx(2.0 * np.log(places[near] / max(target, 0.3)) ** 2)


def square_labels(directions, steps):
    count = len(directions)
    labels = Labels(
        np.arange(count, dtype=float),
        np.zeros(count, dtype=int),
        np.array(directions),
        np.full(count, -1),
    )
    moves = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])[directions] * np.array(steps)[:, None]
    corners = np.vstack([[[0, 0]], np.cumsum(moves, axis=0)[:-1]])
    return LatticeRing(corners, np.array(steps)), labels


def test_cells_of_a_rectangle():
    ring, labels = square_labels([0, 1, 2, 3], [3, 2, 3, 2])
    faces, (walk,) = fill_lattice([ring], [labels])
    assert len(faces) == 6
    assert faces.max() == 11
    assert len(set(walk.tolist())) == 10


def test_a_slit_doubles_its_vertices():
    # a 4 by 2 rectangle with a slit of one step down from the middle of its top
    ring, labels = square_labels([0, 1, 2, 3, 1, 2, 3], [4, 2, 2, 1, 1, 2, 2])
    faces, (walk,) = fill_lattice([ring], [labels])
    assert len(faces) == 8
    assert faces.max() + 1 == 16  # 15 lattice points, the mouth of the slit twice
    assert len(walk) == 14


def test_crossing_rings_are_refused():
    ring, labels = square_labels([0, 1, 2, 3, 0, 1, 2, 3], [3, 3, 2, 4, 3, 2, 4, 1])
    assert fill_lattice([ring], [labels]) is None


def test_overlap_cuts_part_touching_pieces():
    u_shape = shapely.box(0, 0, 500, 400) - shapely.box(200, 100, 300, 400)
    rings, _, _, labels = labelled(u_shape, 100)
    corners = np.array([[0, 0], [4, 0], [4, 4], [2, 4], [2, 1], [2, 1], [2, 4], [0, 4]])
    touching = LatticeRing(corners, np.array([4, 4, 2, 3, 0, 3, 2, 4]))
    cuts = overlap_cuts(rings, labels, [touching])
    assert any(cut.axis == 0 for cut in cuts)


# ---------------------------------------------------------------- build and relax
def test_draft_of_an_l():
    rings, _, _, labels = labelled(L_SHAPE, 100)
    solution = solve_lattice(rings, labels, 100, find_facing(rings, labels, 100))
    draft = build_draft(rings, labels, solution[0])
    assert len(draft.faces) == 12
    assert (draft.station >= 0).sum() == 6
    inner = draft.ring < 0
    assert inner.sum() == 5


def test_rows_of_a_disc_go_all_round():
    rings, _, _, labels = labelled(shapely.Point(0, 0).buffer(250), 50)
    rows, along, extra = plan_rows(rings, labels, 50)
    assert rows == [Row(0, None, None)]
    assert set(along.values()) == {1}
    assert extra == {}


def test_smoothing_turns_a_folded_grid_right():
    rings, _, _, labels = labelled(shapely.box(0, 0, 500, 500), 100)
    solution = solve_lattice(rings, labels, 100, find_facing(rings, labels, 100))
    draft = build_draft(rings, labels, solution[0])
    folded = draft.vertices.copy()
    inner = np.flatnonzero(draft.ring < 0)
    folded[inner] = folded[inner[::-1]]
    smoother = Smoother(draft, rings, 100)
    assert smoother.least_jacobian(folded) < 0
    vertices, _ = smoother.smooth(folded, draft.arc, draft.station >= 0)
    assert smoother.least_jacobian(vertices) > 0.9


def test_gradient_of_the_energy():
    rings, _, _, labels = labelled(L_SHAPE, 100)
    solution = solve_lattice(rings, labels, 100, find_facing(rings, labels, 100))
    draft = build_draft(rings, labels, solution[0])
    from platwright.mesh.relax import _State

    state = _State(Smoother(draft, rings, 100), draft.vertices, draft.arc, draft.station >= 0)
    rng = np.random.default_rng(3)
    x = state.x + rng.normal(0, 0.05, len(state.x))
    _, gradient = state.energy(x, 1e-3)
    for i in rng.choice(len(x), 8, replace=False):
        step = np.zeros(len(x))
        step[i] = 1e-6
        slope = (state.energy(x + step, 1e-3)[0] - state.energy(x - step, 1e-3)[0]) / 2e-6
        assert gradient[i] == pytest.approx(slope, rel=1e-4, abs=1e-6)


def test_line_triples_of_a_grid():
    assert sorted(map(sorted, line_triples(grid(2, 2)).tolist())) == [[1, 4, 7], [3, 4, 5]]


# ---------------------------------------------------------------- foreign ground
def test_foreign_edges_cross_more_than_five_metres():
    mesh = grid(2, 2, 100.0)
    wide = shapely.box(0, 0, 200, 200) - shapely.box(40, 50, 60, 150)
    thin = shapely.box(0, 0, 200, 200) - shapely.box(40, 50, 44, 150)
    crossing = mesh.edge_between(3, 4)
    assert np.flatnonzero(foreign_edges(mesh, wide)).tolist() == [crossing]
    assert not foreign_edges(mesh, thin).any()


def test_boundary_edges_off_the_site_are_foreign():
    mesh = grid(2, 1, 100.0)
    short = shapely.box(0, 0, 200, 100) - shapely.box(120, 60, 180, 100)
    assert np.flatnonzero(foreign_edges(mesh, short)).tolist() == [mesh.edge_between(4, 5)]
