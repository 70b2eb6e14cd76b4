"""Templates turned and mirrored."""

from __future__ import annotations

from collections.abc import Iterable

from ..types import Cells, Template


def settled(cells: Iterable[tuple[int, int]]) -> Cells:
    """Return cells moved so that the least column and the least row are 0.

    Parameters
    ----------
    cells
        Squares (column, row), at least one.
    """
    cells = tuple(cells)
    left, low = min(column for column, _ in cells), min(row for _, row in cells)
    return frozenset((column - left, row - low) for column, row in cells)


def turned(cells: Cells, quarters: int) -> Cells:
    """Return cells after some quarter turns counter-clockwise.

    Parameters
    ----------
    cells
        Squares (column, row).
    quarters
        Number of turns, any whole number.

    Examples
    --------
    >>> sorted(turned(frozenset({(0, 0), (1, 0)}), 1))
    [(0, 0), (0, 1)]
    """
    for _ in range(quarters % 4):
        cells = frozenset((-row, column) for column, row in cells)
    return settled(cells)


def mirrored(cells: Cells) -> Cells:
    """Return cells with left and right exchanged.

    Parameters
    ----------
    cells
        Squares (column, row).
    """
    return settled((-column, row) for column, row in cells)


def orientations(template: Template) -> tuple[Cells, ...]:
    """Return the different shapes that a template may have on a map.

    Parameters
    ----------
    template
        The template. Where it may be mirrored, that is done first and the turns come after.

    Returns
    -------
    tuple of Cells
        As drawn and turned by ascending angles, then mirrored; none twice.

    Examples
    --------
    >>> line = frozenset({(0, 0), (1, 0), (2, 0)})
    >>> len(orientations(Template("row", line))), len(orientations(Template("row", line, (0,))))
    (2, 1)
    """
    sides = [template.cells, mirrored(template.cells)] if template.mirror else [template.cells]
    shapes = (turned(side, quarters) for side in sides for quarters in sorted(template.rotations))
    return tuple(dict.fromkeys(shapes))


def drawings(template: Template) -> tuple[tuple[Cells, frozenset[int]], ...]:
    """Return the shapes of a template that no turn makes the same, and how each may be turned.

    Parameters
    ----------
    template
        The template.

    Returns
    -------
    tuple
        One or two pairs: squares, and the allowed quarter turns of them. Where a turn leaves the
        squares as they are, the turns hold both ways to say the same.
    """
    found: dict[Cells, frozenset[int]] = {}
    for shape in orientations(template):
        for cells in (template.cells, mirrored(template.cells)):
            turns = {quarters for quarters in range(4) if turned(cells, quarters) == shape}
            if turns:
                found[cells] = found.get(cells, frozenset()) | turns
                break
    return tuple(found.items())
