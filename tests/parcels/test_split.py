"""Layouts of whole sites: tiling, access, connection, determinism, by independent code."""

from __future__ import annotations

import geopandas as gpd
import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from layout_checks import QUICK, RULES, UTM, check, ground, site_of
from platwright.errors import CancelledError, InputError
from platwright.parcels.roadmesh import GivenStreet, street_layer
from platwright.parcels.split import (
    Elements,
    KeyArea,
    SplitRules,
    lay_out,
    lay_out_sites,
    read_key_areas,
    site_layers,
    vary,
)
from platwright.parcels.split.elements import prepare_ground
from platwright.parcels.split.ground import block_length, parts
from platwright.progress import Silent
from shapely.geometry import LineString, Polygon, box


def test_a_rectangle_is_laid_out_in_rows():
    layout = lay_out(ground(box(0, 0, 320, 210)), RULES, QUICK)
    check(layout)
    score = layout.score
    # 67,200 m2: with a fifth of streets about 100 parcels of 540 m2
    assert 90 <= score.parcels <= 112
    assert score.p_angle < 0.5
    assert score.undesirable == 0
    assert score.street < 0.25
    assert layout.blocks[0].block_id == 1
    stages = {"streets", "parcels", "backtracking", "optimisation", "refinement"}
    assert set(layout.seconds) == stages


class Stages(Silent):
    """A progress that remembers what it is told."""

    def __init__(self) -> None:
        self.told = []

    def stage(self, text, fraction):
        self.told.append((text, fraction))


def test_progress_tells_which_piece_of_the_land_is_laid_out():
    """A lake from edge to edge leaves two pieces, and each has its variations."""
    watch = Stages()
    lake = Elements(areas=[KeyArea(box(90, -5, 120, 105), "water")])
    lay_out_sites(
        [site_of(box(0, 0, 240, 100))], RULES, QUICK,
        elements=lambda _: lake, count=2, progress=watch,
    )  # fmt: skip
    starts = [text for text, _ in watch.told if text.endswith("laying streets")]
    assert list(dict.fromkeys(starts)) == [
        f"Piece of land {piece} of 2: variation {k} of 2: laying streets"
        for piece in (1, 2)
        for k in (1, 2)
    ]
    shares = [fraction for _, fraction in watch.told]
    assert shares == sorted(shares)
    assert shares[0] >= 0
    assert shares[-1] <= 1


def test_a_country_is_refused_at_once():
    country = site_of(box(0, 0, 300_000, 200_000))
    with pytest.raises(InputError, match=r"60,000 km2, room for 111,111,111 parcels"):
        lay_out_sites([site_of(box(0, 0, 240, 100)), country], RULES, QUICK)


def test_land_that_a_key_area_loses_is_told():
    """100 of 900 m2 lie under the school, 100 outside the site; slivers are not worth telling."""
    areas = [
        KeyArea(box(100, 0, 140, 40), "school"),
        KeyArea(box(130, 30, 160, 60), "park"),
        KeyArea(box(210, 0, 245, 20), "lake"),
        KeyArea(box(40, 40, 60, 60.1), "court"),
    ]
    ready = prepare_ground(site_of(box(0, 0, 240, 100)), street_width=15.0, areas=areas)
    told = {remark.problem.split(" lie ")[0]: remark for remark in ready.remarks}
    assert set(told) == {"100 m2 of this park", "100 m2 of this lake"}
    assert box(130, 40, 160, 60).contains(told["100 m2 of this park"].place)
    assert [part.polygon.area for part in ready.areas] == [1600, 800, 600, pytest.approx(402)]


@pytest.mark.parametrize(
    ("word", "use", "around"),
    [("yes", "park", True), ("No", "school", False), (None, "school", True), (1, "park", True),
     (False, "school", False), ("", "park", False)],
)  # fmt: skip
def test_a_key_area_says_whether_a_street_runs_around(word, use, around):
    frame = gpd.GeoDataFrame(
        {"use": [use], "around": [word]}, geometry=[box(0, 0, 30, 30)], crs=UTM
    )
    (area,) = read_key_areas(frame, UTM, "areas")
    assert area.around is around


def test_an_unknown_word_for_around_is_refused():
    frame = gpd.GeoDataFrame({"around": ["no", "perhaps"]}, geometry=[box(0, 0, 9, 9)] * 2, crs=UTM)
    with pytest.raises(InputError, match=r"Layer 'areas', feature 1: .*'perhaps'.*Write yes"):
        read_key_areas(frame, UTM, "areas")


def test_the_same_seed_gives_the_same_layout_to_the_last_bit():
    place = ground(Polygon([(0, 0), (300, 30), (280, 230), (20, 200)]))
    first, second = (lay_out(place, RULES, QUICK, seed=5) for _ in range(2))
    assert [[p.polygon.wkb for p in many] for many in first.plots] == [
        [p.polygon.wkb for p in many] for many in second.plots
    ]
    other = lay_out(place, RULES, QUICK, seed=6)
    assert other.mesh.xy.tobytes() != first.mesh.xy.tobytes()


def test_a_site_with_one_street_gets_streets_that_end_in_circles():
    site = box(0, 0, 260, 200)
    layout = lay_out(ground(site, LineString([(0, 0), (260, 0)])), RULES, QUICK)
    check(layout)
    frame = street_layer(layout.mesh, UTM, turning=9.0)
    assert len(frame)
    assert np.isfinite(frame["dist_to_sink_m"].astype(float)).all()
    assert layout.score.parcels > 50


