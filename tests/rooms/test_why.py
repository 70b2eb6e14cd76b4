"""Reasons why there is no plan come in seconds and name places."""

from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest
from clock import allowed
from platwright.errors import InfeasibleError
from platwright.mesh.grids import grid
from platwright.rooms.program.index import RoomIndex
from platwright.rooms.solve import solve_rooms
from platwright.rooms.types import CountRule
from platwright.rooms.why import NoPlanError, why_not
from platwright.rooms.why.tiling import tile

from .support import room_problem


def reasons(problem, solver="cpsat"):
    begin = time.monotonic()
    with pytest.raises(NoPlanError) as error:
        solve_rooms(problem, time_limit=60, solver=solver)
    assert time.monotonic() - begin < allowed(20)
    return error.value.reasons


@pytest.mark.parametrize("solver", ["cpsat", "highs"])
def test_a_board_without_two_corners_of_one_colour_has_no_dominoes(solver):
    mesh = grid(6, 6, keep=lambda i, j: (i, j) not in {(0, 0), (5, 5)})
    (reason,) = reasons(room_problem(mesh, ["1x2"], outer=True, dead_ends=0.0), solver)
    assert "exactly once" in reason.problem
    # a board that lacks two squares of one colour leaves two of the other over
    assert len(reason.faces) == 2


def test_cells_that_no_shape_covers_are_named():
    mesh = grid(6, 4, keep=lambda i, j: j < 3 or i == 0)
    bottom = np.flatnonzero((mesh.vertices == (3.0, 0.0)).all(axis=1)).tolist()
    (reason,) = reasons(room_problem(mesh, ["2x2", "3x3"], sinks=bottom))
    top = int(np.argmax(mesh.vertices[mesh.faces][:, :, 1].max(axis=1)))
    assert top in reason.faces
    assert "no shape" in reason.problem


def test_a_number_of_cells_that_does_not_add_up_is_told():
    problem = room_problem(grid(5, 3), ["2x2", "3x2"])
    (reason,) = reasons(problem)
    assert "15 connected cells" in reason.problem
    assert "4, 6" in reason.problem


def test_numbers_in_conflict_are_named():
    mesh = grid(6, 4)
    plain = room_problem(mesh, ["2x2", "3x2"])
    three = (plain.placements.template == 1).astype(float)
    rule = CountRule("exactly 3 of '3x2'", three, 3.0, 3.0)
    (reason,) = reasons(room_problem(mesh, ["2x2", "3x2"], counts=(rule,)))
    assert "exactly 3 of '3x2'" in reason.problem


def test_more_rooms_than_floor_are_told():
    problem = room_problem(grid(6, 4), ["2x2", "3x2"])
    asked = dataclasses.replace(problem.templates[1], least=9)
    many = dataclasses.replace(problem, templates=(problem.templates[0], asked))
    (reason,) = reasons(many)
    assert "54 cells" in reason.problem
    assert "24" in reason.problem


def test_a_sink_without_any_way_is_told():
    mesh = grid(6, 4)
    corner = int(np.argmin(mesh.vertices.sum(axis=1)))
    (reason,) = reasons(room_problem(mesh, ["2x2"], sinks=[corner]))
    assert "sink" in reason.problem


def test_what_only_corridors_forbid_is_told_too():
    # one room of 3 by 3 in the middle of rooms without any wall at a corridor
    problem = room_problem(grid(2, 2), ["2x2"], outer=False)
    with pytest.raises(InfeasibleError):
        solve_rooms(problem, time_limit=20)


@pytest.mark.parametrize("by_cp", [True, False])
def test_nothing_is_said_against_what_can_be_tiled(by_cp):
    index = RoomIndex(room_problem(grid(7, 6), ["2x2", "3x2", "L"]))
    assert why_not(index, by_cp=by_cp) == []
    found = tile(index, seconds=5, by_cp=by_cp)
    faces = [f for r in found.rooms for f in index.problem.placements.faces[r]]
    assert sorted(faces) == list(range(42))
