"""The figures of the paper, made again: files, sites, pictures, and two of the designs."""

from __future__ import annotations

import importlib.util
import json
import re
import sys
from types import ModuleType

import networkx as nx
import numpy as np
import pytest

from house import ROOT

FOLDER = ROOT / "figures"
NAMES = ["2a", "2b", "2c", "2d", "2e", "2f", "2g", "5", "6a", "6b", "6c", "6d", "6e", "7",
         "8c", "8d", "8e", "8f", "8g", "8h"]  # fmt: skip
PICTURES = ROOT / "docs" / "images" / "figures"
KEYS = {
    "figure", "says", "mesh", "scenario", "site", "walled", "snap_distance", "specification",
    "wishes", "variants", "colour", "seconds",
}  # fmt: skip
WISHES = {"sinks", "required", "forbidden", "routes", "partition", "obstacles"}


@pytest.fixture(scope="module")
def made() -> ModuleType:
    """Import the script that designs."""
    path = ROOT / "scripts" / "_figures_design.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


def test_there_is_a_file_for_every_figure():
    assert sorted(path.stem for path in FOLDER.glob("*.json")) == sorted(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_the_file_says_what_the_readme_explains(made, name):
    file = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    assert set(file) <= KEYS
    assert file["figure"] == f"CND {name}"
    assert file["says"].endswith(".")
    assert ("mesh" in file) != ("site" in file)
    explained = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert all(f"`{key}`" in explained for key in file)
    specifications = made.specifications(file)
    assert len(specifications) == len(file.get("variants", [1]))
    assert all(0 < spec.time_limit <= 30 for spec in specifications)
    assert set(file.get("wishes", {})) <= WISHES


@pytest.mark.parametrize("name", [n for n in NAMES if n[0] in "678"])
def test_the_site_of_a_figure_is_there(made, name):
    file = made.read(name)
    layers = made.given_layers(file)
    assert len(layers["site"]) == 1
    assert layers["site"].geometry.is_valid.all()
    assert len(layers["streets"]) > 20
    wishes = made.wishes_of(file)
    outline = layers["site"].geometry.iloc[0]
    assert all(outline.distance(line) == 0 for line in wishes.required)
    drawn = file.get("wishes", {}).get("obstacles", [])
    assert all(
        outline.contains(shape) for shape in layers["obstacles"].geometry[-len(drawn) :]
    ) or (not drawn)


def test_every_picture_is_small_and_shown():
    page = (ROOT / "docs" / "figures.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"images/figures/([\w.-]+\.png)", page))
    assert shown == {path.name for path in PICTURES.iterdir()} == {f"{n}.png" for n in NAMES}
    assert all(path.stat().st_size <= 60_000 for path in PICTURES.iterdir())


def test_data_of_others_is_named():
    notice = (FOLDER / "data" / "NOTICE.md").read_text(encoding="utf-8")
    for path in (FOLDER / "data").glob("*.geojson"):
        assert path.stat().st_size < 60_000
        assert f"`{path.name}`" in notice
        assert "OpenStreetMap" in json.loads(path.read_text(encoding="utf-8"))["attribution"]


def test_a_detour_is_none_where_all_edges_are_streets(made):
    file = made.read("2e")
    problem = made.problem_of(file, made.specifications(file)[0])
    every = np.ones(len(problem.mesh.edges), dtype=bool)
    new = list(range(len(problem.mesh.vertices)))

    class All:
        active = every

    assert made._detour(problem, All, new) == 1.0


@pytest.mark.slow
def test_designs_are_what_the_paper_asks_for(made):
    """Figures 2a and 2b, judged by sets and networkx alone."""
    numbers = []
    for name in ("2a", "2b"):
        (own,) = made.design(made.read(name), seconds=3.0)
        mesh, active = own.problem.mesh, own.design.active
        streets = nx.Graph()
        streets.add_edges_from(mesh.edges[active].tolist())
        rim = set(np.flatnonzero(mesh.boundary_vertices).tolist())
        whole = nx.Graph(mesh.edges.tolist())
        # no island, no dead end, every vertex within two edges of a street
        assert all(piece & rim for piece in nx.connected_components(streets))
        assert all(d > 1 for v, d in streets.degree() if v not in rim)
        near = nx.multi_source_dijkstra_path_length(whole, rim | set(streets), weight=None)
        assert max(near.values()) <= 2
        far = nx.multi_source_dijkstra_path_length(streets, rim & set(streets), weight=None)
        inner = [far[v] for v in streets if v not in rim]
        assert own.numbers["length"] == int(active.sum())
        assert own.numbers["mean"] == pytest.approx(np.mean(inner))
        numbers.append((int(active.sum()), float(np.mean(inner))))
    (short, slow), (long, quick) = numbers
    assert short <= long
    assert quick < slow