def test_parcels_back_on_to_a_pond():
    site = Polygon(box(0, 0, 330, 260).exterior, [box(120, 90, 200, 150).exterior])
    layout = lay_out(ground(site), RULES, QUICK)
    check(layout)
    assert layout.score.parcels > 80


def test_main_streets_and_key_areas_are_fixed_first():
    site = site_of(box(0, 0, 400, 300))
    school = KeyArea(box(150, 180, 230, 250), "school", around=True)
    lake = KeyArea(box(300, 40, 360, 90), "water")
    main = GivenStreet(LineString([(0, 130), (400, 130)]), 22.0, "High Street")
    own = Elements([school, lake], [main])
    (done,) = lay_out_sites([site], RULES, QUICK, elements=lambda _: own)
    layers = site_layers([done], UTM)
    parcels = layers["parcels"]
    uses = parcels["land_use"].value_counts()
    assert uses["school"] == uses["water"] == 1
    assert parcels.loc[parcels["land_use"] == "water"].geometry.iloc[0].equals(lake.polygon)
    high = layers["streets"][layers["streets"]["name"] == "High Street"]
    assert high.length.sum() == pytest.approx(400)
    assert set(high["level"]) == {1}
    assert set(high["width_m"]) == {22.0}
    # nothing is built on the street, on the lake, or on the street around the school
    own_parcels = shapely.union_all(parcels.loc[parcels["land_use"] == "parcel"].geometry)
    ring = school.polygon.buffer(7.5 - 0.01, join_style="mitre").exterior.buffer(7.4)
    for free in (main.line.buffer(10.99), lake.polygon, school.polygon, ring):
        assert own_parcels.intersection(free).area < 1.0
    graph = nx.Graph()
    for line in layers["streets"].geometry:
        graph.add_edge(*(tuple(np.round(line.coords[k], 3)) for k in (0, -1)))
    assert nx.number_connected_components(graph) <= 1 + sum(
        site.polygon.exterior.distance(shapely.Point(next(iter(part)))) < 1e-6
        for part in nx.connected_components(graph)
    )


def test_key_areas_that_take_all_land_are_refused():
    site = site_of(box(0, 0, 100, 100))
    own = Elements([KeyArea(box(-10, -10, 110, 110), "park")])
    with pytest.raises(InputError, match="leave no land"):
        lay_out_sites([site], RULES, QUICK, elements=lambda _: own)


def test_variations_are_ranked_and_differ():
    place = ground(Polygon([(0, 0), (340, 40), (300, 260), (10, 220)]))
    found = vary(place, RULES, QUICK, count=4, seed=3)
    scores = [layout.score.value for layout in found]
    assert scores == sorted(scores)
    assert len({layout.mesh.xy.tobytes() for layout in found}) == len(found) > 1


def test_second_thoughts_never_make_it_worse():
    place = ground(Polygon([(0, 0), (260, -20), (330, 120), (240, 260), (40, 230), (-30, 90)]))
    costs = []
    for tries in (0, 6):
        layout = lay_out(place, RULES, SplitRules(tries=tries))
        check(layout)
        costs.append(layout.score.value)
    assert costs[1] <= costs[0] + 0.5


class Stopped(Silent):
    """Cancels when a stage begins."""

    def __init__(self, word: str) -> None:
        self.word, self.stop, self.told = word, False, []

    def stage(self, text: str, fraction: float) -> None:
        assert 0 <= fraction <= 1
        self.stop = self.stop or self.word in text

    def warn(self, text: str) -> None:
        self.told.append(text)

    def cancelled(self) -> bool:
        return self.stop


def test_cancelling_before_there_is_a_layout_raises():
    with pytest.raises(CancelledError):
        lay_out(ground(box(0, 0, 400, 300)), RULES, QUICK, progress=Stopped("Laying"))


def test_cancelling_later_keeps_what_is_there():
    progress = Stopped("otherwise")
    polygon = Polygon([(0, 0), (260, -20), (330, 120), (240, 260), (40, 230)])
    layout = lay_out(ground(polygon), RULES, QUICK, progress=progress)
    check(layout)
    assert progress.told


@settings(max_examples=12)
@given(
    st.lists(st.floats(0.75, 1.25), min_size=5, max_size=11),
    st.floats(90, 190),
    st.floats(0, 6.3),
    st.booleans(),
)
@pytest.mark.slow
def test_any_site_is_laid_out(radii, size, turn, with_hole):
    angles = turn + np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    xy = size * np.array(radii)[:, None] * np.c_[np.cos(angles), np.sin(angles)]
    site = Polygon(xy)
    if with_hole:
        site = site.difference(shapely.Point(0, 0).buffer(size / 5, quad_segs=3))
    if site.geom_type != "Polygon" or not site.is_valid:
        return
    check(lay_out(ground(site), RULES, QUICK))


def test_a_line_across_a_hole_does_not_cut():
    ring = Polygon(box(0, 0, 10, 10).exterior, [box(4, 4, 6, 6).exterior])
    assert parts(ring, [LineString([(0, 5), (10, 5)])]) is None
    halves = parts(ring, [LineString([(0, 5), (4, 5)]), LineString([(6, 5), (10, 5)])])
    assert sorted(p.area for p in halves) == pytest.approx([48, 48])


def test_the_length_of_a_bent_block_is_told():
    inner, outer = (
        [(r * np.cos(a), r * np.sin(a)) for a in np.linspace(0, np.pi / 2, 20)] for r in (100, 170)
    )
    bent = Polygon([*inner, *outer[::-1]])
    # a quarter of a ring of 70 m: its middle is 135 m from the centre
    assert block_length(bent) == pytest.approx(135 * np.pi / 2, rel=0.03)
