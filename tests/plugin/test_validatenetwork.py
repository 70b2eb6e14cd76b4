"""Validate street network: what is wrong is found, what is right is left in peace."""

from __future__ import annotations

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis

from support import ROADS, layer, line, roads, site  # noqa: E402


def streets(*lines, status="new"):
    return layer(
        list(lines),
        kind="LineString",
        name="drawn",
        fields="field=status:string(20)",
        values=[[status]] * len(lines),
    )


CROSS = [
    line((150, 0), (150, 100)), line((150, 100), (150, 200)),
    line((0, 100), (150, 100)), line((150, 100), (300, 100)),
]  # fmt: skip


def kinds(run, severity="error"):
    return sorted(p["kind"] for p in run.rows("PROBLEMS") if p["severity"] == severity)


def test_a_sound_network_has_no_problem(toolbox):
    run = toolbox.run("validatenetwork", INPUT=streets(*CROSS), SITE=site())
    assert run.results["VIOLATIONS"] == 0
    assert run.results["TOTAL_LENGTH"] == pytest.approx(500)
    # half way along a street of 150 m between the edge and a place 100 m from it
    assert run.results["MAX_DISTANCE"] == pytest.approx(125)
    assert run.rows("PROBLEMS") == []


def test_a_grid_with_t_junctions_is_no_list_of_problems(toolbox):
    stubs = [line((60, 100), (60, 200)), line((60, 0), (60, 100)), line((75, 0), (75, 200))]
    run = toolbox.run("validatenetwork", INPUT=streets(*CROSS[:2], *stubs), SITE=site())
    assert kinds(run, "warning") == []
    run = toolbox.run(
        "validatenetwork", INPUT=streets(*CROSS[:2], *stubs), SITE=site(), TOO_CLOSE="discourage"
    )
    assert "too close" in kinds(run, "warning")


def test_without_a_range_no_uncovered_area_is_told(toolbox):
    run = toolbox.run("validatenetwork", INPUT=streets(*CROSS), SITE=site())
    assert run.results["UNCOVERED_AREA"] is None
    assert not any("coverage" in text for text in run.said.infos)


def test_dead_ends_and_islands_are_found_and_explained(toolbox):
    island = line((40, 40), (60, 60))
    stub = line((150, 100), (220, 160))
    run = toolbox.run("validatenetwork", INPUT=streets(*CROSS, island, stub), SITE=site())
    assert "island" in kinds(run)
    assert "dead end" in kinds(run)
    assert run.results["VIOLATIONS"] == len(kinds(run))
    for problem in run.rows("PROBLEMS"):
        assert problem["layer"] == "drawn"
        assert problem["feature"]
        assert problem["problem"].endswith(".")
        assert problem["action"].endswith(".")
        assert not problem["geometry"].isNull()


@pytest.mark.parametrize(
    ("word", "errors", "warnings"),
    [("forbid", ["dead end"], []), ("discourage", [], ["dead end"]), ("allow", [], [])],
)
def test_words_decide_what_is_an_error(toolbox, word, errors, warnings):
    stub = line((150, 100), (220, 160))
    run = toolbox.run("validatenetwork", INPUT=streets(*CROSS, stub), SITE=site(), DEAD_ENDS=word)
    assert kinds(run) == errors
    assert kinds(run, "warning") == warnings
    assert run.results["WARNINGS"] == len(warnings)


def test_coverage_is_measured_in_metres(toolbox):
    near = toolbox.run("validatenetwork", INPUT=streets(*CROSS), SITE=site(), COVERAGE=90)
    far = toolbox.run("validatenetwork", INPUT=streets(*CROSS), SITE=site(), COVERAGE=50)
    assert near.results["UNCOVERED_AREA"] < 2000
    assert far.results["UNCOVERED_AREA"] > 8000
    assert "coverage" in kinds(far)


def test_streets_on_obstacles_and_outside_are_found(toolbox):
    from support import box

    run = toolbox.run(
        "validatenetwork",
        INPUT=streets(*CROSS, line((0, 100), (-150, 100))),
        SITE=site(),
        OBSTACLES=layer([box(120, 20, 60, 60)]),
    )
    assert {"obstacle", "outside"} <= set(kinds(run))


def test_existing_streets_beside_the_site_are_the_way_out(toolbox):
    inner = [line((150, -8), (150, 100)), line((150, 100), (150, 208))]
    run = toolbox.run(
        "validatenetwork", INPUT=streets(*inner), SITE=site(), BOUNDARY_STREETS=roads()
    )
    assert "island" not in kinds(run)
    assert len(ROADS) == 5


def directed(*lines, ways):
    return layer(
        list(lines),
        kind="LineString",
        name="drawn",
        fields="field=status:string(20)&field=oneway:string(8)",
        values=[["new", way] for way in ways],
    )


def test_limits_of_the_whole_network_are_checked_where_they_are_given(toolbox):
    ladder = [
        line((a, 0), (a, 100)) for a in (100, 150)
    ] + [line((a, 100), (a, 200)) for a in (100, 150)] + [line((100, 100), (150, 100))]  # fmt: skip
    free = toolbox.run("validatenetwork", INPUT=streets(*ladder), SITE=site())
    assert free.rows("PROBLEMS") == []
    limits = {"EXITS": 3, "LENGTH_BUDGET": 400, "MAX_DISTANCE": 90, "JUNCTION_SPACING": 60}
    run = toolbox.run("validatenetwork", INPUT=streets(*ladder), SITE=site(), **limits)
    expected = ["exits", "junction spacing", "length budget", "way out", "way out"]
    assert kinds(run) == expected
    for problem in run.rows("PROBLEMS"):
        assert problem["feature"]
        assert problem["action"].startswith(("Take", "Move", "Join"))
    limits = {"EXITS": 4, "LENGTH_BUDGET": 450, "MAX_DISTANCE": 100, "JUNCTION_SPACING": 50}
    kept = toolbox.run("validatenetwork", INPUT=streets(*ladder), SITE=site(), **limits)
    assert kept.rows("PROBLEMS") == []


def test_one_way_streets_that_lead_nowhere_are_found(toolbox):
    sound = directed(*CROSS, ways=["true", "false", "false", "false"])
    assert toolbox.run("validatenetwork", INPUT=sound, SITE=site()).rows("PROBLEMS") == []
    # the second and the fourth of the arms are drawn outwards
    trap = directed(*CROSS, ways=["true", "-1", "true", "-1"])
    assert kinds(toolbox.run("validatenetwork", INPUT=trap, SITE=site())) == ["one-way"]


def test_areas_have_ranges_of_their_own(toolbox):
    from support import box

    areas = {
        "kind": "Polygon",
        "name": "ranges",
        "fields": "field=far:double",
    }
    halves = [box(0, 0, 150, 200), box(150, 0, 150, 200)]
    density = layer(halves, values=[[40.0], [200.0]], **areas)
    run = toolbox.run(
        "validatenetwork",
        INPUT=streets(*CROSS),
        SITE=site(),
        DENSITY=density,
        DENSITY_FIELD="far",
    )
    assert set(kinds(run)) == {"coverage"}
    assert run.results["UNCOVERED_AREA"] > 8000
    assert all(problem["geometry"].asPoint().x() < 500150 for problem in run.rows("PROBLEMS"))


def test_areas_without_the_field_are_refused(toolbox):
    from support import box

    with pytest.raises(Exception, match="has no field 'coverage_m'"):
        toolbox.run(
            "validatenetwork",
            INPUT=streets(*CROSS),
            SITE=site(),
            DENSITY=layer([box(0, 0, 150, 200)]),
        )
