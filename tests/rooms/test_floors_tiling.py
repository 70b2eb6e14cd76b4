"""The mesh of a footprint tiles it exactly, keeps its corners and has near squares."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.rooms.floors import tile_footprint
from shapely.affinity import rotate
from shapely.geometry import Point, Polygon, box

TURN = np.linspace(0, 1.8, 30)
CIRCLE = np.column_stack([np.cos(TURN), np.sin(TURN)])
SHAPES = {
    "rectangle": box(0, 0, 60, 18),
    "L": Polygon([(0, 0), (50, 0), (50, 15), (18, 15), (18, 43), (0, 43)]),
    "U": Polygon([(0, 0), (60, 0), (60, 40), (43, 40), (43, 16), (16, 16), (16, 40), (0, 40)]),
    "courtyard": box(0, 0, 60, 50) - box(17, 16, 41, 33),
    "cross": box(20, 0, 38, 57) | box(0, 20, 58, 36),
    "trapezoid": Polygon([(0, 0), (60, 0), (48, 22), (8, 22)]),
    "curve": Polygon(np.vstack([50 * CIRCLE, 34 * CIRCLE[::-1]])),
    "round": Point(0, 0).buffer(25),
    "jogs": Polygon(
        [(0, 0), (30, 0), (30, 0.8), (61, 0.8), (61, 21), (40, 21), (40, 19.5), (0, 19.5)]
    ),
}  # fmt: skip


def sides(mesh, face):
    """The outline of a face, written out from the definition of `QuadMesh`."""
    points = []
    for k in range(4):
        u, v = int(mesh.faces[face, k]), int(mesh.faces[face, (k + 1) % 4])
        edge = next(
            i for i, ends in enumerate(mesh.edges.tolist()) if ends == [min(u, v), max(u, v)]
        )
        line = mesh.boundary_arcs.get(edge, mesh.vertices[[min(u, v), max(u, v)]])
        points += (line if u < v else line[::-1])[:-1].tolist()
    return Polygon(points)


def check_tiling(mesh, polygon):
    faces = np.array([sides(mesh, f) for f in range(len(mesh.faces))], dtype=object)
    assert shapely.is_valid(faces).all()
    assert shapely.coverage_is_valid(faces)
    assert shapely.area(faces).sum() == pytest.approx(polygon.area, rel=1e-6)
    rest = shapely.symmetric_difference(shapely.union_all(faces, grid_size=1e-6), polygon)
    assert rest.area < 1e-5 * polygon.area + 1e-5 * polygon.length


def missed_corners(mesh, polygon):
    corners = shapely.get_coordinates(polygon)
    far = np.hypot(*(corners[:, None] - mesh.vertices[None]).transpose(2, 0, 1)).min(axis=1)
    return int((far > 1e-6).sum())


@pytest.mark.parametrize("angle", [0.0, 23.0])
@pytest.mark.parametrize("name", SHAPES)
def test_tiles_exactly(name, angle):
    polygon = rotate(SHAPES[name], angle, origin=(0, 0))
    tiling = tile_footprint(polygon, 4.0)
    assert tiling.polygon.equals(polygon)
    assert tiling.remarks == ()
    check_tiling(tiling.mesh, polygon)
    if name not in ("curve", "round", "jogs"):
        assert missed_corners(tiling.mesh, polygon) == 0


@pytest.mark.parametrize("name", ["rectangle", "L", "U", "courtyard", "cross"])
def test_sides_that_are_no_multiples_are_stretched_evenly(name):
    polygon = rotate(SHAPES[name], 11.0, origin=(0, 0))
    mesh = tile_footprint(polygon, 4.0).mesh
    assert mesh.lengths.min() >= 3.4
    assert mesh.lengths.max() <= 4.6
    corners = mesh.vertices[mesh.faces]
    ahead = np.roll(corners, -1, axis=1) - corners
    back = np.roll(corners, 1, axis=1) - corners
    cosine = (ahead * back).sum(axis=2) / (np.hypot(*ahead.T) * np.hypot(*back.T)).T
    assert np.abs(cosine).max() < np.sin(np.radians(3.0))  # right angles stay right


def test_rectangle_has_the_squares_that_fit_best():
    # 18 m: five rows of 3.6 m are nearer to 4 m than four of 4.5 m
    mesh = tile_footprint(box(0, 0, 60, 18), 4.0).mesh
    assert len(mesh.faces) == 15 * 5
    assert set(np.round(mesh.lengths, 9)) == {4.0, 3.6}


def test_same_input_same_mesh():
    for name in ("L", "trapezoid", "jogs"):
        first, second = (tile_footprint(SHAPES[name], 4.0).mesh for _ in range(2))
        assert np.array_equal(first.vertices, second.vertices)
        assert np.array_equal(first.faces, second.faces)


def test_shaft_is_filled_and_told():
    shaft = box(20, 6, 21.5, 7.5)
    tiling = tile_footprint(box(0, 0, 60, 18) - shaft, 4.0)
    assert [s.equals(shaft) for s in tiling.shafts] == [True]
    assert "1 holes" in tiling.remarks[0].text
    check_tiling(tiling.mesh, box(0, 0, 60, 18))


def test_narrow_slot_is_cut_and_told():
    slot = box(0, 0, 60, 24) - box(28.0, 2.0, 28.3, 24)
    tiling = tile_footprint(slot, 4.0)
    check_tiling(tiling.mesh, tiling.polygon)
    if not tiling.polygon.equals(slot):
        assert any("too narrow" in remark.text for remark in tiling.remarks)


@pytest.mark.parametrize(
    ("polygon", "module", "says"),
    [
        (box(0, 0, 7.5, 40), 4.0, r"2 x 2 modules of 4 m. Set a module of 3.7 m or less"),
        (box(0, 0, 400, 300), 4.0, r"7500 squares .* Set a module of 5.5 m or more"),
        (box(0, 0, 40, 30), 0.0, r"module is 0"),
        (box(0, 0, 40, 30), -2.0, r"greater than 0"),
        (box(0, 0, 40, 30), float("nan"), r"module is nan"),
    ],
)
def test_unusable_is_refused_with_a_way_out(polygon, module, says):
    with pytest.raises(InputError, match=says):
        tile_footprint(polygon, module, layer="Houses", feature=7)


def test_suggested_modules_do():
    with pytest.raises(InputError):
        tile_footprint(box(0, 0, 7.5, 40), 4.0)
    check_tiling(tile_footprint(box(0, 0, 7.5, 40), 3.7).mesh, box(0, 0, 7.5, 40))


@st.composite
def rectilinear(draw):
    """Wings of a building, perhaps with a courtyard, off any raster."""
    length = st.integers(900, 4000).map(lambda cm: cm / 100)
    x, y = draw(length), draw(length)
    shape = box(0, 0, x, y)
    for _ in range(draw(st.integers(0, 3))):
        width, depth = draw(length), draw(length)
        at_x, at_y = (draw(st.integers(-2000, int(100 * side) - 200)) / 100 for side in (x, y))
        shape = shape | box(at_x, at_y, at_x + width, at_y + depth)
    if draw(st.booleans()):
        mid = shape.representative_point()
        hole = box(mid.x - 4, mid.y - 3, mid.x + 4, mid.y + 3)
        shape = shape - hole if shape.buffer(-5).contains(hole) else shape
    parts = shapely.get_parts(shapely.set_precision(shape, 1e-3))
    polygon = max(parts, key=lambda part: part.area)
    return rotate(polygon, draw(st.integers(0, 900)) / 10, origin=(0, 0))


@settings(max_examples=40)
@given(rectilinear())
def test_random_buildings_are_tiled_exactly(polygon):
    tiling = tile_footprint(polygon, 4.0)
    check_tiling(tiling.mesh, tiling.polygon)
    if not any("changed by" in remark.text + remark.action for remark in tiling.remarks):
        assert tiling.polygon.equals(polygon) or len(tiling.shafts)


def test_real_footprints_of_monaco():
    folder = pytest.importorskip("pathlib").Path(__file__).resolve().parents[3] / "shared/data/town"
    if not (folder / "monaco.gpkg").exists():
        pytest.skip("the shared data folder is not here")
    buildings = gpd.read_file(folder / "monaco.gpkg", layer="buildings")
    for feature in (534, 47, 56, 52, 80, 840, 53):
        polygon = max(
            shapely.get_parts(shapely.force_2d(buildings.geometry[feature])), key=lambda p: p.area
        )
        tiling = tile_footprint(polygon, 4.0)
        check_tiling(tiling.mesh, tiling.polygon)
        assert tiling.polygon.equals(polygon)
