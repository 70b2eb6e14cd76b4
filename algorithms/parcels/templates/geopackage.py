"""GeoPackages by way of Python's own SQLite.

The library that comes along is read inside QGIS, too, where a second GDAL (that of pyogrio) may be
missing or unwelcome. A GeoPackage is a SQLite file whose geometries are WKB behind a short header
(OGC 12-128r18, annex and clause 2.1.3).
"""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import shapely

from ...errors import InputError

#: The layers and what reads them.
READ = {
    "templates": "SELECT rowid AS own_id, * FROM templates ORDER BY rowid",
    "faces": "SELECT rowid AS own_id, * FROM faces ORDER BY rowid",
    "edges": "SELECT rowid AS own_id, * FROM edges ORDER BY rowid",
    "corners": "SELECT rowid AS own_id, * FROM corners ORDER BY rowid",
}
#: And what writes them, one place for each column of `write_layers`.
WRITE = {
    "templates": "INSERT INTO templates VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    "faces": "INSERT INTO faces VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    "edges": "INSERT INTO edges VALUES (?, ?, ?, ?)",
    "corners": "INSERT INTO corners VALUES (?, ?, ?, ?)",
}
#: Length of the bounding box in the header of a geometry, by its kind (bytes).
ENVELOPES = (0, 32, 48, 48, 64)
#: Coordinates of a flat sheet that lies nowhere on Earth.
SHEET = -1
#: Nothing changes from one writing to the next, not even a date.
DATE = "2026-01-01T00:00:00.000Z"
BASE = """
PRAGMA application_id = 1196444487;
PRAGMA user_version = 10300;
CREATE TABLE gpkg_spatial_ref_sys (srs_name TEXT NOT NULL, srs_id INTEGER PRIMARY KEY,
    organization TEXT NOT NULL, organization_coordsys_id INTEGER NOT NULL,
    definition TEXT NOT NULL, description TEXT);
CREATE TABLE gpkg_contents (table_name TEXT NOT NULL PRIMARY KEY, data_type TEXT NOT NULL,
    identifier TEXT UNIQUE, description TEXT DEFAULT '', last_change DATETIME NOT NULL,
    min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE, srs_id INTEGER,
    CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id));
CREATE TABLE gpkg_geometry_columns (table_name TEXT NOT NULL, column_name TEXT NOT NULL,
    geometry_type_name TEXT NOT NULL, srs_id INTEGER NOT NULL, z TINYINT NOT NULL,
    m TINYINT NOT NULL, CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name),
    CONSTRAINT uk_gc_table_name UNIQUE (table_name));
"""
WORLD = (
    'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],'
    'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433],AUTHORITY["EPSG","4326"]]'
)
SYSTEMS = (
    ("Undefined Cartesian SRS", -1, "NONE", -1, "undefined", "flat sheet, metres"),
    ("Undefined geographic SRS", 0, "NONE", 0, "undefined", ""),
    ("WGS 84", 4326, "EPSG", 4326, WORLD, ""),
)
TYPES = {"int": "INTEGER", "float": "REAL", "bool": "BOOLEAN"}


def read_layers(path: Path) -> dict[str, tuple[str, list[dict[str, Any]]]]:
    """Read the layers of a library.

    Parameters
    ----------
    path
        The GeoPackage.

    Returns
    -------
    dict
        For each layer that is there the name of its geometry column (empty: it has none) and its
        features in the order of their ids, which are in `own_id`.

    Raises
    ------
    InputError
        If the file is none.
    """
    found = {}
    try:
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as database:
            tables = {
                str(row[0]) for row in database.execute("SELECT table_name FROM gpkg_contents")
            }
            columns = database.execute("SELECT table_name, column_name FROM gpkg_geometry_columns")
            shapes = {str(table): str(column) for table, column in columns}
            for layer in sorted(tables & set(READ)):
                rows = database.execute(READ[layer])
                names = [str(column[0]) for column in rows.description]
                found[layer] = (shapes.get(layer, ""), [dict(zip(names, row)) for row in rows])
    except sqlite3.DatabaseError:
        raise InputError(
            f"'{path.name}' is no GeoPackage.", "Choose a GeoPackage of templates."
        ) from None
    return found


def write_layers(
    path: Path,
    layers: Mapping[str, tuple[str, Mapping[str, str], Sequence[Sequence[Any]]]],
) -> None:
    """Write the layers of a library.

    Parameters
    ----------
    path
        Where to; there must be no file.
    layers
        For each layer the type of its geometry (empty: it has none), the Python types of its
        fields, and its features: geometry, if any, and values.
    """
    with closing(sqlite3.connect(path)) as database:
        database.executescript(BASE)
        insert = "INSERT INTO gpkg_spatial_ref_sys VALUES (?, ?, ?, ?, ?, ?)"
        database.executemany(insert, SYSTEMS)
        for layer, (geometry, columns, features) in layers.items():
            shape = f"geom {geometry.upper()}, " if geometry else ""
            parts = ", ".join(
                f'"{name}" {TYPES.get(kind, "TEXT")}' for name, kind in columns.items()
            )
            own = "fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL"
            database.execute(f'CREATE TABLE "{layer}" ({own}, {shape}{parts})')
            box: tuple[Any, ...] = (None,) * 4
            if geometry:
                shapes = [feature[0] for feature in features]
                box = tuple(shapely.total_bounds(shapes).tolist()) if shapes else box
                database.execute(
                    "INSERT INTO gpkg_geometry_columns VALUES (?, 'geom', ?, ?, 0, 0)",
                    (layer, geometry.upper(), SHEET),
                )
            database.execute(
                "INSERT INTO gpkg_contents VALUES (?, ?, ?, '', ?, ?, ?, ?, ?, ?)",
                (layer, "features" if geometry else "attributes", layer, DATE, *box,
                 SHEET if geometry else None),
            )  # fmt: skip
            rows = [
                (k + 1, *(to_blob(value) if isinstance(value, shapely.Geometry) else value
                          for value in feature))
                for k, feature in enumerate(features)
            ]  # fmt: skip
            database.executemany(WRITE[layer], rows)
        database.commit()


def to_blob(shape: shapely.Geometry) -> bytes:
    """Write a geometry the way GeoPackages hold it.

    Parameters
    ----------
    shape
        The geometry.
    """
    # little endian, no bounding box
    head = b"GP\x00" + bytes([0b1]) + struct.pack("<i", SHEET)
    return head + bytes(shapely.to_wkb(shape, byte_order=1, flavor="iso"))


def from_blob(blob: Any) -> shapely.Geometry | None:
    """Read a geometry from a GeoPackage; None where there is none that can be read.

    Parameters
    ----------
    blob
        What the geometry column holds.
    """
    if not isinstance(blob, bytes) or len(blob) < 8 or blob[:2] != b"GP":
        return None
    kind = blob[3] >> 1 & 0b111
    if kind >= len(ENVELOPES):
        return None
    try:
        return shapely.force_2d(shapely.from_wkb(blob[8 + ENVELOPES[kind] :]))
    except shapely.errors.GEOSException:  # a curve, for example
        return None
