"""A small server that plays Nominatim and Overpass on this computer, from an OpenStreetMap file.

    python tests/osm/server.py --port 8077 [--extract FILE.osm.pbf]

plays Nominatim at http://127.0.0.1:8077/ and Overpass at http://127.0.0.1:8077/api until it is
interrupted. Addresses with /broken/KIND before the rest give broken answers: every HTTP code,
and the words of `BROKEN`.

It knows as much of both languages as osmnx and Platwright speak, no more.
"""

from __future__ import annotations

import argparse
import json
import re
import signal
import sys
import threading
import time
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import osmium
import shapely

SHIPPED = Path(__file__).resolve().parents[2] / "data" / "osm" / "monaco.osm.pbf"
LICENCE = "Data © OpenStreetMap contributors, ODbL 1.0. http://osm.org/copyright"

#: Words after /broken/ in an address, and what they do.
BROKEN = {
    "truncated": "announces more than it sends, and closes",
    "half": "sends half of the data and says it is all",
    "html": "sends a web page as a success",
    "garbage": "sends text that is no data",
    "empty": "sends nothing as a success",
    "foreign": "sends good JSON of another kind",
    "remark": "sends some of the elements, and a remark that memory ran out",
    "hang": "takes the request and never answers",
    "drip": "sends a byte a second",
    "reset": "closes without an answer",
    "loop": "sends the request back to itself",
    "once": "says 429 to the first request, and answers the next",
}

_KINDS = ("boundary", "place", "landuse", "leisure", "natural", "amenity", "tourism")
_FILTER = re.compile(
    r"""\[\s*(~)?\s*(?:"([^"]*)"|'([^']*)')\s*(?:(=|!=|~|!~)\s*(?:"([^"]*)"|'([^']*)'))?\s*\]"""
)
_STATEMENT = re.compile(r"\b(node|way|relation)((?:\[[^\]]*\]|\([^()]*\))+)")
_MEMBER = {"n": "node", "w": "way", "r": "relation"}


def fold(text: str) -> str:
    """Return a text without case, accents and punctuation."""
    bare = unicodedata.normalize("NFKD", text.casefold())
    return " ".join(re.findall(r"\w+", "".join(c for c in bare if not unicodedata.combining(c))))


@dataclass
class Extract:
    """The contents of an OpenStreetMap file."""

    date: str = "2020-01-01T00:00:00Z"
    nodes: dict[int, tuple[float, float, dict[str, str]]] = field(default_factory=dict)
    ways: dict[int, tuple[list[int], dict[str, str]]] = field(default_factory=dict)
    relations: dict[int, tuple[list[tuple[str, int, str]], dict[str, str]]] = field(
        default_factory=dict
    )
    areas: dict[tuple[str, int], Any] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path) -> Extract:
        made = cls()
        with osmium.io.Reader(str(path)) as reader:
            made.date = reader.header().get("osmosis_replication_timestamp") or made.date
        factory = osmium.geom.WKBFactory()
        for thing in osmium.FileProcessor(str(path)).with_locations().with_areas():
            tags = {tag.k: tag.v for tag in thing.tags}
            if thing.is_node():
                made.nodes[thing.id] = (thing.location.lon, thing.location.lat, tags)
            elif thing.is_way():
                made.ways[thing.id] = ([node.ref for node in thing.nodes], tags)
            elif thing.is_relation():
                members = [(_MEMBER[m.type], m.ref, m.role) for m in thing.members]
                made.relations[thing.id] = (members, tags)
            else:
                try:
                    shape = shapely.from_wkb(factory.create_multipolygon(thing))
                except RuntimeError:
                    continue
                made.areas["way" if thing.from_way() else "relation", thing.orig_id()] = shape
        return made

    def tags(self, kind: str, number: int) -> dict[str, str]:
        return {"node": self.nodes, "way": self.ways, "relation": self.relations}[kind][number][-1]

    def line(self, way: int) -> list[tuple[float, float]]:
        return [self.nodes[n][:2] for n in self.ways[way][0] if n in self.nodes]

    def shape(self, kind: str, number: int) -> Any:
        """Return what a thing looks like: its area, its line, or its point."""
        if (kind, number) in self.areas:
            return self.areas[kind, number]
        if kind == "node":
            return shapely.Point(self.nodes[number][:2])
        if kind == "way":
            points = self.line(number)
            return shapely.LineString(points) if len(points) > 1 else shapely.Point()
        members = [w for k, w, _ in self.relations[number][0] if k == "way" and w in self.ways]
        return shapely.GeometryCollection([self.shape("way", w) for w in members])

    def numbers(self, kind: str) -> Iterable[int]:
        return {"node": self.nodes, "way": self.ways, "relation": self.relations}[kind]


