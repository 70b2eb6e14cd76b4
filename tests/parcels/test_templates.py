"""Drawn templates: the shipped library, files, what validation says, repeats and scaling."""

from __future__ import annotations

import importlib
import sys
from dataclasses import replace

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely
from platwright.errors import InputError
from platwright.parcels.templates import (
    CornerMark,
    Edge,
    Face,
    Template,
    TemplateLibrary,
    cells,
    check_library,
    read_library,
    repeated,
    scaled,
    shipped_library,
    write_library,
)
from shapely.geometry import LineString, Point, Polygon, box

from house import ROOT

ROW = Template(
    "row",
    faces=(Face(box(0, 0, 18, 30), repeat="x"),),
    edges=(Edge(LineString([(0, 0), (18, 0)])),),
    corners=(CornerMark(Point(0, 0)),),
    lot_width=18.0,
    lot_depth=30.0,
)


@pytest.fixture(scope="module")
def shipped():
    return shipped_library()


@pytest.fixture(scope="module")
def drawings():
    """Return the module that draws the library."""
    sys.path.insert(0, str(ROOT / "scripts"))
    try:
        yield importlib.import_module("_templates")
    finally:
        sys.path.remove(str(ROOT / "scripts"))


@pytest.fixture(scope="module")
def outline(drawings):
    return importlib.import_module("_template_drawing").outline


def test_the_shipped_library_is_what_the_script_draws(shipped, drawings):
    assert shipped == TemplateLibrary(tuple(drawings.drawings()))


def test_the_shipped_library_has_what_is_promised(shipped):
    names = {template.name for template in shipped}
    assert {
        "Single row", "Double row", "Double row with end caps", "Cul-de-sac",
        "Cul-de-sac with side rows", "Wedge", "Pentagon with a private park", "L-block",
        "Townhouses with a rear lane", "Apartment court", "Commercial pad with parking", "School",
        "Park", "House", "House with pool",
    } <= names  # fmt: skip
    labels = {face.label for template in shipped.labelled("parcel") for face in template.faces}
    assert {"house", "driveway", "garden", "pool"} <= labels
    assert {template.level for template in shipped} == {1, 2, 3}


def test_faces_of_the_shipped_library_tile_their_outline(shipped, outline):
    for template in shipped:
        faces = [face.polygon for face in template.faces]
        around = outline(template)
        assert around.is_valid
        assert sum(face.area for face in faces) == pytest.approx(around.area, rel=1e-9)
        overlap = [a.intersection(b).area for k, a in enumerate(faces) for b in faces[:k]]
        assert max(overlap, default=0.0) < 1e-6


def test_parcels_of_the_shipped_library_have_the_size_of_a_lot(shipped):
    for name in ("Single row", "Double row", "Cul-de-sac", "L-block"):
        for face in shipped[name].faces:
            if face.label == "parcel" and face.repeat:
                assert face.polygon.area == pytest.approx(540.0)


def test_a_library_is_read_as_it_was_written(shipped, tmp_path):
    write_library(shipped, tmp_path / "a.gpkg")
    again = read_library(tmp_path / "a.gpkg")
    assert again == shipped
    for old, new in zip(shipped, again):
        for a, b in zip(old.faces, new.faces):
            assert shapely.to_wkb(a.polygon) == shapely.to_wkb(b.polygon)
    write_library(again, tmp_path / "b.gpkg")
    assert read_library(tmp_path / "b.gpkg") == shipped


def test_a_library_of_one_face_without_lines_round_trips(tmp_path):
    library = TemplateLibrary((replace(ROW, edges=(), corners=()),))
    write_library(library, tmp_path / "a.gpkg")
    assert read_library(tmp_path / "a.gpkg") == library


def test_empty_fields_take_their_defaults(tmp_path):
    """A planner who draws a face and enters the template's name only."""
    path = tmp_path / "a.gpkg"
    faces = gpd.GeoDataFrame({"template": ["t"], "label": [None]}, geometry=[box(0, 0, 9, 9)])
    pyogrio.write_dataframe(faces.set_crs(3857), path, layer="faces")
    table = pd.DataFrame({"name": ["t"], "probability": [None]})
    pyogrio.write_dataframe(table, path, layer="templates")
    assert read_library(path) == TemplateLibrary((Template("t", faces=(Face(box(0, 0, 9, 9)),)),))


