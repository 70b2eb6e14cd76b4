"""Maps and tilesets of Tiled 1.10 as XML (TMX and TSX)."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Mapping

from ...network.problem import FloatArray
from ..types import IntArray
from .document import Document, MapObject, Properties
from .tileset import Tileset

#: Of the format, and the program that writes it so.
VERSION, TILED_VERSION = "1.10", "1.10.2"
_HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
#: Characters that XML cannot hold.
_UNWRITABLE = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def tmx(made: Document, tileset: str | None, image: str) -> str:
    """Write a map as XML.

    Parameters
    ----------
    made
        The map.
    tileset
        Name of the file of its tileset, or None to write it into the map.
    image
        Name of the picture of the tileset.
    """
    size = made.tileset.size
    attributes = {
        "version": VERSION,
        "tiledversion": TILED_VERSION,
        "orientation": "orthogonal",
        "renderorder": "right-down",
        "width": made.width,
        "height": made.height,
        "tilewidth": size,
        "tileheight": size,
        "infinite": 0,
        "nextlayerid": len(made.layers) + 2,
        "nextobjectid": len(made.objects) + 1,
    }
    lines = [_tag("map", attributes), *_indented(_properties(made.properties))]
    if tileset is None:
        lines += _indented(_tileset(made.tileset, image, embedded=True))
    else:
        lines.append(" " + _tag("tileset", {"firstgid": 1, "source": tileset}, end=True))
    for i, layer in enumerate(made.layers):
        shape = {"id": i + 1, "name": layer.name, "width": made.width, "height": made.height}
        lines.append(" " + _tag("layer", shape))
        lines += ['  <data encoding="csv">', csv(layer.gids), "</data>", " </layer>"]
    lines.append(" " + _tag("objectgroup", {"id": len(made.layers) + 1, "name": "objects"}))
    for i, thing in enumerate(made.objects):
        lines += _indented(_object(i + 1, thing), "  ")
    lines += [" </objectgroup>", "</map>", ""]
    return _HEAD + "\n".join(lines)


def tsx(tileset: Tileset, image: str) -> str:
    """Write a tileset as XML, `image` being the name of its picture."""
    return _HEAD + "\n".join([*_tileset(tileset, image, embedded=False), ""])


def csv(gids: IntArray) -> str:
    """Write tiles row by row, a comma after each but the last."""
    return ",\n".join(",".join(map(str, row)) for row in gids.tolist())


def _tileset(tileset: Tileset, image: str, *, embedded: bool) -> list[str]:
    """Write a tileset."""
    count, size = len(tileset.kinds), tileset.size
    own = {"version": VERSION, "tiledversion": TILED_VERSION}
    first: dict[str, object] = {"firstgid": 1} if embedded else {**own}
    shape = {"tilewidth": size, "tileheight": size, "tilecount": count, "columns": count}
    lines = [
        _tag("tileset", {**first, "name": "level", **shape}),
        " " + _tag("image", {"source": image, "width": count * size, "height": size}, end=True),
    ]
    for i, kind in enumerate(tileset.kinds):
        lines.append(" " + _tag("tile", {"id": i, "type": kind}))
        lines += _indented(_properties(tile_properties(tileset, i)), "  ")
        lines.append(" </tile>")
    return [*lines, "</tileset>"]


def tile_properties(tileset: Tileset, index: int) -> Properties:
    """Say of a tile whether one can walk on it, and of which template a floor is."""
    walkable: Properties = (("walkable", "bool", tileset.kinds[index] != "wall"),)
    if index >= len(tileset.templates):
        return walkable
    return (("template", "string", tileset.templates[index].name), *walkable)


def _object(number: int, thing: MapObject) -> list[str]:
    """Write an object; its points count from the first."""
    x, y = thing.points[0].tolist()
    place = {"id": number, "name": thing.name, "type": thing.kind, "x": _text(x), "y": _text(y)}
    lines = [_tag("object", place)]
    lines += _indented(_properties(thing.properties))
    if thing.shape == "point":
        lines.append(" <point/>")
    else:
        lines.append(" " + _tag(thing.shape, {"points": _points(thing.points)}, end=True))
    return [*lines, "</object>"]


def _points(points: FloatArray) -> str:
    """Write points as "x,y x,y", from the first."""
    return " ".join(f"{_text(x)},{_text(y)}" for x, y in (points - points[0]).round(4).tolist())


def _properties(properties: Properties) -> list[str]:
    """Write custom properties."""
    if not properties:
        return []
    lines = ["<properties>"]
    for name, kind, value in properties:
        given = {} if kind == "string" else {"type": kind}
        lines.append(
            " " + _tag("property", {"name": name, **given, "value": _text(value)}, end=True)
        )
    return [*lines, "</properties>"]


def _text(value: object) -> str:
    """Write a value as Tiled does: true and false, whole numbers without a point."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    return str(value)


def _tag(tag: str, attributes: Mapping[str, object], *, end: bool = False) -> str:
    """Write a tag with its attributes."""
    written = "".join(f' {key}="{_escaped(str(value))}"' for key, value in attributes.items())
    return f"<{tag}{written}{'/' if end else ''}>"


def _escaped(text: str) -> str:
    """Make text fit for an attribute."""
    escaped = html.escape(_UNWRITABLE.sub("\ufffd", text))
    return re.sub("[\t\n\r]", lambda found: f"&#{ord(found.group())};", escaped)


def _indented(lines: Iterable[str], by: str = " ") -> list[str]:
    """Move lines to the right."""
    return [by + line for line in lines]