class Overpass:
    """Answers queries."""

    def __init__(self, extract: Extract) -> None:
        self.extract = extract

    def answer(self, query: str) -> dict[str, Any]:
        found: dict[str, set[int]] = {"node": set(), "way": set(), "relation": set()}
        spot = re.search(r"is_in\(\s*(-?[\d.]+)\s*,\s*(-?[\d.]+)\s*\)", query)
        around = set()
        if spot:
            point = shapely.Point(float(spot[2]), float(spot[1]))
            around = {key for key, area in self.extract.areas.items() if area.intersects(point)}
        for kind, filters in _STATEMENT.findall(query):
            found[kind] |= set(self._select(kind, filters, around))
        if ">;" in query:
            self._recurse(found)
        how = re.findall(r"\bout\b([^;]*);", query)[-1].split()
        elements = [
            self._element(kind, number, how) for kind in found for number in sorted(found[kind])
        ]
        return {
            "version": 0.6,
            "generator": "Platwright's local server",
            "osm3s": {"timestamp_osm_base": self.extract.date, "copyright": LICENCE},
            "elements": elements,
        }

    def _select(self, kind: str, filters: str, around: set[tuple[str, int]]) -> Iterator[int]:
        numbers: Iterable[int] = self.extract.numbers(kind)
        place = None
        for inside in re.findall(r"\(([^()]*)\)", re.sub(r"\[[^\]]*\]", "", filters)):
            if inside.startswith("poly:"):
                values = [float(v) for v in re.findall(r"-?\d+\.?\d*", inside)]
                place = shapely.Polygon(list(zip(values[1::2], values[::2])))
                shapely.prepare(place)
            elif inside.startswith("pivot"):
                numbers = [n for k, n in around if k == kind]
            else:
                asked = [int(v) for v in re.findall(r"\d+", inside)]
                numbers = [n for n in asked if n in self.extract.numbers(kind)]
        tests = _FILTER.findall(filters)
        for number in numbers:
            if not _passes(self.extract.tags(kind, number), tests):
                continue
            if place is None or place.intersects(self.extract.shape(kind, number)):
                yield number

    def _recurse(self, found: dict[str, set[int]]) -> None:
        for number in found["relation"]:
            for kind, member, _ in self.extract.relations[number][0]:
                if kind != "relation" and member in self.extract.numbers(kind):
                    found[kind].add(member)
        for number in found["way"]:
            found["node"] |= {n for n in self.extract.ways[number][0] if n in self.extract.nodes}

    def _element(self, kind: str, number: int, how: list[str]) -> dict[str, Any]:
        made: dict[str, Any] = {"type": kind, "id": number}
        tags = self.extract.tags(kind, number)
        if kind == "node" and "tags" not in how:
            made["lon"], made["lat"] = self.extract.nodes[number][:2]
        elif {"bb", "geom"} & set(how) and kind != "node":
            west, south, east, north = self.extract.shape(kind, number).bounds
            made["bounds"] = {"minlat": south, "minlon": west, "maxlat": north, "maxlon": east}
        if kind == "way" and "tags" not in how:
            made["nodes"] = self.extract.ways[number][0]
            if "geom" in how:
                made["geometry"] = self._geometry(number)
        if kind == "relation" and "tags" not in how:
            made["members"] = [
                {"type": k, "ref": ref, "role": role}
                | (
                    {"geometry": self._geometry(ref)}
                    if "geom" in how and k == "way" and ref in self.extract.ways
                    else {}
                )
                for k, ref, role in self.extract.relations[number][0]
            ]
        return made | ({"tags": tags} if tags else {})

    def _geometry(self, way: int) -> list[dict[str, float]]:
        return [{"lat": lat, "lon": lon} for lon, lat in self.extract.line(way)]


