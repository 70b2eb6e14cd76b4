"""What is missing, for which tool, and where packages of our own lie."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import sysconfig

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not installed")
pytestmark = pytest.mark.qgis


@pytest.fixture
def deps(package):
    return package("plugin.deps")


@pytest.fixture
def folder(package, tmp_path, monkeypatch):
    """Return the module with a base folder of its own, as in a fresh profile."""
    module = package("plugin.installer_folder")
    monkeypatch.setattr(module, "base", lambda: tmp_path / "packages")
    monkeypatch.delenv("PLATWRIGHT_DEPS", raising=False)
    return module


def test_requirements_are_those_of_the_installer(package, root):
    guard = package("plugin.guard")
    lines = (root / "requirements.txt").read_text("utf-8").splitlines()
    listed = {re.split(r"[<>=]", line)[0]: line for line in lines if line and line[0] != "#"}
    # QGIS brings numpy and scipy; geopandas brings pyogrio; SUMO is larger than all the rest.
    expected = {p.install: p for name, p in guard.PACKAGES.items()
                if name not in ("numpy", "scipy", "pyogrio", "sumo")}  # fmt: skip
    assert set(listed) == set(expected)
    for name, line in listed.items():
        least = re.search(r">=([\d.]+)", line).group(1)
        below = re.search(r"<([\d.]+)", line)
        assert guard.version_tuple(least) == guard.version_tuple(expected[name].least), name
        assert (below.group(1) if below else "") == expected[name].below, name


def test_the_library_asks_pip_for_the_same(package, root):
    guard = package("plugin.guard")
    text = (root / "pyproject.toml").read_text("utf-8")
    block = re.search(r"^dependencies = \[(.*?)\]", text, re.DOTALL | re.MULTILINE).group(1)
    asked = set(re.findall(r'"([^"]+)"', block))
    for name in (*guard.LAYERS, *guard.SOLVERS, *guard.SUN, "ortools"):
        assert guard.PACKAGES[name].requirement in asked


@pytest.mark.parametrize(
    ("text", "numbers"),
    [("1.24.2", (1, 24, 2)), ("2.1rc1", (2, 1)), ("3.6.2+dfsg", (3, 6, 2)), ("0", (0,))],
)
def test_versions_are_read(package, text, numbers):
    assert package("plugin.guard").version_tuple(text) == numbers


def test_a_version_fits_between_its_limits(package):
    guard = package("plugin.guard")
    assert guard.fits("pulp", "3.1")
    assert guard.fits("pulp", "3.3.2")
    assert not guard.fits("pulp", "3.0.9")
    assert not guard.fits("pulp", "4.0")


def test_what_is_too_old_is_named_with_what_was_found(deps, monkeypatch):
    monkeypatch.setitem(deps.PACKAGES, "networkx", deps.PACKAGES["networkx"]._replace(least="99.0"))
    monkeypatch.delitem(sys.modules, "networkx", raising=False)
    (text,) = deps.missing(("networkx",))
    assert re.fullmatch(r"networkx \(version 99.0 or newer, found \d[\d.]*\)", text)


def test_the_way_out_is_the_installer(deps, monkeypatch):
    monkeypatch.setitem(deps.PACKAGES, "nowhere_", deps.PACKAGES["numpy"]._replace(install="no"))
    text = deps.missing_text(("nowhere_",))
    assert "no (version 1.22 or newer)" in text
    assert "Settings > Options > Platwright" in text
    assert "platwright:installdependencies" in text
    with pytest.raises(deps.DependencyError, match="Settings > Options"):
        deps.load(("nowhere_",))


def test_nothing_is_imported_for_a_tool_that_needs_nothing(deps, monkeypatch):
    monkeypatch.setattr(deps.guard, "import_package", lambda name: pytest.fail(name))
    deps.load(())


def test_the_notice_names_packages_and_tools_once(deps, monkeypatch):
    spec = deps.PACKAGES["numpy"]._replace(install="absent")
    monkeypatch.setitem(deps.PACKAGES, "absent_", spec)
    tools = [("One", ("absent_",)), ("Two", ("numpy", "absent_")), ("Installer", ())]
    assert deps.notice(tools) == (
        "Platwright needs a Python package that is not installed (absent), for all its tools."
    )
    tools.append(("Three", ("numpy",)))
    assert deps.notice(tools).endswith("for One, Two.")
    assert deps.notice(tools[2:]) == ""


def test_a_new_installation_takes_the_place_of_the_old_in_one_step(folder):
    assert folder.current() is None
    first = folder.new()
    assert folder.current() is None
    folder.put_in_force(first, {"installed": {}})
    assert folder.current() == first
    second = folder.base() / "second"
    second.mkdir()
    (second / "module.py").write_text("")
    folder.put_in_force(second, {"installed": {}})
    assert folder.current() == second
    folder.tidy()
    assert not first.exists()
    assert (second / "module.py").exists()
    assert folder.remove()
    assert folder.current() is None
    assert not second.exists()


def test_an_installation_in_use_is_kept(folder, monkeypatch):
    old = folder.new()
    monkeypatch.syspath_prepend(str(old))
    folder.tidy()
    assert old.exists()


def test_an_installation_for_another_python_is_not_used(folder, deps, monkeypatch):
    made = folder.new()
    folder.put_in_force(made, {})
    noted = json.loads((folder.base() / "current.json").read_text())
    noted["python"] = "3.5 linux-x86_64"
    (folder.base() / "current.json").write_text(json.dumps(noted))
    assert folder.current() is None
    assert deps.folders() == []
    monkeypatch.setitem(deps.PACKAGES, "nowhere_", deps.PACKAGES["numpy"]._replace(install="no"))
    assert "installed for Python 3.5 linux-x86_64" in deps.missing_text(("nowhere_",))


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"folder": 3}', '{"folder": "../../elsewhere"}', '{"folder": "gone"}']
)
def test_a_damaged_note_means_no_installation(folder, text):
    folder.base().mkdir()
    (folder.base() / "current.json").write_text(text)
    assert folder.current() is None
    assert folder.record() == {}


def test_the_trial_shows_what_qgis_would_do_to_an_unguarded_import(root):
    """The fresh process is like QGIS: without the guard shapely fails in it, with it it works."""
    if not sys.platform.startswith("linux"):
        pytest.skip("only Linux puts the libraries of QGIS first")
    packages = sysconfig.get_paths()["purelib"]
    program = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "import guard, contextlib, os\n"
        "if sys.argv[3] == 'bare': guard.bound_at_home = contextlib.nullcontext\n"
        "guard._like_qgis()\n"
        "print(guard.try_out(sys.argv[2], ['shapely', 'pyproj'])['error'], flush=True)\n"
        "os._exit(0)"
    )

    def said(how):
        words = ["/usr/bin/python3", "-c", program, str(root / "plugin"), packages, how]
        return subprocess.run(words, capture_output=True, text=True, timeout=60, check=True).stdout

    assert said("guarded").strip().endswith("None")
    bare = said("bare")
    if bare.strip().endswith("None"):
        pytest.skip("the libraries of this QGIS happen to agree with those of the packages")
    assert "does not work in this QGIS" in bare or "cannot be loaded" in bare


@pytest.mark.parametrize("name", ["geopandas", "pulp", "ortools", "osmnx"])
def test_who_imports_first_is_not_held_for_ever(root, name):
    """PuLP keeps errors, and they their tracebacks: QGIS crashed at its end over held layers."""
    program = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "import gc, guard, weakref\n"
        "class Layer: pass\n"
        "def tool():\n"
        "    layer = Layer()\n"
        "    guard.import_package(sys.argv[2])\n"
        "    return weakref.ref(layer)\n"
        "held = tool()\n"
        "gc.collect()\n"
        "print(held() is None)\n"
    )
    words = [sys.executable, "-c", program, str(root / "plugin"), name]
    ended = subprocess.run(words, capture_output=True, text=True, timeout=60, check=True)
    assert ended.stdout.strip() == "True"


def test_a_package_without_a_record_will_do(package, monkeypatch):
    """Some bundles of QGIS have none."""
    guard = package("plugin.guard")
    monkeypatch.setattr(guard.importlib.metadata, "distributions", lambda **_: iter(()))
    assert guard.try_out("", ["networkx"]) == {"error": None, "versions": {"networkx": "?"}}
