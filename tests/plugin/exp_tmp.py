import pytest
from support import *
@pytest.mark.parametrize("kw",[dict(SINK_MODE="access points"),dict(SINK_MODE="whole boundary"),dict(SINK_MODE="given points"),dict(SINK_MODE="given points",mid=1),dict(RULES="as in the paper",LEVELS=1,BLOCK_WIDTH=100),dict(RULES="as in the paper",LEVELS=2,BLOCK_WIDTH=100),dict(req=1),dict(forb=1),dict(RULES="as in the paper",LEVELS=1,BLOCK_WIDTH=100,SINK_MODE="access points"), dict(big=1), dict(big=1,RULES="as in the paper",BLOCK_WIDTH=150)])
def test_x(toolbox, kw):
    kw=dict(kw)
    mid=kw.pop("mid",0)
    if kw.get("SINK_MODE")=="given points":
        kw["SINKS"]=layer([point(150,0)] if not mid else [point(100,0),point(110,100)],kind="Point")
    if kw.pop("req",0): kw["REQUIRED"]=layer([line((75, 5), (75, 195))], kind="LineString")
    if kw.pop("forb",0):
        kw["FORBIDDEN"]=layer([line((20, 150), (90, 150))], kind="LineString"); kw["OBSTACLES"]=layer([box(110, 60, 80, 80)])
    g=layer([box(0,0,900,700)]) if kw.pop("big",0) else site()
    r=toolbox.run("designstreets",INPUT=g,ROADS=roads() if g.name()=="my site" else None,TIME_LIMIT=3,**kw)
    assert r.results["VIOLATIONS"]==0,[(p["problem"],p["geometry"].asWkt()[:60]) for p in r.rows("PROBLEMS")]
