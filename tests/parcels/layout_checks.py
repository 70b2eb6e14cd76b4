"""What every layout must keep, by independent code; small sites."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
import shapely
from platwright.parcels.roadmesh import Ground
from platwright.parcels.roadmesh.streets import street_lines
from platwright.parcels.rules import ParcelRules
from platwright.parcels.split import Layout, SplitRules
from platwright.site import Site
from pyproj import CRS
from shapely.geometry import LineString, MultiLineString, Polygon

UTM = CRS.from_epsg(25832)
RULES = ParcelRules()
QUICK = SplitRules(tries=2)


def ground(polygon: Polygon, *open_lines: LineString) -> Ground:
    """A site with streets along some lines, or along its whole outer edge."""
    front = open_lines or (LineString(polygon.exterior),)
    return Ground(polygon, MultiLineString(front))


def site_of(polygon: Polygon) -> Site:
    return Site(
        name="Test site", feature=7, polygon=polygon, crs=UTM, source_crs=UTM,
        street_frontage=MultiLineString([LineString(polygon.exterior)]),
    )  # fmt: skip


def check(layout: Layout, *, access: bool = True) -> None:
    """Plots and street space tile the site; parcels have streets; streets lead out."""
    site = layout.ground.polygon
    plots = [plot for many in layout.plots for plot in many]
    shapes = np.array([plot.polygon for plot in plots], dtype=object)
    assert shapely.is_valid(shapes).all()
    land = shapely.union_all(shapes)
    assert shapely.area(shapes).sum() == pytest.approx(land.area, rel=1e-6)
    assert land.difference(site).area < 1e-6 * site.area
    space = [s.line.buffer(s.width / 2 - 0.01) for s in street_lines(layout.mesh)]
    street = shapely.union_all(space)
    assert land.intersection(street).area < 1e-3 * site.area
    if access:
        # what is no plot is street space, to a metre beyond its edges
        ways = shapely.union_all(
            [site.difference(land), *(p.polygon for p in plots if p.use in ("lane", "street"))]
        ).buffer(0.1)
        open_edge = shapely.union_all([ways, layout.ground.frontage.buffer(0.1)])
        for plot in plots:
            if plot.use == "parcel":
                length = plot.polygon.exterior.intersection(open_edge).length
                assert length >= RULES.min_frontage - 0.5
    graph = nx.Graph()
    for s in street_lines(layout.mesh):
        graph.add_edge(*s.ends)
    edge = layout.ground.frontage
    for part in nx.connected_components(graph):
        assert min(edge.distance(shapely.Point(layout.mesh.xy[v])) for v in part) < 1e-6
