"""The hierarchy of streets: numbers, names and design speeds of the levels."""

from __future__ import annotations

from collections.abc import Mapping

MAJOR, COLLECTOR, LOCAL, CUL_DE_SAC = 1, 2, 3, 4
#: What the levels are called.
LEVEL_NAMES: Mapping[int, str] = {
    MAJOR: "major",
    COLLECTOR: "collector",
    LOCAL: "local",
    CUL_DE_SAC: "cul-de-sac",
}
#: Design speeds, km/h: 40, 30 and 20 miles per hour (CND section 5.1) as limits that are posted;
#: culs-de-sac are slower than the paper's 20 miles per hour, since children play there.
SPEEDS: Mapping[int, float] = {MAJOR: 65.0, COLLECTOR: 50.0, LOCAL: 30.0, CUL_DE_SAC: 20.0}
