"""Where the programs of Eclipse SUMO are; they are run, and nothing of SUMO is imported.

SUMO is free software (EPL 2.0, or GPL 2 or later) of about 460 MB. The wheel `eclipse-sumo` holds
its programs in `sumo/bin`. Importing that package would set PROJ_LIB for the whole process and
so mislead every other library of maps; therefore it is only looked for.
"""

from __future__ import annotations

import importlib.machinery
import os
import shutil
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Optional

from ...errors import MissingDependencyError

#: Names the folder of a SUMO that its own installer has put there.
VARIABLE = "SUMO_HOME"
#: What is needed of it.
PROGRAMS = ("netconvert", "duarouter", "sumo")
_MISSING = (
    "The traffic simulator Eclipse SUMO was not found. It is free (EPL 2.0) and takes about "
    "500 MB: install it with 'pip install eclipse-sumo'. One that is installed otherwise is found "
    f"where the environment variable {VARIABLE} names its folder, or on the PATH."
)


@dataclass(frozen=True)
class Sumo:
    """Where SUMO is.

    Attributes
    ----------
    folder
        Holds the programs.
    home
        Holds the folder `data`, or None where that is not known.
    """

    folder: Path
    home: Optional[Path] = None

    def program(self, name: str) -> Path:
        """Return the path of one of `PROGRAMS`."""
        return self.folder / _file(name)

    def environment(self) -> Mapping[str, str]:
        """Return the environment variables with which its programs are run."""
        made = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
        if self.home is not None:
            made[VARIABLE] = str(self.home)
            maps = self.home / "data" / "proj"
            # its programs must not read the tables of another PROJ, for instance of QGIS
            if maps.is_dir():
                made["PROJ_LIB"] = made["PROJ_DATA"] = str(maps)
        return made


def find_sumo() -> Sumo:
    """Return where SUMO is: as SUMO_HOME says, in a Python package, or on the PATH.

    Raises
    ------
    MissingDependencyError
        It is not installed, or not all of it.
    """
    for found in _candidates():
        if all(found.program(name).is_file() for name in PROGRAMS):
            return found
    raise MissingDependencyError(_MISSING)


def _candidates() -> Iterator[Sumo]:
    named = os.environ.get(VARIABLE)
    if named:
        yield Sumo(Path(named) / "bin", Path(named))
    spec = importlib.machinery.PathFinder.find_spec("sumo", sys.path)
    for place in (spec.submodule_search_locations or ()) if spec else ():
        yield Sumo(Path(place) / "bin", Path(place))
    # where a distribution puts it, the programs are among others
    program = shutil.which("sumo")
    if program:
        folder = Path(program).resolve().parent
        homes = (folder.parent, folder.parent / "share" / "sumo")
        yield Sumo(folder, next((home for home in homes if (home / "data").is_dir()), None))


def _file(name: str) -> str:
    return f"{name}.exe" if os.name == "nt" else name
