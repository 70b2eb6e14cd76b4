"""Ways to cut blocks, each standing in for the one before where that fails."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import CancelledError
from ...progress import Progress, Silent
from ..cut import cut_blocks
from ..halving.halve import halve_block
from ..halving.skeleton import skeleton_block
from ..refine import refine_blocks
from ..rules import Method, ParcelRules
from ..types import Block, Plot
from .guard import Fault, faults

#: What stands in for what, and what each is called.
ORDER: tuple[Method, ...] = ("strips", "skeleton", "halving")
NAMES = {
    "strips": "rows along the streets",
    "skeleton": "strips of the skeleton",
    "halving": "halving",
}
CANCELLED = "Cutting parcels was cancelled."
#: Of a block that is large enough and has a street, but got no parcel.
NOTHING = "No parcel was found."


class Cut:
    """How a block was cut.

    Attributes
    ----------
    plots
        Its plots.
    method
        How; empty for one green.
    failed
        Ways that failed before, with the reason.
    """

    def __init__(self) -> None:
        self.plots: list[Plot] = []
        self.method = ""
        self.failed: list[tuple[Method, Fault]] = []


def cut_safely(
    blocks: Sequence[Block],
    rules: ParcelRules,
    seed: int = 0,
    progress: Progress | None = None,
    *,
    refine: bool = True,
) -> list[Cut]:
    """Cut blocks by the method of the rules, and where that fails by the next.

    A method fails on a block where it raises an error, its plots do not tile the block, a
    parcel has no access, or there is no parcel though the block is large enough and has a
    street. If all fail, the block becomes one green.

    Parameters
    ----------
    blocks
        Sound blocks.
    rules
        What is asked.
    seed
        Of what is left to chance.
    progress
        Told of blocks; asked for cancellation. None for none.
    refine
        Whether plots are improved by `refine.refine_blocks`.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    progress = progress or Silent()
    found = [Cut() for _ in blocks]
    waiting = list(range(len(blocks)))
    for method in ORDER[ORDER.index(rules.method) :]:
        if not waiting:
            break
        asked = [blocks[i] for i in waiting]
        rows, broken = attempt(method, asked, rules, seed, progress)
        told = [fault or hollow(b, r, rules) for fault, b, r in zip(broken, asked, rows)]
        good = [i for i, fault in enumerate(told) if fault is None]
        if refine and good:
            better = refined([asked[i] for i in good], [rows[i] for i in good], rules, progress)
            for i, row in zip(good, better):
                rows[i] = row
        still = []
        for index, row, fault in zip(waiting, rows, told):
            if fault is None:
                found[index].plots, found[index].method = row, method
            else:
                found[index].failed.append((method, fault))
                still.append(index)
        waiting = still
    for index in waiting:
        reason = found[index].failed[-1][1].reason if found[index].failed else NOTHING
        found[index].plots = [Plot(blocks[index].polygon, "green", reason)]
    return found


def attempt(
    method: Method, blocks: Sequence[Block], rules: ParcelRules, seed: int, progress: Progress
) -> tuple[list[list[Plot]], list[Fault | None]]:
    """Cut blocks by one method; return the plots of each, and its fault or None.

    Parameters
    ----------
    method
        Which.
    blocks, rules, seed, progress
        See `cut_safely`.
    """
    rows: list[list[Plot]] = []
    told: list[Fault | None] = []
    if method == "strips":
        try:
            rows = cut_blocks(blocks, rules, progress)
        except CancelledError:
            raise
        except Exception:  # one block must not stop the others
            rows = []
    if len(rows) != len(blocks):
        rows = []
        for block in blocks:
            if progress.cancelled():
                raise CancelledError(CANCELLED)
            row, fault = _alone(method, block, rules, seed)
            rows.append(row)
            told.append(fault)
    else:
        told = [None] * len(blocks)
    sound = [i for i, fault in enumerate(told) if fault is None]
    checked = faults([blocks[i] for i in sound], [rows[i] for i in sound], rules)
    for i, fault in zip(sound, checked):
        told[i] = fault
    return rows, told


def _alone(
    method: Method, block: Block, rules: ParcelRules, seed: int
) -> tuple[list[Plot], Fault | None]:
    """Cut one block, whatever happens."""
    try:
        if method == "strips":
            return cut_blocks([block], rules)[0], None
        if method == "skeleton":
            return skeleton_block(block, rules), None
        return halve_block(block, rules, seed), None
    except CancelledError:
        raise
    except Exception as error:  # one block must not stop the others
        text = str(error) or type(error).__name__
        return [], Fault(text, block.polygon.representative_point())


def hollow(block: Block, plots: Sequence[Plot], rules: ParcelRules) -> Fault | None:
    """Return a fault if a block that could hold a parcel has none.

    Parameters
    ----------
    block, plots, rules
        See `cut_safely`.
    """
    if any(plot.use == "parcel" for plot in plots) or block.polygon.area < rules.least_area:
        return None
    rim = block.polygon.boundary.length
    if rim - block.closed.length < rules.min_frontage:
        return None
    return Fault(NOTHING, block.polygon.representative_point())


def refined(
    blocks: Sequence[Block],
    rows: Sequence[list[Plot]],
    rules: ParcelRules,
    progress: Progress,
) -> list[list[Plot]]:
    """Improve plots; where that fails, they stay as they are.

    Parameters
    ----------
    blocks, rows, rules, progress
        See `cut_safely`.
    """
    try:
        better = refine_blocks(blocks, rows, rules, progress)
    except CancelledError:
        raise
    except Exception:  # one block must not stop the others
        better = []
        for block, row in zip(blocks, rows):
            if progress.cancelled():
                raise CancelledError(CANCELLED) from None
            try:
                better += refine_blocks([block], [row], rules)
            except Exception:
                better.append(row)
    checked = faults(blocks, better, rules)
    return [row if fault else new for row, new, fault in zip(rows, better, checked)]
