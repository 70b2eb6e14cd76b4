"""Design real sites, print what a planner would look at, and draw the plans on one sheet."""

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
#: every site for a street.
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
    drawn = []
    for file in files:
        key = file.name[:2]
        if wanted and key not in wanted:
            continue
        try:
            drawn.append((key, *_one(key, file, spec)))
        except PlatwrightError as error:
            print(f"{key}: {error}")
    _summary([row for *_, row in drawn if row is not None], spec)
    if given.picture is not None:
        _draw(drawn, given.picture, given.block_width)


def _one(
    key: str, file: Path, spec: Specification
) -> tuple[StreetPlan, gpd.GeoDataFrame, tuple[Row, Row] | None]:
    """Design one site and print its row, and that of the prototype."""
    names = [name for name, _ in pyogrio.list_layers(file)]
    site, roads = (gpd.read_file(file, layer=name) for name in ("site", "streets"))
    obstacles = gpd.read_file(file, layer="obstacles") if "obstacles" in names else None
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
    print(
        f"{key} {seconds:5.1f} {plan.numbers['ACHIEVED_GAP']:4.0%} {m.bends:3d} "
        f"{m.t_junctions:3d} {m.crossings:3d} {continued:3d}/{len(own):<3d} {m.blocks:4d} "
        f"{m.block_width:6.0f} {m.share_wide_enough:5.2f} {m.share_too_thin:5.2f} "
        f"{m.block_length:6.0f} {m.length_per_hectare:5.0f} {lost:3d} {len(wrong):3d}",
        flush=True,
    )
    for text in wrong["text"]:
        print(f"  error: {text}")
    if key in PROTOTYPE:
        p = PROTOTYPE[key]
        print(
            f" prototype: {p[0]} s, bends {p[1]}, T {p[2]}, X {p[3]}, continued {p[4]}, blocks "
            f"{p[5]}, width {p[6]}, good {p[7]}, thin {p[8]}, longest {p[9]}"
        )
        before = (p[0], p[1], share(p[4]), p[6], p[7], p[8], p[9])
        now = (
            seconds,
            m.bends,
            continued / max(1, len(own)),
            m.block_width,
            m.share_wide_enough,
            m.share_too_thin,
            m.block_length,
        )
        return plan, roads, (now, before)
    return plan, roads, None


def share(text: str) -> float:
    """Turn "3/8" into a number."""
    part, whole = text.split("/")
    return int(part) / int(whole)


def _summary(rows: list[tuple[Row, Row]], spec: Specification) -> None:
    """Say for each column on how many sites it is as good as the prototype's, and both means.

    Widths are better the nearer they are to the asked one, and a longest block is good enough
    where it is no longer than asked. How many junctions and blocks there are is neither.
    """
    if not rows:
        return
    asked, longest = spec.block_width, spec.block_length
    rules: dict[str, Callable[[float], float]] = {
        "seconds": lambda v: v,
        "bends": lambda v: v,
        "share continued": lambda v: -v,
        "width": lambda v: abs(v - asked),
        "share good": lambda v: -v,
        "share thin": lambda v: v,
        "longest": lambda v: max(v, longest),
    }
    print("column           as good on   mean   prototype's")
    for k, (name, cost) in enumerate(rules.items()):
        good = sum(cost(round(now[k], 2)) <= cost(before[k]) + 1e-9 for now, before in rows)
        means = [sum(pair[i][k] for pair in rows) / len(rows) for i in (0, 1)]
        print(f"{name:16s} {good:2d} of {len(rows):<2d}  {means[0]:8.2f} {means[1]:8.2f}")


def _draw(
    drawn: list[tuple[str, StreetPlan, gpd.GeoDataFrame, object]], picture: Path, width: float
) -> None:
    """Draw all plans side by side."""
    import matplotlib.pyplot as plt

    columns = min(4, max(1, len(drawn)))
    rows = -(-len(drawn) // columns)
    _, axes = plt.subplots(rows, columns, figsize=(9 * columns, 9 * rows), squeeze=False)
    for axis in axes.ravel():
        axis.axis("off")
    for axis, (key, plan, roads, _) in zip(axes.ravel(), drawn, strict=False):
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