def test_other_programs_read_and_edit_a_library(tmp_path):
    """GDAL, on which QGIS relies, sees the layers and can add to them."""
    path = tmp_path / "a.gpkg"
    write_library(TemplateLibrary((ROW,)), path)
    seen = {str(name): geometry for name, geometry in pyogrio.list_layers(path)}
    assert seen == {
        "templates": None, "faces": "Polygon", "edges": "LineString", "corners": "Point"
    }  # fmt: skip
    faces = pyogrio.read_dataframe(path, layer="faces")
    assert faces.geometry.iloc[0].equals(box(0, 0, 18, 30))
    assert faces["repeat"].tolist() == ["x"]
    assert "metre" in faces.crs.axis_info[0].unit_name.lower() or faces.crs.is_engineering
    more = faces.assign(label="green", repeat="").set_geometry([box(18, 0, 30, 30)], crs=faces.crs)
    pyogrio.write_dataframe(more, path, layer="faces", driver="GPKG", append=True)
    (again,) = read_library(path)
    assert again.faces == (
        ROW.faces[0], replace(ROW.faces[0], polygon=box(18, 0, 30, 30), label="green", repeat=""),
    )  # fmt: skip


def with_face(**change: object) -> Template:
    return replace(ROW, faces=(replace(ROW.faces[0], **change),))


HOLE = Polygon(box(0, 0, 18, 30).exterior, [box(5, 5, 8, 8).exterior])
BOW = Polygon([(0, 0), (18, 30), (18, 0), (0, 30)])
#: A broken template, and what is said: layer, field, part of the text.
BROKEN = [
    (replace(ROW, name=" "), "templates", "name", "is empty"),
    (replace(ROW, level=4), "templates", "level", "4 is no level"),
    (replace(ROW, region_label=""), "templates", "region_label", "is empty"),
    (replace(ROW, probability=0.0), "templates", "probability", "it is 0"),
    (replace(ROW, probability=float("nan")), "templates", "probability", "it is nan"),
    (replace(ROW, min_uses=-1), "templates", "min_uses", "it is -1"),
    (replace(ROW, min_uses=3, max_uses=2), "templates", "max_uses", "below min_uses, 3"),
    (replace(ROW, max_uses=0), "templates", "max_uses", "below 1"),
    (replace(ROW, lot_width=-1.0), "templates", "lot_width", "it is -1"),
    (replace(ROW, lot_depth=0.0), "templates", "lot_depth", "one of lot_width and lot_depth"),
    (replace(ROW, faces=()), "templates", "name", "no face"),
    (with_face(polygon=BOW), "faces", "geometry", "no valid polygon"),
    (with_face(polygon=Polygon()), "faces", "geometry", "no valid polygon"),
    (with_face(polygon=HOLE), "faces", "geometry", "has a hole"),
    (with_face(label="castle"), "faces", "label", "'castle'"),
    (with_face(label="house"), "faces", "label", "'house'"),
    (with_face(deform="bendy"), "faces", "deform", "'bendy'"),
    (with_face(width_min=2.0), "faces", "width_min", "2 to 1.3"),
    (with_face(depth_min=0.0), "faces", "depth_min", "0 to 1.3"),
    (with_face(axis=float("inf")), "faces", "axis", "no number"),
    (with_face(tolerance=0.0), "faces", "tolerance", "it is 0"),
    (with_face(repeat="north"), "faces", "repeat", "'north'"),
    (with_face(repeat_ideal=10.0, repeat_min=12.0), "faces", "repeat_ideal", "should be 10 m"),
    (
        replace(ROW, faces=(ROW.faces[0], Face(box(9, 30, 18, 40)))),
        "faces", "repeat", "inside the stretch from 0 to 18 m",
    ),
    (
        replace(ROW, faces=(
            Face(box(0, 0, 18, 30), repeat="x north"), Face(box(0, 30, 18, 60), repeat="x south"),
        )),
        "faces", "repeat", "from 0 to 18 m, where 'x north' repeats, too",
    ),
    (
        replace(ROW, faces=(Face(box(0, 0, 18, 30)), Face(box(10, 0, 28, 30)))),
        "faces", "geometry", "overlaps",
    ),
    (
        replace(ROW, faces=(Face(box(0, 0, 18, 30)), Face(box(20, 0, 28, 30)))),
        "faces", "geometry", "gap",
    ),
    (
        replace(ROW, faces=(Face(box(0, 0, 18, 30)), Face(box(18, 30, 28, 40)))),
        "faces", "geometry", "point only",
    ),
    (
        replace(ROW, edges=(Edge(LineString([(0, 0), (18, 0)]), "sea"),)),
        "edges", "meaning", "'sea'",
    ),
    (replace(ROW, edges=(Edge(LineString()),)), "edges", "geometry", "no line"),
    (
        replace(ROW, edges=(Edge(LineString([(0, 0), (18, 30)])),)),
        "edges", "geometry", "leaves the outline",
    ),
    (
        replace(ROW, edges=(Edge(LineString([(1, 1), (5, 5)]), "circle"),)),
        "edges", "geometry", "0 vertices",
    ),
    (
        replace(ROW, edges=(Edge(LineString([(1, 1), (5, 5)]), "centre"),)),
        "edges", "geometry", "leaves the street and lane",
    ),
    (replace(ROW, corners=(CornerMark(Point(0, 0), "blunt"),)), "corners", "kind", "'blunt'"),
    (replace(ROW, corners=(CornerMark(Point(5, 0)),)), "corners", "geometry", "no vertex"),
    (
        replace(
            ROW,
            faces=(Face(box(0, 0, 18, 30)), Face(box(18, 0, 36, 30))),
            corners=tuple(
                CornerMark(Point(p), "regular") for p in [(0, 0), (36, 0), (36, 30), (0, 30)]
            ),
        ),
        "faces", "geometry", "has no corner",
    ),
    (replace(with_face(label="inner"), region_label="inner"), "faces", "label", "again"),
]  # fmt: skip


