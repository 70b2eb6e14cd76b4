"""Levels as tiles: what can be walked is what the route says, and nothing else."""

from __future__ import annotations

import itertools

import networkx as nx
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from platwright.errors import CancelledError, InputError
from platwright.mesh.grids import fan, grid
from platwright.progress import Silent
from platwright.rooms.levels import read_level
from platwright.rooms.tiled import rasterise
from platwright.rooms.tiled.frame import frame_of, lattice

from .level_examples import circular, linear, moved, random_tree, solved, star

TURN = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
MOVES = {
    "straight": lambda points: points * 1.0,
    "turned": lambda points: points @ TURN * 1.0 + (4e5, 6e6),
    "bent": lambda points: np.column_stack(
        [
            points[:, 0] + 0.2 * np.sin(points[:, 1]),
            points[:, 1] + 0.2 * np.sin(points[:, 0] + 0.3 * points[:, 1]),
        ]
    ),
}


def walkable(tiles, closed=frozenset()) -> nx.Graph:
    """Join free tiles by their sides, some passages left out."""
    free = tiles.free & ~np.isin(tiles.door, list(closed))
    graph = nx.Graph()
    for row, column in np.argwhere(free).tolist():
        graph.add_node((row, column))
        for near in ((row - 1, column), (row, column - 1)):
            if min(near) >= 0 and free[near]:
                graph.add_edge((row, column), near)
    return graph


def joined_blocks(tiles, closed=frozenset()) -> set[frozenset[int]]:
    """Return the groups of blocks that can be walked between."""
    parts = nx.connected_components(walkable(tiles, closed))
    return {frozenset(int(tiles.owner[tile]) for tile in part) for part in parts}


def expected_groups(level, closed=frozenset()) -> set[frozenset[int]]:
    """Return the groups of blocks that the route joins, some passages left out."""
    graph = nx.Graph()
    graph.add_nodes_from(range(level.count))
    for i, passage in enumerate(level.passages):
        if i not in closed:
            nx.add_path(graph, passage.blocks)
    return {frozenset(part) for part in nx.connected_components(graph)}


def check_walks(level, tiles):
    """Fill the level from everywhere, with all doors and with each closed in turn."""
    assert joined_blocks(tiles) == expected_groups(level)
    for i in range(len(level.passages)):
        assert joined_blocks(tiles, {i}) == expected_groups(level, {i}), i
    everything = set(range(len(level.passages)))
    assert joined_blocks(tiles, everything) == {frozenset({b}) for b in range(level.count)}
    # not even at corners do free tiles of two blocks meet, but at doors; nor the outside
    owner = np.pad(tiles.owner, 1, constant_values=-1)
    plain = np.pad(tiles.free & (tiles.door < 0), 1)
    for row, column in np.argwhere(plain).tolist():
        assert len(np.unique(owner[row - 1 : row + 2, column - 1 : column + 2])) == 1
    free = np.pad(tiles.free, 1)
    for row, column in np.argwhere(free).tolist():
        assert (owner[row - 1 : row + 2, column - 1 : column + 2] >= 0).all()
    assert not (tiles.wall & tiles.free).any()
    assert not (tiles.wall & (tiles.door >= 0)).any()
    assert ((tiles.owner >= 0) == (tiles.wall | tiles.free)).all()


@given(
    st.integers(1, 4),
    st.integers(1, 4),
    st.integers(0, 10_000),
    st.integers(3, 6),
    st.sampled_from(sorted(MOVES)),
)
@example(5, 2, 9, 3, "bent")  # rooms that hang together by their doors alone
@settings(max_examples=25)
def test_random_trees_can_be_walked_as_drawn(columns, rows, seed, k, move):
    problem, plan, tree = random_tree(columns, rows, seed)
    level = read_level(moved(problem, MOVES[move]), plan)
    tiles = rasterise(level, tiles_per_cell=k)
    check_walks(level, tiles)
    # the groups are those of the tree that was drawn, not only of what was read from it
    for a, b in tree.edges:
        (door,) = [i for i, p in enumerate(level.passages) if p.blocks == (min(a, b), max(a, b))]
        cut = nx.Graph(tree)
        cut.remove_edge(a, b)
        parts = {frozenset(part) for part in nx.connected_components(cut)}
        assert joined_blocks(tiles, {door}) == parts


@pytest.mark.parametrize("make", [linear, circular, star], ids=lambda make: make.__name__)
def test_drawn_levels_can_be_walked(make):
    level = read_level(*make())
    check_walks(level, rasterise(level, tiles_per_cell=9))


@pytest.mark.parametrize("k", [3, 4, 5, 8])
@pytest.mark.parametrize("size", [(6, 5, [(0, 1), (6, 4)]), (8, 6, [(3, 3)])])
def test_solved_levels_can_be_walked(size, k):
    level = read_level(*solved(*size))
    tiles = rasterise(level, tiles_per_cell=k)
    check_walks(level, tiles)
    # the way from start to goal leads through the blocks of the route, in their order
    way = nx.shortest_path(walkable(tiles), tiles.start, tiles.goal)
    passed = [b for b, _ in itertools.groupby(int(tiles.owner[tile]) for tile in way)]
    ranks = [level.order[b] for b in passed]
    assert ranks[0] == 1
    assert len(set(ranks)) == len(ranks)
    one_way = list(range(1, len(ranks) + 1))
    assert ranks in (one_way, [1, *range(level.count, level.count - len(ranks) + 1, -1)])


