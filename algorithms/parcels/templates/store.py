"""Libraries of templates as GeoPackages that a planner draws in QGIS."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import fields
from importlib import resources
from pathlib import Path
from typing import Any

from ...errors import InputError
from .check import check_library
from .geopackage import from_blob, read_layers, write_layers
from .types import CornerMark, Edge, Face, Template, TemplateLibrary

#: Layer -> field of its geometry in our classes, and what they are.
LAYERS: dict[str, tuple[str, type[Any], str]] = {
    "faces": ("polygon", Face, "Polygon"),
    "edges": ("line", Edge, "LineString"),
    "corners": ("point", CornerMark, "Point"),
}
DRAWING = ("faces", "edges", "corners")


def shipped_library() -> TemplateLibrary:
    """Read the library that comes along.

    Returns
    -------
    TemplateLibrary
        Drawn for parcels of 18 x 30 m.
    """
    with resources.as_file(resources.files(__package__) / "library.gpkg") as path:
        return read_library(path)


def write_library(library: TemplateLibrary, path: str | Path) -> None:
    """Write a library as a GeoPackage with the layers templates, faces, edges and corners.

    Parameters
    ----------
    library
        The templates.
    path
        Where to; a file that is there already is replaced.

    Raises
    ------
    InputError
        If the library could not be read again.
    """
    check_library(library)
    path = Path(path)
    path.unlink(missing_ok=True)
    own = {f.name: str(f.type) for f in fields(Template) if f.name not in DRAWING}
    layers: dict[str, tuple[str, dict[str, str], list[tuple[Any, ...]]]] = {
        "templates": ("", own, [tuple(getattr(t, name) for name in own) for t in library])
    }
    for layer, (shape, kind, geometry) in LAYERS.items():
        types = {f.name: str(f.type) for f in fields(kind) if f.name != shape}
        rows = [
            (getattr(feature, shape), template.name, *(getattr(feature, name) for name in types))
            for template in library
            for feature in getattr(template, layer)
        ]
        layers[layer] = (geometry, {"template": "str", **types}, rows)
    write_layers(path, layers)


def read_library(path: str | Path) -> TemplateLibrary:
    """Read and check a library.

    Parameters
    ----------
    path
        A GeoPackage with the layers that `write_library` writes; edges and corners may be missing,
        and so may fields that have a default.

    Returns
    -------
    TemplateLibrary
        The templates in the order of the table.

    Raises
    ------
    InputError
        If there is no such file, a layer or field is missing, or a drawing cannot be used.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"There is no file '{path.name}'.", "Choose a GeoPackage of templates.")
    found = read_layers(path)
    for layer in ("templates", "faces"):
        if layer not in found:
            raise InputError(
                f"'{path.name}' has no layer '{layer}'.",
                "Start from a copy of the library that comes along.",
            )
    rows = [
        (row["own_id"], _attributes(row, Template, (*DRAWING,), "templates", row["own_id"]))
        for row in found["templates"][1]
    ]
    known = {attributes["name"] for _, attributes in rows}
    ids: dict[str, dict[str, list[int]]] = {"templates": defaultdict(list)}
    drawn: dict[str, dict[str, list[Any]]] = {}
    for fid, attributes in rows:
        ids["templates"][attributes["name"]].append(int(fid))
    for layer in LAYERS:
        drawn[layer], ids[layer] = _read_layer(layer, known, found.get(layer))
    made = []
    for _, attributes in rows:
        attributes.update({x: tuple(drawn[x].get(attributes["name"], ())) for x in LAYERS})
        made.append(Template(**attributes))
    library = TemplateLibrary(tuple(made))
    check_library(library, ids)
    return library


def _read_layer(
    layer: str, known: set[str], rows: tuple[str, list[dict[str, Any]]] | None
) -> tuple[dict[str, list[Any]], dict[str, list[int]]]:
    """Turn the features of a layer into ours, with their ids, by template."""
    found: dict[str, list[Any]] = defaultdict(list)
    ids: dict[str, list[int]] = defaultdict(list)
    if rows is None:
        return found, ids
    column, features = rows
    shape, kind, wanted = LAYERS[layer]
    if not column:
        raise InputError("It has no geometry.", f"Make it a layer of {wanted}s.", layer=layer)
    for row in features:
        fid, drawn = row["own_id"], from_blob(row[column])
        name = row.get("template")
        if name not in known:
            raise InputError(
                f"Field 'template': there is no template '{name}'.",
                "Enter it in the table 'templates', or correct the name.",
                layer=layer, feature=int(fid),
            )  # fmt: skip
        parts = [] if drawn is None else list(getattr(drawn, "geoms", [drawn]))
        if len(parts) != 1 or parts[0].geom_type != wanted:
            raise InputError(
                f"Template '{name}', field 'geometry': it is no single {wanted}.",
                "Draw the feature in one piece, or delete it.",
                layer=layer, feature=int(fid),
            )  # fmt: skip
        attributes = _attributes(row, kind, (shape,), layer, int(fid), name)
        found[name].append(kind(**{shape: parts[0]}, **attributes))
        ids[name].append(int(fid))
    return found, ids


def _attributes(
    row: dict[str, Any],
    kind: type[Any],
    without: tuple[str, ...],
    layer: str,
    fid: int,
    template: str | None = None,
) -> dict[str, Any]:
    """Turn the fields of a feature into those of our class; empty ones take their default."""
    found: dict[str, Any] = {}
    of = row.get("name") if template is None else template
    for field in fields(kind):
        if field.name in without:
            continue
        value = row.get(field.name)
        if value is None or (isinstance(value, float) and math.isnan(value)):
            if field.name == "name":
                raise InputError(
                    "Field 'name': it is empty.", "Give the template a name.",
                    layer=layer, feature=int(fid),
                )  # fmt: skip
            continue
        convert = {"int": int, "float": float, "bool": bool}.get(str(field.type), str)
        try:
            if convert is int and float(value) != int(float(value)):
                raise ValueError
            found[field.name] = convert(value)
        except (TypeError, ValueError, OverflowError):
            raise InputError(
                f"Template '{of}', field '{field.name}': '{value}' is no {convert.__name__}.",
                "Correct the value.", layer=layer, feature=int(fid),
            ) from None  # fmt: skip
        if convert is bool and not isinstance(value, int):
            found[field.name] = str(value).strip().lower() in ("1", "true", "yes", "t", "y")
    return found
