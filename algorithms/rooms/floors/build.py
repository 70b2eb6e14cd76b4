"""The floors of buildings: from layers to one mesh per footprint and what is on it per storey."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import geopandas as gpd
import numpy as np
import shapely
from pyproj import CRS
from shapely.geometry import Polygon

from ...errors import InputError
from ...mesh.layers import mesh_from_faces
from ...mesh.quadmesh import QuadMesh
from ...progress import Progress, Share, Silent
from ...site.watch import ask
from .assign import CLOSE, corridor_edges, open_faces, pieces, sink_vertices, usual_sinks
from .fit import face_polygons, tiles
from .read import (
    LinePart,
    Part,
    PointPart,
    PolygonPart,
    metric_crs,
    read_footprints,
    read_lines,
    read_points,
    read_polygons,
    storeys_in,
)
from .tile import MOST_FACES, check_module, check_size, tile_footprint
from .types import Feature, Floor, LayerNames, Remark

WORK = "the floors were being laid out"


@dataclass(frozen=True)
class _Ground:
    """A meshed footprint."""

    feature: Feature
    storey: int | None
    polygon: Polygon
    mesh: QuadMesh
    shafts: tuple[PolygonPart, ...]
    remarks: tuple[Remark, ...]


@dataclass(frozen=True)
class _Things:
    """What stands on floors."""

    sinks: list[PointPart]
    obstacles: list[PolygonPart]
    corridors: list[LinePart]


def floors_of(
    footprints: gpd.GeoDataFrame,
    *,
    module: float = 4.0,
    sinks: gpd.GeoDataFrame | None = None,
    obstacles: gpd.GeoDataFrame | None = None,
    corridors: gpd.GeoDataFrame | None = None,
    storeys: int | None = None,
    names: LayerNames | None = None,
    progress: Progress | None = None,
) -> list[Floor]:
    """Lay a mesh over footprints and put exits, obstacles and given corridors on it.

    CND section 5.2 needs a mesh of near squares (eq. 15-17); the sinks are its "fixed elements
    such as elevators", the required edges its "forced corridor locations".

    Parameters
    ----------
    footprints
        Polygons in any CRS, one per building; courtyards are holes. One that names a storey is
        the footprint of that storey only.
    module
        Side that squares should have, metres; half the usual depth of a room.
    sinks
        Points: entrances, stairs, lifts. A storey without any has one in the middle of its longest
        outer side, or, above or below the ground, at the largest shaft that all storeys share.
    obstacles
        Polygons that no room covers: shafts, columns, roof gardens.
    corridors
        Lines along which a corridor must run.
    storeys
        Number of storeys, counted from 0; None for those that the layers name, or one.
    names
        Names of the layers, and of their field with the storey.
    progress
        Told of stages, asked for cancellation.

    Returns
    -------
    list of Floor
        By footprint, then by storey.

    Raises
    ------
    InputError
        If a layer or the module cannot be used; the text names layer, feature and remedy.
    CancelledError
        If the caller cancels.
    """
    names, progress = names or LayerNames(), progress or Silent()
    check_module(module)
    crs, source = metric_crs(footprints, names.footprints)
    remarks: list[Remark] = []
    found = read_footprints(footprints, names.footprints, names.floor, crs, remarks, progress)
    for part in found:
        check_size(part.shape, module, names.footprints, part.feature)
    things = _things(sinks, obstacles, corridors, names, crs, remarks, progress)
    layers = [(footprints, names.footprints), *_layers(sinks, obstacles, corridors, names)]
    numbers = _numbers(storeys, storeys_in(layers, names.floor))
    _check_things(found, numbers, things, module, names, remarks)
    grounds = []
    for k, part in enumerate(found):
        progress.stage("Laying out the floor", k / len(found))
        share = Share(progress, k / len(found), (k + 1) / len(found))
        tiling = tile_footprint(
            part.shape, module, layer=names.footprints, feature=part.feature, progress=share
        )
        _check_whole(tiling.mesh, names.footprints, part.feature)
        shafts = tuple(PolygonPart(part.feature, None, hole) for hole in tiling.shafts)
        grounds.append(
            _Ground(part.feature, part.storey, tiling.polygon, tiling.mesh, shafts, tiling.remarks)
        )
    return _floors(grounds, numbers, things, names, crs, source, remarks, progress)


def floors_of_mesh(
    faces: gpd.GeoDataFrame,
    *,
    sinks: gpd.GeoDataFrame | None = None,
    obstacles: gpd.GeoDataFrame | None = None,
    corridors: gpd.GeoDataFrame | None = None,
    storeys: int | None = None,
    names: LayerNames | None = None,
    progress: Progress | None = None,
) -> list[Floor]:
    """Put exits, obstacles and given corridors on a mesh that was drawn.

    Parameters
    ----------
    faces
        Quadrilaterals that share whole sides, any CRS; their storeys are not asked for.
        `LayerNames.footprints` is the name of this layer.
    sinks, obstacles, corridors, storeys, names, progress
        As of `floors_of`.

    Returns
    -------
    list of Floor
        By storey; `feature` is the id of the first face.

    Raises
    ------
    InputError
        If the faces are no mesh in one piece, or as `floors_of`.
    CancelledError
        If the caller cancels.
    """
    names, progress = names or LayerNames(footprints="Mesh faces"), progress or Silent()
    layer = names.footprints
    crs, source = metric_crs(faces, layer)
    if len(faces) > MOST_FACES:
        raise InputError(
            f"It has {len(faces)} faces, more than {MOST_FACES}.",
            "Split the mesh or draw larger faces.",
            layer=layer,
        )
    moved = gpd.GeoDataFrame(geometry=faces.geometry.copy(), crs=source).to_crs(crs)
    mesh = mesh_from_faces(moved, layer=layer)
    feature = faces.index[0] if isinstance(faces.index[0], str) else int(faces.index[0])
    _check_whole(mesh, layer, None)
    polygon = shapely.coverage_union_all(face_polygons(mesh))
    if not isinstance(polygon, Polygon) or not tiles(mesh, polygon):
        raise InputError(
            "Its faces overlap or leave gaps.", "Redraw them so that they share sides.", layer=layer
        )
    remarks: list[Remark] = []
    things = _things(sinks, obstacles, corridors, names, crs, remarks, progress)
    layers = _layers(sinks, obstacles, corridors, names)
    numbers = _numbers(storeys, storeys_in(layers, names.floor))
    whole = [PolygonPart(feature, None, polygon)]
    _check_things(whole, numbers, things, mesh.edge_length, names, remarks)
    ground = _Ground(feature, None, polygon, mesh, (), ())
    return _floors([ground], numbers, things, names, crs, source, remarks, progress)


def _layers(
    sinks: gpd.GeoDataFrame | None,
    obstacles: gpd.GeoDataFrame | None,
    corridors: gpd.GeoDataFrame | None,
    names: LayerNames,
) -> list[tuple[gpd.GeoDataFrame | None, str]]:
    """Return the layers beside the footprints with their names."""
    return [(sinks, names.sinks), (obstacles, names.obstacles), (corridors, names.corridors)]


def _things(
    sinks: gpd.GeoDataFrame | None,
    obstacles: gpd.GeoDataFrame | None,
    corridors: gpd.GeoDataFrame | None,
    names: LayerNames,
    crs: CRS,
    remarks: list[Remark],
    progress: Progress,
) -> _Things:
    """Read what stands on the floors."""
    return _Things(
        read_points(sinks, names.sinks, names.floor, crs),
        read_polygons(obstacles, names.obstacles, names.floor, crs, remarks, progress),
        read_lines(corridors, names.corridors, names.floor, crs),
    )


def _numbers(storeys: int | None, named: list[int]) -> list[int]:
    """Return the storeys."""
    if storeys is None:
        return named or [0]
    if storeys < 1:
        raise InputError(f"The number of storeys is {storeys}.", "It must be at least 1.")
    return list(range(storeys))


def _stands(part: Part, storey: int) -> bool:
    return part.storey is None or part.storey == storey


def _check_things(
    footprints: Sequence[PolygonPart],
    storeys: list[int],
    things: _Things,
    module: float,
    names: LayerNames,
    remarks: list[Remark],
) -> None:
    """Refuse what stands on no floor, before any mesh is made."""
    rows: list[tuple[str, Sequence[Part], float]] = [
        (names.footprints, footprints, 0.0),
        (names.sinks, things.sinks, CLOSE * module),
        (names.corridors, things.corridors, CLOSE * module),
        (names.obstacles, things.obstacles, 0.0),
    ]
    for layer, parts, reach in rows:
        for part in parts:
            if part.storey is not None and part.storey not in storeys:
                raise InputError(
                    f"There is no storey {part.storey}: the storeys are {storeys[0]} to "
                    f"{storeys[-1]}.",
                    f"Correct its field '{names.floor}' or the number of storeys.",
                    layer=layer,
                    feature=part.feature,
                )
            far = _distance(part, footprints)
            if far <= reach:
                continue
            if layer == names.obstacles:
                text = f"Layer '{layer}', feature {part.feature} lies on no floor."
                remarks.append(Remark(text, "It was left out.", "warning", part.shape))
                continue
            raise InputError(
                f"It lies {far:.1f} m outside all footprints of its storey.",
                f"Move it to the floor; {reach:.1f} m outside are bridged.",
                layer=layer,
                feature=part.feature,
            )


def _distance(part: Part, footprints: Sequence[PolygonPart]) -> float:
    """Return how far a thing is from the next footprint of its storey, metres."""
    return min(
        (
            float(own.shape.distance(part.shape))
            for own in footprints
            if part.storey is None or own.storey is None or own.storey == part.storey
        ),
        default=float("inf"),
    )


def _check_whole(mesh: QuadMesh, layer: str, feature: Feature | None) -> None:
    """Refuse a mesh in pieces."""
    piece = pieces(mesh, np.ones(len(mesh.faces), dtype=np.bool_))
    if piece.max() == 0:
        return
    small = int(np.bincount(piece).argmin())
    x, y = mesh.vertices[mesh.faces[piece == small]].reshape(-1, 2).mean(axis=0)
    raise InputError(
        f"The mesh is in {int(piece.max()) + 1} pieces; the smallest "
        f"({int((piece == small).sum())} faces) is at ({x:.1f}, {y:.1f}).",
        "Join the pieces along sides or treat them one by one.",
        layer=layer,
        feature=feature,
    )


def _floors(
    grounds: Sequence[_Ground],
    storeys: list[int],
    things: _Things,
    names: LayerNames,
    crs: CRS,
    source: CRS,
    remarks: list[Remark],
    progress: Progress,
) -> list[Floor]:
    """Make the floors of all footprints; remarks on layers go to the first one."""
    made: list[Floor] = []
    entered = 0 if 0 in storeys else min(storeys)
    for ground in grounds:
        faces = face_polygons(ground.mesh)
        shared = list(ground.remarks)
        for storey in storeys:
            if ground.storey is not None and ground.storey != storey:
                continue
            ask(progress, WORK)
            here = [g for g in grounds if g.storey is None or g.storey == storey]
            own = [*shared, *(remarks if not made else [])]
            shared = []
            obstacles = [o for o in things.obstacles if _stands(o, storey)] + list(ground.shafts)
            exits = [s for s in things.sinks if _stands(s, storey) and _nearest(s, here) is ground]
            lines = [
                c
                for c in things.corridors
                if _stands(c, storey)
                and c.shape.distance(ground.polygon) <= CLOSE * ground.mesh.edge_length
                and _nearest(c, here).polygon.distance(c.shape) >= ground.polygon.distance(c.shape)
            ]
            free = open_faces(ground.mesh, faces, obstacles, names.obstacles, own)
            sinks = sink_vertices(ground.mesh, faces, free, exits, obstacles, names.sinks)
            if not sinks.any():
                shafts = [o for o in obstacles if o.storey is None and storey != entered]
                sinks, remark = usual_sinks(ground.mesh, faces, free, ground.polygon, shafts)
                own.append(remark)
            made.append(
                Floor(
                    storey=storey,
                    feature=ground.feature,
                    polygon=ground.polygon,
                    mesh=ground.mesh,
                    floor=free,
                    sinks=sinks,
                    required=corridor_edges(
                        ground.mesh, ground.polygon, free, lines, names.corridors
                    ),
                    outer=ground.mesh.boundary_edges,
                    crs=crs,
                    source_crs=source,
                    remarks=tuple(own),
                )
            )
    return made


def _nearest(part: Part, grounds: Sequence[_Ground]) -> _Ground:
    """Return the footprint that is nearest to a thing."""
    return min(grounds, key=lambda ground: float(ground.polygon.distance(part.shape)))
