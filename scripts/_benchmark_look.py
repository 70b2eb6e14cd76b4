"""Hold streets designed by today's rules against the real ones of the same place.

Real quarters are taken as they stand: their own streets are removed, those on the edge stay, and
the quarter is designed anew with blocks as wide as those that are there (the median by area) and,
since BLOCK_LENGTH is the longest that is wished, no longer than three quarters of them by area.
Both patterns are measured by the same code. Then the sites of the test data, which have no
streets of their own: their figures alone.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import geopandas as gpd
import pandas as pd
import pyogrio
from platwright.errors import PlatwrightError
from platwright.measure.pattern import PatternMetrics, measure_pattern
from platwright.network.specification import Specification
from platwright.site import prepare_sites
from platwright.streets import StreetPlan, design_streets, plan_layers

from _look_places import Place, data_folder, places

#: What is compared: figure, whether more of it is better, and what difference counts as none.
MEASURES = {
    "bends_per_km": (False, 0.05),
    "turning_per_km": (False, 5.0),
    "odd_corners": (False, 0.005),
    "offsets": (False, 0.005),
    "dead_ends_per_km": (False, 0.05),
    "continued": (True, 0.005),
    "width_off": (False, 0.01),
    "length_off": (False, 0.01),
    "good": (True, 0.005),
    "thin": (False, 0.005),
    "deep": (False, 0.005),
    "rectangularity": (True, 0.005),
    "length_per_hectare": (False, 1.0),
    "way_out": (False, 1.0),
}
#: What is neither good nor bad.
OTHERS = ("t_junctions", "crossings", "blocks")
#: Picture of one place (inches), and its resolution.
SIZE, DPI = (7.2, 4.0), 80


@dataclass(frozen=True)
class Compared:
    """One place: what is there, and what was designed."""

    place: Place
    plan: StreetPlan
    streets: gpd.GeoDataFrame
    real: PatternMetrics
    ours: PatternMetrics
    seconds: float


def main(words: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="beginnings of names, with commas")
    parser.add_argument("--time-limit", type=float, default=10.0)
    parser.add_argument("--pictures", type=Path, help="folder for a picture of each place")
    parser.add_argument("--no-sites", action="store_true", help="leave the empty sites out")
    given = parser.parse_args(words)
    spec = Specification(time_limit=given.time_limit)
    found = []
    for place in places(given.only):
        try:
            one = compare(place, spec)
        except PlatwrightError as error:
            print(f"{place.where.name}: {error}")
            continue
        found.append(one)
        print("\n".join(rows_of(one)), flush=True)
        if given.pictures is not None:
            given.pictures.mkdir(parents=True, exist_ok=True)
            draw(one, given.pictures / f"{place.where.name.lower().replace(' ', '_')}.png")
    print("\n".join(summary([(one.real, one.ours) for one in found])))
    if not given.no_sites:
        print("\n".join(site_rows(given.only, spec)))
    return 0


def compare(place: Place, spec: Specification) -> Compared:
    """Design a place anew, and measure what is there and what was designed.

    Parameters
    ----------
    place
        The quarter.
    spec
        What is asked but for the size of blocks.
    """
    grain = place.grain
    longest = max(grain.width, grain.longest)
    asked = dataclasses.replace(spec, block_width=grain.width, block_length=longest)
    begun = time.perf_counter()
    prepared = prepare_sites(place.site, place.around)
    plan = design_streets(prepared.sites, asked)
    streets = plan_layers(plan)["streets"]
    seconds = time.perf_counter() - begun
    size = {"block_width": grain.width, "block_length": grain.length}
    real = measure_pattern(place.own, place.site, place.around, **size)
    ours = measure_pattern(streets, place.site, place.around, **size)
    return Compared(place, plan, streets, real, ours, seconds)


def as_good(real: PatternMetrics, ours: PatternMetrics) -> dict[str, bool]:
    """Tell for each measure whether ours is at least as good."""
    mine, theirs = ours.as_dict(), real.as_dict()
    return {
        name: mine[name] >= theirs[name] - slack if more else mine[name] <= theirs[name] + slack
        for name, (more, slack) in MEASURES.items()
    }


def rows_of(one: Compared) -> list[str]:
    """Write the rows of a place: real, ours, and where ours is worse."""
    place, good = one.place, as_good(one.real, one.ours)
    area = float(place.site.area.sum()) / 1e4
    head = (
        f"{place.where.name}: {area:.1f} ha, blocks of {place.grain.width:.0f} by "
        f"{place.grain.length:.0f} m, {one.seconds:.1f} s, as good on {sum(good.values())} of "
        f"{len(good)}"
    )
    names = [*MEASURES, *OTHERS]
    title = "  " + "".join(f"{name.replace('_per_', '/')[:12]:>13s}" for name in names)
    both = [
        f"  {who} "[:2] + "".join(f"{values[name]:13.2f}" for name in names) + f"  {who}"
        for who, values in (("real", one.real.as_dict()), ("ours", one.ours.as_dict()))
    ]
    worse = ", ".join(name for name, yes in good.items() if not yes)
    return [head, title, *both, f"  worse: {worse or 'nothing'}"]


def summary(pairs: list[tuple[PatternMetrics, PatternMetrics]]) -> list[str]:
    """Write for each measure both means, and on how many places ours is as good."""
    if not pairs:
        return ["There is no place to compare."]
    rows = [f"{'measure':20s} {'real':>8s} {'ours':>8s}  better is  mean as good  as good on"]
    good = [as_good(*pair) for pair in pairs]
    for name, (more, slack) in MEASURES.items():
        real, ours = (sum(p[k].as_dict()[name] for p in pairs) / len(pairs) for k in (0, 1))
        fine = ours >= real - slack if more else ours <= real + slack
        rows.append(
            f"{name:20s} {real:8.2f} {ours:8.2f}  {'more' if more else 'less':9s}  "
            f"{'yes' if fine else 'no':12s}  {sum(g[name] for g in good)} of {len(good)}"
        )
    for name in OTHERS:
        real, ours = (sum(p[k].as_dict()[name] for p in pairs) / len(pairs) for k in (0, 1))
        rows.append(f"{name:20s} {real:8.2f} {ours:8.2f}  neither")
    most = sum(2 * sum(g.values()) > len(g) for g in good)
    total = sum(sum(g.values()) for g in good)
    rows.append(
        f"As good on {total} of {len(good) * len(MEASURES)} measures of all places, and on more "
        f"than half of the measures in {most} of {len(good)} places."
    )
    return rows


def site_rows(only: str, spec: Specification) -> Iterator[str]:
    """Yield the figures of the empty sites."""
    files = sorted((data_folder() / "sites").glob("*.gpkg"))
    if not files:
        yield f"SKIPPED: the empty sites, which are not in {data_folder()}"
        return
    names = [*MEASURES, *OTHERS]
    yield "site" + "".join(f"{name.replace('_per_', '/')[:12]:>13s}" for name in names)
    for file in files:
        if only and not any(file.name.startswith(word) for word in only.split(",")):
            continue
        layers = {name for name, _ in pyogrio.list_layers(file)}
        site, roads = (gpd.read_file(file, layer=name) for name in ("site", "streets"))
        bars = gpd.read_file(file, layer="obstacles") if "obstacles" in layers else None
        try:
            plan = design_streets(prepare_sites(site, roads, bars).sites, spec)
        except PlatwrightError as error:
            yield f"{file.name[:2]}: {error}"
            continue
        streets = plan_layers(plan)["streets"].to_crs(site.crs)
        around = _with_boundary(streets, roads.to_crs(site.crs), site)
        values = measure_pattern(
            streets,
            site,
            around,
            block_width=spec.block_width,
            block_length=spec.block_length,
            obstacles=bars,
        ).as_dict()
        # the edge is the property line here: streets arrive beside it
        arriving = sum(len(own.arrivals) for own in plan.plans)
        values["continued"] = sum(own.continued for own in plan.plans) / max(1, arriving)
        yield f"{file.name[:2]}  " + "".join(f"{values[name]:13.2f}" for name in names)


def _with_boundary(
    streets: gpd.GeoDataFrame, roads: gpd.GeoDataFrame, site: gpd.GeoDataFrame
) -> gpd.GeoDataFrame:
    """Join the roads outside of a site with the existing streets of its plan."""
    old = streets[streets["status"] == "existing"][["geometry"]]
    known = old.union_all().buffer(0.5)
    rest = roads.geometry.difference(known).difference(site.union_all())
    rest = rest[rest.length > 1.0].explode(index_parts=False)
    parts = [old, gpd.GeoDataFrame(geometry=rest.to_numpy(), crs=roads.crs)]
    return gpd.GeoDataFrame(pd.concat(parts, ignore_index=True), crs=roads.crs)


def draw(one: Compared, path: Path) -> None:
    """Draw the real pattern of a place on the left, the designed one on the right."""
    import matplotlib.pyplot as plt
    from PIL import Image

    place = one.place
    new = one.streets[one.streets["status"] != "existing"].to_crs(place.site.crs)
    figure, axes = plt.subplots(1, 2, figsize=SIZE, layout="constrained")
    west, south, east, north = place.site.total_bounds
    for axis, lines, title in zip(axes, (place.own, new), ("as it is", "designed"), strict=True):
        place.site.plot(ax=axis, color="#f0efe9")
        place.around.plot(ax=axis, color="0.35", lw=1.6)
        if len(lines):
            lines.plot(ax=axis, color="#1f6fb4", lw=1.4)
        axis.set(xlim=(west - 40, east + 40), ylim=(south - 40, north + 40), aspect="equal")
        axis.axis("off")
        axis.set_title(f"{place.where.name}, {title}", fontsize=9)
    figure.text(0.995, 0.01, place.credit, ha="right", fontsize=6, color="0.4")
    figure.savefig(path, dpi=DPI)
    plt.close(figure)
    with Image.open(path) as opened:
        opened.convert("RGB").quantize(32, dither=Image.Dither.NONE).save(path, optimize=True)


if __name__ == "__main__":
    main()
