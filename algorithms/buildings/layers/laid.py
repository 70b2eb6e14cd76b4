"""Rows of what lies between buildings: paths, corridors, parking, green, trees, patches."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from ..layout import Layout
from ..rules import LayoutRules
from ..types import BUILDING_PATTERNS, PATH_PATTERNS


def zone_rows(layout: Layout) -> dict[str, Any]:
    """Give the one row of the zone, with how its plan was made."""
    zone, score = layout.zone, layout.score
    row = {
        "site_id": zone.site_id,
        "feature": str(zone.feature),
        "name": zone.name,
        "area_m2": float(zone.polygon.area),
        "method": layout.method,
        "seed": layout.seed,
        "seconds": layout.seconds,
        "objective": score.total,
        "remainder": score.remainder,
        "grouping": score.grouping,
        "ways": score.ways,
        "pattern": score.pattern,
        "geometry": zone.polygon,
    }
    return {name: [value] for name, value in row.items()}


def path_rows(layout: Layout, rules: LayoutRules) -> dict[str, Any]:
    """Give the columns of the paths."""
    paths = layout.paths.paths
    return {
        "path_id": np.arange(1, len(paths) + 1),
        "site_id": [layout.zone.site_id] * len(paths),
        "patch_id": np.array([path.patch + 1 for path in paths], dtype=np.int64),
        "kind": [path.kind for path in paths],
        "buildings": np.array([len(path.buildings) for path in paths], dtype=np.int64),
        "length_m": np.array([path.line.length for path in paths], dtype=float),
        "turns": np.array([path.turns for path in paths], dtype=np.int64),
        "width_m": np.full(len(paths), rules.path_m),
        "exit": np.array([path.exit is not None for path in paths], dtype=bool),
        "geometry": [path.line for path in paths],
    }


def corridor_rows(layout: Layout) -> dict[str, Any]:
    """Give the columns of the corridors."""
    corridors = layout.zone.corridors
    return {
        "corridor_id": np.arange(1, len(corridors) + 1),
        "site_id": [layout.zone.site_id] * len(corridors),
        "level": np.array([corridor.level for corridor in corridors], dtype=np.int64),
        "name": [corridor.name for corridor in corridors],
        "width_m": np.array([corridor.width_m for corridor in corridors], dtype=float),
        "length_m": np.array([corridor.line.length for corridor in corridors], dtype=float),
        "edge": np.array([corridor.edge for corridor in corridors], dtype=bool),
        "geometry": [corridor.line for corridor in corridors],
    }


def parking_rows(layout: Layout) -> dict[str, Any]:
    """Give the columns of parking."""
    rows = layout.details.parking
    return {
        "parking_id": np.arange(1, len(rows) + 1),
        "site_id": [layout.zone.site_id] * len(rows),
        "places": np.array(layout.details.places, dtype=np.int64),
        "area_m2": np.array([row.area for row in rows], dtype=float),
        "geometry": rows,
    }


def green_rows(layout: Layout) -> dict[str, Any]:
    """Give the columns of green."""
    plots = layout.details.green
    return {
        "green_id": np.arange(1, len(plots) + 1),
        "site_id": [layout.zone.site_id] * len(plots),
        "area_m2": np.array([plot.area for plot in plots], dtype=float),
        "geometry": plots,
    }


def tree_rows(layout: Layout) -> dict[str, Any]:
    """Give the columns of trees."""
    trees = layout.details.trees
    return {
        "tree_id": np.arange(1, len(trees) + 1),
        "site_id": [layout.zone.site_id] * len(trees),
        "beside": list(layout.details.tree_of),
        "geometry": shapely.points(trees),
    }


def patch_rows(layout: Layout) -> dict[str, Any]:
    """Give the columns of patches."""
    patches, placed = layout.zone.patches, layout.placements
    area = np.array([patch.polygon.area for patch in patches], dtype=float)
    floor = np.array([t.floor_area_m2 for t in layout.types], dtype=float)[placed.type]
    ground = np.array([t.footprint_m2 for t in layout.types], dtype=float)[placed.type]
    count = len(patches)
    return {
        "patch_id": np.arange(1, count + 1),
        "site_id": [layout.zone.site_id] * count,
        "feature": [None if p.feature is None else str(p.feature) for p in patches],
        "residences": [BUILDING_PATTERNS[p.residences] for p in patches],
        "facilities": [BUILDING_PATTERNS[p.facilities] for p in patches],
        "paths": [PATH_PATTERNS[p.paths] for p in patches],
        "area_m2": area,
        "buildings": np.bincount(placed.patch, minlength=count),
        "far": np.bincount(placed.patch, weights=floor, minlength=count) / area,
        "density": np.bincount(placed.patch, weights=ground, minlength=count) / area,
        "geometry": [patch.polygon for patch in patches],
    }


def problem_rows(layout: Layout) -> dict[str, Any]:
    """Give the columns of what could not be done."""
    findings = layout.findings
    return {
        "layer": [layout.zone.name] * len(findings),
        "feature": [str(layout.zone.feature)] * len(findings),
        "problem": [finding.problem for finding in findings],
        "action": [finding.action for finding in findings],
        "severity": [finding.severity for finding in findings],
        "geometry": [finding.place for finding in findings],
    }
