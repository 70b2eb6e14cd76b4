"""Saved models with the tools of parcels behind those of streets, through the real program."""

from __future__ import annotations

import importlib
import sys

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = [pytest.mark.qgis, pytest.mark.slow]

import test_binary as binary  # noqa: E402
from qgis.core import QgsGeometry  # noqa: E402

# Its fixtures serve here, too.
environment = binary.environment
qgis_process = binary.qgis_process
sample = binary.sample

#: What is asked of the tools that make streets.
WISHES = {
    "growstreets": {"GRAMMAR": "grid", "SCALE": 60},
    "designstreets": {"TIME_LIMIT": 4, "BLOCK_WIDTH": 80},
}


@pytest.fixture(scope="module")
def draft(root, toolbox):
    """Import what the shipped models are put together with."""
    sys.path.insert(0, str(root / "scripts"))
    yield importlib.import_module("_model_draft")
    sys.path.remove(str(root / "scripts"))


def chain(draft, first, behind):
    """Put a model together: streets, parcels in blocks, one that changes them, all measures."""
    asked, made, value = draft.asked, draft.made, draft.value
    model = draft.Draft(f"{first}{behind}", "Chain", "Tests.", "Tests.")
    for key in ("INPUT", "ROADS", "OBSTACLES"):
        model.input(draft.of_tool("preparesite", key))
    site, roads = {"SITE": asked("INPUT")}, {"ROADS": asked("ROADS")}
    model.step(
        "streets", f"platwright:{first}", "Streets",
        {
            "INPUT": asked("INPUT"), "OBSTACLES": asked("OBSTACLES"), **roads,
            "SNAP_DISTANCE": value(60),
            **{key: value(wish) for key, wish in WISHES[first].items()},
        },
        STREETS="Streets",
    )  # fmt: skip
    # measured streets are still streets: parcels are made of what the measure gives
    model.step(
        "net", "platwright:measurestreets", "Network",
        {"INPUT": made("streets", "STREETS"), **site}, OUTPUT="Network",
    )  # fmt: skip
    parcels = {"OBSTACLES": asked("OBSTACLES"), "SNAP_DISTANCE": value(60)}
    model.step(
        "parcels", "platwright:parcelblocks", "Parcels",
        {"STREETS": made("net", "OUTPUT"), **site, **parcels},
        PARCELS="Parcels",
    )  # fmt: skip
    steps = {
        # the site has obstacles in it: without it the parcels and their streets are the land
        "optimiselayout": {
            "INPUT_PARCELS": made("parcels", "PARCELS"),
            "INPUT_STREETS": made("streets", "STREETS"),
        },
        "resplitlayout": {
            "INPUT": made("parcels", "PARCELS"), "INPUT_STREETS": made("streets", "STREETS"),
            **site, "WHERE": value("\"block_id\" = 1"),
        },
    }  # fmt: skip
    model.step(
        "changed", f"platwright:{behind}", "Changed",
        {**steps[behind], **roads, "SNAP_DISTANCE": value(60)}, PARCELS="Changed",
    )  # fmt: skip
    model.step(
        "measured", "platwright:measureparcels", "Measured",
        {"INPUT": made("changed", "PARCELS"), "STREETS": made("streets", "STREETS"), **site},
        OUTPUT="Measured",
    )  # fmt: skip
    model.step(
        "shares", "platwright:measurelanduse", "Shares",
        {"INPUT": made("changed", "PARCELS"), "STREETS": made("streets", "STREETS"), **site},
        OUTPUT="Shares",
    )  # fmt: skip
    return model


OUTPUTS = ("streets:STREETS", "net:OUTPUT", "parcels:PARCELS", "changed:PARCELS",
           "measured:OUTPUT", "shares:OUTPUT")  # fmt: skip


@pytest.mark.parametrize("first", sorted(WISHES))
@pytest.mark.parametrize("behind", ["optimiselayout", "resplitlayout"])
def test_parcels_behind_streets_in_a_saved_model(
    draft, qgis_process, sample, tmp_path, first, behind
):
    saved = tmp_path / f"{first}_{behind}.model3"
    saved.write_text(chain(draft, first, behind).text(), encoding="utf-8")
    paths = {key: tmp_path / f"{key.replace(':', '_')}.gpkg" for key in OUTPUTS}
    given = {
        "INPUT": f"{sample}|layername=site", "ROADS": f"{sample}|layername=streets",
        "OBSTACLES": f"{sample}|layername=obstacles",
    }  # fmt: skip
    said = qgis_process(
        "run", str(saved), *(f"--{key}={text}" for key, text in {**given, **paths}.items()),
        timeout=300,
    )  # fmt: skip
    found = {key: binary.rows(path) for key, path in paths.items()}
    assert any(row["status"] == "new" for row in found["streets:STREETS"]), said
    net = found["net:OUTPUT"]
    assert len(net) == len(found["streets:STREETS"])
    # pieces of existing streets under half a metre are one place
    assert all(row["betweenness"] >= 0 for row in net if row["length_m"] > 0.5)
    assert {row["natural_id"] for row in net} >= {1, 2, 3}
    before, after = found["parcels:PARCELS"], found["changed:PARCELS"]
    lots = [row for row in after if row["land_use"] == "parcel"]
    assert len(lots) > 40, said
    # No land is lost, whatever became of it, and nothing overlaps.
    size = sum(row["geometry"].area() for row in before)
    assert sum(row["geometry"].area() for row in after) == pytest.approx(size, rel=0.05)
    whole = QgsGeometry.unaryUnion([row["geometry"] for row in after])
    assert whole.area() == pytest.approx(sum(r["geometry"].area() for r in after), rel=1e-4)
    measured = found["measured:OUTPUT"]
    assert len(measured) == len(after)
    assert all(row["p_area"] >= 0.999 for row in measured if row["land_use"] == "parcel")
    shares = {row["land_use"]: row["share_pct"] for row in found["shares:OUTPUT"]}
    assert shares["all"] == pytest.approx(100, abs=0.5)
    assert shares["parcels"] > 20
    assert shares["streets"] > 5


def test_the_shipped_model_on_a_real_site(qgis_process, sample, tmp_path):
    keys = ("streets:STREETS", "parcels:PARCELS", "parcels:BLOCKS", "measures:HISTOGRAM")
    paths = {key: tmp_path / f"{key.replace(':', '_')}.gpkg" for key in keys}
    said = qgis_process(
        "run", "platwright:growstreetsandparcels", f"--INPUT={sample}|layername=site",
        f"--ROADS={sample}|layername=streets", f"--OBSTACLES={sample}|layername=obstacles",
        "--SNAP_DISTANCE=60", "--GRAMMAR=grid",
        *(f"--{key}={path}" for key, path in paths.items()), timeout=200,
    )  # fmt: skip
    found = {key: binary.rows(path) for key, path in paths.items()}
    streets = found["streets:STREETS"]
    assert sum(row["length_m"] for row in streets if row["status"] == "new") > 500, said
    lots = [row for row in found["parcels:PARCELS"] if row["land_use"] == "parcel"]
    assert len(lots) > 40
    assert sum(row["access"] for row in lots) == len(lots)
    counted = [row for row in found["measures:HISTOGRAM"] if row["measure"] == "p_angle"]
    assert sum(row["count"] for row in counted) == len(lots)
