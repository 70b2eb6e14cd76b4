"""Measure the mesher on real sites and random polygons: quality and seconds, one line each."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import geopandas as gpd
import numpy as np
from platwright.errors import PlatwrightError
from platwright.mesh import MeshQuality, quadrangulate, quality
from shapely.geometry import MultiPolygon, Polygon

SIZES = (24.0, 40.0, 48.0, 72.0)
HEADER = (
    "site                             h  quads  val4 %  triangles  inverted  min SJ  "
    "edge/h  within 15 %  foreign  seconds"
)


def data_folder() -> Path:
    """Folder of the real test data: PLATWRIGHT_TEST_DATA or ../shared/data."""
    given = os.environ.get("PLATWRIGHT_TEST_DATA")
    return Path(given) if given else Path(__file__).resolve().parents[2] / "shared" / "data"


def real_sites(folder: Path) -> Iterator[tuple[str, Polygon | MultiPolygon]]:
    """Yield the name and polygon of every real site."""
    for path in sorted((folder / "sites").glob("*.gpkg")):
        yield path.stem, gpd.read_file(path, layer="site").geometry.iloc[0]


def random_sites(count: int, seed: int) -> Iterator[tuple[str, Polygon]]:
    """Yield star-shaped polygons with 5 to 13 corners, 120 to 400 m from their centre."""
    rng = np.random.default_rng(seed)
    for i in range(count):
        corners = int(rng.integers(5, 14))
        angle = (np.arange(corners) + rng.uniform(0.1, 0.9, corners)) * 2 * np.pi / corners
        radius = rng.uniform(120, 400, corners)
        yield (
            f"random {i}",
            Polygon(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])),
        )


def line(name: str, h: float, figures: MeshQuality, seconds: float) -> str:
    """Return one line of the table. A `QuadMesh` holds quads only: triangles are always 0."""
    return (
        f"{name[:30]:30} {h:4.0f}  {figures.quads:5d}  {100 * figures.inner_valence_4:6.1f}  "
        f"{0:9d}  {figures.inverted:8d}  {figures.min_scaled_jacobian:6.2f}  "
        f"{figures.mean_edge_ratio:6.2f}  {100 * figures.within_15_percent:11.0f}  "
        f"{figures.foreign:7d}  {seconds:7.2f}"
    )


def main(arguments: list[str] | None = None) -> int:
    """Print the table; return 0 if nothing failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=float, nargs="+", default=list(SIZES), metavar="M")
    parser.add_argument("--random", type=int, default=0, help="number of random polygons")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--site", default="", help="only sites whose name contains this")
    options = parser.parse_args(arguments)
    folder = data_folder()
    sites = list(real_sites(folder))
    if not sites:
        print(f"no real sites in {folder}: set PLATWRIGHT_TEST_DATA", file=sys.stderr)
    sites += list(random_sites(options.random, options.seed))
    print(HEADER)
    failed = 0
    all_seconds = []
    for name, polygon in sites:
        if options.site not in name:
            continue
        for h in options.sizes:
            start = time.perf_counter()
            try:
                mesh = quadrangulate(polygon, h)
            except PlatwrightError as error:
                print(f"{name[:30]:30} {h:4.0f}  {error}")
                failed += 1
                continue
            seconds = time.perf_counter() - start
            all_seconds.append(seconds)
            print(line(name, h, quality(mesh, polygon), seconds), flush=True)
    if all_seconds:
        print(
            f"{len(all_seconds)} meshes, {failed} failed, seconds: "
            f"median {np.median(all_seconds):.2f}, most {max(all_seconds):.2f}"
        )
    return 1 if failed or not all_seconds else 0


if __name__ == "__main__":
    raise SystemExit(main())
