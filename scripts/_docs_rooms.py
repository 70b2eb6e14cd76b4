"""Draw which rooms of the library import which, as the code has it, to docs/images/rooms.svg."""

from __future__ import annotations

import ast
import html
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "images" / "rooms.svg"
#: Modules that every room uses; drawn apart.
COMMON = {"errors", "progress"}
WIDTH, HEIGHT, ACROSS, DOWN, EDGE = 130, 48, 70, 34, 24
COLOURS = {"plugin": "#f6d7c8", "room": "#f5ecd2", "common": "#dfe8c9"}


def imports() -> dict[str, set[str]]:
    """Return the rooms that each room of the library imports, and those that the plugin does."""
    rooms = {path.parent.name for path in (ROOT / "algorithms").glob("*/__init__.py")}
    found: dict[str, set[str]] = {room: set() for room in (*rooms, "plugin")}
    for path in sorted([*(ROOT / "algorithms").rglob("*.py"), *(ROOT / "plugin").rglob("*.py")]):
        parts = path.relative_to(ROOT).parts[:-1]
        own = parts[0] if parts[0] == "plugin" else parts[1] if len(parts) > 1 else ""
        if own not in found:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.ImportFrom) or not node.level:
                continue
            base = parts[: len(parts) - node.level + 1]
            names = [node.module] if node.module else [alias.name for alias in node.names]
            for name in names:
                full = (*base, *name.split("."))
                if full[0] == "algorithms" and len(full) > 1 and full[1] in rooms:
                    found[own].add(full[1])
    return {room: others - {room} for room, others in found.items()}


def columns(graph: dict[str, set[str]]) -> dict[str, int]:
    """Return a column for each room: right of all that it imports."""
    depth: dict[str, int] = {}

    def of(room: str) -> int:
        if room not in depth:
            depth[room] = 1 + max((of(other) for other in graph[room]), default=-1)
        return depth[room]

    for room in sorted(graph):
        of(room)
    depth["plugin"] = max(depth.values()) if graph["plugin"] else 0
    return depth


def direct(graph: dict[str, set[str]]) -> dict[str, set[str]]:
    """Leave out what follows: an arrow to a room that another arrow leads to as well."""

    def beyond(room: str) -> set[str]:
        found = set(graph[room])
        for other in graph[room]:
            found |= beyond(other)
        return found

    return {
        room: {o for o in others if not any(o in beyond(p) for p in others - {o})}
        for room, others in graph.items()
    }


def picture() -> str:
    """Return the picture as SVG."""
    graph = imports()
    column = columns(graph)
    rows: dict[int, list[str]] = {}
    for room in sorted(column):
        rows.setdefault(column[room], []).append(room)
    most = max(len(own) for own in rows.values())
    tall = most * (HEIGHT + DOWN) - DOWN
    place = {}
    for at, own in rows.items():
        top = EDGE + (tall - (len(own) * (HEIGHT + DOWN) - DOWN)) / 2
        for row, room in enumerate(own):
            place[room] = (EDGE + at * (WIDTH + ACROSS), top + row * (HEIGHT + DOWN))
    wide = 2 * EDGE + (max(rows) + 1) * (WIDTH + ACROSS) - ACROSS
    high = 2 * EDGE + tall + 62
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide:g} {high:g}" '
        f'width="{wide:g}" height="{high:g}" font-family="sans-serif">',
        '<defs><marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" '
        'markerHeight="7" orient="auto"><path d="M0 0 L10 5 L0 10 z" fill="#7a7366"/></marker>'
        "</defs>",
        f'<rect width="{wide:g}" height="{high:g}" fill="#fbfaf7"/>',
    ]
    for room, others in sorted(direct(graph).items()):
        parts += [_arrow(place[room], place[other]) for other in sorted(others)]
    for room, (x, y) in sorted(place.items()):
        parts += _box(room, x, y, COLOURS["plugin" if room == "plugin" else "room"])
    y = EDGE + tall + 20
    common = ", ".join(f"{name}.py" for name in sorted(COMMON))
    parts.append(
        f'<rect x="{EDGE}" y="{y:g}" width="{wide - 2 * EDGE:g}" height="40" rx="6" '
        f'fill="{COLOURS["common"]}" stroke="#8a857c"/>'
        f'<text x="{wide / 2:g}" y="{y + 25:g}" font-size="15" text-anchor="middle" '
        f'fill="#2b2b2b">{common}: used by all</text>'
    )
    return "\n".join([*parts, "</svg>", ""])


def _box(room: str, x: float, y: float, colour: str) -> list[str]:
    """Draw a room."""
    title = f"{room}/"
    return [
        f'<rect x="{x:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="6" fill="{colour}" '
        'stroke="#8a857c"/>',
        f'<text x="{x + WIDTH / 2:g}" y="{y + HEIGHT / 2 + 5:g}" font-size="15" '
        f'text-anchor="middle" font-weight="bold" fill="#2b2b2b">{html.escape(title)}</text>',
    ]


def _arrow(start: tuple[float, float], end: tuple[float, float]) -> str:
    """Draw an arrow from a room to one further left that it imports."""
    x0, y0 = start[0], start[1] + HEIGHT / 2
    x1, y1 = end[0] + WIDTH + 3, end[1] + HEIGHT / 2
    bend = max(30.0, (x0 - x1) / 2)
    if x0 <= x1:  # in one column
        x0, x1, bend = start[0] + WIDTH / 2, end[0] + WIDTH / 2, 0.0
        y0, y1 = (start[1], end[1] + HEIGHT + 3) if start[1] > end[1] else (
            start[1] + HEIGHT, end[1] - 3)  # fmt: skip
    return (
        f'<path d="M{x0:g} {y0:g} C{x0 - bend:g} {y0:g} {x1 + bend:g} {y1:g} {x1:g} {y1:g}" '
        'fill="none" stroke="#7a7366" stroke-width="1.6" marker-end="url(#tip)"/>'
    )


if __name__ == "__main__":
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    PICTURE.write_text(picture(), encoding="utf-8")
