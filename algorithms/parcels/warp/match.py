"""Templates that fit blocks, best first (UP section 4.1)."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString

from ...errors import CancelledError
from ...measure.parcel_shape import corner_deviation, rectangle_ratio, undesirable
from ...progress import Progress, Silent
from ..rules import ParcelRules
from ..templates.types import FURNITURE, LAND, Template, TemplateLibrary
from ..types import Block, Plot, PlotUse
from .assign import Kit, all_ways, kits
from .batch import ITERATIONS, Batch, Task, Warped
from .nested import conform, inner_block
from .regions import outline
from .tiles import Tiles, centre_lines, shared_edges, tile

#: Corners of faces in one batch: its arrays stay in the cache of a processor.
BATCH = 12000
#: Bounds of the factor that makes distances of small and large parcels comparable.
PROPORTION = (0.7, 2.0)
#: Energies above this part of the side of a square parcel are no match.
FARTHEST = 0.2
#: What sides that are longer or shorter than drawn add to it: metres, times the mean logarithm of
#: the factor (parcels may be wider than asked for at no cost otherwise).
STRETCH = 2.0
#: Labels that no other template fills.
OWN = (*LAND, *FURNITURE)
#: What the share of undesirable parcels adds to the energy (metres).
BAD = 3.0
#: Parcels may have this part of the width wished for as frontage if that is less than the rules'.
FRONT = 0.7
USES: dict[str, PlotUse] = {
    "parcel": "parcel",
    "green": "green",
    "court": "court",
    "lane": "lane",
    "street": "street",
    "building": "parcel",
    "parking": "court",
}


@dataclass(frozen=True)
class Match:
    """A template warped into a block.

    Attributes
    ----------
    template
        Its name.
    energy
        How badly it fits, metres: the distance, times the square root of the area wished for
        over that of its parcels; 2 m times the mean stretch of the sides (logarithm of the
        factor); and 3 m times the share of parcels that are undesirable or whose area is out of
        bounds.
    plots
        They tile the block.
    streets
        Centre lines of the streets and lanes inside, metres.
    distance
        Mean registration distance of its parcels (UP Fig. 6), metres.
    """

    template: str
    energy: float
    plots: list[Plot] = field(default_factory=list)
    streets: list[LineString] = field(default_factory=list)
    distance: float = 0.0


@dataclass
class _Candidate:
    """A way of laying a template into a block."""

    block: int
    name: str
    task: Task


#: A match with faces to be filled: its pieces, their labels, its centre lines and its energy.
_Nested = tuple[_Candidate, list[shapely.Polygon], list[str], list[LineString], float]


def match_templates(
    blocks: Sequence[Block],
    library: TemplateLibrary,
    rules: ParcelRules,
    *,
    region_label: str = "block",
    names: Collection[str] | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> list[list[Match]]:
    """Warp the templates that fit into blocks.

    Parameters
    ----------
    blocks
        The regions.
    library
        The templates.
    rules
        Size of the parcels wished for, and their bounds; templates are scaled to it.
    region_label
        Templates for such regions are tried.
    names
        Only these templates; all by default. What fills their faces is not restricted.
    seed
        Where several templates fit a face of another template, one is drawn, the more likely the
        better it fits and the greater its probability.
    progress
        Told, and asked for cancellation.

    Returns
    -------
    list
        For each block its matches, least energy first; none where no template fits. Blocks with
        holes are matched by templates without corners only.

    Raises
    ------
    CancelledError
        If the caller cancels.
    """
    progress = Silent() if progress is None else progress
    chosen = [
        t for t in library.labelled(region_label) if names is None or t.name in set(names)
    ]  # fmt: skip
    made = {t.name: kits(t, rules) for t in chosen if _has_corners(t)}
    found: list[list[Match]] = [[] for _ in blocks]
    for template in chosen:
        if template.name not in made and not _has_corners(template):
            for block, matches in zip(blocks, found):
                matches.append(_whole(template, block))
    candidates = _candidates(blocks, made, progress)
    chunks = list(_chunks(candidates))
    for k, chunk in enumerate(chunks):
        _check(progress)
        progress.stage("warping templates", k / len(chunks))
        for candidate, match in _warp(chunk, blocks, library, rules, seed, progress):
            found[candidate.block].append(match)
    return [sorted(matches, key=lambda m: (m.energy, m.template)) for matches in found]


def _check(progress: Progress) -> None:
    if progress.cancelled():
        raise CancelledError("Cancelled while templates were warped.")


def _has_corners(template: Template) -> bool:
    """Tell whether a template is more than one face that takes any shape."""
    regular = sum(mark.kind == "regular" for mark in template.corners)
    one = len(template.faces) == 1 and not template.faces[0].repeat
    return not (one and regular >= len(template.faces[0].polygon.exterior.coords) - 1)


def _whole(template: Template, block: Block) -> Match:
    """Fill a block with the one face of a template without corners."""
    label = template.faces[0].label
    return Match(template.name, 0.0, [_plot(block.polygon, label, template.name)])


def _plot(polygon: shapely.Polygon, label: str, name: str) -> Plot:
    return Plot(polygon, USES[label], "" if label in USES and USES[label] == label else label, name)


def _candidates(
    blocks: Sequence[Block], made: dict[str, tuple[Kit, ...]], progress: Progress
) -> list[_Candidate]:
    """List what is worth warping."""
    found: list[_Candidate] = []
    for k, block in enumerate(blocks):
        if k % 64 == 0:
            _check(progress)
        if block.polygon.interiors or not made:
            continue
        ways = all_ways(made, outline(block))
        found.extend(_Candidate(k, name, task) for name, _, task in ways)
    return found


def _chunks(candidates: list[_Candidate]) -> Iterator[list[_Candidate]]:
    """Cut a list into batches of about the same size."""
    chunk: list[_Candidate] = []
    size = 0
    for candidate in candidates:
        chunk.append(candidate)
        size += len(candidate.task.form.vertex)
        if size > BATCH:
            yield chunk
            chunk, size = [], 0
    if chunk:
        yield chunk


def evaluate(
    tasks: Sequence[Task],
    areas: npt.NDArray[np.float64],
    rules: ParcelRules,
    stretch: float = STRETCH,
) -> tuple[Warped, Tiles, npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Warp templates and measure how well they fit.

    Parameters
    ----------
    tasks
        Templates and regions.
    areas
        Of the regions, shape (tasks,), square metres.
    rules
        What parcels are asked for.
    stretch
        What the mean stretch of the sides adds to the energy, metres.

    Returns
    -------
    warped, tiles
        Where the templates lie.
    distance
        Mean registration distances of the parcels, shape (tasks,), metres.
    energy
        Shape (tasks,), metres; infinite where a template does not tile its region or a parcel
        has no access.
    """
    batch = Batch(tasks, rules.least_area / rules.area, rules.largest_area / rules.area)
    warped = batch.run(ITERATIONS)
    distance = warped.energy(tasks)
    tiles = tile(tasks, warped, areas)
    forms = [task.form for task in tasks]
    parcel = np.concatenate(
        [np.array(form.labels)[form.piece_face] == "parcel" for form in forms]
    )  # fmt: skip
    access = np.concatenate([form.access for form in forms])
    front = np.concatenate([form.front[form.piece_face] for form in forms])
    size = np.concatenate([form.size[form.piece_face] for form in forms])
    need = np.minimum(rules.min_frontage, FRONT * front)
    lost = parcel & ~access & (tiles.open < need)
    ok = tiles.valid & ~np.logical_or.reduceat(lost, tiles.start[:-1])
    bad = np.zeros(len(parcel))
    which = np.flatnonzero(parcel & np.repeat(ok, np.diff(tiles.start)))
    if len(which):
        some = tiles.polygons[which]
        factor = shapely.area(some) / size[which]
        wrong = undesirable(corner_deviation(some), rectangle_ratio(some))
        wrong |= factor < rules.least_area / rules.area
        wrong |= factor > rules.largest_area / rules.area
        bad[which] = wrong
    count = np.add.reduceat(parcel.astype(float), tiles.start[:-1])
    share = np.add.reduceat(bad, tiles.start[:-1]) / np.maximum(count, 1.0)
    # narrow parcels are off by less in metres, though not in proportion
    size = np.array([form.size[form.counted].mean() for form in forms])
    factor = np.clip(np.sqrt(rules.area / size), *PROPORTION)
    energy = distance * factor + BAD * share
    energy += stretch * np.array([task.stretch for task in tasks])
    # faces that other templates fill may well be bent
    final = np.array([all(label in OWN for label in form.labels) for form in forms])
    ok &= ~final | (energy < FARTHEST * np.sqrt(rules.area))
    return warped, tiles, distance, np.where(ok, energy, np.inf)


