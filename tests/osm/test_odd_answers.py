"""Answers that are good JSON but not what they should be: never an error that nobody planned."""

from __future__ import annotations

import pytest
import shapely
from hypothesis import HealthCheck, given
from hypothesis import settings as rules
from hypothesis import strategies as st
from platwright.errors import PlatwrightError
from platwright.osm import OsmSettings, boundaries
from platwright.osm.transport import Transport

anything = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5),
    st.lists(st.integers(), max_size=2),
    st.dictionaries(st.text(max_size=3), st.none(), max_size=1),
)  # fmt: skip
square = {"type": "Polygon", "coordinates": [[[7, 43], [8, 43], [8, 44], [7, 43]]]}
geometry = st.one_of(
    anything,
    st.sampled_from(
        [
            square,
            {"type": "Polygon", "coordinates": []},
            {"type": "Polygon", "coordinates": [[[7, 43], [8, 43]]]},
            {"type": "Polygon", "coordinates": [[["a", "b"]]]},
            {"type": "MultiPolygon", "coordinates": [[[[7, 43], [8, 43], [8, 44], [7, 43]]], []]},
            {"type": "Point", "coordinates": [7.5, 43.5]},
            {"type": "Circle", "coordinates": [1, 2]},
        ]
    ),
)
texts = ("name", "display_name", "type", "class", "licence")
places = st.lists(
    st.fixed_dictionaries(
        {},
        optional={
            "osm_type": st.one_of(st.sampled_from(["node", "way", "relation"]), anything),
            "osm_id": st.one_of(st.integers(1, 9), anything),
            "geojson": geometry,
            **dict.fromkeys(("importance", "place_rank", "lat", "lon"), anything),
            **dict.fromkeys(texts, anything),
        },
    ),
    max_size=3,
)
points = st.lists(
    st.one_of(
        st.just(None),
        st.fixed_dictionaries(
            {"lon": st.sampled_from([7, 8, 9]), "lat": st.sampled_from([43, 44])}
        ),
    ),
    max_size=5,
)
elements = st.lists(
    st.fixed_dictionaries(
        {"type": st.sampled_from(["node", "way", "relation", "area", None])},
        optional={
            "id": st.integers(1, 9),
            "tags": st.dictionaries(
                st.sampled_from(["name", "boundary", "admin_level", "name:fr"]), st.text(max_size=5)
            ),
            "bounds": st.one_of(
                st.none(),
                st.just({"minlon": 7, "maxlon": 8, "minlat": 43, "maxlat": 44}),
                st.just({"minlon": "x"}),
            ),
            "geometry": points,
            "members": st.lists(
                st.fixed_dictionaries(
                    {"type": st.just("way"), "role": st.sampled_from(["outer", "inner", "x", ""])},
                    optional={"geometry": points},
                ),
                max_size=3,
            ),
        },
    ),
    max_size=3,
)
questions = st.sampled_from(
    [{"place": "Somewhere"}, {"place": "R5"}, {"place": "N5"}, {"point": (7.5, 43.5)}]
)


@given(questions, places, elements)
@rules(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_layer_or_a_sentence(monkeypatch, question, found, mapped):
    monkeypatch.setattr(Transport, "nominatim", lambda *_: [dict(place) for place in found])
    monkeypatch.setattr(Transport, "overpass", lambda *_: {"elements": mapped})
    try:
        frame = boundaries(settings=OsmSettings(rate_limit=False), **question)
    except PlatwrightError as error:
        said = str(error)
    else:
        said = "a layer." if shapely.is_valid(frame.geometry.to_numpy()).all() else "nonsense"
        assert (frame["area_ha"] > 0).all()
        assert frame["osm_id"].str.fullmatch(r"[WR]\d+").all()
    assert said.endswith(".")


@pytest.mark.parametrize("data", [[{"a": 1}], []])
def test_nothing_found_is_a_sentence(monkeypatch, data):
    monkeypatch.setattr(Transport, "nominatim", lambda *_: data)
    monkeypatch.setattr(Transport, "overpass", lambda *_: {"elements": []})
    with pytest.raises(PlatwrightError):
        boundaries("Somewhere", settings=OsmSettings(rate_limit=False))
