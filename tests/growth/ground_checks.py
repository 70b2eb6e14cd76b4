"""What every ground must keep, checked by overlays and lines alone."""

from __future__ import annotations

import math

import numpy as np
import shapely


def crossings(lines):
    """Pairs of straight lines that share a point which is no end of both."""
    first, second = shapely.STRtree(lines).query(lines, predicate="intersects")
    some = first < second
    first, second = first[some], second[some]
    shared = shapely.intersection(lines[first], lines[second])
    ends = shapely.boundary(lines)
    fine = shapely.get_type_id(shared) == 0
    fine &= shapely.distance(shared, ends[first]) < 1e-9
    fine &= shapely.distance(shared, ends[second]) < 1e-9
    return list(zip(first[~fine].tolist(), second[~fine].tolist()))


def check_ground(real, given, tolerance=1e-6):
    """Hold what a `RealGround` promises; `given` are the lines that it was made of, if known."""
    ground = real.ground
    n, e = len(ground.nodes), len(ground.ends)
    assert ground.street.shape == (e,)
    assert ground.bends.shape == (n,)
    assert real.crs.is_projected
    if e:
        lines = shapely.linestrings(ground.nodes[ground.ends])
        assert crossings(lines) == []
        assert shapely.length(lines).min() > 0
        assert len({tuple(sorted(pair)) for pair in ground.ends.tolist()}) == e
        assert set(ground.street.tolist()) == set(range(len(real.streets)))
        # each street is the chain of its pieces
        order = np.argsort(ground.street, kind="stable")
        own = shapely.multilinestrings(lines[order], indices=ground.street[order])
        streets = np.array([street.line for street in real.streets], dtype=object)
        assert shapely.hausdorff_distance(own, streets).max() < 2 * tolerance
        simple = shapely.is_simple(streets)
        assert abs(shapely.length(own) - shapely.length(streets))[simple].max(initial=0) < 1e-3
        assert_bends(ground)
    if given is not None:
        new = shapely.multilinestrings(shapely.linestrings(ground.nodes[ground.ends]))
        around, given = new.buffer(1e-3), np.array(given, dtype=object)
        # nothing of the streets is lost, and none of them moves
        assert shapely.length(shapely.difference(given, around)).max() < 1e-3
        vertices = shapely.points(shapely.get_coordinates(given))
        assert shapely.distance(vertices, new).max() < 2 * tolerance
    assert ground.starts
    for start in ground.starts:
        assert math.isclose(math.hypot(*start.direction), 1.0, abs_tol=1e-9)
        assert all(math.isfinite(c) for c in start.xy)
        if ground.domain is not None:
            assert ground.domain.distance(shapely.Point(start.xy)) < 1e-6
        if start.node >= 0:
            assert tuple(ground.nodes[start.node]) == start.xy
            assert not ground.bends[start.node]
        elif e:
            assert shapely.STRtree(lines).query(shapely.Point(start.xy), "dwithin", 1e-6).size == 0
    nodes = [s.node for s in ground.starts if s.node >= 0]
    assert len(nodes) == len(set(nodes))
    if ground.domain is not None:
        assert ground.domain.is_valid
        assert ground.domain.geom_type in ("Polygon", "MultiPolygon")
    columns = ["layer", "feature", "problem", "action", "severity", "geometry"]
    assert list(real.problems.columns) == columns
    assert real.problems.crs == real.source_crs


def assert_bends(ground):
    """Bends are nodes where two pieces of one street meet, but for those where growth begins."""
    at = [[] for _ in ground.nodes]
    for (a, b), street in zip(ground.ends.tolist(), ground.street.tolist()):
        at[a].append(street)
        at[b].append(street)
    assert all(at)
    plain = np.array([len(own) == 2 and own[0] == own[1] for own in at])
    plain[[s.node for s in ground.starts if s.node >= 0]] = False
    assert (ground.bends == plain).all()
