"""Many designs of the same sites, side by side."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Optional

import geopandas as gpd
import numpy as np
import pandas as pd

from ..errors import InputError
from ..progress import Progress, Silent
from ..site.types import PreparedSites, Site
from ..streets import Wishes
from ..tasks import Executor, Outcome, run_tasks
from .design import FIGURES, design
from .front import pareto_front
from .parameters import PARAMETERS, SINKS, Run, told

#: What the front is looked for in, unless something else is asked.
COLUMNS = ("length_m", "mean_distance_m")
#: Work of each design, see `Specification.effort`: then no clock has a say in it.
EFFORT = 20.0
#: Places where the planner names something, see `design.design`.
_PLACES = ("SINKS", "REQUIRED", "FORBIDDEN")


@dataclass(frozen=True, eq=False)
class Explored:
    """One run and what came of it.

    Attributes
    ----------
    run
        What was asked.
    state, reason
        "done"; "failed" and why; or "cancelled".
    figures
        By the keys of `FIGURES`; empty where there is no design.
    layers
        "streets", "junctions", "blocks" and "problems" as of a street plan, and "violations" as
        the independent check finds them (`ValidationReport.problems`), unless it was cancelled;
        empty where there is no design.
    pareto
        Whether no other design is better in every way.
    hurried
        Whether the time limit was reached, so that another try may give another design.
    """

    run: Run
    state: str
    reason: str = ""
    figures: Mapping[str, float] = dataclasses.field(default_factory=dict)
    layers: Mapping[str, gpd.GeoDataFrame] = dataclasses.field(default_factory=dict)
    pareto: bool = False
    hurried: bool = False


@dataclass(frozen=True, eq=False)
class Exploration:
    """All runs, in their order.

    Attributes
    ----------
    prepared
        The sites.
    designs
        One for each run.
    columns
        The figures in which the front was looked for.
    """

    prepared: PreparedSites
    designs: tuple[Explored, ...]
    columns: tuple[str, ...] = COLUMNS

    @property
    def done(self) -> list[Explored]:
        """Those with a design."""
        return [one for one in self.designs if one.state == "done"]

    @property
    def varied(self) -> list[str]:
        """What differs between the runs, by the field of the specification."""
        keys = dict.fromkeys(key for one in self.designs for key in one.run.values)
        return [
            key
            for key in keys
            if len({repr(_value(one.run, key)) for one in self.designs}) > 1
            or len(self.designs) == 1
        ]

    def table(self) -> pd.DataFrame:
        """Return a row for each run.

        Columns: design, name, one for each parameter that differs, those of `FIGURES`, pareto,
        state, reason, hurried, and parameters (what was asked otherwise than usual, as JSON).
        """
        varied = self.varied
        rows = []
        for one in self.designs:
            figures = {key: one.figures.get(key, math.nan) for key in FIGURES}
            own = {key: _value(one.run, key) for key in varied}
            shown = {k: _plain(v) for k, v in one.run.values.items()}
            end = (one.pareto, one.state, one.reason, one.hurried, json.dumps(shown))
            rows.append(
                {"design": one.run.number, "name": one.run.name, **own, **figures}
                | dict(zip(("pareto", "state", "reason", "hurried", "parameters"), end))
            )
        return pd.DataFrame(rows)

    def layer(self, key: str) -> gpd.GeoDataFrame:
        """Return a layer of all designs as one; "design" and "design_name" tell them apart."""
        crs = self.prepared.sites[0].source_crs
        parts = [
            one.layers[key].assign(
                design=one.run.number, design_name=one.run.name, pareto=one.pareto
            )
            for one in self.done
            if key in one.layers
        ]
        full = [part for part in parts if len(part)]
        if not full:
            return parts[0] if parts else gpd.GeoDataFrame({"design": []}, geometry=[], crs=crs)
        # columns that are empty in some designs must not decide what kind the others are
        plain = [part.drop(columns="geometry").astype(object) for part in full]
        rows = pd.concat(plain, ignore_index=True).infer_objects()
        shapes = np.concatenate([part.geometry.array for part in full])
        return gpd.GeoDataFrame(rows, geometry=shapes, crs=full[0].crs)


def explore(
    prepared: PreparedSites,
    runs: Sequence[Run],
    *,
    wishes: Optional[Callable[[Site, Run], Wishes]] = None,
    given: Optional[Callable[[Run], Mapping[str, Any]]] = None,
    columns: Sequence[str] = COLUMNS,
    executor: Optional[Executor] = None,
    progress: Optional[Progress] = None,
) -> Exploration:
    """Design the same sites as each run asks, and compare.

    A run whose specification has no `effort` gets `EFFORT`: its design then depends neither on how
    busy the machine is nor on where it is made, as long as its time limit is not reached first.

    Parameters
    ----------
    prepared
        The sites.
    runs
        What is asked, see `grid` and `runs_of`.
    wishes
        Gives the places that the planner names for a site and a run.
    given
        Gives the layers SINKS, REQUIRED and FORBIDDEN that the design of a run is checked against.
    columns
        The figures in which the Pareto front is looked for; less is better in each.
    executor
        Where the work is done, see `run_tasks`; None for here, one after the other.
    progress
        Told of stages; asked whether to stop. What is done by then is kept.

    Returns
    -------
    Exploration

    Raises
    ------
    InputError
        There is no site or no run, or no such figure.
    """
    unknown = [name for name in columns if name not in FIGURES]
    if unknown or not columns:
        raise InputError(f"No such figure: {', '.join(unknown)}.", f"Choose from {list(FIGURES)}.")
    if not prepared.sites or not runs:
        raise InputError("There is nothing to design.", "Give at least one site and one run.")
    progress = progress or Silent()
    outcomes = run_tasks(
        design,
        [_item(prepared, run, wishes, given) for run in runs],
        executor,
        progress,
        labels=[f"Design {run.number}" for run in runs],
    )
    found = [_explored(run, outcome) for run, outcome in zip(runs, outcomes)]
    for one in (one for one in found if one.hurried):
        progress.warn(
            f"Design {one.run.number} reached its time limit: on another machine it may be another."
        )
    figures = [[one.figures.get(name, math.nan) for name in columns] for one in found]
    front = pareto_front(np.array(figures, dtype=float))
    designs = [dataclasses.replace(one, pareto=bool(on)) for one, on in zip(found, front)]
    return Exploration(prepared, tuple(designs), tuple(columns))


def _item(
    prepared: PreparedSites,
    run: Run,
    wishes: Optional[Callable[[Site, Run], Wishes]],
    given: Optional[Callable[[Run], Mapping[str, Any]]],
) -> dict[str, Any]:
    asked = run.specification
    places = given(run) if given is not None else {}
    return {
        "prepared": prepared,
        "specification": dataclasses.replace(asked, effort=asked.effort or EFFORT),
        "wishes": {
            site.site_id: wishes(site, run) if wishes is not None else Wishes()
            for site in prepared.sites
        },
        "given": {key: places.get(key) for key in _PLACES},
    }


def _explored(run: Run, outcome: Outcome) -> Explored:
    if not outcome.done:
        return Explored(run, outcome.state, outcome.reason)
    figures, layers = outcome.value["figures"], outcome.value["layers"]
    return Explored(run, "done", "", figures, layers, hurried=outcome.value["by_clock"])


def table_of_axes(exploration: Exploration) -> gpd.GeoDataFrame:
    """Return `Exploration.table` with the same columns whatever was varied.

    Returns
    -------
    geopandas.GeoDataFrame
        Without shapes. In place of a column for each parameter: parameter_x, value_x, parameter_y,
        value_y, as texts, of the first two that differ.
    """
    table, varied = exploration.table(), exploration.varied
    for letter, key in zip("xy", [*varied, "", ""]):
        values = [told({key: _value(one.run, key)}) if key else "" for one in exploration.designs]
        name = (PARAMETERS[key].label if key in PARAMETERS else key).partition(",")[0]
        table[f"parameter_{letter}"] = name
        table[f"value_{letter}"] = [text.removeprefix(f"{name} ") for text in values]
    shapes = gpd.GeoSeries([None] * len(table), crs=exploration.prepared.sites[0].source_crs)
    return gpd.GeoDataFrame(table.drop(columns=varied), geometry=shapes)


def _value(run: Run, key: str) -> Any:
    """Return what a run asks of a parameter, also where it is as usual."""
    return run.sinks if key == SINKS else getattr(run.specification, key)


def _plain(value: Any) -> Any:
    """Return a value as JSON has it."""
    return "forbid" if isinstance(value, float) and math.isinf(value) else value


def label(run: Run, varied: Sequence[str]) -> str:
    """Return what a picture calls a run: its name, or what it asks where that is no name."""
    own = {key: _value(run, key) for key in varied}
    return run.name if run.name != told(run.values) or not own else told(own)
