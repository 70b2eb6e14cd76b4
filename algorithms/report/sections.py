"""Sections of the page: key figures, targets, comparison, runs with their solver, problems."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from .figures import Figure
from .html import Content, Html, joined, table, tag, text
from .report import Design, Report, Run
from .solver import SolverFacts
from .targets import Target, TargetResult
from .wishes import Wish

#: Figures that are shown first, by their keys, as far as a design has them.
KEY_FIGURES = (
    "TOTAL_LENGTH", "BLOCKS", "MEAN_DISTANCE", "ACHIEVED", "PARCEL_COUNT", "MEAN_P_ANGLE",
    "STREET_SHARE", "FAR_REACHED", "DWELLINGS", "GREEN_REACHED", "BUILDING_COUNT", "ROOM_COUNT",
    "NET_TO_GROSS", "MAX_EGRESS", "BLOCK_COUNT", "ROUTE_LENGTH", "MEAN_TIME", "MEAN_WAITING",
    "LENGTH_M", "REGION_COUNT",
    "MEAN_WAY_M", "BLOCK_WIDTH_M", "LENGTH_KM", "INTERSECTIONS_KM2", "VIOLATIONS",
)  # fmt: skip
#: How many of them a single design shows, and each of several.
_KEYS_ONE, _KEYS_EACH = 8, 5
#: Designs beside each other in one table, so that it fits a sheet of paper.
BESIDE = 5
#: Tables of more figures are folded where a comparison has them, too.
FOLDED = 12
#: Problems that are listed.
LISTED = 60
_GRAVE = {"error": 0, "warning": 1, "info": 2}


def key_figures(design: Design, designs: int) -> Html:
    """Return the figures that come first, as a list of terms."""
    by_key: dict[str, Figure] = {}
    for own in design.figures:
        if own.value is not None:
            by_key.setdefault(own.key, own)
    chosen = [by_key[key] for key in KEY_FIGURES if key in by_key] or list(by_key.values())
    shown = chosen[: _KEYS_ONE if designs == 1 else _KEYS_EACH]
    rows = [
        tag("div", tag("dt", own.label.partition(":")[0]), tag("dd", own.text)) for own in shown
    ]
    return tag("dl", *rows, class_="key") if rows else text("")


def targets(report: Report) -> Html:
    """Return the targets with met or not met, design by design."""
    if not report.targets:
        return text("")
    by_target: dict[Target, dict[str, TargetResult]] = {}
    for own in report.targets:
        by_target.setdefault(own.target, {})[own.design] = own
    rows: list[list[Content]] = []
    for target, results in by_target.items():
        known = next(own.figure for own in results.values() if own.figure is not None)
        cells: list[Content] = [_met(results.get(design.name)) for design in report.designs]
        rows.append([known.label, target.words(known.unit), *cells])
    heads = ["Figure", "Target", *(own.name for own in report.designs)]
    made = table("Figures against their targets", heads, rows)
    return joined([tag("h3", "Targets"), made])


def _met(result: TargetResult | None) -> Html:
    if result is None or result.figure is None or result.met is None:
        return tag("span", "not known", class_="unknown")
    word, sign, kind = ("met", "✓", "met") if result.met else ("not met", "✗", "missed")
    return tag("span", f"{result.figure.text} ", tag("b", f"{sign} {word}"), class_=kind)


def comparison(report: Report) -> Html:
    """Return the figures of all designs beside each other, the best marked."""
    parts: list[Content] = []
    for first in range(0, len(report.designs), BESIDE):
        chosen = range(first, min(first + BESIDE, len(report.designs)))
        rows: list[list[Content]] = []
        for run, figures in report.compared():
            rows.append([run.title])
            for figure, found in figures:
                best = best_of(figure, found)
                cells = [_cell(found[at], at in best) for at in chosen]
                rows.append([_named(figure), *cells])
        if not rows:
            words = "The designs have no figure in common."
            return tag("p", words)
        heads = ["Figure", *(report.designs[at].name for at in chosen)]
        part = f", designs {first + 1} to {chosen[-1] + 1}" if len(report.designs) > BESIDE else ""
        parts.append(table(f"Figures of the designs{part}", heads, rows, range(1, len(chosen) + 1)))
    note = (
        "Bold with a star: the best of a row, where planners usually want less of it, or more. "
        "Prices and bounds are not compared, since they depend on what was asked."
    )
    return joined([*parts, tag("p", note, class_="note")])


def best_of(figure: Figure, found: Sequence[Figure | None]) -> set[int]:
    """Return the places of the best values of a row; none where all are written alike."""
    known = {at: own for at, own in enumerate(found) if own is not None and own.value is not None}
    if not figure.wish or len({own.text for own in known.values()}) < 2:
        return set()
    best = max(known.values(), key=lambda own: figure.wish * (own.value or 0.0))
    return {at for at, own in known.items() if own.text == best.text}


def _cell(figure: Figure | None, best: bool) -> Html:
    if figure is None:
        return text("not known")
    if not best:
        return text(figure.text)
    star = tag("span", "★", aria_hidden="true")
    return tag("span", star, f" {figure.text}", tag("span", " (best)", class_="vh"), class_="best")


def _named(figure: Figure) -> Html:
    """Return what a figure says, with its key for whoever writes targets."""
    return tag("span", figure.label, title=figure.key)


def runs(design: Design, designs: int) -> list[Content]:
    """Return every run of a design: what was asked, figures, the solver.

    Of several designs long tables of figures are folded: the comparison has them already.
    """
    parts: list[Content] = []
    for run in design.runs:
        parts.append(tag("h3", run.title))
        if run.solver is not None:
            parts.append(_solver(run.solver))
        parts += _wishes(run)
        if run.figures:
            rows: list[list[Content]] = [
                [_named(own), own.text, tag("code", own.key)] for own in run.figures
            ]
            heads = ["Figure", "Value", "Key"]
            made = table(f"What came out of {run.title}", heads, rows, [1])
            if designs > 1 and len(rows) > FOLDED:
                summary = tag("summary", f"{len(rows)} figures that came out of {run.title}")
                made = tag("details", summary, made)
            parts.append(made)
    return parts


def _wishes(run: Run) -> list[Content]:
    if not run.wishes:
        return []
    asked = [own for own in run.wishes if not own.usual]
    usual = [own for own in run.wishes if own.usual]
    parts: list[Content] = []
    if asked:
        parts.append(_asked(f"What was asked of {run.title}", asked))
    else:
        parts.append(tag("p", "Nothing was asked beyond what the tool does by itself."))
    if usual:
        summary = tag("summary", f"{len(usual)} more as usual or not set")
        rest = f"What {run.title} did as usual"
        parts.append(tag("details", summary, _asked(rest, usual)))
    return parts


def _asked(caption: str, wishes: Iterable[Wish]) -> Html:
    return table(caption, ["Wish", "Value"], [[own.label, own.text] for own in wishes])


def _solver(facts: SolverFacts) -> Html:
    """Return objective, bound, gap and time, with a bar of how much of the price is proven."""
    known = facts.bound is not None
    rows = [("Price of the design", Figure("", "", facts.objective).text)]
    rows += [("Proven lower bound", Figure("", "", facts.bound).text)] if known else []
    if facts.gap is not None:
        rows.append(("Gap", f"{100 * facts.gap:.1f} %"))
    if facts.seconds is not None:
        rows.append(("Time of the run", Figure("", "", facts.seconds, "s").text))
    terms = [tag("div", tag("dt", name), tag("dd", value)) for name, value in rows]
    bar = text("") if facts.gap is None else _bar(facts.gap)
    return joined([tag("dl", *terms, class_="key"), bar, tag("p", facts.sentence)])


def _bar(gap: float) -> Html:
    """Draw the price as a bar: what is proven to be needed, and the gap."""
    wide, high = 340.0, 14.0
    proven = wide * (1.0 - min(max(gap, 0.0), 1.0))
    says = f"{100 * (1 - gap):.1f} % of the price is proven to be needed; the gap is the rest."
    parts = [
        tag("rect", x=0, y=0, width=f"{proven:.1f}", height=f"{high:g}", fill="var(--mark)"),
        tag("rect", x=f"{proven:.1f}", y=0, width=f"{wide - proven:.1f}", height=f"{high:g}",
            fill="var(--gap)"),
        tag("text", "0", x=0, y=25, font_size=9, fill="currentColor"),
        tag("text", "price", x=f"{wide:g}", y=25, font_size=9, text_anchor="end",
            fill="currentColor"),
    ]  # fmt: skip
    # a label under the bound, where it does not run into the others
    if 0.08 < proven / wide < 0.86:
        parts.append(tag("text", "bound", x=f"{proven:.1f}", y=25, font_size=9,
                         text_anchor="middle", fill="currentColor"))  # fmt: skip
    return tag("svg", *parts, viewBox=f"0 0 {wide:g} 28", role="img", aria_label=says, class_="bar")


def problems(design: Design) -> list[Content]:
    """Return what was found wrong, the gravest first."""
    if not design.problems:
        return []
    found = sorted(design.problems, key=lambda own: _GRAVE.get(own.severity, len(_GRAVE)))
    counts = Counter(own.severity or "of no severity" for own in found)
    told = ", ".join(f"{number} {word}" for word, number in counts.items())
    rows = [
        [own.severity, own.layer, own.feature, own.problem, own.action] for own in found[:LISTED]
    ]
    heads = ["Severity", "Layer", "Feature", "Problem", "What was done, or what to do"]
    parts: list[Content] = [tag("h3", "Problems found"), table(f"By severity: {told}", heads, rows)]
    if len(found) > LISTED:
        parts.append(tag("p", f"{len(found) - LISTED} more are in the layer of problems."))
    return parts
