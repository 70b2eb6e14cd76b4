"""Residential zones are laid out: buildings, sunlight, paths and what lies between (RZ)."""
