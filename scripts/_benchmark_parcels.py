"""Hold laid-out suburbs against the real ones of the same ground, as in UP Table 1.

Every region is measured four times by the same code: the real parcels (Map); the real streets
with parcels of ours between them (Refill); streets of ours with parcels by halving (CE2, what the
paper compares with); streets and parcels of ours (Ours). Outlines of all four are simplified by
1 m before corners are looked at, since surveyed ones have jogs that nobody drew.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import geopandas as gpd
import numpy as np
import shapely
from platwright.measure.landuse import measure_land_use
from platwright.measure.parcels import Ideal, measure_parcels
from platwright.parcels.rules import ParcelRules
from platwright.parcels.types import Block, Plot
from shapely.geometry.polygon import orient

from _parcel_regions import Region, data_folder, regions, ring_lines

#: Classes of land use by what a plot is.
USES = {"parcel": "parcel", "green": "park", "court": "park", "lane": "street", "street": "street"}
#: Pieces of land smaller than this are no block (square metres).
SCRAP = 300.0
#: Columns of UP Table 1, then ours: title, figure, decimals.
COLUMNS = (
    ("ls %", "streets_pct", 1), ("lr %", "parcels_pct", 1), ("lp %", "parks_pct", 1),
    ("lo %", "other_pct", 1), ("bn", "blocks_km2", 1), ("bmax", "block_max", 0),
    ("bavg", "block_mean", 0), ("bmin", "block_min", 0), ("sl", "street_km_km2", 1),
    ("si", "intersections_km2", 0), ("sd", "dead_ends_km2", 1), ("pn", "per_km2", 0),
    ("p_angle", "p_angle", 2), ("p_area", "p_area", 3), ("bad %", "undesirable_pct", 1),
    ("access %", "access_pct", 1), ("p_ideal", "p_ideal", 2), ("p_sim m", "p_similarity", 2),
    ("CV", "cv_area", 2), ("parcels", "count", 0), ("p_angle 5 cm", "p_angle_fine", 2),
    ("s", "seconds", 1), ("cpu s", "cpu", 1),
)  # fmt: skip


@dataclass(frozen=True)
class Asked:
    """What parcels and streets are to be like, metres, and the seed."""

    width: float
    depth: float
    street: float
    seed: int = 0

    @property
    def rules(self) -> ParcelRules:
        """What the library is asked of parcels."""
        return ParcelRules(width=self.width, depth=self.depth)


@dataclass(frozen=True)
class Made:
    """A layout of a region: plots with their use, and centre lines; what took how long.

    Attributes
    ----------
    seconds
        Wall time by stage; cpu: seconds of the processor for all, which others on the machine
        disturb less.
    """

    plots: gpd.GeoDataFrame
    streets: gpd.GeoDataFrame | None
    seconds: dict[str, float] = field(default_factory=dict)
    cpu: float = np.nan
    problems: int = 0


def real(region: Region, asked: Asked) -> Made:  # noqa: ARG001
    """Give what is there."""
    return Made(region.parcels, region.streets)


def refill(region: Region, asked: Asked) -> Made:
    """Cut the real blocks anew."""
    from platwright.parcels.fill import fill_blocks

    began, cpu = time.perf_counter(), time.process_time()
    filled = fill_blocks(real_blocks(region), asked.rules, seed=asked.seed)
    seconds = {"parcels": time.perf_counter() - began}
    cpu = time.process_time() - cpu
    plots = [plot for row in filled.plots for plot in row]
    return Made(_frame(plots, region), region.streets, seconds, cpu, len(filled.problems))


class Split:
    """Streets of ours, once for each region, and what is cut between them."""

    def __init__(self) -> None:
        self.layouts: dict[str, object] = {}
        self.cpu: dict[str, float] = {}

    def layout(self, region: Region, asked: Asked) -> object:
        """Lay a region out, or give the layout that there is."""
        from platwright.parcels.roadmesh import Ground
        from platwright.parcels.split.layout import lay_out
        from platwright.parcels.split.rules import SplitRules

        if region.name not in self.layouts:
            rings = ring_lines(region.polygon)
            ground = Ground(
                region.polygon,
                frontage=rings,
                centre_lines=rings if region.on_centre else shapely.MultiLineString(),
                width=asked.street,
            )
            split = SplitRules(street_width=asked.street)
            began = time.process_time()
            self.layouts[region.name] = lay_out(ground, asked.rules, split, seed=asked.seed)
            self.cpu[region.name] = time.process_time() - began
        return self.layouts[region.name]

    def ours(self, region: Region, asked: Asked) -> Made:
        """Give streets and parcels of ours."""
        layout = self.layout(region, asked)
        plots = [plot for row in layout.plots for plot in row]
        streets = self._streets(layout, region)
        seconds, cpu = dict(layout.seconds), self.cpu[region.name]
        return Made(_frame(plots, region), streets, seconds, cpu, len(layout.remarks))

    def halved(self, region: Region, asked: Asked) -> Made:
        """Cut the blocks of ours by halving."""
        from platwright.parcels.halving import halve_blocks

        layout = self.layout(region, asked)
        began, cpu = time.perf_counter(), time.process_time()
        rows = halve_blocks(layout.blocks, asked.rules, asked.seed)
        seconds = {"parcels": time.perf_counter() - began}
        cpu = time.process_time() - cpu
        plots = [plot for row in rows for plot in row]
        return Made(_frame(plots, region), self._streets(layout, region), seconds, cpu)

    def _streets(self, layout: object, region: Region) -> gpd.GeoDataFrame:
        from platwright.parcels.roadmesh import street_lines

        lines = [street.line for street in street_lines(layout.mesh)]
        if region.on_centre:
            lines += list(ring_lines(region.polygon).geoms)
        return gpd.GeoDataFrame(geometry=lines, crs=region.parcels.crs)


def real_blocks(region: Region) -> list[Block]:
    """Give the land between the real streets: the parcels, joined."""
    land = shapely.union_all(region.parcels.geometry.to_numpy())
    # gaps and jogs of the survey are not to be cut again
    land = shapely.buffer(shapely.buffer(land, 1.0, join_style="mitre"), -1.0, join_style="mitre")
    land = shapely.simplify(shapely.intersection(land, region.polygon), 0.5)
    parts = [p for p in shapely.get_parts(land) if p.geom_type == "Polygon" and p.area > SCRAP]
    return [Block(orient(part), block_id=at) for at, part in enumerate(parts, 1)]


def _frame(plots: list[Plot], region: Region) -> gpd.GeoDataFrame:
    uses = {"use": [USES[plot.use] for plot in plots]}
    return gpd.GeoDataFrame(uses, geometry=[p.polygon for p in plots], crs=region.parcels.crs)


def measure(made: Made, region: Region, asked: Asked) -> dict[str, float]:
    """Measure a layout, whoever made it."""
    site = gpd.GeoDataFrame(geometry=[region.polygon], crs=region.parcels.crs)
    land = measure_land_use(made.plots, streets=made.streets, site=site).figures
    housing = made.plots[made.plots["use"] != "other"]
    found = {}
    for tolerance in (0.05, 1.0):
        ideal = Ideal(asked.width, asked.depth, tolerance)
        figures = measure_parcels(housing, site=site, ideal=ideal).figures
        found = {"p_angle_fine": found.get("p_angle", np.nan), **figures.as_dict()}
    return {
        **land.as_dict(),
        **found,
        "seconds": sum(made.seconds.values()) or np.nan,
        "cpu": made.cpu,
        "problems": made.problems,
    }


def methods() -> dict[str, Callable[[Region, Asked], Made]]:
    """Give what is compared, by its name in the table."""
    split = Split()
    return {"Map": real, "Refill": refill, "CE2": split.halved, "Ours": split.ours}


def draw(made: dict[str, Made], region: Region, file: Path) -> None:
    """Draw all layouts of a region side by side, parcels from blue to red as in UP Fig. 12."""
    from matplotlib import pyplot as plt
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Polygon as Patch

    figure, axes = plt.subplots(1, len(made), figsize=(9 * len(made), 9))
    for axis, (name, one) in zip(np.atleast_1d(axes), made.items(), strict=True):
        found = measure_parcels(one.plots[one.plots["use"] != "other"], ideal=Ideal(tolerance=1.0))
        bad = np.maximum(found.parcels["p_angle"] / 15, (found.parcels["p_area"] - 1) / 0.2)
        shapes = found.parcels.geometry.to_numpy()
        parcel = ~np.isnan(bad.to_numpy(dtype=float))
        for which, options in (
            (~parcel, {"facecolor": "#cfe0b5"}),
            (parcel, {"cmap": "RdYlBu_r", "array": bad[parcel], "clim": (0, 1)}),
        ):
            patches = [Patch(np.asarray(shape.exterior.coords)) for shape in shapes[which]]
            if "array" not in options:
                axis.add_collection(PatchCollection(patches, edgecolor="w", lw=0.3, **options))
                continue
            values, limits = options.pop("array"), options.pop("clim")
            drawn = PatchCollection(patches, edgecolor="w", lw=0.3, **options)
            drawn.set_array(np.asarray(values))
            drawn.set_clim(*limits)
            axis.add_collection(drawn)
        axis.set(title=f"{region.name}: {name}", aspect="equal")
        axis.autoscale()
        axis.axis("off")
    figure.tight_layout()
    figure.savefig(file, dpi=70)
    plt.close(figure)


def main(given: list[str] | None = None) -> int:
    """Print the table; return 1 if a layout failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="only regions whose name contains this")
    parser.add_argument("--rows", nargs="+", default=list(methods()), choices=list(methods()))
    parser.add_argument("--width", type=float, default=18.0, metavar="M")
    parser.add_argument("--depth", type=float, default=30.0, metavar="M")
    parser.add_argument("--street", type=float, default=15.0, metavar="M")
    parser.add_argument("--own", action="store_true", help="parcels as wide and deep as the real")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--pictures", type=Path, help="folder for a picture of each region")
    parser.add_argument("--json", type=Path, help="file for the figures")
    options = parser.parse_args(given)
    print("| region | ha | | " + " | ".join(title for title, _, _ in COLUMNS) + " |")
    print("|---" * (len(COLUMNS) + 3) + "|")
    failed, told = 0, []
    for region in regions(data_folder(), options.only):
        size = region.median_size if options.own else (options.width, options.depth)
        asked = Asked(*size, options.street, options.seed)
        made: dict[str, Made] = {}
        for name, method in methods_of(options.rows).items():
            try:
                made[name] = method(region, asked)
                row = measure(made[name], region, asked)
            except Exception as error:
                print(f"| {region.name} | | {name} | FAILED: {type(error).__name__}: {error} |")
                failed += 1
                continue
            told.append({"region": region.name, "row": name, **row, **made[name].seconds})
            cells = ["-" if np.isnan(row[k]) else f"{row[k]:.{n}f}" for _, k, n in COLUMNS]
            area = f"{region.polygon.area / 1e4:.0f}"
            print(f"| {region.name} | {area} | {name} | " + " | ".join(cells) + " |", flush=True)
        if options.pictures is not None and made:
            options.pictures.mkdir(parents=True, exist_ok=True)
            draw(made, region, options.pictures / f"{region.name.lower().replace(' ', '_')}.png")
    if options.json is not None:
        options.json.write_text(json.dumps(told, indent=1, default=float), encoding="utf-8")
    return 1 if failed else 0


def methods_of(names: list[str]) -> dict[str, Callable[[Region, Asked], Made]]:
    """Give some of the methods, which share what they make."""
    every = methods()
    return {name: every[name] for name in every if name in names}


if __name__ == "__main__":
    raise SystemExit(main())
