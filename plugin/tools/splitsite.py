"""Streets and parcels of a site together."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterator
from typing import Any, ClassVar

from qgis.core import QgsProcessingParameterDefinition

from .. import deps, fields, parcel_fields
from ..help import About
from ..outputs import Result
from ..progress import FeedbackProgress
from ..record import to_json
from ..request import Request
from ..tool import Tool
from . import parcelinputs, siteinputs, splitinputs, templateinputs
from .collect import joined


class SplitSite(Tool):
    """Lays out a site: streets where rows of parcels fit between them, and the parcels."""

    about = About(
        name="splitsite",
        title="Streets and parcels",
        group="parcels",
        tags=(
            "streets", "parcels", "lots", "subdivision", "layout", "neighbourhood", "streamlines",
            "cross field", "urban pattern", "variations", "site planning", "platwright",
        ),
        summary="Lays out a site at once: streets that leave room for whole rows of parcels, and "
        "the parcels along them, in as many variations as you like, the best first.",
        paragraphs=(
            "The site is split along the lines of a cross field, which follow its edges and meet "
            "at right angles, until two rows of parcels fit between the streets. Poor places are "
            "then split otherwise, and the parcels are improved together. Every parcel has a "
            "street; land that suits none becomes green, and the layer of problems says why.",
            "Existing roads along the edge give access from outside, and streets continue those "
            "that arrive; edges without a road give none. Without a layer of roads the whole edge "
            "counts as a street. Key areas (lakes, parks, schools) and main streets are fixed "
            "first; parcels back on to lakes and parks, and a street runs around schools.",
            "All variations are ranked by one score; as many as you keep are in the layers, the "
            "field variation tells them apart, and the table of variations compares them. Where "
            "there are several, the best is shown and the others wait for a tick in the list of "
            "layers.",
            "To see why streets lie where they lie, ask for the cross field and the candidate "
            "streets: they show what the first split of each site had to choose from.",
        ),
        picture="A site laid out: streets, parcels, and green where no parcel suits.",
        references=("UP",),
    )  # fmt: skip
    layers: ClassVar = {
        "STREETS": parcel_fields.LAYOUT_STREETS,
        "PARCELS": parcel_fields.LAYOUT_PARCELS,
        "BLOCKS": parcel_fields.LAYOUT_BLOCKS,
        "PROBLEMS": fields.PROBLEMS,
        "VARIATION_TABLE": parcel_fields.VARIATIONS,
        "CROSS_FIELD": parcel_fields.CROSS_FIELD,
        "CANDIDATES": parcel_fields.CANDIDATES,
    }
    numbers: ClassVar = {
        "PARCEL_COUNT": "Parcels of the best variation",
        "MEAN_P_ANGLE": "Mean deviation of their corners from 90 degrees (degrees)",
        "MEAN_P_AREA": "Mean of smallest rectangle around / area",
        "UNDESIRABLE": "Undesirable parcels (%)",
        "GREEN": "Land that became green or court (%)",
        "STREET_SHARE": "Land that became street (%)",
        "STREET_LENGTH": "Length of the new streets (m)",
        "SCORE": "Score of the best variation, smaller is better",
        "MADE": "Number of variations that were made",
        "SECONDS": "Time of the run (s)",
    }
    needs = deps.LAYERS

    def inputs(self) -> Iterator[QgsProcessingParameterDefinition]:
        """Yield the site, what is fixed on it, and what is asked of parcels and streets."""
        yield siteinputs.site()
        yield siteinputs.roads()
        yield splitinputs.key_elements()
        yield templateinputs.source()
        yield from splitinputs.sizes()
        yield from splitinputs.variations()
        yield from splitinputs.streets()
        yield siteinputs.obstacles(advanced=True)
        yield from templateinputs.details()
        yield from parcelinputs.sizes()
        yield from splitinputs.deep()
        yield from siteinputs.snapping(advanced=True)

    def check(self, request: Request) -> None:
        """Check numbers that must fit together."""
        splitinputs.rules_of(request)
        splitinputs.split_of(request)

    def compute(self, request: Request, progress: FeedbackProgress) -> Result:
        """Prepare the sites, lay all of them out and collect the layers."""
        from ...algorithms.parcels.split import lay_out_sites, site_layers

        begun = time.monotonic()
        rules, split = splitinputs.rules_of(request), splitinputs.split_of(request)
        prepared = siteinputs.prepared_sites(request, progress.part(0.0, 0.1))
        elements = self._elements(request, split, progress.part(0.1, 0.15))
        done = lay_out_sites(
            prepared.sites,
            rules,
            split,
            elements=elements,
            count=request.integer("VARIATIONS"),
            seed=request.integer("SEED"),
            progress=progress.part(0.15, 0.95),
        )
        made = max(len(own.variations) for own in done)
        kept = [
            dataclasses.replace(own, variations=own.variations[: request.integer("KEEP")])
            for own in done
        ]
        progress.stage("Collecting the layers", 0.96)
        source = prepared.sites[0].source_crs
        found = site_layers(kept, source, turning=split.turning_radius)
        table = site_layers(done, source)["variations"] if made > 1 else found["variations"]
        _tell(table, progress)
        found |= self._why(request, done, rules, split, elements, progress.part(0.97, 1.0))
        return Result(
            crs=request.crs("INPUT"),
            layers={
                "STREETS": found["streets"],
                "PARCELS": found["parcels"],
                "BLOCKS": found["parcel_blocks"],
                "PROBLEMS": joined(prepared.problems, found["problems"]),
                "VARIATION_TABLE": table,
                "CROSS_FIELD": found.get("cross_field"),
                "CANDIDATES": found.get("candidates"),
            },
            numbers={
                **_figures(found["variations"].iloc[0]),
                "MADE": made,
                "SECONDS": time.monotonic() - begun,
            },
            specification=to_json(
                {
                    "parcels": dataclasses.asdict(rules),
                    "streets": dataclasses.asdict(dataclasses.replace(split, templates=None)),
                    "templates": templateinputs.record(split.templates),
                }
            ),
            keep=True,
        )

    def _why(
        self,
        request: Request,
        done: Any,
        rules: Any,
        split: Any,
        elements: Any,
        progress: FeedbackProgress,
    ) -> dict[str, Any]:
        """Return field and candidates of the first splits, if the planner asks for them."""
        from ...algorithms.parcels.split import first_splits

        if not (request.has("CROSS_FIELD") or request.has("CANDIDATES")):
            return {}
        source = done[0].site.source_crs
        return dict(first_splits(done, rules, split, source, elements=elements, progress=progress))

    def _elements(
        self, request: Request, split: Any, progress: FeedbackProgress
    ) -> Callable[[Any], Any]:
        """Return a function that gives what is fixed on a site, in its working CRS."""
        from ...algorithms.parcels.split import Elements, read_key_areas, read_key_streets

        frames = {
            key: request.frame(key, progress) for key in ("KEY_ELEMENTS", "KEY_STREETS", "GUIDES")
        }

        def of_site(site: Any) -> Any:
            guides = read_key_streets(frames["GUIDES"], site.crs, request.name("GUIDES"), 1.0)
            return Elements(
                read_key_areas(frames["KEY_ELEMENTS"], site.crs, request.name("KEY_ELEMENTS")),
                read_key_streets(
                    frames["KEY_STREETS"], site.crs, request.name("KEY_STREETS"),
                    split.street_width,
                ),
                [guide.line for guide in guides],
            )  # fmt: skip

        return of_site


def _tell(table: Any, progress: FeedbackProgress) -> None:
    """Tell how each variation came out, the best first."""
    for row in table.itertuples():
        progress.info(
            f"Variation {row.variation}: {row.parcels} parcels, p_angle {row.p_angle:.1f}, "
            f"{row.undesirable_pct:.1f} % undesirable, {row.green_pct:.1f} % green, "
            f"{row.street_pct:.1f} % streets, score {row.score:.1f}."
        )
    if not table["parcels"].any():
        progress.warn(
            "No parcel fits. The site may be smaller than a parcel, or no road runs along its "
            "edge: see the layer of problems, give smaller parcels, a larger snap distance, or "
            "no layer of roads, so that the whole edge counts as a street."
        )


def _figures(best: Any) -> dict[str, float]:
    """Return the numbers of a row of the table of variations."""
    return {
        "PARCEL_COUNT": int(best["parcels"]),
        "MEAN_P_ANGLE": float(best["p_angle"]),
        "MEAN_P_AREA": float(best["p_area"]),
        "UNDESIRABLE": float(best["undesirable_pct"]),
        "GREEN": float(best["green_pct"]),
        "STREET_SHARE": float(best["street_pct"]),
        "STREET_LENGTH": float(best["street_m"]),
        "SCORE": float(best["score"]),
    }
