"""Design real sites, print what a planner would look at, and draw the plans on one sheet.

Beside each site stands what the prototype before this product made of it. It did not know of the
station in the Helsinki yard and built through it, so the row that is compared with it, and only
that one, is designed without this obstacle; the true one stands outside of the means.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import geopandas as gpd
import pyogrio
from platwright.errors import PlatwrightError
from platwright.measure import measure_plan, validate_network
from platwright.network.specification import Specification
from platwright.site import prepare_sites, site_layers
from platwright.streets import StreetPlan, design_streets, plan_layers

Row = tuple[float, ...]

ROOT = Path(__file__).resolve().parents[1]

#: The prototype before this product: seconds, bends, T, crossings, continued, blocks, median
#: width, share of good widths, share too thin, longest block. It took the whole boundary of
#: every site for a street: compare with it by `--sinks boundary`.
PROTOTYPE = {
    "01": (1.6, 0, 2, 6, "3/8", 14, 65, 0.79, 0.0, 158),
    "02": (8.2, 2, 8, 6, "3/4", 18, 57, 0.44, 0.17, 149),
    "05": (10, 3, 1, 11, "3/5", 24, 70, 0.67, 0.17, 179),
    "08": (4.1, 0, 1, 9, "2/6", 23, 68, 0.48, 0.17, 137),
    "09": (30, 8, 25, 31, "6/15", 68, 61, 0.62, 0.07, 175),
    "10": (19, 3, 5, 17, "2/3", 34, 63, 0.68, 0.18, 178),
    "11": (12, 1, 6, 13, "5/8", 28, 69, 0.61, 0.07, 146),
    "12": (11, 3, 7, 8, "3/9", 23, 58, 0.52, 0.26, 156),
    "he": (6.2, 3, 1, 5, "2/2", 16, 67, 0.50, 0.31, 148),
}
#: Sites whose obstacles the prototype did not know.
BUILT_THROUGH = {"he": "its station"}
HEAD = (
    "site  s  gap  bends  T  X  continued  blocks  width  good  thin  longest  m/ha  "
    "uncovered  errors"
)


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sites", type=Path, default=ROOT.parent / "shared" / "data" / "sites")
    parser.add_argument("--only", default="", help="first two letters of files, with commas")
    parser.add_argument("--sinks", default="streets", choices=("streets", "boundary", "access"))
    parser.add_argument("--block-width", type=float, default=72.0)
    parser.add_argument("--time-limit", type=float, default=30.0)
    parser.add_argument("--picture", type=Path, help="PNG to draw the plans on")
    given = parser.parse_args()
    files = [ROOT / "data" / "helsinki" / "helsinki_yard.gpkg", *sorted(given.sites.glob("*.gpkg"))]
    wanted = [w for w in given.only.split(",") if w]
    spec = Specification(
        sink_mode=given.sinks, block_width=given.block_width, time_limit=given.time_limit
    )
    print(HEAD)
    drawn: list[tuple[str, StreetPlan, gpd.GeoDataFrame]] = []
    compared: list[tuple[Row, Row]] = []
    for file in files:
        key = file.name[:2]
        if wanted and key not in wanted:
            continue
        runs = [True, False] if key in BUILT_THROUGH else [True]
        for barred in runs:
            try:
                plan, roads, row = _one(key, file, spec, barred=barred)
            except PlatwrightError as error:
                print(f"{key}: {error}")
                continue
            drawn.append((key if barred else f"{key} without {BUILT_THROUGH[key]}", plan, roads))
            # like for like: the last run of a site is that on the prototype's ground
            if barred == runs[-1] and key in PROTOTYPE:
                compared.append((row, _prototype(key)))
    _summary(compared, spec)
    if given.picture is not None:
        _draw(drawn, given.picture, given.block_width)


def _one(
    key: str, file: Path, spec: Specification, *, barred: bool
) -> tuple[StreetPlan, gpd.GeoDataFrame, Row]:
    """Design one site, with or without its obstacles, and print its row."""
    names = [name for name, _ in pyogrio.list_layers(file)]
    site, roads = (gpd.read_file(file, layer=name) for name in ("site", "streets"))
    known = barred and "obstacles" in names
    obstacles = gpd.read_file(file, layer="obstacles") if known else None
    begun = time.perf_counter()
    prepared = prepare_sites(site, roads, obstacles)
    plan = design_streets(prepared.sites, spec)
    layers = plan_layers(plan)
    seconds = time.perf_counter() - begun
    ground = site_layers(prepared)
    own = [p for p in plan.plans for p in p.arrivals]
    m = measure_plan(
        layers["streets"],
        ground["site"],
        block_width=spec.block_width,
        obstacles=ground["site_obstacles"],
    )
    report = validate_network(
        layers["streets"],
        site=ground["site"],
        obstacles=ground["site_obstacles"],
        boundary_streets=ground["boundary_streets"] if spec.sink_mode == "streets" else None,
        sinks=layers["junctions"].query("is_sink") if spec.sink_mode == "access" else None,
        dead_ends=spec.dead_ends,
    )
    wrong = report.problems[report.problems["severity"] == "error"]
    continued = sum(p.continued for p in plan.plans)
    lost = sum(len(p.uncovered) for p in plan.plans)
    if not barred:
        print(f"{key} without {BUILT_THROUGH[key]}, as the prototype had it:")
    elif key in BUILT_THROUGH:
        print(f"{key} as it is (outside of the comparison and its means):")
    print(
        f"{key} {seconds:5.1f} {plan.numbers['ACHIEVED_GAP']:4.0%} {m.bends:3d} "
        f"{m.t_junctions:3d} {m.crossings:3d} {continued:3d}/{len(own):<3d} {m.blocks:4d} "
        f"{m.block_width:6.0f} {m.share_wide_enough:5.2f} {m.share_too_thin:5.2f} "
        f"{m.block_length:6.0f} {m.length_per_hectare:5.0f} {lost:3d} {len(wrong):3d}",
        flush=True,
    )
    for text in wrong["text"]:
        print(f"  error: {text}")
    if key in PROTOTYPE and (not barred or key not in BUILT_THROUGH):
        p = PROTOTYPE[key]
        print(
            f" prototype: {p[0]} s, bends {p[1]}, T {p[2]}, X {p[3]}, continued {p[4]}, blocks "
            f"{p[5]}, width {p[6]}, good {p[7]}, thin {p[8]}, longest {p[9]}"
        )
    row = (
        seconds,
        m.bends,
        continued / max(1, len(own)),
        m.block_width,
        m.share_wide_enough,
        m.share_too_thin,
        m.block_length,
    )
    return plan, roads, row


def _prototype(key: str) -> Row:
    """Return what is compared of the prototype's row."""
    p = PROTOTYPE[key]
    return (p[0], p[1], share(p[4]), p[6], p[7], p[8], p[9])


