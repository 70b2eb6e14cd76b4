"""The QGIS side of Platwright: Processing tools over the planning library, kept thin."""
