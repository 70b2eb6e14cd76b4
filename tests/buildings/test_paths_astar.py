"""The modified A* and the layered search against Dijkstra by networkx on a graph of directions."""

from __future__ import annotations

import math

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from platwright.buildings.paths.astar import direct, find_way, optimal_exit, sees
from platwright.buildings.paths.ground import Ground, Prices, roughness
from platwright.buildings.paths.layered import Layered

SIDES = {"east": (0, 1), "west": (0, -1), "north": (1, 0), "south": (-1, 0)}


@st.composite
def grounds(draw) -> tuple[Ground, tuple[int, int], tuple[int, int]]:
    """A small grid with walls, uneven rows, rough places, and two free nodes."""
    rows, columns = draw(st.integers(2, 7)), draw(st.integers(2, 7))
    seed = draw(st.integers(0, 10_000))
    share = draw(st.sampled_from([0.0, 0.2, 0.4]))
    rng = np.random.default_rng(seed)
    free = rng.random((rows, columns)) >= share
    xs = np.cumsum(rng.choice([0.5, 1.0, 1.5], columns))
    ys = np.cumsum(rng.choice([0.5, 1.0, 1.5], rows))
    a, b = (int(rng.integers(rows)), int(rng.integers(columns))), (
        int(rng.integers(rows)), int(rng.integers(columns)),
    )  # fmt: skip
    free[a] = free[b] = True
    return Ground(xs, ys, free, rng.integers(0, 3, (2, rows, columns)).astype(float)), a, b


def brute(ground: Ground, a, b, prices: Prices) -> float:
    """Least cost over states (node, direction of the last step), a turn paid when it happens."""
    graph = nx.DiGraph()
    rows, columns = ground.free.shape
    for r in range(rows):
        for c in range(columns):
            for went, _ in SIDES.items() if ground.free[r, c] else ():
                for goes, (dr, dc) in SIDES.items():
                    p, q = r + dr, c + dc
                    if not (0 <= p < rows and 0 <= q < columns and ground.free[p, q]):
                        continue
                    axis = 0 if dc else 1
                    length = abs(ground.xs[q] - ground.xs[c]) + abs(ground.ys[p] - ground.ys[r])
                    rough = (ground.rough[axis, r, c] + ground.rough[axis, p, q]) / 2
                    cost = length * (1 + prices.room * rough)
                    graph.add_edge(
                        (r, c, went), (p, q, goes), weight=cost + prices.turn * (went != goes)
                    )
                    graph.add_edge((r, c, "start"), (p, q, goes), weight=cost)
    if a == b:
        return 0.0
    if (*a, "start") not in graph:
        return math.inf
    far = nx.single_source_dijkstra_path_length(graph, (*a, "start"))
    return min((far.get((*b, went), math.inf) for went in SIDES), default=math.inf)


@settings(max_examples=150, deadline=None)
@given(grounds(), st.sampled_from([0.0, 2.0, 5.0]), st.sampled_from([0.0, 0.5]))
def test_a_star_costs_what_brute_force_costs(case, turn, room):
    ground, a, b = case
    prices = Prices(turn=turn, room=room)
    way = find_way(ground, a, b, prices, straight_first=False)
    least = brute(ground, a, b, prices)
    if way is None:
        assert least == math.inf
    else:
        assert way.cost == pytest.approx(least)
        assert (way.nodes[0], way.nodes[-1]) == (a, b)


@settings(max_examples=100, deadline=None)
@given(grounds())
def test_ways_run_along_rows_and_columns_through_free_nodes_only(case):
    ground, a, b = case
    way = find_way(ground, a, b, Prices(), straight_first=False)
    if way is None:
        return
    assert way.turns == max(0, len(way.nodes) - 2)
    length = 0.0
    for (r, c), (p, q) in zip(way.nodes, way.nodes[1:]):
        assert (r == p) != (c == q), "a step is diagonal"
        assert ground.free[min(r, p) : max(r, p) + 1, min(c, q) : max(c, q) + 1].all()
        length += abs(ground.xs[c] - ground.xs[q]) + abs(ground.ys[r] - ground.ys[p])
    assert way.length_m == pytest.approx(length)


@settings(max_examples=100, deadline=None)
@given(grounds(), st.sampled_from([0.0, 3.0]))
def test_the_layered_search_costs_what_a_star_costs(case, turn):
    ground, a, _ = case
    prices = Prices(turn=turn)
    graph = Layered(ground, prices)
    start = graph.number[a]
    cost, before = graph.search(np.array([2 * start, 2 * start + 1]), np.zeros(2))
    for node, (r, c) in enumerate(zip(graph.row, graph.column)):
        way = find_way(ground, a, (int(r), int(c)), prices, straight_first=False)
        least = cost[2 * node : 2 * node + 2].min()
        assert math.isinf(least) if way is None else least == pytest.approx(way.cost, abs=1e-6)
        if way is not None:
            state = 2 * node + int(np.argmin(cost[2 * node : 2 * node + 2]))
            assert graph.trace(before, state)[0] // 2 == start