def share(text: str) -> float:
    """Turn "3/8" into a number."""
    part, whole = text.split("/")
    return int(part) / int(whole)


def _summary(rows: list[tuple[Row, Row]], spec: Specification) -> None:
    """Say for each column how both means compare, and on how many sites it is as good.

    Widths are better the nearer they are to the asked one, so their column is the distance from
    it; a longest block of one site is good enough where it is no longer than asked. How many
    junctions and blocks there are is neither good nor bad.
    """
    if not rows:
        return
    asked, longest = spec.block_width, spec.block_length
    print(f"{'column':16s}   mean  prototype's  at least as good  on")
    for name, mine, theirs, as_good, count in compared_columns(rows, asked, longest):
        answer = "yes" if as_good else "no"
        print(f"{name:16s} {mine:6.2f}  {theirs:11.2f}  {answer:16s}  {count} of {len(rows)}")


def compared_columns(
    rows: list[tuple[Row, Row]], asked: float, longest: float
) -> list[tuple[str, float, float, bool, int]]:
    """Compare two sets of rows column by column.

    Parameters
    ----------
    rows
        For each site our row and the prototype's.
    asked, longest
        Asked block width and block length, metres.

    Returns
    -------
    list
        Name of the column, our mean, the prototype's, whether ours is at least as good, and on
        how many sites it is.
    """
    as_it_is: Callable[[float], float] = float
    # what is averaged; sign of what is better; on one site, as good as any value up to the last
    rules: list[tuple[str, Callable[[float], float], int, float]] = [
        ("seconds", as_it_is, 1, 0.0),
        ("bends", as_it_is, 1, 0.0),
        ("share continued", as_it_is, -1, -1.0),
        ("width off by", lambda v: abs(v - asked), 1, 0.0),
        ("share good", as_it_is, -1, -1.0),
        ("share thin", as_it_is, 1, 0.0),
        ("longest", as_it_is, 1, longest),
    ]
    found = []
    for k, (name, value, sign, enough) in enumerate(rules):
        mine = [round(value(now[k]), 2) for now, _ in rows]
        theirs = [round(value(before[k]), 2) for _, before in rows]
        good = sum(max(sign * a, enough) <= max(sign * b, enough) for a, b in zip(mine, theirs))
        means = [round(sum(values) / len(rows), 2) for values in (mine, theirs)]
        found.append((name, *means, sign * means[0] <= sign * means[1], good))
    return found


def _draw(
    drawn: list[tuple[str, StreetPlan, gpd.GeoDataFrame]], picture: Path, width: float
) -> None:
    """Draw all plans side by side."""
    import matplotlib.pyplot as plt

    columns = min(4, max(1, len(drawn)))
    rows = -(-len(drawn) // columns)
    _, axes = plt.subplots(rows, columns, figsize=(9 * columns, 9 * rows), squeeze=False)
    for axis in axes.ravel():
        axis.axis("off")
    for axis, (key, plan, roads) in zip(axes.ravel(), drawn, strict=False):
        axis.set_title(key)
        axis.set_aspect("equal")
        for own in plan.plans:
            _draw_site(axis, own, roads.to_crs(own.site.crs), width)
    plt.savefig(picture, dpi=60, bbox_inches="tight")


def _draw_site(axis, own, roads: gpd.GeoDataFrame, width: float) -> None:
    """Draw the plan of one site."""
    tints = ((0.62, "#fde0dd"), (0.76, "#fff7d6"), (1.11, "#e6f4d8"), (9e9, "#dcecf7"))
    for block in own.blocks:
        tint = next(c for limit, c in tints if block.width < limit * width)
        axis.fill(*block.polygon.exterior.xy, fc=tint)
    near = roads[roads.distance(own.site.polygon) < 150]
    if len(near):
        near.plot(ax=axis, color="0.65", lw=1)
    for area in own.site.obstacles:
        axis.fill(*area.exterior.xy, fc="#a9d49a")
    for segment in sorted(own.segments, key=lambda s: -s.level):
        thick = segment.level == 2
        axis.plot(*segment.line.xy, c="#d7191c" if thick else "#2b7bba", lw=3 if thick else 1.8)
    for joint in own.connectors:
        axis.plot(*joint.line.xy, c="#8856a7", lw=1.5)
    for ring in (own.site.polygon.exterior, *own.site.polygon.interiors):
        axis.plot(*ring.xy, "k", lw=0.6)
    for part in own.site.street_frontage.geoms:
        axis.plot(*part.xy, c="k", lw=2)


if __name__ == "__main__":
    main()
