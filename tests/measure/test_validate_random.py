"""The checker on random networks, against plain searches, and on real streets."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.measure import validate_network
from shapely.geometry import LineString, Point, box

# A plane in metres, true to scale around its origin.
CRS = "+proj=tmerc +lat_0=60 +lon_0=25 +k=1 +datum=WGS84 +units=m +type=crs"
H = 40.0


def layer(*shapes, **columns):
    return gpd.GeoDataFrame(columns, geometry=list(shapes), crs=CRS)


def kinds(streets, **options):
    return sorted(validate_network(streets, edge_length=H, **options).problems["kind"])


def grid_lines(nx, ny, h):
    """Streets of a grid between the sides of its rectangle, cut at the junctions."""
    rows = [((i, j), (i + 1, j)) for i in range(nx) for j in range(1, ny)]
    columns = [((i, j), (i, j + 1)) for i in range(1, nx) for j in range(ny)]
    return [LineString([(h * a[0], h * a[1]), (h * b[0], h * b[1])]) for a, b in rows + columns]


@settings(deadline=None, max_examples=25)
@given(nx=st.integers(2, 6), ny=st.integers(2, 5), data=st.data())
def test_grids_are_clean_and_lose_it_with_one_fault(nx, ny, data):
    h = 80.0
    site = layer(box(0, 0, nx * h, ny * h))
    lines = grid_lines(nx, ny, h)
    rules = {"site": site, "coverage_m": h, "zigzags": np.inf, "too_close": np.inf}
    report = validate_network(layer(*lines), edge_length=H, **rules)
    assert report.problems.empty
    assert report.numbers["TOTAL_LENGTH"] == pytest.approx(h * len(lines))

    # Without one street, each of its inner ends is a T-junction, a bend or a dead end.
    gone = data.draw(st.integers(0, len(lines) - 1))
    rest = lines[:gone] + lines[gone + 1 :]
    changed = validate_network(layer(*rest), edge_length=H, **rules) if rest else None
    inner = [p for p in lines[gone].coords if 0 < p[0] < nx * h and 0 < p[1] < ny * h]
    if changed is not None:
        assert changed.numbers["T_JUNCTION"] == len(inner)

    # A spur from the middle of a block is a dead end and nothing else.
    host = data.draw(st.sampled_from(lines))
    middle = host.interpolate(0.5, normalized=True)
    dx, dy = (host.coords[1][k] - host.coords[0][k] for k in (0, 1))
    spur = LineString([middle, (middle.x - dy * 0.4, middle.y + dx * 0.4)])
    assert kinds(layer(*lines, spur), **rules | {"zigzags": 0.0}) == ["dead end"]


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10**6))
def test_random_networks_agree_with_a_plain_search(seed):
    """Islands and dead ends on random pieces of a grid, against a search by hand."""
    random = np.random.default_rng(seed)
    h, n = 80.0, 5
    lines = [s for s in grid_lines(n, n, h) if random.random() < 0.5]
    if not lines:
        return
    report = validate_network(
        layer(*lines), site=layer(box(0, 0, n * h, n * h)), edge_length=H, dead_ends=np.inf
    )
    neighbours: dict[tuple[float, float], list[tuple[float, float]]] = {}
    for street in lines:
        a, b = street.coords
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    edge = {p for p in neighbours if {0.0, n * h} & set(p)}
    seen, todo = set(edge), list(edge)
    while todo:
        fresh = [q for q in neighbours[todo.pop()] if q not in seen]
        seen |= set(fresh)
        todo += fresh
    lost, islands = set(neighbours) - seen, 0
    while lost:
        islands += 1
        todo = [lost.pop()]
        while todo:
            fresh = [q for q in neighbours[todo.pop()] if q in lost]
            lost -= set(fresh)
            todo += fresh
    found = report.problems["kind"].tolist()
    assert found.count("island") == islands
    blind = sum(len(near) == 1 for p, near in neighbours.items() if p not in edge)
    assert found.count("dead end") == blind


def random_streets(seed, n, share):
    """Random edges of a grid of n by n unit cells, its sides left out, as pairs of points."""
    random = np.random.default_rng(seed)
    rows = [((i, j), (i + 1, j)) for i in range(n) for j in range(1, n)]
    columns = [((i, j), (i, j + 1)) for i in range(1, n) for j in range(n)]
    return {pair for pair in rows + columns if random.random() < share}


def active(streets, a, b):
    return (min(a, b), max(a, b)) in streets


def moved(point, step):
    return (point[0] + step[0], point[1] + step[1])


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6), st.sampled_from([0.2, 0.35, 0.5, 0.8]))
def test_zigzags_are_those_of_the_mesh(seed, share):
    """Against the definition on a grid: three edges around one, two opposite turns."""
    streets = random_streets(seed, 5, share)
    expected = set()
    for a, b in streets:
        along = (b[0] - a[0], b[1] - a[1])
        for side in (1, -1):
            off = (-along[1] * side, along[0] * side)
            if active(streets, a, moved(a, off)) and active(
                streets, b, moved(b, (-off[0], -off[1]))
            ):
                expected.add((a, b))
    drawn = [LineString(np.array(pair) * H) for pair in sorted(streets)]
    report = validate_network(layer(*drawn), edge_length=H, dead_ends=0, zigzags=np.inf)
    zigzags = report.problems[report.problems["kind"] == "zigzag"]
    found = {
        tuple(sorted((round(x / H), round(y / H)) for x, y in line.coords))
        for line in zigzags.geometry
    }
    assert found <= expected
    assert bool(found) == bool(expected)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10**6), st.sampled_from([0.1, 0.2, 0.3]))
def test_streets_too_close_are_those_of_the_mesh(seed, share):
    """Against the definition on a grid: opposite edges of one cell.

    The scale of the check is 1.9 cells, so that one cell is too close (0.6 times that) and
    one edge is long enough (0.5 times that).
    """
    streets = random_streets(seed, 5, share)
    expected = any(
        active(streets, moved(a, (-(b[1] - a[1]), b[0] - a[0])),
               moved(b, (-(b[1] - a[1]), b[0] - a[0])))
        for a, b in streets
    )  # fmt: skip
    drawn = [LineString(np.array(pair) * H) for pair in sorted(streets)]
    report = validate_network(layer(*drawn), edge_length=1.9 * H)
    assert (report.numbers["TOO_CLOSE"] > 0) == expected


@pytest.mark.parametrize(
    ("file", "name"),
    [("parcels/bubenec_prague.gpkg", "streets"), ("town/vaduz_li.gpkg", "streets")],
)
def test_dead_ends_of_real_streets(shared_data, file, name):
    """Against a count by distances alone: an end that no other line comes near."""
    streets = gpd.read_file(shared_data / file, layer=name)
    plane = streets.to_crs(streets.estimate_utm_crs()).explode(ignore_index=True)
    alone = [
        Point(street.coords[side])
        for k, street in enumerate(plane.geometry)
        for side in (0, -1)
        if plane.geometry.drop(k).distance(Point(street.coords[side])).min() > 0.5
        and list(street.coords).count(street.coords[side]) == 1  # no ring, no ring on a stem
    ]
    report = validate_network(streets, edge_length=H)
    assert report.numbers["DEAD_END"] == len(alone) > 5
    found = report.problems[report.problems["kind"] == "dead end"].to_crs(plane.crs)
    assert max(found.geometry.distance(at).min() for at in alone) < 1


@pytest.mark.parametrize("name", ["streets_m", "streets_zm"])
@pytest.mark.filterwarnings("ignore:Measured:UserWarning")
def test_real_lines_with_heights_and_measures(shared_data, name):
    streets = gpd.read_file(shared_data / "bad" / "derived_m_zm_streets.gpkg", layer=name)
    report = validate_network(streets, edge_length=H)
    assert report.numbers["TOTAL_LENGTH"] > 100
    assert not report.problems.geometry.has_z.any()
