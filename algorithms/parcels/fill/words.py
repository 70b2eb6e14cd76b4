"""Why a block has fewer parcels than its land holds, in words."""

from __future__ import annotations

from collections.abc import Sequence

import shapely
from shapely.geometry import Point

from ..halving.rectangle import smallest_rectangle
from ..rules import ParcelRules
from ..types import Block, Plot
from .deep import NO_WAY
from .result import FillProblem

#: A shortfall is told from so many parcels on, and from this share of what was asked.
FEW = 2
SHARE = 0.15
#: Width of a street that would part a deep block (metres).
STREET = 15.0


def shortfalls(
    block: Block, plots: Sequence[Plot], wanted: int, rules: ParcelRules
) -> list[FillProblem]:
    """Tell what a block lacks: access, parcels, a street through it.

    Parameters
    ----------
    block
        A sound block.
    plots
        Its plots.
    wanted
        How many parcels its land holds.
    rules
        What was asked.
    """
    found = []
    courts = [plot for plot in plots if plot.use == "court"]
    for court in courts:
        if court.note == NO_WAY:
            found.append(
                FillProblem(
                    block.block_id,
                    court.polygon.representative_point(),
                    "No two parcels can give way to the land behind them.",
                    "It stays a court that is reached over parcels only.",
                )
            )
    got = sum(plot.use == "parcel" for plot in plots)
    if courts:
        found.append(_deep(block, courts, got, rules))
    lacking = wanted - got
    if lacking < FEW or lacking < SHARE * wanted:
        return found
    greens = [plot for plot in plots if plot.use == "green"]
    largest = max(greens, key=lambda plot: plot.polygon.area, default=None)
    parts = [
        f"{sum(p.polygon.area for p in plots if p.use == use):.0f} m2 {words}"
        for use, words in (
            ("court", "too far from the streets"),
            ("green", f"green ({largest.note or 'no parcel fits'})" if largest else ""),
            ("lane", "lanes"),
        )
        if any(p.use == use for p in plots)
    ]
    land = sum(p.polygon.area for p in plots if p.use == "parcel")
    if got:
        parts.append(f"parcels of {land / got:.0f} m2 on average where {rules.area:.0f} were asked")
    place = largest.polygon if largest is not None and not courts else block.polygon
    reason = f"{got} of {wanted} parcels: " + ", ".join(parts) + "."
    point = place.representative_point()
    found.append(FillProblem(block.block_id, point, reason, "Kept as it is."))
    return found


def _deep(block: Block, courts: Sequence[Plot], got: int, rules: ParcelRules) -> FillProblem:
    """Tell how deep a block is, and what a street through its court would serve."""
    court = max((plot.polygon for plot in courts), key=lambda polygon: polygon.area)
    circle = shapely.maximum_inscribed_circle(block.polygon, tolerance=0.5)
    deep = 2 * shapely.length(circle)
    x, y = shapely.get_coordinates(circle)[0].tolist()
    # the street runs the length of the court, its way out not counted, and on to two streets
    # through a row on each side
    half = 0.51 * rules.flag_width
    body = court.buffer(-half, join_style="mitre").buffer(half, join_style="mitre")
    body = court if body.is_empty else body
    length = smallest_rectangle(shapely.get_coordinates(body)).long
    land = sum(plot.polygon.area for plot in courts) - STREET * (length + 2 * rules.depth)
    more = max(0, int(land / rules.area))
    reason = f"The block is {deep:.0f} m deep"
    if more:
        reason += f": a street through it would serve about {more} more parcel" + "s" * (more > 1)
    uses = {
        "court": "a court",
        "lane": "lanes and a court",
        "flag": "parcels behind others and a court",
    }
    area = sum(plot.polygon.area for plot in courts)
    return FillProblem(
        block.block_id,
        Point(x, y),
        reason + ".",
        f"It has {uses[rules.deep]} of {area:.0f} m2, and {got} parcels.",
    )
