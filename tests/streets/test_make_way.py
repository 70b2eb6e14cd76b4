"""Mesh lines that step aside for obstacles."""

from __future__ import annotations

import dataclasses
import time

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from platwright.mesh import fan, grid
from platwright.mesh.quadmesh import QuadMesh
from platwright.mesh.quality import line_bends, scaled_jacobians
from platwright.mesh.relax import line_triples
from platwright.network.specification import Specification
from platwright.site import prepare_sites
from platwright.site.types import Site
from platwright.streets import arriving_streets, site_mesh
from platwright.streets.make_way import make_way
from platwright.streets.survey import TOUCH
from pyproj import CRS
from shapely import affinity
from shapely.geometry import Point, Polygon, box

UTM = CRS(32633)
H = 72.0


def site_of(mesh: QuadMesh, obstacles: list[Polygon]) -> Site:
    outline = shapely.union_all(shapely.polygons(mesh.vertices[mesh.faces]))
    return Site("Field", 1, outline, UTM, UTM, obstacles=obstacles)


def barred(mesh: QuadMesh, site: Site) -> np.ndarray:
    """Inner edges on obstacles for more than a touch, told without the library."""
    lines = shapely.linestrings(mesh.vertices[mesh.edges])
    inside = shapely.length(shapely.intersection(lines, site.obstacle_union))
    return ~mesh.boundary_edges & (inside > TOUCH + 0.05)


def nearest(mesh: QuadMesh, obstacle: Polygon) -> float:
    """Distance of an obstacle from the nearest inner edge."""
    lines = shapely.linestrings(mesh.vertices[mesh.edges[~mesh.boundary_edges]])
    return float(shapely.distance(lines, obstacle).min())


def moves(before: QuadMesh, after: QuadMesh) -> np.ndarray:
    return np.hypot(*(after.vertices - before.vertices).T)


def worst_bend(mesh: QuadMesh) -> float:
    return float(np.degrees(line_bends(mesh.vertices, line_triples(mesh)).max()))


def house(x: float, y: float, width: float = 20.0, depth: float = 20.0, turn: float = 0.0):
    shape = box(x - width / 2, y - depth / 2, x + width / 2, y + depth / 2)
    return affinity.rotate(shape, turn)


def test_line_bends_round_a_house_on_it():
    mesh = grid(6, 6, H)
    site = site_of(mesh, [house(3 * H, 2.5 * H)])
    assert barred(mesh, site).sum() == 1
    after = make_way(mesh, site)
    assert not barred(after, site).any()
    assert nearest(after, site.obstacles[0]) > 3.5
    # half the house and the clearance, and no more than that
    assert 10.0 < moves(mesh, after).max() < 18.0
    assert worst_bend(after) < 15.0


def test_house_on_a_crossing_gets_into_one_cell():
    mesh = grid(6, 6, H)
    site = site_of(mesh, [house(3 * H, 3 * H, 16.0, 16.0, 20.0)])
    assert barred(mesh, site).sum() == 4
    after = make_way(mesh, site)
    assert not barred(after, site).any()
    cells = shapely.polygons(after.vertices[after.faces])
    assert shapely.contains(cells, site.obstacles[0]).sum() == 1


def test_house_off_the_line_is_passed_on_the_nearer_side():
    mesh = grid(6, 6, H)
    site = site_of(mesh, [house(3 * H + 6.0, 2.5 * H)])
    after = make_way(mesh, site)
    assert not barred(after, site).any()
    shift = after.vertices - mesh.vertices
    # west by what is missing: 4 m of house and 4 m of clearance
    assert -10.0 < shift[:, 0].min() < -7.0
    assert shift[:, 0].max() < 2.0


def test_house_too_near_a_line_is_given_room():
    mesh = grid(4, 4, H)
    site = site_of(mesh, [house(2 * H + 11.0, 1.5 * H)])
    assert not barred(mesh, site).any()
    assert nearest(mesh, site.obstacles[0]) < 1.1
    assert nearest(make_way(mesh, site), site.obstacles[0]) > 3.5


def test_row_of_houses_moves_a_whole_line():
    mesh = grid(6, 6, H)
    site = site_of(mesh, [house((i + 0.5) * H, 3 * H + 5.0) for i in range(1, 5)])
    after = make_way(mesh, site)
    assert not barred(after, site).any()
    line = (mesh.vertices[:, 1] == 3 * H) & ~mesh.boundary_vertices
    assert (after.vertices[line, 1] < 3 * H).all()
    assert np.ptp(after.vertices[line, 1]) < 6.0


def test_nothing_to_do_leaves_the_mesh_alone():
    mesh = grid(4, 4, H)
    assert make_way(mesh, site_of(mesh, [])) is mesh
    assert make_way(mesh, site_of(mesh, [house(1.5 * H, 1.5 * H)])) is mesh
    # every vertex lies on the boundary
    row = grid(5, 1, H)
    assert make_way(row, site_of(row, [house(2 * H, 0.5 * H)])) is row
    held = dataclasses.replace(mesh, fixed=np.ones(len(mesh.vertices), dtype=bool))
    assert make_way(held, site_of(held, [house(2 * H, 1.5 * H)])) is held
    assert make_way(mesh, site_of(mesh, [house(2 * H, 1.5 * H)]), reach=0.0) is mesh


def test_obstacle_larger_than_a_cell_bars_no_more_than_before():
    mesh = grid(6, 6, H)
    site = site_of(mesh, [Point(3.1 * H, 2.8 * H).buffer(1.2 * H)])
    before, after = barred(mesh, site), barred(make_way(mesh, site), site)
    assert before.any()
    assert 0 < after.sum() <= before.sum()


