"""What is finished already, kept in the output GeoPackage while a city is being designed."""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterator
from pathlib import Path

from ..errors import InputError

#: Seconds to wait for whoever has the file open.
WAIT = 20.0
_MAKE = (
    "CREATE TABLE IF NOT EXISTS finished_sub_regions (fid INTEGER PRIMARY KEY AUTOINCREMENT, "
    "key TEXT UNIQUE NOT NULL, result TEXT NOT NULL)"
)
_TELL = (
    "INSERT OR IGNORE INTO gpkg_contents (table_name, data_type, identifier, description) "
    "VALUES ('finished_sub_regions', 'attributes', 'finished_sub_regions', "
    "'What a later run need not compute again')"
)
_READ = "SELECT key, result FROM finished_sub_regions"
_ADD = "INSERT OR REPLACE INTO finished_sub_regions (key, result) VALUES (?, ?)"
_KNOWN = "SELECT name FROM sqlite_master WHERE type = 'table' AND name = 'finished_sub_regions'"
#: The least that makes a file a GeoPackage (OGC 12-128r18, 1.1.1 to 2.1.5).
_GEOPACKAGE = (
    f"PRAGMA application_id = {0x47504B47}",
    "PRAGMA user_version = 10300",
    "CREATE TABLE gpkg_spatial_ref_sys (srs_name TEXT NOT NULL, srs_id INTEGER PRIMARY KEY, "
    "organization TEXT NOT NULL, organization_coordsys_id INTEGER NOT NULL, "
    "definition TEXT NOT NULL, description TEXT)",
    "INSERT INTO gpkg_spatial_ref_sys VALUES "
    "('Undefined Cartesian SRS', -1, 'NONE', -1, 'undefined', ''), "
    "('Undefined geographic SRS', 0, 'NONE', 0, 'undefined', ''), "
    "('WGS 84 geodetic', 4326, 'EPSG', 4326, "
    '\'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],'
    'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]\', \'\')',
    "CREATE TABLE gpkg_contents (table_name TEXT NOT NULL PRIMARY KEY, data_type TEXT NOT NULL, "
    "identifier TEXT UNIQUE, description TEXT DEFAULT '', last_change DATETIME NOT NULL "
    "DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')), min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, "
    "max_y DOUBLE, srs_id INTEGER, CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) "
    "REFERENCES gpkg_spatial_ref_sys(srs_id))",
    "CREATE TABLE gpkg_geometry_columns (table_name TEXT NOT NULL, column_name TEXT NOT NULL, "
    "geometry_type_name TEXT NOT NULL, srs_id INTEGER NOT NULL, z TINYINT NOT NULL, "
    "m TINYINT NOT NULL, CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name))",
)


class CityFile:
    """A GeoPackage that takes finished sub-regions one by one.

    Every sub-region is written as one row in one transaction: whatever ends the run, the file
    has each of them whole or not at all.

    Parameters
    ----------
    path
        The file, which may be there already.

    Raises
    ------
    InputError
        If it is no GeoPackage, or cannot be written.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if self.path.suffix.lower() != ".gpkg":
            raise InputError(
                f"'{self.path.name}' is no GeoPackage.", "Give a file that ends in .gpkg."
            )
        if not self.path.parent.is_dir():
            raise InputError(
                f"The folder of '{self.path.name}' does not exist.", "Make it, or choose another."
            )

    def open(self) -> None:
        """Make the file, or prepare one that is there."""
        new = not self.path.exists()
        with self._connection() as base:
            if new:
                for text in _GEOPACKAGE:
                    base.execute(text)
            base.execute(_MAKE)
            base.execute(_TELL)

    def finished(self) -> dict[str, str]:
        """Return the results of finished sub-regions by the key of their task."""
        if not self.path.exists():
            return {}
        with self._connection() as base:
            if base.execute(_KNOWN).fetchone() is None:
                return {}
            return dict(base.execute(_READ).fetchall())

    def add(self, key: str, result: str) -> None:
        """Keep the result of a sub-region.

        Parameters
        ----------
        key
            Of its task.
        result
            What its worker gave.
        """
        with self._connection() as base:
            base.execute(_ADD, (key, result))

    @contextlib.contextmanager
    def _connection(self) -> Iterator[sqlite3.Connection]:
        """Open the file for one transaction."""
        try:
            base = sqlite3.connect(self.path, timeout=WAIT)
            try:
                with base:
                    yield base
            finally:
                base.close()
        except sqlite3.Error as error:
            raise InputError(
                f"The GeoPackage '{self.path}' could not be used: {error}.",
                "Close it in other programs, or choose another file.",
            ) from error
