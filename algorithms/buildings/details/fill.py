"""Parking, green and trees of a zone, in this order."""

from __future__ import annotations

from collections.abc import Sequence

from ..layout import Details, PathPlan
from ..rules import LayoutRules
from ..types import BuildingType, Placements
from ..zone import Zone
from .green import green_plots
from .parking import lay_parking
from .taken import taken_ground
from .trees import plant_trees


def lay_details(
    zone: Zone,
    types: Sequence[BuildingType],
    rules: LayoutRules,
    placed: Placements,
    plan: PathPlan,
) -> Details:
    """Fill the ground that buildings and paths leave (RZ Fig. 2: green land, trees, parking).

    RZ names parking beside roads, green land by plots and trees along roads without saying how.
    Here rows of bays lie inside the patches along streets, near the buildings whose types ask
    for them, as many as they ask for while there is room; all open ground that is left and is no
    mere strip becomes green; trees stand along streets and paths, and in larger greens.

    Parameters
    ----------
    zone
        The ground.
    types
        Kinds of buildings; their `parking` and `dwellings` say how many places are needed.
    rules
        `path_m`, `tree_spacing_m` and `seed` are used.
    placed
        Where buildings stand.
    plan
        Their paths.

    Returns
    -------
    Details
        Parking, green, paths and buildings do not overlap; all lie inside patches.
    """
    taken = taken_ground(zone, types, rules, placed, plan)
    rows = lay_parking(zone, types, placed, taken)
    parking = tuple(row.polygon for row in rows)
    green = green_plots(zone, taken, parking)
    trees, of = plant_trees(zone, rules, plan, taken, rows, green)
    return Details(green, trees, of, parking, tuple(row.places for row in rows))