def _passes(tags: dict[str, str], tests: list[tuple[str, ...]]) -> bool:
    for by_pattern, key2, key1, operator, value2, value1 in tests:
        key, value = key2 or key1, value2 or value1
        if by_pattern:
            good = any(re.search(key, k) and re.search(value, v) for k, v in tags.items())
        elif not operator:
            good = key in tags
        elif operator in ("=", "!="):
            good = (tags.get(key) == value) == (operator == "=")
        else:
            good = (key in tags and bool(re.search(value, tags[key]))) == (operator == "~")
        if not good:
            return False
    return True


class Nominatim:
    """Finds what has a name."""

    def __init__(self, extract: Extract) -> None:
        self.extract = extract
        self.places = [*_made_up(), *self._from_extract()]
        self.places.sort(key=lambda place: -place["importance"])

    def search(self, asked: dict[str, str]) -> list[dict[str, Any]]:
        wanted, *around = [fold(part) for part in asked.get("q", "").split(",")]
        found = [
            place
            for place in self.places
            if wanted in (fold(name) for name in place["names"])
            and all(part in fold(place["display_name"]) for part in around)
        ]
        return [_public(place) for place in found[: int(asked.get("limit", 10))]]

    def lookup(self, asked: dict[str, str]) -> list[dict[str, Any]]:
        ids = asked.get("osm_ids", "").split(",")
        return [
            _public(place)
            for place in self.places
            if f"{place['osm_type'][0].upper()}{place['osm_id']}" in ids
        ]

    def reverse(self, asked: dict[str, str]) -> dict[str, Any]:
        point = shapely.Point(float(asked["lon"]), float(asked["lat"]))
        most = int(asked.get("zoom", 18)) + 6
        inside = [
            place
            for place in self.places
            if place["type"] == "administrative"
            and place["place_rank"] <= most
            and place["shape"].intersects(point)
        ]
        if not inside:
            return {"error": "Unable to geocode"}
        return _public(max(inside, key=lambda place: place["place_rank"]))

    def _from_extract(self) -> Iterator[dict[str, Any]]:
        things = [*self.extract.areas, *(("node", n) for n in self.extract.nodes)]
        for kind, number in things:
            tags = self.extract.tags(kind, number)
            what = next((key for key in _KINDS if key in tags), None)
            if "name" in tags and what and (kind != "node" or "place" in tags):
                yield self._place(kind, number, tags, what)

    def _place(self, kind: str, number: int, tags: dict[str, str], what: str) -> dict[str, Any]:
        shape = self.extract.shape(kind, number)
        middle = shape.representative_point()
        level = tags.get("admin_level", "")
        administrative = tags.get("boundary") == "administrative" and level.isdigit()
        rank = 2 * int(level) if administrative else 22
        around = [
            (int(self.extract.tags(*key).get("admin_level", "99")), self.extract.tags(*key)["name"])
            for key, area in self.extract.areas.items()
            if self.extract.tags(*key).get("boundary") == "administrative"
            and "name" in self.extract.tags(*key)
            and area.area > shape.area
            and area.intersects(middle)
        ]
        names = [tags["name"], *(name for own, name in sorted(around, reverse=True))]
        return place_of(
            kind, number, tags["name"], shape, tags[what] if what else "", rank,
            importance=0.9 - rank / 40 if administrative else 0.3 if kind == "node" else 0.1,
            category=what, display_name=", ".join(dict.fromkeys(names)),
            names=[text for key, text in tags.items() if "name" in key],
        )  # fmt: skip


