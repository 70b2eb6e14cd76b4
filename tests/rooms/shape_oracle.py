"""Shapes at random, and where they fit on grids, by coordinates alone."""

from __future__ import annotations

from hypothesis import strategies as st
from platwright.rooms.types import Template

BESIDE = ((1, 0), (-1, 0), (0, 1), (0, -1))


def moved(cells):
    """Move squares to the origin."""
    left, low = min(x for x, _ in cells), min(y for _, y in cells)
    return frozenset((x - left, y - low) for x, y in cells)


@st.composite
def polyominoes(draw, most=7):
    """Draw squares that hang together, grown one by one; they may have holes."""
    cells = {(0, 0)}
    for _ in range(draw(st.integers(0, most - 1))):
        free = sorted({(x + a, y + b) for x, y in cells for a, b in BESIDE} - cells)
        cells.add(draw(st.sampled_from(free)))
    return moved(cells)


def pinched(cells):
    """Tell whether two squares meet in a corner with no square beside both."""
    return any(
        (x + a, y + 1) in cells and (x + a, y) not in cells and (x, y + 1) not in cells
        for x, y in cells
        for a in (-1, 1)
    )


def poses(template):
    """Give all allowed poses of a template: squares turned by hand-written matrices."""
    matrices = {0: (1, 0, 0, 1), 1: (0, -1, 1, 0), 2: (-1, 0, 0, -1), 3: (0, 1, -1, 0)}
    found = set()
    for flip in (1, -1) if template.mirror else (1,):
        for quarters in template.rotations:
            a, b, c, d = matrices[quarters]
            found.add(
                moved({(a * flip * x + b * y, c * flip * x + d * y) for x, y in template.cells})
            )
    return found


def fits_by_coordinates(mesh, template, allowed):
    """Give the sets of faces where a template fits on a grid of unit squares."""
    corner = mesh.vertices[mesh.faces].min(axis=1).round().astype(int)
    face_at = {tuple(xy): f for f, xy in enumerate(corner.tolist()) if allowed[f]}
    wide, high = corner.max(axis=0) + 1
    found = set()
    for pose in poses(template):
        for x in range(wide):
            for y in range(high):
                faces = [face_at.get((x + a, y + b)) for a, b in pose]
                if None not in faces:
                    found.add(tuple(sorted(faces)))
    return found


templates = st.builds(
    Template,
    st.just("any"),
    polyominoes(),
    st.sets(st.integers(0, 3), min_size=1).map(lambda s: tuple(sorted(s))),
    st.booleans(),
)
