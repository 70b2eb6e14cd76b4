"""The independent check of streets that were designed; see the library."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..progress import FeedbackProgress


def check_design(
    found: dict[str, Any],
    around: dict[str, Any],
    plan: Any,
    given: Mapping[str, Any],
    progress: FeedbackProgress,
) -> Any:
    """Return what the checker says of a design; see `explore.check.check_design`."""
    from ...algorithms.explore.check import check_design as check

    return check(found, around, plan, given, progress)
