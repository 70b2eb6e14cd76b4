"""Platwright: neighbourhoods designed from what they should do, as a plain Python library."""