def test_fixed_and_attracted_vertices_stay_and_the_rest_is_kept():
    mesh = grid(6, 6, H)
    fixed = np.zeros(len(mesh.vertices), dtype=bool)
    inner = np.flatnonzero(~mesh.boundary_vertices)
    fixed[inner[:3]] = True
    foreign = np.zeros(len(mesh.edges), dtype=bool)
    foreign[5] = True
    mesh = dataclasses.replace(mesh, fixed=fixed, foreign=foreign, attracted={3: 1, 24: 0})
    x, y = mesh.vertices[24]
    site = site_of(mesh, [house(x, y + 36.0), house(x + 2 * H, y + 30.0)])
    after = make_way(mesh, site)
    assert after is not mesh
    still = fixed | mesh.boundary_vertices
    still[24] = True
    assert (moves(mesh, after)[still] == 0).all()
    assert (after.faces == mesh.faces).all()
    assert (after.foreign == foreign).all()
    assert (after.fixed == fixed).all()
    assert after.attracted == mesh.attracted
    assert after.edge_length == mesh.edge_length


def test_mesh_with_an_irregular_vertex():
    mesh = fan(5, 3, H)
    spot = mesh.vertices[mesh.edges[np.flatnonzero(~mesh.boundary_edges)[0]]].mean(axis=0)
    site = site_of(mesh, [house(*spot, 14.0, 14.0)])
    assert barred(mesh, site).any()
    after = make_way(mesh, site)
    assert not barred(after, site).any()
    assert scaled_jacobians(after.vertices, after.faces).min() > 0.35


def test_edges_stay_on_the_site():
    # a pond in the cell beside the line: west is free, east is water
    mesh = grid(4, 4, H)
    site = site_of(mesh, [house(2 * H - 3.0, 1.5 * H)])
    pond = box(2 * H + 8.0, H + 5.0, 3 * H - 8.0, 2 * H - 5.0)
    site = dataclasses.replace(site, polygon=site.polygon.difference(pond))
    after = make_way(mesh, site)
    lines = shapely.linestrings(after.vertices[after.edges[~after.boundary_edges]])
    assert shapely.length(shapely.intersection(lines, pond)).max() <= 5.1


def test_same_answer_every_time():
    mesh = grid(6, 6, H)
    rng = np.random.default_rng(5)
    site = site_of(mesh, [house(*rng.uniform(0, 6 * H, 2), turn=15.0) for _ in range(12)])
    assert (make_way(mesh, site).vertices == make_way(mesh, site).vertices).all()


HOUSES = st.lists(
    st.tuples(
        st.floats(0, 5 * H),
        st.floats(0, 4 * H),
        st.floats(4, 90),
        st.floats(4, 60),
        st.floats(0, 90),
    ),
    min_size=1,
    max_size=14,
)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(houses=HOUSES, wobble=st.integers(0, 2**31))
def test_random_obstacles(houses: list[tuple[float, ...]], wobble: int):
    mesh = grid(5, 4, H)
    shift = np.random.default_rng(wobble).uniform(-0.12, 0.12, mesh.vertices.shape) * H
    shift[mesh.boundary_vertices] = 0.0
    mesh = dataclasses.replace(mesh, vertices=mesh.vertices + shift)
    site = site_of(mesh, [house(*values) for values in houses])
    after = make_way(mesh, site)
    assert (moves(mesh, after)[mesh.boundary_vertices] == 0).all()
    assert moves(mesh, after).max() <= 0.35 * H + 1e-6
    least = np.minimum(0.35, scaled_jacobians(mesh.vertices, mesh.faces))
    assert (scaled_jacobians(after.vertices, after.faces) >= least - 1e-6).all()
    lines = shapely.linestrings(after.vertices[after.edges])
    inside = shapely.length(shapely.intersection(lines, site.obstacle_union))
    sure = ~mesh.boundary_edges & (inside > TOUCH + 0.1)
    assert sure.sum() <= before_at_most(mesh, site)


def before_at_most(mesh: QuadMesh, site: Site) -> int:
    """Barred edges of a mesh, doubtful ones (within rounding of a touch) included."""
    lines = shapely.linestrings(mesh.vertices[mesh.edges])
    inside = shapely.length(shapely.intersection(lines, site.obstacle_union))
    return int((~mesh.boundary_edges & (inside > TOUCH - 0.1)).sum())


def test_quick_enough_and_worth_it_on_a_large_site():
    mesh = grid(15, 10, H)
    rng = np.random.default_rng(1)
    spots = rng.uniform((0, 0), (15 * H, 10 * H), (30, 2))
    site = site_of(mesh, [house(*spot, *rng.uniform(8, 30, 2), 30.0) for spot in spots])
    started = time.process_time()
    after = make_way(mesh, site)
    # about 0.3 s on a quiet machine
    assert time.process_time() - started < 2.0
    assert barred(after, site).sum() < 0.35 * barred(mesh, site).sum()
    assert worst_bend(after) < 45.0


@pytest.mark.parametrize(("edge", "at_most"), [(72.0, 5), (48.0, 5)])
def test_real_site_with_many_houses(shared_data, edge: float, at_most: int):
    path = shared_data / "sites" / "02_organic_triesen_li.gpkg"
    layers = (gpd.read_file(path, layer=name) for name in ("site", "streets", "obstacles"))
    site = prepare_sites(*layers).sites[0]
    mesh = site_mesh(site, Specification(block_width=edge), arriving_streets(site, edge / 2))
    before, after = barred(mesh, site), barred(make_way(mesh, site), site)
    assert before.sum() >= 10
    assert after.sum() <= at_most
