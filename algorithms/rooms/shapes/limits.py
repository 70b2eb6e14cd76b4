"""Limits of the numbers and of the areas of rooms as sums over placements (CND 5.2, at its end)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...errors import InputError
from ..types import BoolArray, CountRule, FloatArray, Placements, Template

#: Slack of sums of areas, as a share of the floor: far above rounding, far below any room.
SLACK = 1e-9


def count_rules(
    templates: Sequence[Template],
    placements: Placements,
    face_area: FloatArray,
    floor: BoolArray,
) -> tuple[CountRule, ...]:
    """Write what templates ask of numbers and areas as rules for a plan.

    A share s of template t asks, with the areas a of the placements that are chosen, for
    ``sum(a of t) <= s * sum(face_area[floor])``: rooms tile the floor, so that its area is that of
    all rooms (CND eq. 15).

    Parameters
    ----------
    templates
        The templates.
    placements
        Where their rooms may lie, r placements.
    face_area
        Shape (m,). Areas of the faces, m².
    floor
        Shape (m,). Faces to be tiled.

    Returns
    -------
    tuple of CountRule
        One for each limit that is set, in the order of the templates: least and largest number,
        then least and largest area in m². Bounds of areas are wider by 1e-9 of the floor, so that
        rounding forbids no plan.

    Raises
    ------
    InputError
        If `face_area` and `floor` differ in shape.
    """
    if face_area.shape != floor.shape:
        raise InputError(f"'floor' has shape {floor.shape}, expected {face_area.shape}.")
    total = float(face_area[floor].sum())
    area = np.array([face_area[list(faces)].sum() for faces in placements.faces], dtype=np.float64)
    slack = SLACK * total
    rules = []
    for kind, template in enumerate(templates):
        own = (placements.template == kind).astype(np.float64)
        name = template.name
        if template.least > 0:
            text = f"at least {template.least} of '{name}'"
            rules.append(CountRule(text, own, float(template.least), math.inf))
        if template.most is not None:
            text = f"at most {template.most} of '{name}'"
            rules.append(CountRule(text, own, -math.inf, float(template.most)))
        if template.least_share > 0:
            text = f"at least {100 * template.least_share:.4g} % of the area in '{name}'"
            least = template.least_share * total - slack
            rules.append(CountRule(text, own * area, least, math.inf))
        if template.most_share is not None and template.most_share < 1:
            text = f"at most {100 * template.most_share:.4g} % of the area in '{name}'"
            most = template.most_share * total + slack
            rules.append(CountRule(text, own * area, -math.inf, most))
    return tuple(rules)