@settings(max_examples=60, deadline=None)
@given(grounds(), st.booleans(), st.integers(0, 99))
def test_the_optimal_exit_is_the_best_of_all_exits(case, straight, seed):
    ground, a, _ = case
    rng = np.random.default_rng(seed)
    nodes = np.argwhere(ground.free)
    exits = [tuple(map(int, nodes[k])) for k in rng.integers(len(nodes), size=5)]
    prices = Prices()
    found = optimal_exit(ground, a, exits, prices, straight_first=straight)
    ways = [find_way(ground, a, e, prices, straight_first=straight) for e in exits]
    costs = [math.inf if w is None else w.cost for w in ways]
    if found is None:
        assert min(costs) == math.inf
    else:
        assert found[1].cost == pytest.approx(min(costs))
        assert costs[found[0]] == pytest.approx(min(costs))


def even(free) -> Ground:
    free = np.asarray(free, dtype=bool)
    rows, columns = free.shape
    return Ground(
        np.arange(columns) * 1.0, np.arange(rows) * 1.0, free, np.zeros((2, rows, columns))
    )  # fmt: skip


def test_no_way_squeezes_diagonally_between_two_corners():
    ground = even([[1, 0], [0, 1]])
    assert not sees(ground, (0, 0), (1, 1))
    assert find_way(ground, (0, 0), (1, 1), Prices()) is None
    assert not sees(even([[1, 1], [0, 1]]), (0, 0), (1, 1)), "the corner of a wall is cut"


def test_a_direct_way_is_straight_and_has_no_turn():
    ground = even(np.ones((4, 4)))
    way = find_way(ground, (0, 0), (3, 3), Prices())
    assert way is not None
    assert (way.turns, way.nodes) == (0, ((0, 0), (3, 3)))
    assert way.length_m == pytest.approx(math.sqrt(18))
    bent = find_way(ground, (0, 0), (3, 3), Prices(), straight_first=False)
    assert bent is not None
    assert (bent.turns, bent.length_m, bent.cost) == (1, 6.0, 11.0)


def test_a_dear_turn_is_avoided_by_a_longer_way():
    # A stair of three turns, or round the outside with two.
    ground = even(
        [
            [1, 1, 1, 1, 1],
            [1, 0, 0, 0, 1],
            [1, 1, 1, 0, 1],
            [0, 0, 1, 1, 1],
        ]
    )
    cheap = find_way(ground, (2, 0), (3, 4), Prices(turn=0.0), straight_first=False)
    dear = find_way(ground, (2, 0), (3, 4), Prices(turn=50.0), straight_first=False)
    assert cheap is not None
    assert dear is not None
    assert (cheap.length_m, cheap.turns) == (5.0, 2)
    assert (dear.length_m, dear.turns) == (5.0, 2)
    ground.free[3, 3] = False
    around = find_way(ground, (2, 0), (3, 4), Prices(turn=50.0), straight_first=False)
    assert around is not None
    assert (around.length_m, around.turns) == (9.0, 2)
    assert direct(ground, (2, 0), (3, 4), Prices()) is None


def test_roominess_by_hand():
    # Free from x = 0 to 40, walls at both ends; y from 0 to 8, walls above and below.
    xs, ys = np.arange(-1.0, 42.0), np.arange(-1.0, 10.0)
    closed = np.zeros((len(ys), len(xs)), dtype=bool)
    closed[[0, -1], :] = closed[:, [0, -1]] = True
    street = np.zeros_like(closed)
    rough = roughness(xs, ys, closed, street)
    row, middle = 5, 21  # y = 4 between walls at -1 and 9, x = 20 between -1 and 41
    assert rough[:, row, middle].tolist() == [0.0, 0.0]
    # Three metres from the wall below, seven from that above: even enough; along the columns near.
    assert rough[:, 3, middle].tolist() == [0.0, 1.0]
    # One metre from the wall below and nine from that above: near and uneven.
    assert rough[:, 1, middle].tolist() == [1.0, 2.0]
    # Three metres before the end: near along the row, and uneven along it.
    assert rough[:, row, 3].tolist() == [2.0, 1.0]
    street[:, 0] = True
    assert rough_at(xs, ys, closed, street, row, 3) == [0.0, 0.0], "a street narrows nothing"


def rough_at(xs, ys, closed, street, row, column):
    return roughness(xs, ys, closed, street)[:, row, column].tolist()
