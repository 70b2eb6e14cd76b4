import pytest
from pathlib import Path


@pytest.mark.parametrize(
    "kw",
    [
        {},
        dict(SNAP_DISTANCE=60),
        dict(SNAP_DISTANCE=60, SINK_MODE="access points"),
        dict(SNAP_DISTANCE=60, RULES="as in the paper"),
        dict(SNAP_DISTANCE=60, RULES="as in the paper", LEVELS=1),
    ],
)
def test_y(toolbox, root, kw):
    from qgis.core import QgsVectorLayer

    S = str(root / "data/helsinki/helsinki_yard.gpkg")
    r = toolbox.run(
        "designstreets",
        INPUT=S + "|layername=site",
        ROADS=S + "|layername=streets",
        OBSTACLES=S + "|layername=obstacles",
        TIME_LIMIT=6,
        **kw,
    )
    assert r.results["VIOLATIONS"] == 0, [
        (p["problem"], p["geometry"].asWkt()[:60])
        for p in r.rows("PROBLEMS")
        if p["severity"] == "error"
    ]
