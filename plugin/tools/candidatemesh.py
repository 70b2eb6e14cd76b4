"""The candidate mesh: quads whose edges may become streets."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from qgis.core import QgsProcessingParameterDefinition

from .. import deps, fields, parameters
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
            "look at it, or to edit its edges and hand them to Design streets. Every face needs "
            "four corners, so do not delete single edges: to bar one, give Design streets a line "
            "along it as a forbidden place.",
            "Where existing streets arrive (the layer of access points, as from Prepare site) a "
            "mesh line begins, so that the new streets can continue them.",
            "Where an edge lies on the edge of the site it has the true shape of it.",
        ),
        picture="A site with its access points; the mesh, whose lines begin where streets arrive.",
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
    needs = (*deps.LAYERS, *deps.SOLVERS)

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the site, what pulls at the mesh, and its size."""
        yield siteinputs.site()
        yield siteinputs.access_points(advanced=False)
        yield siteinputs.obstacles()
        yield parameters.number(
            "BLOCK_WIDTH",
            "Block width",
            "Wished width of the blocks. Cells are about as wide: of several sizes the one that "
            "fits the site and its access points best, as in Design streets.",
            unit="m",
            default=72.0,
            minimum=10.0,
            maximum=2000.0,
        )
        yield parameters.number(
            "EDGE_LENGTH",
            "Edge length",
            "Length that the edges should have, instead of the size that fits best. Empty: as the "
            "block width implies.",
            unit="m",
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
        from ...algorithms.mesh import mesh_layers, quality

        prepared = siteinputs.prepared_sites(request, progress.part(0.0, 0.1))
        wished = {key: request.optional_number(key) for key in ("EDGE_LENGTH", "DIRECTION")}
        wished["BLOCK_WIDTH"] = request.number("BLOCK_WIDTH")
        parts: dict[str, list[Any]] = {kind.key: [] for kind in self.layers.values()}
        reports = []
        lengths = []
        for at, site in enumerate(prepared.sites):
            share = 0.1 + 0.9 * at / len(prepared.sites)
            own = progress.part(share, share + 0.9 / len(prepared.sites))
            own.stage(f"Meshing {site.name}", 0.0)
            mesh = _mesh(
                site, wished["BLOCK_WIDTH"], wished["EDGE_LENGTH"], wished["DIRECTION"], own
            )
            reports.append(quality(mesh, site.polygon))
            lengths.append(mesh.edge_length)
            found = mesh_layers(mesh, site.crs, site.source_crs)
            found["edges"]["blocked"] = _blocked(found["edges"], site)
            for key, frames in parts.items():
                frames.append(found[key].assign(site_id=site.site_id))
        return Result(
            crs=request.crs("INPUT"),
            layers={key: _joined(parts[kind.key]) for key, kind in self.layers.items()},
            numbers=_numbers(reports, lengths),
            specification=to_json({key.lower(): value for key, value in wished.items()}),
        )


def _mesh(
    site: Any,
    block_width: float,
    edge_length: float | None,
    direction: float | None,
    progress: FeedbackProgress,
) -> Any:
    """Return the mesh that Design streets would make, or one of a size or direction asked for."""
    from ...algorithms.mesh import quadrangulate
    from ...algorithms.network.specification import Specification
    from ...algorithms.streets import arriving_streets, site_mesh
    from ...algorithms.streets.plan import ARRIVAL_SPACING

    arrivals = arriving_streets(site, ARRIVAL_SPACING * block_width)
    if direction is None:
        asked = Specification(
            block_width=block_width, block_length=2 * block_width, edge_length=edge_length
        )
        return site_mesh(site, asked, arrivals, progress)
    return quadrangulate(
        site.polygon,
        edge_length or block_width,
        attract_points=[point.xy for point in arrivals],
        guide_direction=direction,
        progress=progress,
    )


def _blocked(edges: Any, site: Any) -> Any:
    """Tell which edges run over an obstacle for more than a metre."""
    lines = edges.geometry.to_crs(site.crs)
    return lines.intersection(site.obstacle_union).length > 1.0


def _joined(frames: list[Any]) -> Any:
    """Return the layers of all sites as one."""
    import pandas

    return pandas.concat(frames, ignore_index=True)


def _numbers(reports: list[Any], lengths: list[float]) -> dict[str, float]:
    """Return the figures of all meshes together."""
    faces = sum(report.quads for report in reports)
    edges = sum(report.edges for report in reports)
    return {
        "FACE_COUNT": faces,
        "MEAN_EDGE_LENGTH": sum(
            length * report.edges * report.mean_edge_ratio
            for length, report in zip(lengths, reports)
        )
        / edges,
        "REGULAR_SHARE": sum(r.quads * r.inner_valence_4 for r in reports) / faces,
        "WORST_QUALITY": min(report.min_scaled_jacobian for report in reports),
    }
