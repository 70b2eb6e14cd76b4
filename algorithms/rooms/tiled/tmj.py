"""Maps and tilesets of Tiled 1.10 as JSON (TMJ and TSJ)."""

from __future__ import annotations

import json
from typing import Any

from .document import Document, MapObject, Properties
from .tileset import Tileset
from .tmx import TILED_VERSION, VERSION, tile_properties


def tmj(made: Document, tileset: str | None, image: str) -> str:
    """Write a map as JSON; parameters as of `tmx.tmx`."""
    size = made.tileset.size
    shown = {"opacity": 1, "visible": True, "x": 0, "y": 0}
    layers: list[dict[str, Any]] = [
        {
            "data": layer.gids.ravel().tolist(),
            "height": made.height,
            "id": i + 1,
            "name": layer.name,
            "type": "tilelayer",
            "width": made.width,
            **shown,
        }
        for i, layer in enumerate(made.layers)
    ]
    layers.append(
        {
            "draworder": "topdown",
            "id": len(made.layers) + 1,
            "name": "objects",
            "objects": [_object(i + 1, thing) for i, thing in enumerate(made.objects)],
            "type": "objectgroup",
            **shown,
        }
    )
    used: dict[str, Any] = _tileset(made.tileset, image) if tileset is None else {"source": tileset}
    return _written(
        {
            "compressionlevel": -1,
            "height": made.height,
            "infinite": False,
            "layers": layers,
            "nextlayerid": len(layers) + 1,
            "nextobjectid": len(made.objects) + 1,
            "orientation": "orthogonal",
            "properties": _properties(made.properties),
            "renderorder": "right-down",
            "tiledversion": TILED_VERSION,
            "tileheight": size,
            "tilesets": [{"firstgid": 1, **used}],
            "tilewidth": size,
            "type": "map",
            "version": VERSION,
            "width": made.width,
        }
    )


def tsj(tileset: Tileset, image: str) -> str:
    """Write a tileset as JSON, `image` being the name of its picture."""
    kind = {"tiledversion": TILED_VERSION, "type": "tileset", "version": VERSION}
    return _written({**_tileset(tileset, image), **kind})


def _tileset(tileset: Tileset, image: str) -> dict[str, Any]:
    """Write what a tileset is, in a file of its own or in the map."""
    count, size = len(tileset.kinds), tileset.size
    return {
        "columns": count,
        "image": image,
        "imageheight": size,
        "imagewidth": count * size,
        "margin": 0,
        "name": "level",
        "spacing": 0,
        "tilecount": count,
        "tileheight": size,
        "tiles": [
            {"id": i, "properties": _properties(tile_properties(tileset, i)), "type": kind}
            for i, kind in enumerate(tileset.kinds)
        ],
        "tilewidth": size,
    }


def _object(number: int, thing: MapObject) -> dict[str, Any]:
    """Write an object; its points count from the first."""
    x, y = thing.points[0].tolist()
    written: dict[str, Any] = {
        "height": 0,
        "id": number,
        "name": thing.name,
        "properties": _properties(thing.properties),
        "rotation": 0,
        "type": thing.kind,
        "visible": True,
        "width": 0,
        "x": x,
        "y": y,
    }
    if thing.shape == "point":
        return {**written, "point": True}
    points = (thing.points - thing.points[0]).round(4).tolist()
    return {**written, thing.shape: [{"x": a, "y": b} for a, b in points]}


def _properties(properties: Properties) -> list[dict[str, object]]:
    """Write custom properties."""
    return [{"name": name, "type": kind, "value": value} for name, kind, value in properties]


def _written(content: dict[str, Any]) -> str:
    """Write JSON, one key below the other only at the top."""
    lines = [
        f" {json.dumps(key)}:{json.dumps(value, allow_nan=False, separators=(',', ':'))}"
        for key, value in content.items()
    ]
    return "{" + ",\n".join(lines) + "\n}\n"
