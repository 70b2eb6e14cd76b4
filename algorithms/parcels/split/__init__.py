"""Sites split along streets until parcels fit: hierarchical domain splitting (UP)."""

from .elements import KeyArea
from .given import read_key_areas, read_key_streets
from .layout import Layout, Score, lay_out
from .rules import SplitRules
from .site_layers import SiteLayouts, site_layers
from .sites import Elements, lay_out_sites
from .variations import vary
from .why import first_splits

__all__ = [
    "Elements",
    "KeyArea",
    "Layout",
    "Score",
    "SiteLayouts",
    "SplitRules",
    "first_splits",
    "lay_out",
    "lay_out_sites",
    "read_key_areas",
    "read_key_streets",
    "site_layers",
    "vary",
]