def place_of(
    kind: str, number: int, name: str, shape: Any, what: str, rank: int, **more: Any
) -> dict[str, Any]:
    """Return a place as Nominatim gives it, with its shape and all its names."""
    middle = shape.representative_point()
    west, south, east, north = shape.bounds
    return {
        "place_id": number, "licence": LICENCE, "osm_type": kind, "osm_id": number,
        "lat": str(middle.y), "lon": str(middle.x), "class": more.get("category", "boundary"),
        "type": what, "place_rank": rank, "importance": more.get("importance", 0.5),
        "addresstype": what, "name": name, "display_name": more.get("display_name", name),
        "boundingbox": [str(south), str(north), str(west), str(east)],
        "names": more.get("names") or [name], "shape": shape,
    }  # fmt: skip


def _made_up() -> Iterator[dict[str, Any]]:
    """Yield places that no small extract has: a state, two halves, twins, the same ground twice."""
    state = shapely.box(20, 40, 30, 48)
    yield place_of("relation", 9000001, "Testland", state, "administrative", 4, importance=0.9)
    halves = shapely.MultiPolygon(
        [shapely.box(178, -18, 180, -16), shapely.box(-180, -18, -179, -16)]
    )
    yield place_of("relation", 9000002, "Datelinia", halves, "administrative", 16)
    for number, (x, weight) in enumerate([(21.0, 0.4), (26.0, 0.6)]):
        yield place_of(
            "relation", 9000010 + number, "Twinbrook", shapely.box(x, 41, x + 0.05, 41.04),
            "administrative", 16, importance=weight, display_name=f"Twinbrook, County {number + 1}",
        )  # fmt: skip
    city = shapely.box(22, 42, 22.1, 42.1)
    for number, rank in ((9000020, 12), (9000021, 16)):
        yield place_of("relation", number, "Stadtkreis", city, "administrative", rank)
    yield place_of(
        "node", 9000030, "Pointville", shapely.Point(7.4325, 43.7415), "village", 19,
        category="place", importance=0.4,
    )  # fmt: skip
    yield place_of(
        "node", 9000040, "Halfway", shapely.Point(7.4325, 43.7415), "village", 19,
        category="place", importance=0.6,
    )  # fmt: skip
    yield place_of(
        "relation", 9000050, "Upper Twinbrook", shapely.box(21, 41.5, 21.1, 41.6),
        "administrative", 16,
    )  # fmt: skip
    yield place_of(
        "node", 9000051, "Upper Twinbrook", shapely.Point(25, 45), "hamlet", 20,
        category="place", importance=0.1,
    )  # fmt: skip
    yield place_of(
        "relation", 9000041, "Halfway", shapely.box(29, 47, 29.1, 47.1), "administrative", 16,
        importance=0.3,
    )  # fmt: skip


def _public(place: dict[str, Any]) -> dict[str, Any]:
    shown = {key: value for key, value in place.items() if key not in ("names", "shape")}
    return shown | {"geojson": json.loads(shapely.to_geojson(place["shape"]))}


