"""Which layers are of one design."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from platwright.errors import InputError
from platwright.report import LayerFacts, group_layers


def layer(key, tool="designstreets", run="1", place="", **more):
    return LayerFacts(
        key, more.pop("name", key), tool, f"asked {run}", f"came {run}", place, **more
    )


def groups(*layers, asked=None):
    return {own.name: set(own.layers) for own in group_layers(layers, asked)}


def test_layers_of_one_run_are_one_design():
    assert groups(layer("streets"), layer("blocks")) == {"Design": {"streets", "blocks"}}


def test_two_runs_of_a_tool_are_two_designs():
    assert groups(layer("a", run="1"), layer("b", run="2"), layer("c", run="1")) == {
        "Design 1": {"a", "c"},
        "Design 2": {"b"},
    }


def test_what_follows_goes_with_the_folder():
    found = groups(
        layer("s1", run="1", place="/x/quiet/streets.gpkg"),
        layer("s2", run="2", place="/x/dense/streets.gpkg"),
        layer("p1", "parcelblocks", "3", "/x/quiet/parcels.gpkg"),
        layer("p2", "parcelblocks", "4", "/x/dense/parcels.gpkg"),
        layer("m2", "measurestreets", "5", "/x/dense/measured.gpkg"),
    )
    assert found == {"quiet": {"s1", "p1"}, "dense": {"s2", "p2", "m2"}}


def test_what_follows_goes_with_the_file():
    found = groups(
        layer("s1", run="1", place="/x/quiet.gpkg"),
        layer("s2", run="2", place="/x/dense.gpkg"),
        layer("p1", "parcelblocks", "3", "/x/quiet.gpkg"),
        layer("p2", "parcelblocks", "4", "/x/dense.gpkg"),
    )
    assert found == {"quiet": {"s1", "p1"}, "dense": {"s2", "p2"}}


def test_what_follows_goes_with_the_names():
    found = groups(
        layer("s1", run="1", place="/x/streets_quiet.gpkg"),
        layer("s2", run="2", place="/x/streets_dense.gpkg"),
        layer("m2", "measuredesign", "3", "/x/figures_dense.gpkg"),
        layer("m1", "measuredesign", "4", "/x/figures_quiet.gpkg"),
    )
    assert set(map(frozenset, found.values())) == {frozenset(("s1", "m1")), frozenset(("s2", "m2"))}


def test_what_follows_one_design_goes_with_it_however_often():
    found = groups(
        layer("s", place="/x/s.gpkg"),
        layer("m1", "measurestreets", "2", "/y/m.gpkg"),
        layer("m2", "measurestreets", "3", "/z/m.gpkg"),
    )
    assert found == {"Design": {"s", "m1", "m2"}}


def test_different_ways_to_streets_are_two_designs():
    assert len(groups(layer("a", "designstreets", "1"), layer("b", "growstreets", "2"))) == 2


def test_a_field_tells_designs_apart():
    made = group_layers([layer("all", designs=("red", "blue")), layer("t", "", designs=("blue",))])
    assert [(own.name, own.layers, own.by_field) for own in made] == [
        ("red", ("all",), {"all"}),
        ("blue", ("all", "t"), {"all", "t"}),
    ]


def test_data_is_of_no_design():
    data = LayerFacts("site", "site")
    assert groups(data, layer("roads", "osmlayers")) == {}
    assert groups(data, layer("s")) == {"Design": {"s"}}


def test_the_planner_has_the_last_word():
    found = groups(
        layer("k1", run="1", name="streets"), layer("k2", run="2", name="other"),
        LayerFacts("k3", "trees"), asked={"Green": ["other", "trees"]},
    )  # fmt: skip
    assert found == {"Green": {"k2", "k3"}, "Design 2": {"k1"}}
    with pytest.raises(InputError, match=r"'tree', which is not among .* Choose from: streets"):
        groups(layer("k1", name="streets"), asked={"Green": ["tree"]})


FACTS = st.builds(
    layer,
    key=st.uuids().map(str),
    tool=st.sampled_from(["designstreets", "growstreets", "parcelblocks", "measurestreets", ""]),
    run=st.sampled_from("1234"),
    place=st.sampled_from(["", "/a/x.gpkg", "/a/y.gpkg", "/b/x.gpkg", "/b/x_y.gpkg"]),
    designs=st.lists(st.sampled_from(["red", "blue"]), unique=True, max_size=2).map(tuple),
)


@given(st.lists(FACTS, max_size=10))
def test_each_layer_is_in_one_design_or_by_its_field(layers):
    made = group_layers(layers)
    assert len({own.name for own in made}) == len(made)
    for own in layers:
        count = sum(own.key in group.layers for group in made)
        assert count == (len(own.designs) if own.designs else int(own.tool != ""))
    # layers of one run are never parted
    home = {key: group.name for group in made for key in group.layers if key not in group.by_field}
    by_run: dict[tuple[str, str, str], set[str]] = {}
    for own in layers:
        if own.key in home:
            by_run.setdefault(own.run, set()).add(home[own.key])
    assert all(len(names) == 1 for names in by_run.values())


def test_the_order_of_layers_is_kept():
    layers = [layer(str(number)) for number in range(5)]
    (made,) = group_layers([replace(own) for own in layers])
    assert made.layers == ("0", "1", "2", "3", "4")


def test_names_that_are_made_up_are_no_names_of_the_planner():
    found = groups(
        layer("a", run="1"), layer("b", run="2"), layer("c", run="3"), asked={"Design 2": ["a"]}
    )
    assert found["Design 2"] == {"a"}
    assert sorted(map(len, found.values())) == [1, 1, 1]
    assert len(found) == 3


def test_a_city_and_a_street_design_are_two_designs():
    city, streets = layer("city", "designcity", "1"), layer("streets", run="2")
    assert len(groups(city, streets)) == 2
