"""How long something may take on a machine that does other things as well."""

from __future__ import annotations

import os


def allowed(seconds: float) -> float:
    """Return how long what takes that long on a quiet machine may take on this one, now.

    Promptness is promised for a machine that is free. The tests share theirs, in continuous
    integration with QGIS and with each other, and a thread then waits for its turn.
    """
    if not hasattr(os, "getloadavg"):  # on Windows
        return 2.0 * seconds
    load = os.getloadavg()[0] / (os.cpu_count() or 1)
    # just what is said where nothing else runs, and never so long that it tests nothing
    return seconds * min(max(1.0, 2.0 * load), 4.0)
