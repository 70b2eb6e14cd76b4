"""From a site and its streets to a zone with patches (RZ section 2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import geopandas as gpd
import numpy as np
import pyproj
import shapely
from shapely.geometry import Polygon

from ...parcels.streetspace import StreetWidths
from ...progress import Progress
from ...site import BoundaryStreet, Site
from ...site.crs import transformer
from ...site.repair import overlay
from ..layout import Finding
from ..tables.patches import PatchChoice
from ..zone import Corridor, Patch, Zone
from .given import Given, existing, given_corridors
from .patches import Places, as_planned, make_patches
from .refine import sample_corridors
from .space import joined, space_in

#: Zones smaller than this (hectares) or narrower (metres) need no corridors of their own.
LARGE_HA, WIDE = 1.2, 80.0
#: Larger zones want streets that are designed (hectares).
VERY_LARGE_HA = 25.0


def zone_of_site(
    site: Site,
    *,
    corridors: gpd.GeoDataFrame | None = None,
    corridor_layer: str = "corridors",
    widths: StreetWidths | None = None,
    samples: bool = True,
    patches: gpd.GeoDataFrame | None = None,
    patch_layer: str = "patches",
    choice: PatchChoice | None = None,
    progress: Progress | None = None,
) -> tuple[Zone, list[Finding]]:
    """Cut a site into patches by its corridors.

    Patches, street space and obstacles tile the zone, but for bits that are told of.

    Parameters
    ----------
    site
        A prepared site.
    corridors
        Streets of any make, None for none.
    corridor_layer
        Name of their layer.
    widths
        How wide streets are by level.
    samples
        Whether corridors of the sample library are fitted in where none are given.
    patches
        Polygons with patterns of their own (`tables.patch_choices`), None for none.
    patch_layer
        Name of their layer.
    choice
        What patches do that do not say it themselves; None: what the sample plans there, else
        rows.
    progress
        Asked for cancellation.

    Returns
    -------
    zone : Zone
    findings : list of Finding
        What the planner should know of it.

    Raises
    ------
    InputError
        If a layer cannot be used.
    CancelledError
        If the caller cancels.
    """
    wide = widths if widths is not None else StreetWidths()
    findings: list[Finding] = []
    edge = existing(tuple(site.boundary_streets), wide, edge=True)
    inner = existing(tuple(site.inner_streets), wide, edge=False)
    barrier = Polygon()
    if corridors is not None:
        given = given_corridors(site, corridors, corridor_layer, wide)
        site, own = _with_given(site, given)
        inner, edge = [*own, *inner], [*edge, *given.edge]
        barrier = given.barrier
        findings += given.findings
        if not own:
            findings.append(_none_inside(site, corridor_layer, samples=samples))
    places: Places = ()
    if not inner and samples:
        inner, places = _from_samples(site, edge, wide, findings, progress)
    space = space_in(site.polygon, [*inner, *edge], progress)
    streets = shapely.union_all([space, site.street_frontage])
    if shapely.is_empty(streets):
        findings.append(_no_street(site))
    ground = overlay(shapely.difference, site.polygon, shapely.union(space, barrier))
    if site.obstacles:
        ground = overlay(shapely.difference, ground, site.obstacle_union)
    longitude, latitude, convergence = place_of(site)
    usual = choice if choice is not None else PatchChoice()
    made, told = make_patches(ground, streets, site, usual, patches, patch_layer)
    findings += told
    if choice is None and places:
        made = as_planned(made, places)
    made = [_to_grid(patch, convergence) for patch in made]
    zone = Zone(
        name=site.name,
        feature=site.feature,
        polygon=site.polygon,
        crs=site.crs,
        source_crs=site.source_crs,
        latitude=latitude,
        longitude=longitude,
        convergence_deg=convergence,
        corridors=(*inner, *edge),
        patches=tuple(made),
        obstacles=tuple(site.obstacles),
        site_id=site.site_id,
    )
    return zone, findings


def _to_grid(patch: Patch, convergence_deg: float) -> Patch:
    """Return a patch whose wished facing, from true north, is counted from grid north."""
    if patch.facing_deg is None:
        return patch
    return replace(patch, facing_deg=(patch.facing_deg - convergence_deg) % 360.0)


def place_of(site: Site) -> tuple[float, float, float]:
    """Return longitude, latitude and meridian convergence of the middle of a site, degrees.

    The convergence is the true azimuth of grid north, from -180 to 180.
    """
    middle = site.polygon.centroid
    there = transformer(site.crs, site.crs.geodetic_crs)
    lon, lat = there.transform(middle.x, middle.y)
    north = there.transform(middle.x, middle.y + 10.0)
    geod = site.crs.get_geod() or pyproj.Geod(ellps="WGS84")
    azimuth, _, _ = geod.inv(lon, lat, *north)
    return float(lon), float(lat), float(azimuth)


def narrow(polygon: Polygon) -> bool:
    """Tell whether a zone is so small or narrow that it needs no corridor of its own."""
    sides = shapely.get_coordinates(polygon.minimum_rotated_rectangle)
    step = np.hypot(*np.diff(sides[:3], axis=0).T)
    return bool(polygon.area / 1e4 < LARGE_HA or step.min() < WIDE)


def _with_given(site: Site, given: Given) -> tuple[Site, list[Corridor]]:
    """Return the site with the streets of a layer along its edge, and the corridors in it."""
    if given.edge:
        lines = tuple(BoundaryStreet(own.line, own.name) for own in given.edge)
        site = replace(site, boundary_streets=lines, street_frontage=given.frontage)
    return site, joined(given.inner, site)


def _none_inside(site: Site, layer: str, *, samples: bool) -> Finding:
    """Tell that no street of a layer is a corridor."""
    instead = " Corridors of a sample zone were fitted in where it needs some." if samples else ""
    return Finding(
        f"No line of the layer '{layer}' lies within the zone.",
        f"Choose streets that run through the zone, or none.{instead}",
        "warning",
        site.polygon.representative_point(),
    )


def _no_street(site: Site) -> Finding:
    """Tell that nothing leads to a zone."""
    return Finding(
        "No corridor lies in this zone and no street runs along its edge.",
        "Nothing can be built: give a layer of roads or of corridors, or a larger snap distance.",
        "error",
        site.polygon.representative_point(),
    )


def _from_samples(
    site: Site,
    edge: Sequence[Corridor],
    widths: StreetWidths,
    findings: list[Finding],
    progress: Progress | None,
) -> tuple[list[Corridor], Places]:
    """Return corridors of the sample library where the zone wants some, with planned patterns."""
    reached = not site.street_frontage.is_empty
    if reached and narrow(site.polygon):
        return [], ()
    here = site.polygon.representative_point()
    if site.area_ha > VERY_LARGE_HA:
        findings.append(
            Finding(
                f"The zone is {site.area_ha:.0f} ha large, and has no corridors.",
                "Corridors of sample zones were fitted in; design the streets of so large a zone "
                "first, and give them as corridors.",
                "warning",
                here,
            )
        )
    made, places, _ = sample_corridors(site, edge, widths, progress)
    if not reached and made:
        findings.append(
            Finding(
                "No street runs along the edge of this zone.",
                "Corridors begin on its edge where it suits them: lead a street there.",
                "warning",
                here,
            )
        )
    elif reached and not made:
        findings.append(
            Finding(
                "No sample zone gave corridors that fit.",
                "The zone stays in one patch. Draw corridors, or design streets first.",
                "warning",
                here,
            )
        )
    return made, places
