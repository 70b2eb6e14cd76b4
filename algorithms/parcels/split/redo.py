"""Part of a layout in layers made anew; all other features stay as they are (UP section 3)."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, cast, get_args

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from shapely.geometry import LineString

from ...errors import InputError
from ...progress import Progress, Silent
from ..fill.result import FillProblem
from ..land import Place
from ..layers import parcel_layers
from ..roadmesh import street_layer
from ..rules import ParcelRules
from ..types import Block, Plot, PlotUse
from .again import blocks_again, parcels_again, streets_again
from .chosen import Around, Chosen, covered, read_chosen
from .connectors import with_connectors
from .layout import Layout
from .rows import Rows, column
from .rules import SplitRules

__all__ = ["Around", "Asked", "Redone", "covered", "redo_parcels"]

#: What may be done with the chosen parcels.
Action = Literal["parcels", "streets", "merge", "use"]
#: What the field `change` says of features.
KEPT, NEW, MERGED, ASSIGNED = "kept", "new", "merged", "use"
#: What new streets have of the chosen parcels.
OF_CHOSEN = ("site_id", "variation")
#: Streets this near to each other touch, in units of the layer.
AT = 1e-6
#: Distances that are told of the streets of a whole site.
OF_SITE = ("dist_to_sink_m", "dist_start_m", "dist_end_m", "direction")


@dataclass(frozen=True)
class Asked:
    """What is to become of the chosen parcels.

    Attributes
    ----------
    action
        "parcels": cut anew; "streets": the streets between them are given up and laid anew,
        too; "merge": those that touch become one; "use": they get another use.
    rules, split
        What is asked of new parcels and streets.
    use
        Use for "use", and for "merge" where it is not empty.
    seed
        Of whatever is random.
    """

    action: Action = "parcels"
    rules: ParcelRules = ParcelRules()  # noqa: RUF009
    split: SplitRules = SplitRules()  # noqa: RUF009
    use: str = ""
    seed: int = 0

    def __post_init__(self) -> None:
        if self.action not in get_args(Action):
            raise InputError(
                f"'{self.action}' cannot be done with parcels.",
                f"Choose one of {', '.join(get_args(Action))}.",
            )
        if self.action == "use" and not self.use:
            raise InputError(
                "No use is given to assign.", "Say which, such as park, school or parcel."
            )


@dataclass(frozen=True)
class Redone:
    """A layout of which a part was made anew.

    Attributes
    ----------
    parcels
        All features that stay with their own index, geometry and values; then those that are
        new, with labels above. The columns `land_use`, `note` and `change` are there.
    streets
        Likewise, with the column `change`; None where no layer of streets was given.
    problems
        What a planner should know.
    chosen, made
        Number of features that were chosen, and that are new.
    """

    parcels: gpd.GeoDataFrame
    streets: gpd.GeoDataFrame | None
    problems: gpd.GeoDataFrame
    chosen: int
    made: int


def redo_parcels(
    parcels: gpd.GeoDataFrame,
    chosen: Sequence[Hashable],
    asked: Asked,
    around: Around | None = None,
    *,
    progress: Progress | None = None,
) -> Redone:
    """Make a part of a layout anew; everything else stays to the last bit.

    Parameters
    ----------
    parcels
        The layout: polygons in any CRS, each with a label of its own (an integer) as the index.
        The columns `land_use`, `parcel_id`, `block_id`, `site_id`, `feature` and `variation`
        are heeded where there are such.
    chosen
        Labels of the features to make anew.
    asked, around
        What is to become of them, and what lies around.
    progress
        Told of the work, asked for cancellation.

    Raises
    ------
    InputError
        If nothing usable is chosen, they are of several variations, streets are to be laid
        without a layer of streets, or a layer has no CRS.
    CancelledError
        If the caller cancels.
    """
    around = around or Around()
    told = progress or Silent()
    if asked.action == "streets" and around.streets is None:
        raise InputError(
            "Streets are to be laid anew, but there is no layer of streets.",
            "Give the streets of the layout.",
        )
    told.stage("Reading the layout", 0.0)
    read = read_chosen(
        parcels, chosen, around, lanes=asked.action == "use", width=asked.split.street_width
    )
    work = _Work(read, asked, around)
    if asked.action == "use":
        return work.assigned()
    if asked.action == "merge":
        return work.merged()
    if asked.action == "streets":
        return work.with_streets(told)
    return work.cut_anew(told)


class _Work:
    """One run: what was read, and what is made of it."""

    def __init__(self, read: Chosen, asked: Asked, around: Around) -> None:
        self.read, self.asked, self.around = read, asked, around
        self.frame, self.crs = read.frame, read.crs
        self.chosen, self.existing = read.chosen, read.existing
        self.problems = read.problems
        self.rows = Rows(read.frame)

    # What becomes of the chosen parcels.

    def cut_anew(self, progress: Progress) -> Redone:
        """Cut them anew."""
        blocks, filled = parcels_again(
            self.existing, self.chosen, self.asked.rules, seed=self.asked.seed, progress=progress
        )
        self._tell(filled.problems)
        return self._finished(self._layer(blocks, filled.plots), NEW)

    def with_streets(self, progress: Progress) -> Redone:
        """Lay the streets between them anew, too."""
        asked = self.asked
        done = streets_again(
            self.existing, self.chosen, asked.rules, asked.split, seed=asked.seed,
            progress=progress,
        )  # fmt: skip
        blocks = [block for layout in done.layouts for block in layout.blocks]
        blocks = [replace(block, block_id=k) for k, block in enumerate(blocks, start=1)]
        plots = [plot for layout in done.layouts for plot in layout.plots]
        for remark in (remark for layout in done.layouts for remark in layout.remarks):
            self.problems.add(
                self.around.parcel_layer, "", remark.problem, remark.action, remark.severity,
                remark.place, self.crs,
            )  # fmt: skip
        made = self._finished(self._layer(blocks, plots), NEW)
        gone = {self.read.street_rows[k] for k in done.removed}
        stay = {
            self.read.street_rows[k]
            for k in range(len(self.read.street_rows))
            if k not in done.removed
        }
        return replace(
            made, streets=self._streets_after(gone - stay, done.layouts, done.connectors)
        )

    def merged(self) -> Redone:
        """Make one of those that touch."""
        blocks = blocks_again(self.existing, self.chosen)
        own = [self.read.uses[k] or "parcel" for k in self.chosen]
        use = self.asked.use or max(dict.fromkeys(own), key=own.count)
        plots = [[_plot(block, use)] for block in blocks]
        return self._finished(self._layer(blocks, plots), MERGED)

    def assigned(self) -> Redone:
        """Give them another use; they keep everything else."""
        blocks, plots = [], []
        for number, k in enumerate(self.chosen, start=1):
            parts = blocks_again(self.existing, [k])
            blocks += [replace(part, block_id=number) for part in parts]
            plots += [[_plot(part, self.asked.use)] for part in parts]
        layer = self._layer(blocks, plots)
        first = layer.drop_duplicates("block_id").set_index("block_id")
        labels = [self.frame.index[self.read.near[k]] for k in self.chosen]
        told = first.loc[range(1, len(labels) + 1)].set_axis(labels)
        after = self.rows.changed(told, ("land_use", "p_angle", "p_area", "undesirable", "corner",
                                         "access", "frontage_m", "depth_m", "width_m"))  # fmt: skip
        after["change"] = np.where(after.index.isin(labels), ASSIGNED, KEPT)
        return Redone(after, self._kept_streets(), self._problems(), len(labels), 0)

    def _tell(self, problems: Sequence[FillProblem]) -> None:
        """Take note of what went otherwise than asked."""
        for problem in problems:
            self.problems.add(
                self.around.parcel_layer, "", problem.reason, problem.done, "warning",
                problem.place, self.crs,
            )  # fmt: skip

    def _layer(self, blocks: Sequence[Block], plots: Sequence[Sequence[Plot]]) -> gpd.GeoDataFrame:
        """Give new plots as a layer with all measures."""
        places = [Place(self.crs)] * len(blocks)
        return parcel_layers(blocks, plots, places, self.read.source)["parcels"]

    def _finished(self, layer: gpd.GeoDataFrame, change: str) -> Redone:
        """Put new plots in the place of the chosen ones."""
        gone = [self.frame.index[self.read.near[k]] for k in self.chosen]
        after = self.rows.replaced(gone, layer, self._homes(layer, gone), change)
        return Redone(after, self._kept_streets(), self._problems(), len(gone), len(layer))

    def _homes(self, layer: gpd.GeoDataFrame, gone: Sequence[Hashable]) -> list[Any]:
        """Label of the chosen feature that each new plot lies on."""
        tree = shapely.STRtree(self.read.plots[self.chosen])
        inside = shapely.point_on_surface(layer.geometry.to_crs(self.crs).to_numpy())
        return [gone[k] for k in tree.nearest(inside).tolist()]

    def _kept_streets(self) -> gpd.GeoDataFrame | None:
        """Give the streets, all of which stay."""
        if self.around.streets is None:
            return None
        frame = self.around.streets.copy()
        frame["change"] = KEPT
        return frame

    def _streets_after(
        self, gone: set[int], layouts: Sequence[Layout], connectors: Sequence[LineString]
    ) -> gpd.GeoDataFrame:
        """Put new streets in the place of those that are gone."""
        frame = self.around.streets
        before = cast(gpd.GeoDataFrame, frame)
        made = [_led_on(street_layer(own.mesh, self.crs), connectors) for own in layouts]
        first = int(self.read.near[self.chosen[0]])
        own_turning = self.asked.split.turning_radius
        for part in made:
            part["turning_m"] = part["turning_m"].where(part["turning_m"].isna(), own_turning)
            for name in OF_CHOSEN:
                own = column(self.frame, name)
                part[name] = None if own is None else own.iloc[first]
        joined = gpd.GeoDataFrame(pd.concat(made, ignore_index=True), crs=self.crs)
        for site in self.read.sites:
            # on to the existing roads outside
            joined = with_connectors(joined.to_crs(site.crs), site).to_crs(self.crs)
        joined[list(OF_SITE)] = None
        gone |= _left_over(before, gone)
        labels = [before.index[k] for k in sorted(gone)]
        return Rows(before).replaced(labels, joined.to_crs(before.crs), None, NEW)

    def _problems(self) -> gpd.GeoDataFrame:
        return self.problems.to_frame(self.read.source)


def _left_over(streets: gpd.GeoDataFrame, gone: set[int]) -> set[int]:
    """Find the rows of connectors that lead to none but streets that are gone."""
    status = column(streets, "status")
    if status is None or not gone:
        return set()
    outer = status.astype(str).str.lower().eq("connector").to_numpy()
    shapes = streets.geometry.to_numpy()
    lost = np.isin(np.arange(len(streets)), sorted(gone))
    at_lost = shapely.union_all(shapes[lost & ~outer])
    at_kept = shapely.union_all(shapes[~lost & ~outer])
    own = np.flatnonzero(outer & ~lost)
    near = [shapely.distance(shapes[own], other) < AT for other in (at_lost, at_kept)]
    return set(own[near[0] & ~near[1]].tolist())


def _led_on(frame: gpd.GeoDataFrame, connectors: Sequence[LineString]) -> gpd.GeoDataFrame:
    """Lead new streets on to the centre lines of those that stay."""
    ends = {connector.coords[0]: connector.coords[-1] for connector in connectors}
    shapes = []
    for line in frame.geometry:
        xy = list(line.coords)
        before, after = ends.get(xy[0]), ends.get(xy[-1])
        xy = ([before] if before else []) + xy + ([after] if after else [])
        shapes.append(LineString(xy))
    found = frame.set_geometry(gpd.GeoSeries(shapes, index=frame.index, crs=frame.crs))
    found["length_m"] = shapely.length(np.array(shapes, dtype=object)) if shapes else []
    return found


def _plot(block: Block, use: str) -> Plot:
    """Make one plot of a block, with any use."""
    return Plot(block.polygon, cast(PlotUse, use))
