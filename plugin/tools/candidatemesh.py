"""The candidate mesh: quads whose edges may become streets."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from qgis.core import QgsProcessingParameterDefinition

from .. import fields, parameters
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool
from . import siteinputs


class CandidateMesh(Tool):
    """Fills every site of a layer with near squares."""

    about = About(
        name="candidatemesh",
        title="Candidate mesh",
        group="site",
        tags=("mesh", "quads", "grid", "polysquare", "site", "platwright"),
        summary="Fills a site with near squares whose edges may become streets.",
        paragraphs=(
            "Corners of the site stay vertices, holes are respected, and long lines run through "
            "the site like streets. Design streets makes this mesh by itself; make one here to "
            "look at it, or to edit its edges and hand them to Design streets.",
            "Where an edge lies on the edge of the site it has the true shape of it.",
        ),
    )
    layers: ClassVar = {
        "EDGES": fields.EDGES,
        "VERTICES": fields.VERTICES,
        "FACES": fields.FACES,
    }
    numbers: ClassVar = {
        "FACE_COUNT": "Number of faces",
        "MEAN_EDGE_LENGTH": "Mean edge length (m)",
        "REGULAR_SHARE": "Share of inner vertices where four edges meet",
        "WORST_QUALITY": "Worst scaled Jacobian of a face (1 is a square)",
    }

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the site, what pulls at the mesh, and its size."""
        yield siteinputs.site()
        yield siteinputs.access_points(advanced=False)
        yield siteinputs.obstacles()
        yield parameters.number(
            "EDGE_LENGTH",
            "Edge length",
            "Length that the edges should have; Design streets takes the block width.",
            unit="m",
            default=72.0,
            minimum=1.0,
            maximum=5000.0,
        )
        yield parameters.number(
            "DIRECTION",
            "Guide direction",
            "Direction of the mesh lines, counter-clockwise from east. Empty: that along which "
            "most of the edge of the site runs.",
            unit="degrees",
            minimum=-360.0,
            maximum=360.0,
            advanced=True,
        )

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Mesh every site and collect the layers."""
        from ...algorithms.mesh import mesh_layers, quadrangulate, quality

        prepared = siteinputs.prepared_sites(request, progress.part(0.0, 0.1))
        edge_length = request.number("EDGE_LENGTH")
        direction = request.optional_number("DIRECTION")
        parts: dict[str, list[Any]] = {kind.key: [] for kind in self.layers.values()}
        reports = []
        for at, site in enumerate(prepared.sites):
            share = 0.1 + 0.9 * at / len(prepared.sites)
            own = progress.part(share, share + 0.9 / len(prepared.sites))
            own.stage(f"Meshing {site.name}", 0.0)
            mesh = quadrangulate(
                site.polygon,
                edge_length,
                attract_points=site.access_xy,
                guide_direction=direction,
                progress=own,
            )
            reports.append(quality(mesh, site.polygon))
            found = mesh_layers(mesh, site.crs, site.source_crs)
            found["edges"]["blocked"] = _blocked(found["edges"], site)
            for key, frames in parts.items():
                frames.append(found[key].assign(site_id=site.site_id))
        return Result(
            crs=request.crs("INPUT"),
            layers={key: _joined(parts[kind.key]) for key, kind in self.layers.items()},
            numbers=_numbers(reports, edge_length),
            specification=to_json({"edge_length": edge_length, "direction": direction}),
        )


def _blocked(edges: Any, site: Any) -> Any:
    """Tell which edges run over an obstacle for more than a metre."""
    lines = edges.geometry.to_crs(site.crs)
    return lines.intersection(site.obstacle_union).length > 1.0


def _joined(frames: list[Any]) -> Any:
    """Return the layers of all sites as one."""
    import pandas

    return pandas.concat(frames, ignore_index=True)


def _numbers(reports: list[Any], edge_length: float) -> dict[str, float]:
    """Return the figures of all meshes together."""
    faces = sum(report.quads for report in reports)
    edges = sum(report.edges for report in reports)
    return {
        "FACE_COUNT": faces,
        "MEAN_EDGE_LENGTH": edge_length
        * sum(report.edges * report.mean_edge_ratio for report in reports)
        / edges,
        "REGULAR_SHARE": sum(r.quads * r.inner_valence_4 for r in reports) / faces,
        "WORST_QUALITY": min(report.min_scaled_jacobian for report in reports),
    }