def _warp(
    chunk: list[_Candidate],
    blocks: Sequence[Block],
    library: TemplateLibrary,
    rules: ParcelRules,
    seed: int,
    progress: Progress,
) -> list[tuple[_Candidate, Match]]:
    """Warp a batch and hand out what fits."""
    tasks = [candidate.task for candidate in chunk]
    areas = shapely.area(np.array([blocks[c.block].polygon for c in chunk], dtype=object))
    warped, tiles, distance, energy = evaluate(tasks, np.asarray(areas), rules)
    found: list[tuple[_Candidate, Match]] = []
    nested: list[_Nested] = []
    for k, candidate in enumerate(chunk):
        if not np.isfinite(energy[k]):
            continue
        form = candidate.task.form
        labels = [form.labels[face] for face in form.piece_face]
        polygons = tiles.polygons[tiles.start[k] : tiles.start[k + 1]]
        points = warped.points[warped.vertex_start[k] : warped.vertex_start[k + 1]]
        arcs = tiles.arc[warped.ring_start[k] : warped.ring_start[k + 1]]
        streets = centre_lines(candidate.task, points, arcs)
        if all(label in LAND for label in labels):
            plots = [_plot(p, label, candidate.name) for p, label in zip(polygons, labels)]
            match = Match(candidate.name, float(energy[k]), plots, streets, float(distance[k]))
            found.append((candidate, match))
        else:
            nested.append((candidate, list(polygons), labels, streets, float(energy[k])))
    return found + _fill(nested, blocks, library, rules, seed, progress)


