"""OpenStreetMap: boundaries of places and layers of areas, from its services or a local file."""

from __future__ import annotations

from .boundaries import boundaries
from .layers import osm_layers
from .settings import ATTRIBUTION, LICENCE, OsmSettings

__all__ = ["ATTRIBUTION", "LICENCE", "OsmSettings", "boundaries", "osm_layers"]
