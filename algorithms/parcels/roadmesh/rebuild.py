"""A street mesh from streets that are there already, wherever they come from."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import shapely
from shapely.geometry import LineString, MultiLineString, Polygon

from ...errors import InputError
from .begin import GivenStreet, Ground, begin_mesh
from .mesh import StreetMesh


def mesh_of_layers(
    site: Polygon,
    streets: Sequence[LineString],
    widths: Sequence[float],
    frontage: MultiLineString | None = None,
    *,
    centre_lines: MultiLineString | None = None,
    outer_width: float = 15.0,
    fixed: Collection[int] = (),
    names: Sequence[str] = (),
) -> tuple[StreetMesh, list[tuple[shapely.Point, str]]]:
    """Make a street mesh of a site and the centre lines of its streets.

    Streets are noded where they cross; ends that stop short are drawn on to the street or the
    edge of the site that lies ahead, if there is one within 40 m. What then still ends in the
    open bounds no region: it is left out, and told.

    Parameters
    ----------
    site
        The site, with holes for what is not to be built on; metres.
    streets
        Centre lines, metres; one for each piece between junctions, or longer ones.
    widths
        Width of each between its property lines, metres.
    frontage
        Parts of the site's rings along existing streets; None for the whole outer ring.
    centre_lines, outer_width
        Centre lines of these streets where the site reaches to them, and their width; metres.
    fixed
        Indices of the streets that must stay as they are; the others may be moved.
    names
        Names of the streets, as far as they have any.

    Returns
    -------
    mesh
        Its street numbers are the indices of `streets`. The site's edge is fixed.
    problems
        Places and what could not be used there.

    Raises
    ------
    InputError
        If there are not as many widths as streets, a width is not greater than 0, or `fixed`
        names a street that is not there.
    """
    if len(widths) != len(streets):
        raise InputError(
            f"There are {len(streets)} streets but {len(widths)} widths.",
            "Give one width for each street.",
        )
    for k, width in enumerate(widths):
        if not width > 0:
            raise InputError(
                f"Street {k} is {width:g} m wide.", "Give a width greater than 0.", feature=k
            )
    unknown = sorted(k for k in fixed if not 0 <= k < len(streets))
    if unknown:
        raise InputError(
            f"Street {unknown[0]} is to stay, but there are only {len(streets)} streets.",
            "Give numbers of streets, from 0.",
        )
    given = [
        GivenStreet(line, float(width), names[k] if k < len(names) else "")
        for k, (line, width) in enumerate(zip(streets, widths))
    ]
    whole = MultiLineString([LineString(site.exterior)])
    mesh, problems = begin_mesh(
        Ground(
            site,
            whole if frontage is None else frontage,
            MultiLineString() if centre_lines is None else centre_lines,
            outer_width,
            given,
        )
    )
    kept = set(fixed)
    for (a, b), edge in list(mesh.edges.items()):
        if edge.street >= 0 and edge.street not in kept and _inside(mesh, a, b):
            mesh.set_edge(a, b, replace(edge, fixed=False))
    return mesh, problems


def _inside(mesh: StreetMesh, a: int, b: int) -> bool:
    """Tell whether an edge has regions on both sides: the edge of the site must not move."""
    return mesh.left_of(a, b) is not None and mesh.left_of(b, a) is not None
