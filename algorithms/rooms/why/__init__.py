"""Why there is no plan: shapes, numbers and places, found before the long search."""

from .reasons import NoPlanError, Reason, why_not

__all__ = ["NoPlanError", "Reason", "why_not"]
