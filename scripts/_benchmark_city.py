"""Design a whole city sub-region by sub-region, on one worker and on two, and compare.

The city is the part of Baltimore that the test data hold: a window over the extract, without the
harbour. Major roads of OpenStreetMap cut it. CND reports 7,844 s of computing for its city, 2,300 s
in parallel; its city is another one, so that only the ratio of both runs is a figure of its own.
Every worker uses one core. Run it on a quiet machine: `--share` says which part of the window.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyogrio
import shapely
from platwright.city import City, CityPlan, CityRules, city_layers, design_city, divide_city
from platwright.network.specification import Specification
from platwright.osm.sea import sea
from platwright.tasks import Processes
from shapely.geometry import box

#: Where test data are.
DATA = Path(
    os.environ.get("PLATWRIGHT_TEST_DATA") or Path(__file__).absolute().parents[2] / "shared/data"
)
#: The window: west, south, east, north (EPSG:26985, metres).
WINDOW = (433700.0, 176600.0, 440950.0, 182150.0)
METRES = 26985
WIDE = 12.0
PARKS = ("park", "golf_course", "nature_reserve")
KEPT = ("cemetery", "railway", "reservoir", "basin")
COLOURS = {
    ("existing", 1): ("#3d3a35", 1.5), ("existing", 2): ("#6b6459", 1.1),
    ("existing", 3): ("#8c867c", 0.7), ("new", 2): ("#c8442c", 0.8), ("new", 3): ("#e08a3c", 0.5),
    ("new", 4): ("#d9a7b8", 0.5), ("connector", 3): ("#e08a3c", 0.5),
}  # fmt: skip


def read(window: shapely.Geometry) -> tuple[gpd.GeoDataFrame, gpd.GeoDataFrame, gpd.GeoDataFrame]:
    """Return the ground of the city, its roads, and what stays free of streets."""
    path = DATA / "osm" / "baltimore.osm.pbf"
    lines = pyogrio.read_dataframe(path, layer="lines")
    areas = pyogrio.read_dataframe(path, layer="multipolygons", on_invalid="ignore")
    degrees = gpd.GeoSeries([window], crs=METRES).to_crs(4326).iloc[0]
    tags = lines["other_tags"].fillna("")
    coast = lines[tags.str.contains('"natural"=>"coastline"')]
    water = gpd.GeoSeries([sea(list(coast.geometry), degrees)], crs=4326).to_crs(METRES).iloc[0]
    rails = lines[(lines["railway"] == "rail") & ~tags.str.contains('"tunnel"=>')].to_crs(METRES)
    near = areas[
        (areas["natural"] == "water")
        | areas["leisure"].isin(PARKS)
        | areas["landuse"].isin(KEPT)
    ].to_crs(METRES)  # fmt: skip
    free = [*near.geometry, *rails.buffer(WIDE).geometry]
    ground = gpd.GeoDataFrame(geometry=[window.difference(water)], crs=METRES)
    roads = lines[lines["highway"].notna()]
    return ground, roads, gpd.GeoDataFrame(geometry=free, crs=METRES)


def draw(plan: CityPlan, path: Path) -> None:
    """Draw the streets of the whole city."""
    import matplotlib.pyplot as plt

    found = city_layers(plan)
    regions, streets = found["sub_regions"], found["streets"]
    figure, ax = plt.subplots(figsize=(13.5, 10.0), facecolor="#ffffff")
    figure.subplots_adjust(0, 0, 1, 1)
    for state, colour in (("done", "#f7f2e7"), ("left", "#dcdfd8"), ("failed", "#f0c4bd")):
        own = regions[regions["state"] == state]
        if len(own):
            own.plot(ax=ax, color=colour, edgecolor="none")
    for (status, level), (colour, width) in sorted(COLOURS.items(), reverse=True):
        own = streets[(streets["status"] == status) & (streets["level"] == level)]
        if len(own):
            own.plot(ax=ax, color=colour, linewidth=width)
    ax.set_axis_off()
    ax.set_aspect("equal")
    figure.text(0.995, 0.005, "© OpenStreetMap contributors", ha="right", fontsize=9)
    figure.savefig(path, dpi=90)
    plt.close(figure)


def tell(city: City) -> None:
    """Print what is to be designed."""
    areas = np.array([r.polygon.area / 1e4 for r in city.to_design])
    print(
        f"{len(city.regions)} sub-regions of {sum(r.polygon.area for r in city.regions) / 1e6:.1f} "
        f"km2; designed: {len(areas)}, {areas.sum() / 100:.1f} km2, {areas.min():.1f} to "
        f"{areas.max():.1f} ha; {len(city.junctions)} planned junctions",
        flush=True,
    )


def main() -> None:
    """Run the city with one worker and with several, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--share", type=float, default=1.0, help="share of the window's sides")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--effort", type=float, default=None, help="windows per 100 edges")
    parser.add_argument("--picture", type=Path, default=None)
    asked = parser.parse_args()
    if not (DATA / "osm" / "baltimore.osm.pbf").is_file():
        raise SystemExit(f"There are no test data in {DATA}; PLATWRIGHT_TEST_DATA says where.")
    west, south, east, north = WINDOW
    wide, high = asked.share * (east - west), asked.share * (north - south)
    begun = time.perf_counter()
    city = divide_city(*read(box(west, north - high, west + wide, north)), CityRules())
    print(f"read and divided in {time.perf_counter() - begun:.1f} s")
    tell(city)
    spec = Specification(effort=asked.effort)
    # both runs in processes of their own, so that nothing but their number differs
    runs = {n: design_city(city, spec, executor=Processes(n)) for n in (1, asked.workers)}
    print("| workers | seconds | computing, s | streets, km | gap, % | sides agree, % | digest |")
    print("|---|---|---|---|---|---|---|")
    for n, plan in runs.items():
        own = plan.numbers
        print(
            f"| {n} | {plan.seconds:.1f} | {plan.computing:.1f} | {own['TOTAL_LENGTH'] / 1e3:.1f} "
            f"| {100 * own['ACHIEVED_GAP']:.1f} | {own['AGREEMENT']:.1f} | {plan.digest[:12]} |"
        )
    one, many = runs[1], runs[asked.workers]
    own = one.numbers
    print(f"ratio {one.seconds / many.seconds:.2f}; same result: {one.digest == many.digest}")
    print({k: round(v, 1) for k, v in own.items()})
    print(f"ends moved by {one.agreement.moved:.1f} m at most; load {os.getloadavg()}")
    if asked.picture is not None:
        draw(one, asked.picture)


if __name__ == "__main__":
    main()
