"""Grounds of real sites and road layers; skipped where the data folder is absent."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
import shapely
from platwright.growth.grammars.shipped import shipped_grammar
from platwright.growth.land.ground import ground_of_roads, ground_of_sites
from platwright.site import prepare_sites

from .ground_checks import check_ground

ORGANIC = shipped_grammar("organic")


def sites_of(shared_data, number, inner_roads="ignore"):
    (path,) = (shared_data / "sites").glob(f"{number:02d}_*.gpkg")
    frames = [gpd.read_file(path, layer=layer) for layer in ("site", "streets")]
    if "obstacles" in gpd.list_layers(path)["name"].tolist():
        frames.append(gpd.read_file(path, layer="obstacles"))
    return prepare_sites(*frames, inner_roads=inner_roads).sites


@pytest.mark.parametrize("number", range(1, 13))
def test_every_site_becomes_a_ground(shared_data, number):
    for inner_roads, edge in (("keep", "stop"), ("ignore", "join")):
        sites = sites_of(shared_data, number, inner_roads)
        real = ground_of_sites(sites, ORGANIC, edge=edge, obstacle_edge=edge, scale=30)
        check_ground(real, [s.line for s in (*sites[0].boundary_streets, *sites[0].inner_streets)])
        (site,) = sites
        # the strip to the centre lines is added, obstacles are taken away
        free = site.polygon.difference(site.obstacle_union)
        assert free.difference(real.ground.domain).area < 0.001 * free.area
        assert real.ground.domain.area < 1.35 * free.area
        barred = real.ground.domain.intersection(site.obstacle_union).area
        assert barred <= 0.11 * sum(s.line.length for s in real.streets if s.edge) + 1e-3
        if edge == "stop":
            assert not any(street.edge for street in real.streets)
            continue
        # roads from outside go on, but for those that do so already or have no room
        arrived = sum(
            any(np.hypot(*np.subtract(s.xy, p.junction)) < 60 for s in real.ground.starts)
            for p in site.access_points
        )
        assert arrived >= 0.5 * len(site.access_points)


def test_a_town_of_three_thousand_roads(shared_data):
    roads = gpd.read_file(shared_data / "town" / "baltimore_se_md.gpkg", layer="streets")
    real = ground_of_roads(roads, ORGANIC, scale=80)
    cars = roads[~roads["highway"].isin(["footway", "path", "steps", "cycleway", "pedestrian"])]
    check_ground(real, None)
    assert len(real.ground.starts) > 100
    # streets are where the roads are: every piece of them lies on a road of the layer
    middles = shapely.points(real.ground.nodes[real.ground.ends].mean(axis=1))
    tree = shapely.STRtree(cars.geometry.to_numpy())
    near = tree.query(middles, predicate="dwithin", distance=1e-6)[0]
    assert len(np.unique(near)) == len(middles)
    # none begins inside a block
    blocks = shapely.get_parts(
        shapely.polygonize(shapely.linestrings(real.ground.nodes[real.ground.ends]))
    )
    blocks = blocks[shapely.area(blocks) < 1e5]
    ahead = [np.add(s.xy, np.multiply(5.0, s.direction)) for s in real.ground.starts]
    inside = shapely.STRtree(blocks).query(shapely.points(ahead), predicate="within")[0]
    assert len(inside) == 0


def test_a_layer_in_degrees_has_the_same_starts(shared_data):
    roads = gpd.read_file(shared_data / "town" / "vaduz_li.gpkg", layer="streets")
    plane = ground_of_roads(roads, ORGANIC, scale=60)
    degrees = ground_of_roads(roads.to_crs(4326), ORGANIC, scale=60)
    assert degrees.crs.axis_info[0].unit_name == "metre"
    assert degrees.source_crs.to_epsg() == 4326
    assert len(degrees.ground.starts) == len(plane.ground.starts)
    moved = gpd.GeoSeries(
        gpd.points_from_xy(*zip(*(s.xy for s in degrees.ground.starts))), crs=degrees.crs
    ).to_crs(plane.crs)
    ours = shapely.STRtree(shapely.points([s.xy for s in plane.ground.starts]))
    assert ours.query_nearest(moved.to_numpy(), return_distance=True)[1].max() < 1.0


def test_pieces_that_do_not_meet(shared_data):
    frame = gpd.read_file(
        shared_data / "bad" / "momepy_tests_broken_networks.gpkg", layer="broken_network"
    )
    real = ground_of_roads(frame, ORGANIC, scale=30)
    check_ground(real, None)


@pytest.mark.parametrize("layer", ["streets_metres", "streets_us_feet"])
def test_layers_in_degrees_metres_and_feet_meet(shared_data, layer):
    path = shared_data / "bad" / "derived_mixed_crs.gpkg"
    site, streets = (gpd.read_file(path, layer=name) for name in ("site_degrees", layer))
    real = ground_of_sites(prepare_sites(site, streets).sites, ORGANIC, scale=30)
    check_ground(real, None)
    assert real.source_crs.to_epsg() == 4326
    assert len(real.ground.starts) >= 5