class Server(ThreadingHTTPServer):
    """The server; as a context it runs in a thread of its own.

    Attributes
    ----------
    log
        Path and headers of every request, in their order.
    """

    daemon_threads = True

    def __init__(self, extract: Path = SHIPPED, port: int = 0) -> None:
        super().__init__(("127.0.0.1", port), _Handler)
        read = Extract.read(extract)
        self.overpass, self.nominatim = Overpass(read), Nominatim(read)
        self.log: list[tuple[str, dict[str, str]]] = []
        self.closing = threading.Event()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"

    def addresses(self, broken: str = "") -> dict[str, str]:
        """Return the settings that lead here, to broken answers where a kind is named."""
        base = f"{self.url}/broken/{broken}" if broken else self.url
        return {"nominatim_url": f"{base}/", "overpass_url": f"{base}/api"}

    def __enter__(self) -> Server:
        threading.Thread(target=self.serve_forever, args=(0.05,), daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self.closing.set()
        self.shutdown()
        self.server_close()

    def handle_error(self, *_: object) -> None:
        """Keep quiet where the other side has hung up, as it should when it is cancelled."""
        error = sys.exc_info()[1]
        if not isinstance(error, (ConnectionError, TimeoutError)):
            super().handle_error(*_)  # type: ignore[arg-type]


class _Handler(BaseHTTPRequestHandler):
    server: Server

    def do_GET(self) -> None:
        self._handle(urlsplit(self.path).query)

    def do_POST(self) -> None:
        self._handle(self.rfile.read(int(self.headers.get("Content-Length", 0))).decode())

    def _handle(self, form: str) -> None:
        path = urlsplit(self.path).path
        self.server.log.append((self.path, dict(self.headers)))
        asked = {key: values[0] for key, values in parse_qs(form).items()}
        broken = re.match(r"/broken/(\w+)(/.*)", path)
        if broken and not path.endswith("/status"):
            self._break(broken[1], broken[2], asked)
        else:
            self._answer(path, asked)

    def _answer(self, path: str, asked: dict[str, str]) -> None:
        service = path.rstrip("/").rsplit("/", 1)[-1]
        if service == "status":
            text = "Connected as: 1\nCurrent time: now\nRate limit: 2\n2 slots available now.\n"
            self._send(text.encode(), kind="text/plain")
        elif service == "interpreter":
            self._send(_json(self.server.overpass.answer(asked.get("data", ""))))
        elif service in ("search", "lookup", "reverse"):
            self._send(_json(getattr(self.server.nominatim, service)(asked)))
        else:
            self._send(b"not here", 404, "text/plain")

    def _break(self, kind: str, path: str, asked: dict[str, str]) -> None:
        if kind.isdigit():
            self._send(f"<html><body>Error {kind}</body></html>".encode(), int(kind), "text/html")
        elif kind == "once":
            before = sum(self.path == given for given, _ in self.server.log)
            if before > 1:
                self._answer(path, asked)
            else:
                self._send(b"", 429, "text/plain", {"Retry-After": "0"})
        elif kind == "loop":
            self._send(b"", 302, "text/plain", {"Location": self.path})
        elif kind == "hang":
            self.server.closing.wait(60)
            self.close_connection = True
        elif kind == "reset":
            self.close_connection = True
        elif kind == "drip":
            self._drip()
        elif kind == "truncated":
            self._send(b'[{"place_id": 1, "osm', length=5000)
            self.close_connection = True
        else:
            bodies = {
                "half": b'{"elements": [{"type": "node", "id": 1, "l',
                "html": b"<!DOCTYPE html><html><body>Welcome to the hotel</body></html>",
                "garbage": b"the answer is forty-two",
                "empty": b"",
                "foreign": b'{"type": "FeatureCollection", "features": []}',
                "remark": b'{"elements": [], "remark": "runtime error: Query run out of memory"}',
            }
            self._send(bodies[kind], kind="text/html" if kind == "html" else "application/json")

    def _drip(self) -> None:
        self.send_response(200)
        self.send_header("Content-Length", "1000")
        self.end_headers()
        while not self.server.closing.wait(1.0):
            self.wfile.write(b" ")
            self.wfile.flush()

    def _send(
        self,
        body: bytes,
        status: int = 200,
        kind: str = "application/json",
        more: dict[str, str] | None = None,
        length: int | None = None,
    ) -> None:
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(body) if length is None else length))
        for name, text in (more or {}).items():
            self.send_header(name, text)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Keep quiet."""


def _json(data: Any) -> bytes:
    return json.dumps(data, ensure_ascii=False).encode()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--port", type=int, default=8077)
    parser.add_argument("--extract", type=Path, default=SHIPPED, help="an .osm or .pbf file")
    given = parser.parse_args()
    # Also where a shell started it in the background: there interrupts are ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with Server(given.extract, given.port) as server:
        urls = server.addresses()
        print(f"Nominatim: {urls['nominatim_url']}\nOverpass:  {urls['overpass_url']}", flush=True)
        try:
            while True:
                time.sleep(1.0)
        except KeyboardInterrupt:
            print("Closed.")


if __name__ == "__main__":
    main()
