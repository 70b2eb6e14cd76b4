"""The mesher as a whole: known shapes, random ones, points, errors."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError, InputError, MeshError, MissingDependencyError
from platwright.mesh import quadrangulate, quality
from platwright.mesh.quality import face_areas, scaled_jacobians
from platwright.progress import Silent

L_SHAPE = shapely.Polygon([(0, 0), (400, 0), (400, 200), (200, 200), (200, 400), (0, 400)])


class Recorder(Silent):
    """Keeps warnings; cancels after a number of questions."""

    def __init__(self, questions=10**9):
        self.warnings = []
        self.left = questions

    def warn(self, text):
        self.warnings.append(text)

    def cancelled(self):
        self.left -= 1
        return self.left < 0


def boundary_of(mesh):
    """Return the boundary edges of a mesh as polygons."""
    lines = [mesh.edge_line(int(i)) for i in np.flatnonzero(mesh.boundary_edges)]
    return shapely.polygonize([shapely.LineString(line) for line in lines])


def check(mesh, polygon, h):
    """Check what must hold of every mesh."""
    euler = len(mesh.vertices) - len(mesh.edges) + len(mesh.faces)
    shapes = shapely.get_parts(boundary_of(mesh))
    assert euler == 1 or len(polygon.interiors) or len(shapes) > 1
    ends = np.bincount(mesh.edges[mesh.boundary_edges].ravel())
    assert set(ends.tolist()) <= {0, 2}
    assert (scaled_jacobians(mesh.vertices, mesh.faces) > 0).all()
    assert (face_areas(mesh.vertices, mesh.faces) > 0).all()
    assert mesh.edge_length == h


# ---------------------------------------------------------------- known shapes
@pytest.mark.parametrize(("width", "height", "count"), [(720, 360, 50), (145, 290, 8), (72, 72, 1)])
def test_rectangles_become_grids(width, height, count):
    mesh = quadrangulate(shapely.box(0, 0, width, height), 72)
    assert len(mesh.faces) == count
    assert quality(mesh).min_scaled_jacobian > 0.999
    assert mesh.lengths == pytest.approx(72, rel=0.02)
    assert mesh.fixed.sum() == 4


def test_turned_and_shifted_far_away():
    moved = shapely.affinity.translate(
        shapely.affinity.rotate(shapely.box(0, 0, 500, 300), 33), 5e5, 6.7e6
    )
    figures = quality(quadrangulate(moved, 50), moved)
    assert figures.quads == 60
    assert figures.min_scaled_jacobian > 0.999
    assert figures.area_ratio == pytest.approx(1)


def test_l_shape():
    mesh = quadrangulate(L_SHAPE, 50)
    figures = quality(mesh, L_SHAPE)
    assert figures.quads == 48
    assert figures.inner_valence_4 == 1
    assert figures.within_15_percent == 1
    assert mesh.fixed.sum() == 6


def test_hole_is_respected():
    holed = shapely.box(0, 0, 500, 500) - shapely.box(200, 200, 300, 300)
    mesh = quadrangulate(holed, 50)
    assert len(mesh.faces) == 96
    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.faces) == 0
    assert not mesh.foreign.any()


def test_disc_has_four_irregular_vertices():
    disc = shapely.Point(0, 0).buffer(300, quad_segs=32)
    mesh = quadrangulate(disc, 50)
    inner = ~mesh.boundary_vertices
    assert (mesh.valences[inner] == 3).sum() == 4
    assert (mesh.valences[inner] > 4).sum() == 0
    figures = quality(mesh, disc)
    assert figures.min_scaled_jacobian > 0.6
    assert mesh.lengths[mesh.boundary_edges].sum() == pytest.approx(disc.length, rel=1e-3)


def test_arcs_follow_the_site():
    mesh = quadrangulate(shapely.Point(0, 0).buffer(300, quad_segs=32), 100)
    assert mesh.boundary_arcs
    for edge, arc in mesh.boundary_arcs.items():
        assert arc[[0, -1]].tolist() == mesh.vertices[mesh.edges[edge]].tolist()
        assert np.hypot(*arc.T) == pytest.approx(300, abs=1)


def test_closed_slot_makes_foreign_edges():
    slotted = shapely.box(0, 0, 600, 400) - shapely.box(244, 120, 256, 400)
    mesh = quadrangulate(slotted, 100)
    assert len(mesh.faces) == 24
    crossing = mesh.foreign & ~mesh.boundary_edges
    middle = mesh.vertices[mesh.edges[crossing]].mean(axis=1)
    assert crossing.sum() == 2
    assert middle == pytest.approx(np.array([[250, 200], [250, 300]]), abs=15)


def test_neck_separates_components():
    bell = shapely.union_all(
        [
            shapely.box(0, 0, 300, 300),
            shapely.box(300, 145, 400, 155),
            shapely.box(400, 0, 700, 300),
        ]
    )
    mesh = quadrangulate(bell, 72)
    assert len(mesh.faces) == 32
    assert len(shapely.get_parts(boundary_of(mesh))) == 2


def test_multipolygon():
    two = shapely.MultiPolygon([shapely.box(0, 0, 300, 300), shapely.box(500, 0, 800, 200)])
    assert len(quadrangulate(two, 100).faces) == 15


# ---------------------------------------------------------------- points and guide
def test_fixed_points_are_vertices():
    points = np.array([[130.0, 0], [400, 125], [0, 310]])
    mesh = quadrangulate(L_SHAPE, 50, fixed_points=points)
    for point in points:
        gap = np.hypot(*(mesh.vertices - point).T)
        assert gap.min() < 1e-6
        assert mesh.fixed[gap.argmin()]


def test_lost_fixed_points_are_told():
    recorder = Recorder()
    points = np.array([[150.0, 0], [155, 0], [200, 100]])
    quadrangulate(shapely.box(0, 0, 400, 400), 72, fixed_points=points, progress=recorder)
    assert len(recorder.warnings) == 1
    assert "2 of 3 fixed points" in recorder.warnings[0]


def test_attracted_vertices_lie_on_their_points():
    box = shapely.box(0, 0, 720, 576)
    points = np.array([[160.0, 0.0], [720, 300], [360, 250], [3, 0]])
    mesh = quadrangulate(box, 72, attract_points=points)
    assert sorted(mesh.attracted.values()) == [0, 1]
    for vertex, point in mesh.attracted.items():
        assert mesh.vertices[vertex] == pytest.approx(points[point])
        assert mesh.boundary_vertices[vertex]
        assert not mesh.fixed[vertex] or mesh.valences[vertex] == 3
    check(mesh, box, 72)


def test_attraction_is_one_to_one_and_keeps_room():
    box = shapely.box(0, 0, 720, 576)
    points = np.array([[x, 0.0] for x in range(20, 710, 13)])
    mesh = quadrangulate(box, 72, attract_points=points)
    used = list(mesh.attracted.values())
    assert len(used) == len(set(used)) >= 5
    assert mesh.lengths[mesh.boundary_edges].min() >= 0.5 * 72
    bottom = np.sort(mesh.vertices[mesh.vertices[:, 1] == 0, 0])
    assert (np.diff(bottom) > 0).all()


def test_guide_turns_the_lines():
    disc = shapely.Point(0, 0).buffer(400, quad_segs=32)
    for angle in (0.0, 30.0):
        mesh = quadrangulate(disc, 60, guide_direction=angle)
        inner = ~mesh.boundary_vertices[mesh.edges].any(axis=1)
        v = np.diff(mesh.vertices[mesh.edges[inner]], axis=1)[:, 0]
        mean = np.exp(4j * np.arctan2(v[:, 1], v[:, 0])).sum()
        off = (np.degrees(np.angle(mean)) / 4 - angle + 45) % 90 - 45
        assert abs(off) < 8


# ---------------------------------------------------------------- errors
def test_site_smaller_than_a_cell_names_an_edge_length():
    small = shapely.box(0, 0, 60, 50)
    with pytest.raises(MeshError, match=r"too small .* Set an edge length of 31 m or less"):
        quadrangulate(small, 72)
    assert len(quadrangulate(small, 31).faces) == 4


def test_thread_names_an_edge_length():
    with pytest.raises(MeshError, match=r"10\.0 m wide .* Set an edge length of 9 m or less"):
        quadrangulate(shapely.box(0, 0, 3000, 10), 72)


@pytest.mark.parametrize(
    ("polygon", "h", "text"),
    [
        (shapely.box(0, 0, 1, 1), 0, "greater than 0"),
        (shapely.box(0, 0, 1, 1), float("nan"), "greater than 0"),
        (shapely.Polygon(), 10, "not a polygon or is empty"),
        (shapely.Point(0, 0), 10, "not a polygon or is empty"),
    ],
)
def test_bad_input_is_refused(polygon, h, text):
    with pytest.raises(InputError, match=text):
        quadrangulate(polygon, h)


def test_bad_points_and_engine_are_refused():
    box = shapely.box(0, 0, 500, 500)
    with pytest.raises(InputError, match="'fixed_points'"):
        quadrangulate(box, 72, fixed_points=[[1, 2, 3]])
    with pytest.raises(InputError, match="no mesher 'tri'"):
        quadrangulate(box, 72, engine="tri")


def test_bow_tie_is_repaired():
    bow = shapely.Polygon([(0, 0), (400, 400), (400, 0), (0, 400)])
    mesh = quadrangulate(bow, 40)
    assert quality(mesh).inverted == 0


@pytest.mark.parametrize("questions", [0, 1, 3])
def test_cancel(questions):
    with pytest.raises(CancelledError):
        quadrangulate(L_SHAPE, 40, progress=Recorder(questions))


def test_gmsh_is_optional():
    try:
        import gmsh  # noqa: F401
    except (ImportError, OSError):
        with pytest.raises(MissingDependencyError, match="pip install gmsh"):
            quadrangulate(L_SHAPE, 40, engine="gmsh")
        pytest.skip("gmsh is not installed: only its absence was tested")
    figures = quality(quadrangulate(L_SHAPE, 40, engine="gmsh"), L_SHAPE)
    assert figures.area_ratio == pytest.approx(1, abs=0.02)


# ---------------------------------------------------------------- random shapes
@st.composite
def rectilinear(draw):
    """Return a union of boxes on a 40 m grid, the largest part, turned."""
    boxes = []
    for _ in range(draw(st.integers(1, 4))):
        x, y = draw(st.integers(0, 6)), draw(st.integers(0, 6))
        w, d = draw(st.integers(2, 8)), draw(st.integers(2, 8))
        boxes.append(shapely.box(40 * x, 40 * y, 40 * (x + w), 40 * (y + d)))
    union = shapely.union_all(boxes)
    largest = max(shapely.get_parts(union), key=lambda p: p.area)
    return shapely.affinity.rotate(largest, draw(st.integers(0, 89)), origin=(0, 0))


@st.composite
def stars(draw):
    """Return a star-shaped polygon with 5 to 12 corners."""
    corners = draw(st.integers(5, 12))
    radius = draw(st.lists(st.integers(120, 350), min_size=corners, max_size=corners))
    shift = draw(st.lists(st.floats(0.1, 0.9), min_size=corners, max_size=corners))
    angle = (np.arange(corners) + np.array(shift)) * 2 * np.pi / corners
    return shapely.Polygon(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]))


@settings(max_examples=12, deadline=None, derandomize=True)
@given(rectilinear(), st.sampled_from([40, 60]))
def test_random_rectilinear_sites(polygon, h):
    mesh = quadrangulate(polygon, h)
    check(mesh, polygon, h)
    figures = quality(mesh, polygon)
    assert figures.area_ratio == pytest.approx(1, abs=0.12)


@settings(max_examples=8, deadline=None, derandomize=True)
@given(stars(), st.sampled_from([40, 72]))
def test_random_stars(polygon, h):
    mesh = quadrangulate(polygon, h)
    check(mesh, polygon, h)
    assert 0.8 < quality(mesh, polygon).area_ratio < 1.2


def test_same_input_same_mesh():
    rng = np.random.default_rng(5)
    angle = (np.arange(9) + rng.uniform(0.1, 0.9, 9)) * 2 * np.pi / 9
    radius = rng.uniform(150, 350, 9)
    star = shapely.Polygon(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]))
    first, second = quadrangulate(star, 50), quadrangulate(star, 50)
    assert (first.vertices == second.vertices).all()
    assert (first.faces == second.faces).all()
