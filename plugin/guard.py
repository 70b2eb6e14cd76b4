"""The Python packages of the library, and how to import them into a process of QGIS.

On Linux QGIS holds its own GEOS, PROJ and protobuf where every library of the process looks
first, so compiled packages that bring theirs would call those of QGIS and crash or fail. Their
first import therefore runs with RTLD_DEEPBIND, which makes a library look at home first.

This module knows no QGIS and imports nothing of the plugin. As a program it tries packages out
in a fresh process that is made like one of QGIS:

    python guard.py HOW FOLDER NAME...

where HOW is "like-qgis" or "alone", and writes one line of JSON:
{"error": text or null, "versions": {name: version}}.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.metadata
import importlib.util
import json
import os
import sys
import types
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple


class Package(NamedTuple):
    """One package.

    Attributes
    ----------
    install
        Its name for pip.
    least
        The oldest version that will do.
    modules
        Modules to load with it, since they hold compiled code of their own.
    below
        The first version that will not do any more; empty where none is known.
    purpose
        What it is for, in a word or two.
    program
        Whether it holds programs that are run, and is never imported.
    """

    install: str
    least: str
    modules: tuple[str, ...] = ()
    below: str = ""
    purpose: str = ""
    program: bool = False

    @property
    def requirement(self) -> str:
        """What pip is asked for."""
        return f"{self.install}>={self.least}" + (f",<{self.below}" if self.below else "")


#: What a tool may ask for, by the name for `import`; in the order of loading: numpy first,
#: pyogrio before geopandas, which would pull it in unguarded.
PACKAGES: dict[str, Package] = {
    "numpy": Package("numpy", "1.22", purpose="arrays"),
    "scipy": Package("scipy", "1.9", ("scipy.optimize", "scipy.sparse"), purpose="numerics"),
    "shapely": Package("shapely", "2.0", ("shapely.lib",), purpose="geometry"),
    "pyproj": Package("pyproj", "3.4", purpose="coordinate systems"),
    "pyogrio": Package("pyogrio", "0.7", ("pyogrio._io", "pyogrio._geometry"), purpose="files"),
    "geopandas": Package("geopandas", "0.14", purpose="layers"),
    "networkx": Package("networkx", "2.8", purpose="graphs"),
    "pulp": Package("pulp", "3.1", below="4", purpose="integer programs"),
    "highspy": Package("highspy", "1.12", below="1.13", purpose="solver HiGHS"),
    "ortools": Package(
        "ortools", "9.10", ("ortools.sat.python.cp_model",), "9.15", "solver CP-SAT, faster"
    ),
    "pvlib": Package("pvlib", "0.10", ("pvlib.spa",), purpose="position of the sun"),
    "requests": Package("requests", "2.25", purpose="web requests"),
    "osmnx": Package("osmnx", "2.0", below="3", purpose="OpenStreetMap"),
    "osmium": Package(
        "osmium",
        "3.6",
        ("osmium.osm", "osmium.io", "osmium.area", "osmium.filter", "osmium.geom"),
        "5",
        "OpenStreetMap files (.pbf)",
    ),
    # An import would turn PROJ_LIB of this process to tables of its own.
    "sumo": Package("eclipse-sumo", "1.28", purpose="traffic simulator", program=True),
}
#: What every tool needs to read and write layers.
LAYERS = ("numpy", "scipy", "shapely", "pyproj", "geopandas")
#: What a tool needs that solves integer programs.
SOLVERS = ("networkx", "pulp", "highspy")
#: What a tool needs that follows the sun.
SUN = ("pvlib",)
#: What a tool needs that asks OpenStreetMap.
OSM = (*LAYERS, "networkx", "requests", "osmnx")
#: Imported where installed, so that it is bound to its own libraries, and never demanded; with
#: the package of which it is an extra.
OPTIONAL = {"pyogrio": "geopandas", "ortools": "pulp", "osmium": "osmnx"}


def version_tuple(text: str) -> tuple[int, ...]:
    """Return the first three numbers of a version, to compare."""
    digits = []
    for part in text.split(".")[:3]:
        number = ""
        for letter in part:
            if not letter.isdigit():
                break
            number += letter
        digits.append(int(number) if number else 0)
    return tuple(digits)


def fits(name: str, found: str) -> bool:
    """Tell whether a version of a package is neither too old nor too new."""
    package = PACKAGES[name]
    version = version_tuple(found)
    too_new = bool(package.below) and version >= version_tuple(package.below)
    return version >= version_tuple(package.least) and not too_new


@contextlib.contextmanager
def bound_at_home() -> Iterator[None]:
    """Make libraries that are loaded in the block look for symbols in themselves first."""
    if not (sys.platform.startswith("linux") and hasattr(os, "RTLD_DEEPBIND")):
        yield
        return
    before = sys.getdlopenflags()
    sys.setdlopenflags(os.RTLD_NOW | os.RTLD_DEEPBIND)
    try:
        yield
    finally:
        sys.setdlopenflags(before)


def import_package(name: str) -> None:
    """Import a package and its compiled modules, bound to their own libraries.

    One that holds programs is only looked for.
    """
    if PACKAGES[name].program:
        if importlib.util.find_spec(name) is None:
            msg = f"No module named {name!r}"
            raise ModuleNotFoundError(msg, name=name)
        return
    with bound_at_home():
        importlib.import_module(name)
        for module in PACKAGES[name].modules:
            importlib.import_module(module)
    _drop_tracebacks(name)


def _drop_tracebacks(package: str) -> None:
    """Take the tracebacks from the errors that the modules of a package have kept.

    PuLP keeps why it did not find this solver or that. The tracebacks would hold on to all who
    asked for the import, with the layers and the dialog of the first run, as long as Python
    lives; and layers that outlive QGIS crash it at its end.
    """
    modules = [m for name, m in sys.modules.copy().items() if f"{name}.".startswith(f"{package}.")]
    for module in (m for m in modules if isinstance(m, types.ModuleType)):
        kept = list(vars(module).values())
        for kind in (k for k in vars(module).values() if isinstance(k, type)):
            kept += vars(kind).values()
        for error in (e for e in kept if isinstance(e, BaseException)):
            error.__traceback__ = error.__context__ = error.__cause__ = None


def trial() -> str:
    """Try out shapely and pyproj, which show a wrong binding first.

    Returns
    -------
    str
        What does not work, or an empty text.
    """
    import pyproj
    import shapely

    try:
        shapely.to_wkb(shapely.box(0, 0, 1, 1))
        shapely.intersection(shapely.box(0, 0, 2, 2), shapely.box(1, 1, 3, 3), grid_size=0.1)
    except Exception as error:
        return f"The package shapely does not work in this QGIS ({error})."
    try:
        pyproj.Transformer.from_crs(4326, 32635, always_xy=True).transform(25.0, 60.0)
    except Exception as error:
        return f"The package pyproj does not work in this QGIS ({error})."
    return ""


def _like_qgis() -> None:
    """Put the libraries of QGIS where every library of this process looks first.

    Where the module of QGIS cannot be imported here, the trial is an ordinary one.
    """
    if not sys.platform.startswith("linux"):
        return
    before = sys.getdlopenflags()
    sys.setdlopenflags(os.RTLD_NOW | os.RTLD_GLOBAL)
    try:
        with contextlib.suppress(ImportError):
            importlib.import_module("qgis.core")
    finally:
        sys.setdlopenflags(before)


def try_out(folder: str, names: Iterable[str]) -> dict[str, object]:
    """Import packages from a folder and return what came of it."""
    if folder:
        sys.path.insert(0, folder)
    versions: dict[str, str] = {}
    wanted = set(names)
    for name in (n for n in PACKAGES if n in wanted):
        try:
            import_package(name)
        except Exception as error:
            text = f"The package {name} cannot be loaded ({type(error).__name__}: {error})."
            return {"error": text, "versions": versions}
        records = importlib.metadata.distributions(name=PACKAGES[name].install)
        # Some bundles of QGIS have packages without a record: what can be imported will do.
        versions[name] = next((record.version for record in records), "?")
        if versions[name] != "?" and not fits(name, versions[name]):
            text = f"{name} has the version {versions[name]}, which does not do."
            return {"error": text, "versions": versions}
    error_text = trial() if {"shapely", "pyproj"} <= wanted else ""
    return {"error": error_text or None, "versions": versions}


def main() -> None:
    """Try out the packages that the command line names."""
    # Python puts the folder of a program first, where our modules could be taken for others.
    here = Path(__file__).resolve().parent
    sys.path[:] = [entry for entry in sys.path if Path(entry or ".").resolve() != here]
    how, folder, *names = sys.argv[1:]
    if how == "like-qgis":
        _like_qgis()
    print(json.dumps(try_out(folder, names)), flush=True)
    # Libraries of QGIS that were loaded without their program may crash while it is taken down.
    sys.stdout.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
