"""Why there is no plan: shapes, numbers and places, found before the long search."""

from .reason import NoPlanError, Reason
from .reasons import why_not

__all__ = ["NoPlanError", "Reason", "why_not"]