def _fill(
    nested: list[_Nested],
    blocks: Sequence[Block],
    library: TemplateLibrary,
    rules: ParcelRules,
    seed: int,
    progress: Progress,
) -> list[tuple[_Candidate, Match]]:
    """Fill faces that stand for other templates, those of all matches at once."""
    waiting: dict[str, list[tuple[int, int, Block]]] = {}
    for k, (candidate, polygons, labels, _, _) in enumerate(nested):
        shared = shared_edges(polygons)
        for piece, label in enumerate(labels):
            if label not in LAND:
                around = blocks[candidate.block]
                inner = inner_block(piece, polygons, labels, around, shared[piece])
                waiting.setdefault(label, []).append((k, piece, inner))
    chosen: dict[tuple[int, int], Match | None] = {}
    for label, pieces in sorted(waiting.items()):
        matches = match_templates(
            [block for _, _, block in pieces], library, rules,
            region_label=label, seed=seed, progress=progress,
        )  # fmt: skip
        for (k, piece, _), fitting in zip(pieces, matches):
            rng = np.random.default_rng([seed, nested[k][0].block, k, piece])
            chosen[k, piece] = _draw(fitting, library, rng)
    found = []
    for k, (candidate, polygons, labels, streets, own) in enumerate(nested):
        parts = {p: chosen[k, p] for p, label in enumerate(labels) if label not in LAND}
        if any(match is None for match in parts.values()):
            continue
        plots: list[Plot] = []
        lines = list(streets)
        energy, distance, count = 0.0, 0.0, 0
        if "parcel" in labels:
            count = labels.count("parcel")
            energy = distance = own * count
        for piece, polygon in enumerate(polygons):
            part = parts.get(piece)
            if part is None:
                plots.append(_plot(polygon, labels[piece], candidate.name))
                continue
            weight = sum(plot.use == "parcel" for plot in part.plots)
            energy, distance = energy + weight * part.energy, distance + weight * part.distance
            count += weight
            plots.extend(part.plots)
            lines.extend(part.streets)
        match = Match(
            candidate.name, energy / max(count, 1), conform(plots), lines, distance / max(count, 1)
        )
        found.append((candidate, match))
    return found


def _draw(fitting: list[Match], library: TemplateLibrary, rng: np.random.Generator) -> Match | None:
    """Draw one of the templates that fit (UP section 3), each in its best match."""
    best: dict[str, Match] = {}
    for match in fitting:
        best.setdefault(match.template, match)
    if len(best) < 2:
        return next(iter(best.values()), None)
    weight = np.array(
        [library[name].probability / (0.2 + m.energy) ** 2 for name, m in best.items()]
    )
    return list(best.values())[int(rng.choice(len(best), p=weight / weight.sum()))]
