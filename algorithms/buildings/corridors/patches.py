"""Patches: what corridors and obstacles leave of a zone, with what is planned in each."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Union

import geopandas as gpd
import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from ...site import Site
from ...site.crs import layer_crs
from ...site.repair import Problems, overlay, repair_polygons
from ..layout import Finding
from ..tables.patches import PatchChoice, choosing_fields, patch_choices
from ..types import EMPTY, ROWS
from ..zone import Patch
from .space import access_of

#: Patches smaller than this stay without buildings (square metres).
LEAST = 300.0
#: Smaller bits of ground are rounding (square metres).
CRUMB = 1.0

#: Places in patches, with the patterns that a sample plans there.
Places = tuple[tuple[tuple[float, float], PatchChoice], ...]
Feature = Union[int, str, None]


@dataclass(frozen=True)
class _Piece:
    """A piece of ground with what is planned there."""

    polygon: Polygon
    choice: PatchChoice
    feature: Feature


def make_patches(
    ground: BaseGeometry,
    streets: BaseGeometry,
    site: Site,
    usual: PatchChoice,
    frame: gpd.GeoDataFrame | None,
    layer: str,
) -> tuple[list[Patch], list[Finding]]:
    """Make the patches of a zone.

    Parameters
    ----------
    ground
        The zone without street space and obstacles, metres.
    streets
        Street space, and the parts of the zone's rings that lie along a street.
    site
        The zone.
    usual
        What is planned where nothing else is said.
    frame
        Polygons with choices of their own (`tables.patch_choices`), in any CRS; they cut the
        patches, the first counts where two overlap. None for none.
    layer
        Name of that layer.

    Returns
    -------
    patches : list of Patch
        From north to south.
    findings : list of Finding

    Raises
    ------
    InputError
        If the layer has no CRS or a choice cannot be read.
    """
    findings: list[Finding] = []
    own: list[_Piece] = []
    if frame is not None:
        own = _chosen(site, frame, layer, usual, findings)
    made: list[Patch] = []
    for polygon in polygons_of(ground):
        if polygon.area < CRUMB:
            continue
        for piece in _cut(polygon, own, usual):
            if piece.polygon.area < LEAST:
                findings.append(
                    Finding(
                        f"A patch of {piece.polygon.area:.0f} m2 is too small for buildings.",
                        "It stays green.",
                        "info",
                        piece.polygon,
                    )
                )
                continue
            patch = _patch(piece, streets)
            if patch.access.is_empty:
                findings.append(
                    Finding(
                        "No corridor can be reached from this patch.",
                        "It stays without buildings. Draw a corridor to it.",
                        "warning",
                        piece.polygon,
                    )
                )
            made.append(patch)
    return made, findings


def polygons_of(geometry: Any) -> list[Polygon]:
    """Return the polygons of a geometry, counter-clockwise, from north to south."""
    parts = shapely.get_parts(geometry)
    found = [orient(own) for own in parts if own.geom_type == "Polygon" and not own.is_empty]
    return sorted(found, key=lambda part: (-round(part.centroid.y, 1), round(part.centroid.x, 1)))


def as_planned(patches: Sequence[Patch], places: Places) -> list[Patch]:
    """Give patches without a feature of their own the patterns that a sample plans there.

    "The sample planning patterns of G are reused as planning constraints" (RZ section 2).

    Parameters
    ----------
    patches
        The patches.
    places
        Places with patterns; of several in a patch the first counts.

    Returns
    -------
    list of Patch
        Patches in which nothing is planned get residences in rows, and facilities only where no
        other patch has any.
    """
    points = shapely.points(np.array([at for at, _ in places], dtype=float).reshape(-1, 2))
    made = []
    for patch in patches:
        if patch.feature is not None or patch.access.is_empty:
            made.append(patch)
            continue
        inside = np.flatnonzero(shapely.intersects(patch.polygon, points))
        plan = places[int(inside[0])][1] if len(inside) else PatchChoice(facilities=EMPTY)
        made.append(dataclasses.replace(patch, **dataclasses.asdict(plan)))
    free = [at for at, own in enumerate(made) if own.feature is None and not own.access.is_empty]
    if free and all(patch.facilities == EMPTY for patch in made):
        middle = shapely.centroid(shapely.union_all([patch.polygon for patch in made]))
        at = min(free, key=lambda k: round(made[k].polygon.distance(middle), 3))
        made[at] = dataclasses.replace(made[at], facilities=ROWS)
    return made


def _chosen(
    site: Site,
    frame: gpd.GeoDataFrame,
    layer: str,
    usual: PatchChoice,
    findings: list[Finding],
) -> list[_Piece]:
    """Return the polygons of a layer of patches, none upon another."""
    here = site.polygon.representative_point()
    choices = patch_choices(frame, layer, usual)
    if not choosing_fields(frame, layer):
        findings.append(
            Finding(
                f"Layer '{layer}' has no field that chooses a pattern.",
                "Its polygons cut the patches all the same; add a field such as residences.",
                "warning",
                here,
            )
        )
    polygons, row = _repaired(site, frame, layer, findings)
    found: list[_Piece] = []
    taken: BaseGeometry = Polygon()
    for polygon, at in zip(polygons, row.tolist()):
        if not polygon.intersects(site.polygon):
            continue
        feature = frame.index[at]
        twice = overlay(shapely.intersection, polygon, taken)
        if twice.area > CRUMB:
            findings.append(
                Finding(
                    f"Layer '{layer}', feature {feature} overlaps others by {twice.area:.0f} m2.",
                    "The first polygon counts there.",
                    "warning",
                    twice,
                )
            )
        free = overlay(shapely.difference, polygon, taken)
        taken = shapely.union(taken, polygon)
        name = feature if isinstance(feature, str) else int(feature)
        found += [_Piece(part, choices[at], name) for part in polygons_of(free)]
    if not found:
        findings.append(
            Finding(
                f"No polygon of the layer '{layer}' lies in the zone.",
                "All patches are planned alike.",
                "warning",
                here,
            )
        )
    return found


def _repaired(
    site: Site, frame: gpd.GeoDataFrame, layer: str, findings: list[Finding]
) -> tuple[Any, Any]:
    """Return the layer's sound polygons in the site's CRS, and the row that each comes from."""
    source = layer_crs(frame, layer)
    shapes = np.asarray(frame.geometry.array, dtype=object).copy()
    if source != site.crs:
        shapes = gpd.GeoSeries(shapes, crs=source).to_crs(site.crs).to_numpy()
    here = site.polygon.representative_point()
    problems = Problems()
    polygons, row = repair_polygons(shapes, np.arange(len(frame)), layer, site.crs, problems)
    for own in problems.to_frame(site.crs).itertuples():
        feature = frame.index[int(own.feature)]
        findings.append(
            Finding(
                f"Layer '{layer}', feature {feature}: {own.problem}.",
                f"It was {own.action}.",
                own.severity,
                here if own.geometry is None else own.geometry,
            )
        )
    return polygons, row


def _cut(patch: Polygon, own: Sequence[_Piece], usual: PatchChoice) -> list[_Piece]:
    """Cut a patch by polygons with choices of their own; slivers join their neighbours."""
    pieces: list[_Piece] = []
    rest: BaseGeometry = patch
    for cut in own:
        part = overlay(shapely.intersection, rest, cut.polygon)
        if part.area < CRUMB:
            continue
        rest = overlay(shapely.difference, rest, cut.polygon)
        pieces += [dataclasses.replace(cut, polygon=p) for p in polygons_of(part)]
    pieces += [_Piece(p, usual, None) for p in polygons_of(rest)]
    while True:
        small = [at for at, p in enumerate(pieces) if p.polygon.area < LEAST]
        joins = [(at, *_neighbour(at, pieces)) for at in small] if len(pieces) > 1 else []
        joins = [join for join in joins if join[2] > 0.0]
        if not joins:
            return pieces
        at, other, _ = joins[0]
        both = polygons_of(shapely.union(pieces[at].polygon, pieces[other].polygon))
        if len(both) != 1:
            return pieces
        pieces[other] = dataclasses.replace(pieces[other], polygon=both[0])
        del pieces[at]


def _neighbour(at: int, pieces: Sequence[_Piece]) -> tuple[int, float]:
    """Return the piece with which one shares most of its edge, and how much, metres."""
    edge = shapely.boundary(pieces[at].polygon)
    shared = [
        0.0 if k == at else float(shapely.length(shapely.intersection(edge, own.polygon)))
        for k, own in enumerate(pieces)
    ]
    best = int(np.argmax(shared))
    return best, shared[best]


def _patch(piece: _Piece, streets: BaseGeometry) -> Patch:
    """Make a patch; one that no street reaches stays empty."""
    access = access_of(piece.polygon, streets)
    patch = Patch(
        polygon=piece.polygon,
        access=access,
        feature=piece.feature,
        **dataclasses.asdict(piece.choice),
    )
    return (
        dataclasses.replace(patch, residences=EMPTY, facilities=EMPTY) if access.is_empty else patch
    )
