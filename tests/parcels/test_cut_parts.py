"""What makes cutting blocks quick and robust: nothing is made twice, and no failure gets lost."""

from __future__ import annotations

import numpy as np
import pytest
from platwright.parcels.cut import blocks as cutting
from platwright.parcels.cut import cut_blocks
from platwright.parcels.cut.corners import Style
from platwright.parcels.cut.draft import draft
from platwright.parcels.cut.kept import Kept
from platwright.parcels.cut.line import Line
from platwright.parcels.rules import ParcelRules
from platwright.parcels.types import Block, Plot
from platwright.progress import Silent
from shapely.geometry import LineString, MultiLineString, Polygon, box
from shapely.geometry.polygon import orient

RULES = ParcelRules()
ANGLES = np.radians(np.linspace(90, 15, 15))
ARC = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
ODD = (
    Polygon([(0, 0), (190, 12), (176, 75), (8, 58)]),
    Polygon([(0, 0), (130, -10), (170, 90), (80, 160), (-15, 95)]),
    Polygon([(0, 0), (180, 0), (180, 62), (64, 62), (64, 170), (0, 170)]),
    Polygon([*(210 * ARC), *(150 * ARC[::-1])]),
)


def test_line_by_hand():
    line = Line(np.array([(0.0, 0.0), (30.0, 0.0), (30.0, 40.0)]))
    assert line.length == 70
    at = np.array([0.0, 10.0, 30.0, 50.0, 70.0])
    assert line.at(at).tolist() == [[0, 0], [10, 0], [30, 0], [30, 20], [30, 40]]
    # 14 m to both sides of the corner the street runs at 45 degrees
    root = 0.5**0.5
    expected = np.array([(0, 1), (0, 1), (-root, root), (-1, 0), (-1, 0)])
    assert line.normals(at) == pytest.approx(expected)
    # the end is the last vertex itself, where nothing else may be a bit off
    third = np.array([(0.1, 0.2), (1 / 3, 1 / 7), (534_000.1, 5_210_000.3)])
    assert (Line(third).at(np.array([Line(third).length]))[0] == third[-1]).all()


def tried(blocks: list[Block]) -> list[cutting.Work]:
    """Cut blocks; return what was tried."""
    work = [cutting.Work(block, RULES) for block in blocks]
    cutting.cut_all(work, Silent())
    return work


def test_ordinary_blocks_lose_no_layout():
    closed = MultiLineString([LineString([(0, 0), (200, 0)])])
    more = [box(0, 0, 200, 140), box(0, 0, 40, 180), box(0, 0, 200, 60).buffer(-8).buffer(8)]
    blocks = [Block(orient(p)) for p in (*ODD, *more)]
    blocks.append(Block(box(0, 0, 200, 60), closed))
    work = tried(blocks)
    assert [one.dropped for one in work] == [[]] * len(blocks)
    assert all(one.tried for one in work)


@pytest.mark.parametrize("broken", ["Row", "Pieces"])
def test_an_error_in_a_layout_is_kept_for_who_asks(monkeypatch, broken):
    def fail(*_: object) -> None:
        msg = "no such thing"
        raise IndexError(msg)

    where = "platwright.parcels.cut." + {"Row": "draft.Row", "Pieces": "blocks.Pieces"}[broken]
    monkeypatch.setattr(where, fail)
    (work,) = tried([Block(box(0, 0, 200, 60))])
    assert {str(error) for error in work.dropped} == {"no such thing"}
    assert [(p.use, p.note) for p in work.best()] == [("green", "no layout found")]


def test_a_draft_is_made_once():
    (work,) = tried([Block(box(0, 0, 200, 60))])
    fronts = work.tried[0][1]
    # no end of a row is slanted there, so how wide slanted ones may be makes no difference
    key, made = draft(work.ground, fronts, Style(wide=2.0))
    assert made is None
    assert key in work.marks
    key, made = draft(work.ground, fronts[:1], Style())
    assert key not in work.marks
    assert made is not None
    # 11 parcels, and the other half is the court
    assert len(made.pieces) == 12


def test_kept_plots_are_those_of_the_same_block_and_rules():
    kept, plots = Kept(most=2), [Plot(box(0, 0, 18, 30))]
    block, shut = Block(box(0, 0, 18, 30)), MultiLineString([LineString([(0, 0), (18, 0)])])
    kept.keep(block, RULES, plots)
    assert kept.find(Block(box(0, 0, 18, 30), block_id=9), RULES) == tuple(plots)
    assert kept.find(Block(box(0, 0, 18, 30), shut), RULES) is None
    assert kept.find(Block(box(0, 0, 18, 31)), RULES) is None
    assert kept.find(block, ParcelRules(greens=False)) is None
    for k in range(2):
        kept.keep(Block(box(k, 0, 40, 30)), RULES, plots)
    assert kept.find(block, RULES) is None


def test_nobody_can_spoil_kept_plots():
    block = Block(box(0, 0, 200, 60))
    first = cut_blocks([block], RULES)[0]
    first.clear()
    assert len(cut_blocks([block], RULES)[0]) == 22


#: A block of a real suburb whose rows meet in a triangle of 3 by 3 cm.
SPECK_BLOCK = Polygon([
    (203.068, 145.738), (200.82, 146.847), (173.969, 158.552), (151.535, 167.972),
    (146.501, 169.17), (142.428, 169.181), (139.006, 168.482), (132.224, 165.915),
    (65.966, 138.423), (52.746, 133.132), (41.303, 127.31), (52.346, 120.857),
    (86.778, 107.105), (111.229, 97.601), (156.999, 79.415), (173.699, 73.181),
])  # fmt: skip


def test_specks_go_to_a_neighbour():
    """A green of a few square centimetres is nothing that a planner could use."""
    block = Block(orient(SPECK_BLOCK))
    (plots,) = cut_blocks([block], RULES)
    areas = [plot.polygon.area for plot in plots]
    assert sum(areas) == pytest.approx(SPECK_BLOCK.area, rel=1e-9)
    assert min(areas) > 1.0
