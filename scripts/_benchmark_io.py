"""Time everything but the search on sites of one square kilometre: read, prepare, mesh, write.

Beside it, in the same run, what reading and writing the same layers costs with geopandas alone.
All times are seconds of wall time, the least of some runs; "cpu" is the processor's share.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import geopandas as gpd
import pyogrio
from platwright.mesh import QuadMesh, mesh_layers, quadrangulate
from platwright.network.specification import Specification
from platwright.site import PreparedSites, prepare_sites, site_layers
from platwright.streets import arriving_streets, edge_length, site_mesh
from shapely import affinity

ROOT = Path(__file__).resolve().parents[1]
SQUARE_KILOMETRE = 1e6
#: Access points nearer than this share of the block width are one arriving street.
SPACING = 0.5
STAGES = ("read", "prepare", "one mesh", "layers", "write", "total")
#: Layers of a site file by what they are for.
LAYERS = ("site", "streets", "obstacles")


@dataclass(frozen=True)
class Case:
    """Where the layers of a site are: file, layer name and one of its features (or all)."""

    name: str
    site: tuple[Path, str, int | None]
    roads: tuple[Path, str]
    obstacles: tuple[Path, str] | None = None
    scaled: bool = False


@dataclass
class Clock:
    """Collects wall and processor seconds by stage."""

    wall: dict[str, float] = field(default_factory=dict)
    cpu: dict[str, float] = field(default_factory=dict)

    def time(self, stage: str, work: Callable[[], Any]) -> Any:
        """Do some work and note what it took."""
        wall, cpu = time.perf_counter(), time.process_time()
        result = work()
        self.wall[stage] = self.wall.get(stage, 0.0) + time.perf_counter() - wall
        self.cpu[stage] = self.cpu.get(stage, 0.0) + time.process_time() - cpu
        return result


def data_folder() -> Path:
    """Folder of the real test data: PLATWRIGHT_TEST_DATA or ../shared/data."""
    given = os.environ.get("PLATWRIGHT_TEST_DATA")
    return Path(given) if given else ROOT.parent / "shared" / "data"


def cases(folder: Path) -> Iterator[Case]:
    """Yield a real quarter of one square kilometre, and real sites blown up to that."""
    town = folder / "town" / "monaco.gpkg"
    if town.is_file():
        # the largest residential area there: 105 ha, 185 corners, streets and parks all over it
        yield Case(
            "Monaco, residential area",
            (town, "landuse", _largest(town, "landuse", "landuse", "residential")),
            (town, "streets"),
            (town, "parks"),
        )
    sites = sorted((folder / "sites").glob("*.gpkg"))
    if not sites or not town.is_file():
        print(f"SKIPPED: real sites, which are not in {folder} (PLATWRIGHT_TEST_DATA says where)")
    for file in (ROOT / "data" / "helsinki" / "helsinki_yard.gpkg", *sites):
        names = [name for name, _ in pyogrio.list_layers(file)]
        barred = (file, "obstacles") if "obstacles" in names else None
        yield Case(file.stem[:24], (file, "site", None), (file, "streets"), barred, scaled=True)


def _largest(file: Path, layer: str, column: str, value: str) -> int:
    """Return the row of the largest polygon with a value."""
    frame = gpd.read_file(file, layer=layer)
    return int(frame[frame[column] == value].area.idxmax())


def read(case: Case) -> list[gpd.GeoDataFrame]:
    """Read site, roads and, where there are any, obstacles."""
    file, layer, feature = case.site
    site = gpd.read_file(file, layer=layer)
    frames = [site if feature is None else site.loc[[feature]]]
    others = [case.roads] if case.obstacles is None else [case.roads, case.obstacles]
    return frames + [gpd.read_file(path, layer=name) for path, name in others]


def blown_up(frames: Iterable[gpd.GeoDataFrame]) -> list[gpd.GeoDataFrame]:
    """Scale a site and all around it to one square kilometre, in metres."""
    own = list(frames)
    crs = own[0].estimate_utm_crs()
    moved = [frame.to_crs(crs) for frame in own]
    factor = (SQUARE_KILOMETRE / moved[0].area.sum()) ** 0.5
    middle = moved[0].union_all().centroid
    matrix = [factor, 0, 0, factor, middle.x * (1 - factor), middle.y * (1 - factor)]
    return [
        frame.set_geometry(frame.geometry.map(lambda g: affinity.affine_transform(g, matrix)))
        for frame in moved
    ]


def write(layers: dict[str, gpd.GeoDataFrame], file: Path) -> None:
    """Write all layers into one GeoPackage."""
    file.unlink(missing_ok=True)
    for name, frame in layers.items():
        frame.to_file(file, layer=name, driver="GPKG")


def run(case: Case, folder: Path, block_width: float, *, choice: bool) -> tuple[Clock, str]:
    """Time one site from layers to layers.

    Parameters
    ----------
    case
        The site.
    folder
        For what is written.
    block_width
        Metres.
    choice
        Also time the choice of a mesh from several, as `designstreets` makes it.

    Returns
    -------
    tuple
        The times, and what was made.
    """
    clock = Clock()
    spec = Specification(block_width=block_width, block_length=2 * block_width)
    here = case
    if case.scaled:
        source = folder / "in.gpkg"
        write(dict(zip(LAYERS, blown_up(read(case)), strict=False)), source)
        barred = None if case.obstacles is None else (source, "obstacles")
        here = Case(case.name, (source, "site", None), (source, "streets"), barred)
    frames = clock.time("read", lambda: read(here))
    prepared: PreparedSites = clock.time("prepare", lambda: prepare_sites(*frames))
    spacing = SPACING * block_width
    arriving = {s.site_id: [p.xy for p in arriving_streets(s, spacing)] for s in prepared.sites}

    def mesh() -> list[QuadMesh]:
        return [
            quadrangulate(s.polygon, edge_length(spec), attract_points=arriving[s.site_id])
            for s in prepared.sites
        ]

    meshes = clock.time("one mesh", mesh)
    layers = clock.time("layers", lambda: _layers(prepared, meshes))
    clock.time("write", lambda: write(layers, folder / "out.gpkg"))
    for seconds in (clock.wall, clock.cpu):
        seconds["total"] = sum(seconds[stage] for stage in STAGES[:-1])
    if choice:
        clock.time(
            "choice",
            lambda: [site_mesh(s, spec, arriving_streets(s, spacing)) for s in prepared.sites],
        )
    # the same layers in and out by geopandas alone: what no program that uses it can beat
    clock.time("baseline", lambda: (read(here), write(layers, folder / "plain.gpkg")))
    made = f"{sum(s.area_ha for s in prepared.sites):.0f} ha, {sum(len(m.faces) for m in meshes)}"
    rows = sum(len(frame) for frame in layers.values())
    return clock, f"{made} cells, {sum(map(len, frames))} features in, {rows} out"


def _layers(prepared: PreparedSites, meshes: list[QuadMesh]) -> dict[str, gpd.GeoDataFrame]:
    """Return all layers that preparesite and candidatemesh write."""
    layers = dict(site_layers(prepared))
    for site, mesh in zip(prepared.sites, meshes, strict=True):
        for name, frame in mesh_layers(mesh, site.crs, site.source_crs).items():
            layers[f"mesh_{name}_{site.site_id}"] = frame
    return layers


def least(clocks: list[Clock]) -> Clock:
    """Return the least of several runs, stage by stage."""
    best = Clock()
    for name in ("wall", "cpu"):
        seconds = [getattr(clock, name) for clock in clocks]
        getattr(best, name).update({k: min(s[k] for s in seconds) for k in seconds[0]})
    return best


def main(given: list[str] | None = None) -> int:
    """Print the table; return 1 if a site took longer than is allowed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--block-width", type=float, default=72.0, metavar="M")
    parser.add_argument("--only", default="", help="only sites whose name contains this")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--limit", type=float, default=3.0, help="seconds that are allowed")
    parser.add_argument("--no-choice", action="store_true", help="leave the choice of meshes out")
    options = parser.parse_args(given)
    heads = [*STAGES, "cpu", "baseline", "ratio", *([] if options.no_choice else ["choice, cpu"])]
    print("| site | " + " | ".join(heads) + " | made |")
    print("|---|" + "---|" * (len(heads) + 1))
    slow = []
    for case in cases(data_folder()):
        if options.only.lower() not in case.name.lower():
            continue
        with tempfile.TemporaryDirectory() as folder:
            done = [
                run(case, Path(folder), options.block_width, choice=not options.no_choice)
                for _ in range(max(1, options.runs))
            ]
        clock = least([one for one, _ in done])
        total, plain = clock.wall["total"], clock.wall["baseline"]
        cells = [f"{clock.wall[stage]:.2f}" for stage in STAGES]
        cells += [f"{clock.cpu['total']:.2f}", f"{plain:.2f}", f"{total / plain:.1f}"]
        if not options.no_choice:
            cells.append(f"{clock.wall['choice']:.2f}, {clock.cpu['choice']:.2f}")
        print(f"| {case.name} | " + " | ".join(cells) + f" | {done[0][1]} |", flush=True)
        if total > options.limit:
            slow.append(case.name)
    print(f"over {options.limit:g} s: {', '.join(slow) or 'none'}")
    return 1 if slow else 0


if __name__ == "__main__":
    raise SystemExit(main())