@pytest.mark.parametrize(("template", "layer", "field", "said"), BROKEN)
def test_what_validation_says(template, layer, field, said):
    good = replace(ROW, name="good")
    with pytest.raises(InputError) as caught:
        check_library(TemplateLibrary((good, template)))
    text = str(caught.value)
    assert caught.value.layer == layer
    assert f"field '{field}'" in text
    assert said in text
    assert f"Template '{template.name}'" in text
    # the feature of the second template, whichever of its own it is
    own = {"templates": (2,), "faces": (2, 3), "edges": (2,), "corners": (2,)}[layer]
    assert caught.value.feature in own
    assert caught.value.remedy.endswith(".")


def test_two_templates_of_one_name():
    with pytest.raises(InputError, match=r"Layer 'templates', feature 1: .*two templates.*'row'"):
        check_library(TemplateLibrary((ROW, ROW)))


def test_circles_over_two_templates_are_found():
    a = replace(with_face(label="b"), name="a", region_label="a")
    b = replace(with_face(label="a"), name="b", region_label="b")
    with pytest.raises(InputError, match=r"Layer 'faces', feature 1: Template 'a', field 'label'"):
        check_library(TemplateLibrary((a, b)))


def written(tmp_path, **layers):
    """Write a library with some layers replaced by frames (None: left out)."""
    path = tmp_path / "broken.gpkg"
    write_library(TemplateLibrary((ROW,)), path)
    good = {name: pyogrio.read_dataframe(path, layer=name) for name, _ in pyogrio.list_layers(path)}
    path.unlink()
    for name, frame in good.items():
        change = layers.get(name, lambda frame: frame)
        if change is not None:
            pyogrio.write_dataframe(change(frame), path, layer=name, driver="GPKG")
    return path


#: Layer, how it is changed, and what is said.
FILES = [
    ("faces", None, "no layer 'faces'"),
    ("templates", None, "no layer 'templates'"),
    ("faces", lambda f: f.assign(template="x"), "Layer 'faces', feature 1: .*no template 'x'"),
    ("faces", lambda f: f.assign(tolerance="wide"), "field 'tolerance': 'wide' is no float"),
    ("faces", lambda f: pd.DataFrame(f.drop(columns="geometry")), "Layer 'faces': .*no geometry"),
    ("faces", lambda f: f.set_geometry(f.centroid), "no single Polygon"),
    ("templates", lambda f: f.assign(level=1.5), "'level': '1.5' is no int"),
    ("templates", lambda f: f.assign(name=None), "'name': it is empty"),
    ("corners", lambda f: f.assign(kind="flat"), "Layer 'corners', feature 1: .*'kind': 'flat'"),
]


@pytest.mark.parametrize(("layer", "change", "said"), FILES)
def test_what_reading_says(tmp_path, layer, change, said):
    path = written(tmp_path, **{layer: change})
    with pytest.raises(InputError, match=said):
        read_library(path)


