"""The growth itself: rules chosen, streets built, planar or as CitySprout builds them."""

from .gardener import grow

__all__ = ["grow"]