def test_three_blocks_in_a_row_by_hand():
    tiles = rasterise(read_level(*linear()), tiles_per_cell=4)
    drawn = [
        "".join(
            "#" if tiles.wall[r, c] else "+" if tiles.door[r, c] >= 0 else "." for c in range(24)
        )
        for r in range(8)
    ]
    closed, room, way = "#" * 24, "#......#" * 3, "#......++......++......#"
    assert drawn == [closed, room, room, way, way, room, room, closed]
    assert (tiles.owner == np.repeat([0, 1, 2], 8)).all()
    assert tiles.door[3].tolist()[6:10] == [-1, 0, 0, -1]
    # on the route, inside the outer wall; the first of two rows
    assert tiles.start == (3, 1)
    assert tiles.goal == (3, 22)
    assert np.flatnonzero(tiles.route.any(axis=1)).tolist() == [3, 4]
    assert tiles.route[3].tolist() == [False, *[True] * 22, False]
    assert tiles.treasures == {}


def test_treasures_lie_in_dead_ends():
    level = read_level(*random_tree(4, 3, 5)[:2])
    tiles = rasterise(level)
    assert {b for b, role in enumerate(level.roles) if role == "treasure"} == set(tiles.treasures)
    assert tiles.treasures
    for block, at in tiles.treasures.items():
        assert tiles.owner[at] == block
        assert tiles.free[at]
        assert tiles.door[at] < 0


def test_tiles_lie_where_the_ground_is():
    """Every tile's middle, taken back to metres, lies in its block."""
    for move in MOVES.values():
        problem, plan, _ = random_tree(3, 2, 4)
        level = read_level(moved(problem, move), plan)
        tiles = rasterise(level, tiles_per_cell=5)
        frame, mesh = tiles.frame, level.problem.network.mesh
        middles = mesh.vertices[mesh.faces].mean(axis=1)
        at = np.floor(frame.to_tiles(middles)).astype(int)
        assert (tiles.owner[at[:, 1], at[:, 0]] == level.face_block).all()
    # y points down: the northern blocks are in the first rows
    assert tiles.owner[2, tiles.owner.shape[1] // 2] >= 3


def test_grids_are_known_turned_or_not():
    mesh = grid(4, 3, 2.5, keep=lambda i, j: (i, j) != (0, 0))
    for angle in (0.0, 0.4, 1.2, 2.9, -0.7):
        c, s = np.cos(angle), np.sin(angle)
        turned = type(mesh)(mesh.vertices @ np.array([[c, s], [-s, c]]) + 1e5, mesh.faces, 2.5)
        found = lattice(turned)
        assert found is not None
        towards, _, side, cells = found
        assert side == pytest.approx(2.5)
        assert abs(towards) <= np.pi / 4 + 1e-9
        assert len(np.unique(cells, axis=0)) == 11
        assert sorted(cells.max(axis=0) + 1) == [3, 4]
        frame = frame_of(turned, 5, None)
        tiles = frame.to_tiles(turned.vertices)
        assert np.abs(tiles - np.rint(tiles)).max() < 1e-6
        assert tiles.min() > -1e-6
    assert lattice(fan(5, 2)) is None
    assert lattice(fan(6, 1)) is None
    assert lattice(type(mesh)(mesh.vertices * (1, 1.1), mesh.faces, 2.5)) is None
    bulge = type(mesh)(mesh.vertices, mesh.faces, 2.5)
    at = int(np.flatnonzero(bulge.boundary_edges)[0])
    a, b = bulge.vertices[bulge.edges[at]]
    arcs = {at: np.array([a, (a + b) / 2 + (0.3, 0.3), b])}
    assert lattice(type(mesh)(mesh.vertices, mesh.faces, 2.5, boundary_arcs=arcs)) is None


def test_a_tile_size_in_metres_is_kept_on_any_mesh():
    level = read_level(*circular())
    tiles = rasterise(level, tile_m=0.13)
    assert tiles.frame.tile_m == 0.13
    # 4 m by 4 m
    assert tiles.owner.shape == (31, 31)
    check_walks(level, tiles)


def test_tiles_that_cannot_show_the_level_are_refused():
    level = read_level(*circular())
    with pytest.raises(InputError, match="leave no room between walls"):
        rasterise(level, tiles_per_cell=2)
    with pytest.raises(InputError, match="Take smaller tiles"):
        rasterise(level, tile_m=1.0)
    with pytest.raises(InputError, match="impossible"):
        rasterise(level, tile_m=0.0)
    with pytest.raises(InputError, match="the most is"):
        rasterise(level, tile_m=1e-4)
    with pytest.raises(InputError, match="the most is"):
        rasterise(level, tiles_per_cell=10**6)
    with pytest.raises(InputError, match="Take smaller tiles"):
        rasterise(read_level(*star()), tiles_per_cell=3)


def test_cancel_stops():
    class Stop(Silent):
        def cancelled(self) -> bool:
            return True

    with pytest.raises(CancelledError):
        rasterise(read_level(*linear()), progress=Stop())


def test_doors_never_open_the_outside():
    """A passage whose way runs half a tile inside the outer wall."""
    problem, plan = linear()

    def low(points):
        return np.column_stack([points[:, 0], np.array([0.0, 0.15, 2.0])[points[:, 1].astype(int)]])

    level = read_level(moved(problem, low), plan)
    tiles = rasterise(level, tiles_per_cell=5)
    check_walks(level, tiles)
    assert tiles.wall[-1].all()
    assert (tiles.door[-2] >= 0).sum() == 4
