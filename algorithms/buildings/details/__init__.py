"""What fills the ground between buildings and paths: parking, green, trees."""

from .fill import lay_details

__all__ = ["lay_details"]
