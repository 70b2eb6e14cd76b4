import numpy as np
import pytest
import shapely
from platwright.site.repair import Problems, make_valid, repair_polygons
from pyproj import CRS
from shapely.geometry import GeometryCollection, LineString, MultiPolygon, Point, Polygon, box

UTM = CRS.from_epsg(25832)


def repair(*geometries):
    array = np.empty(len(geometries), dtype=object)
    array[:] = geometries
    problems = Problems()
    ids = np.array([f"f{k}" for k in range(len(geometries))], dtype=object)
    polygons, own = repair_polygons(array, ids, "parcels", UTM, problems)
    return polygons, own.tolist(), problems.to_frame(UTM)


def test_a_good_polygon_passes_without_a_word():
    polygons, own, problems = repair(box(0, 0, 10, 10))
    assert polygons[0].equals(box(0, 0, 10, 10))
    assert own == ["f0"]
    assert len(problems) == 0
    assert list(problems.columns) == [
        "layer", "feature", "problem", "action", "severity", "geometry",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("geometry", "words"),
    [
        (None, "NULL"),
        (Polygon(), "EMPTY"),
        (Point(1, 1), "Point, not a polygon"),
        (LineString([(0, 0), (1, 1)]), "LineString, not a polygon"),
        (Polygon([(0, 0), (5, 5), (10, 10)]), "no area"),
        (Polygon([(0, 0), (np.inf, 0), (1, 1)]), "not finite"),
    ],
)
def test_unusable_features_are_skipped_and_named(geometry, words):
    polygons, own, problems = repair(box(0, 0, 10, 10), geometry)
    assert own == ["f0"]
    assert len(polygons) == 1
    last = problems.iloc[-1]
    assert words in last["problem"]
    assert (last["feature"], last["action"], last["severity"]) == ("f1", "skipped", "error")


def test_bow_tie_becomes_both_its_lobes():
    polygons, own, problems = repair(Polygon([(0, 0), (10, 10), (10, 0), (0, 10)]))
    assert sorted(p.area for p in polygons) == pytest.approx([25, 25])
    assert own == ["f0", "f0"]
    assert set(problems["action"]) == {"made valid", "split into its parts"}


def test_a_hole_outside_its_shell_adds_nothing():
    shape = Polygon(box(0, 0, 10, 10).exterior, [box(8, 2, 14, 4).exterior])
    assert make_valid(shape).area == pytest.approx(100 - 2 * 2)


def test_spike_without_width_goes():
    polygons, _, problems = repair(
        Polygon([(0, 0), (10, 0), (10, 10), (5, 10), (5, 90), (5, 10), (0, 10)])
    )
    assert len(polygons) == 1
    assert polygons[0].equals(box(0, 0, 10, 10))
    assert "invalid" in problems["problem"][0]


def test_heights_are_dropped_and_said_once():
    raised = [shapely.force_3d(box(k, 0, k + 1, 1), 7.0) for k in (0, 5)]
    polygons, _, problems = repair(*raised)
    assert not shapely.has_z(polygons).any()
    assert problems["problem"].tolist() == ["2 features have heights (Z), this is the first"]


def test_parts_and_collections_are_split():
    mixed = GeometryCollection([Point(0, 0), MultiPolygon([box(0, 0, 1, 1), box(5, 5, 7, 7)])])
    polygons, own, _ = repair(mixed)
    assert [p.area for p in polygons] == [1, 4]
    assert own == ["f0", "f0"]


def test_near_double_vertices_fall_together():
    polygons, _, problems = repair(
        Polygon([(0, 0), (10, 0), (10, 1e-4), (10, 10), (10 - 1e-6, 10), (0, 10)])
    )
    assert len(polygons[0].exterior.coords) == 5
    assert problems["problem"].tolist() == ["2 vertices coincide or lie on a spike"]
    assert problems["severity"].tolist() == ["info"]


def test_findings_come_in_the_asked_crs():
    problems = Problems()
    problems.add("x", 1, "a", "b", "info", Point(500_000, 5_400_000), UTM)
    problems.add("x", 2, "a", "b", "info", None, UTM)
    frame = problems.to_frame(CRS.from_epsg(4326))
    assert frame.geometry[0].x == pytest.approx(9.0)
    assert frame.geometry[1] is None