def test_files_that_are_no_library(tmp_path):
    with pytest.raises(InputError, match=r"no file 'none\.gpkg'"):
        read_library(tmp_path / "none.gpkg")
    (tmp_path / "text.gpkg").write_text("no database")
    with pytest.raises(InputError, match=r"'text\.gpkg' is no GeoPackage"):
        read_library(tmp_path / "text.gpkg")


def test_ids_of_the_file_are_named(tmp_path):
    """Features keep the ids that QGIS shows, though others before them were deleted."""

    def three(frame):
        frame = pd.concat([frame] * 3, ignore_index=True)
        frame.loc[2, "deform"] = "bendy"
        return frame

    path = written(tmp_path, faces=three)
    with pytest.raises(InputError, match=r"Layer 'faces', feature 3: .*'bendy'"):
        read_library(path)


def test_a_repeated_stretch_moves_what_lies_behind(shipped):
    """End caps of 30 m and five repeats of 18 m: 30 + 90 + 30 = 150 m, 3 + 10 + 3 parcels."""
    template = repeated(shipped["Double row with end caps"], {"x": 5})
    polygons = [face.polygon for face in template.faces]
    assert shapely.total_bounds(polygons).tolist() == [0, 0, 150, 60]
    assert len(polygons) == 16
    assert shapely.union_all(polygons).area == pytest.approx(9000.0)
    assert sorted(e.line.bounds[0] for e in template.edges) == [0, 0, 0, 150]


@pytest.mark.parametrize("names", [("x a", "x b"), ("x b", "x a")])
@pytest.mark.parametrize("counts", [(1, 1), (3, 1), (1, 3), (2, 3), (4, 2)])
def test_several_stretches_repeat_each_by_itself(names, counts):
    """A green of 20 m between parcels of 18 m and of 12 m, two rows; every name comes first."""
    faces = [
        Face(box(start, y, end, y + 30), label, repeat=name)
        for start, end, label, name in (
            (0, 18, "parcel", names[0]), (18, 38, "green", ""), (38, 50, "parcel", names[1]),
        )
        for y in (0, 30)
    ]  # fmt: skip
    template = repeated(Template("close", faces=tuple(faces)), dict(zip(names, counts)))
    polygons = [face.polygon for face in template.faces]
    length = 18 * counts[0] + 20 + 12 * counts[1]
    assert shapely.total_bounds(polygons).tolist() == [0, 0, length, 60]
    assert shapely.union_all(polygons).area == pytest.approx(60 * length)
    assert shapely.area(polygons).sum() == pytest.approx(60 * length)
    greens = [face.polygon.bounds for face in template.faces if face.label == "green"]
    assert [(a, b) for a, _, b, _ in greens] == [(18 * counts[0], 18 * counts[0] + 20)] * 2


def test_centre_lines_inside_a_repeat_are_repeated(shipped):
    template = repeated(shipped["Blocks side by side"], {"x": 3})
    centres = [e.line.bounds[0] for e in template.edges if e.meaning == "centre"]
    assert centres == [67.5, 142.5, 217.5]


def test_scaling_keeps_streets(shipped):
    """Two depths of 30 m become 25 m, the street keeps its 15 m; 18 m of front become 12 m."""
    template = scaled(shipped["Cul-de-sac"], 12.0, 25.0)
    bounds = shapely.total_bounds([face.polygon for face in template.faces])
    assert bounds[2] - bounds[0] == pytest.approx(2 * 25 + 15, rel=0.05)
    stem = next(face for face in template.faces if face.repeat and face.label == "street")
    assert stem.polygon.bounds[2] - stem.polygon.bounds[0] == pytest.approx(15.0)
    lots = [face for face in template.faces if face.repeat and face.label == "parcel"]
    ideal = [lot.polygon.area * lot.wish[0] * lot.wish[1] for lot in lots]
    assert ideal == pytest.approx([12 * 25.0] * 2)
    (cell,) = cells(template)
    assert (cell.ideal, cell.least, cell.most) == pytest.approx((12.0, 8.4, 16.8))


def test_scaling_to_the_drawn_size_changes_nothing(shipped):
    for template in shipped:
        again = scaled(template, 18.0, 30.0)
        for old, new in zip(template.faces, again.faces):
            assert old.polygon.symmetric_difference(new.polygon).area < 1e-6
            assert np.allclose(new.wish, 1.0, atol=1e-9)
