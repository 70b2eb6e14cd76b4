"""Where the sun stands, shadows, and hours of sun."""

from .checks import check_sun
from .hours import open_hours, sun_hours
from .shade import shade_pairs, shaded
from .shadows import shadow_polygons, shadow_rectangles
from .track import LOW_SUN_DEG, SunTrack, sun_track

__all__ = [
    "LOW_SUN_DEG",
    "SunTrack",
    "check_sun",
    "open_hours",
    "shade_pairs",
    "shaded",
    "shadow_polygons",
    "shadow_rectangles",
    "sun_hours",
    "sun_track",
]
