"""The page: one HTML document that holds all it shows and asks nothing of a network."""

from __future__ import annotations

from collections.abc import Iterable

from . import pictures
from .html import Content, Html, joined, table, tag, text
from .report import Credit, Design, LayerRow, Report
from .sections import comparison, key_figures, problems, runs, targets
from .style import STYLE

#: Nothing may be fetched, run or sent, whatever a browser finds in the page.
POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; form-action 'none'"
#: Where the program comes from.
HOME = "https://github.com/platwright/platwright"
#: Counts up to here are words.
_WORDS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine")


def report_page(report: Report) -> str:
    """Return the whole page.

    Parameters
    ----------
    report
        What it tells.

    Returns
    -------
    str
        An HTML document with its style and its pictures inside. Every text of the report is
        escaped; there is no script, and a policy in its head forbids any request.
    """
    sections = [_summary(report)]
    if len(report.designs) > 1:
        sections.append(_section("Comparison", "comparison", comparison(report)))
    sections += [_design(own, at, report) for at, own in enumerate(report.designs, 1)]
    if report.data_pictures or report.data:
        maps = [pictures.figure(own) for own in report.data_pictures]
        rows = [_layers("Layers that are given, not designed", report.data)] if report.data else []
        sections.append(_section("Data", "data", *maps, *rows))
    sections.append(_section("Data sources", "sources", *_credits(report.credits)))
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=POLICY),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("meta", name="generator", content=f"Platwright {report.version}"),
        tag("title", report.title),
        # the style is ours and has nothing to escape
        Html(f"<style>{STYLE}</style>"),
    )
    body = tag("body", joined([_top(report), tag("main", joined(sections)), _foot(report)]))
    return f"<!DOCTYPE html>\n{tag('html', head, body, lang='en').markup}\n"


def _section(title: str, key: str, *content: Content, kind: str | None = None) -> Html:
    heading = tag("h2", title, id=f"{key}-title")
    return tag(
        "section", heading, joined(content), id=key, class_=kind, aria_labelledby=f"{key}-title"
    )


def _top(report: Report) -> Html:
    told = [own for own in (report.place, report.author, report.date) if own]
    links = [("Summary", "summary")]
    if len(report.designs) > 1:
        links.append(("Comparison", "comparison"))
    links += [(own.name, f"design-{at}") for at, own in enumerate(report.designs, 1)]
    links += [("Data", "data")] if report.data_pictures or report.data else []
    links.append(("Data sources", "sources"))
    rows = [tag("li", tag("a", name, href=f"#{key}")) for name, key in links]
    return tag(
        "header",
        tag("h1", report.title),
        tag("p", " · ".join(told)),
        tag("nav", tag("ul", *rows), aria_label="Contents"),
    )


def _count(number: int, word: str) -> str:
    name = _WORDS[number] if number < len(_WORDS) else str(number)
    return f"{name} {word}{'' if number == 1 else 's'}"


def lead_of(report: Report) -> str:
    """Return the report in one or two sentences."""
    if not report.designs:
        first = f"{_count(len(report.data), 'layer')} of data, no design"
    else:
        tools = dict.fromkeys(run.title for own in report.designs for run in own.runs)
        made = f", made with {', '.join(tools)}" if tools else ""
        place = f" for {report.place}" if report.place else ""
        first = f"{_count(len(report.designs), 'design')}{place}{made}"
    words = f"{first[:1].upper()}{first[1:]}."
    if report.targets:
        met = sum(own.met is True for own in report.targets)
        words += f" {met} of {len(report.targets)} targets are met."
    return words


def _summary(report: Report) -> Html:
    """Return the first section: a sentence, a plan of each design, key figures, targets."""
    articles = []
    for design in report.designs:
        parts: list[Content] = [pictures.overview(design.pictures[0])] if design.pictures else []
        if len(report.designs) > 1:
            parts.append(tag("h3", design.name))
        articles.append(tag("article", *parts, key_figures(design, len(report.designs))))
    kind = "plans one" if len(articles) == 1 else "plans"
    plans = tag("div", joined(articles), class_=kind) if articles else text("")
    lead = tag("p", lead_of(report), class_="lead")
    return _section("Summary", "summary", lead, plans, targets(report))


def _design(design: Design, number: int, report: Report) -> Html:
    """Return the section of one design."""
    maps = [pictures.figure(own) for own in design.pictures]
    parts = [*maps, *runs(design, len(report.designs)), *problems(design)]
    if design.layers:
        parts.append(_layers(f"Layers of {design.name}", design.layers))
    title = design.name if len(report.designs) > 1 else f"The plan: {design.name}"
    if len(report.designs) == 1 and design.name == "Design":
        title = "The design"
    return _section(title, f"design-{number}", *parts, kind="design")


def _layers(caption: str, rows: Iterable[LayerRow]) -> Html:
    return table(
        caption,
        ["Layer", "Made with", "Features", "File or service", "Coordinate reference system"],
        [
            [
                own.name,
                own.made_by or "data",
                "" if own.features is None else f"{own.features:,}",
                own.source,
                own.crs,
            ]
            for own in rows
        ],
        numbers=[2],
    )


def _credits(credits_: tuple[Credit, ...]) -> list[Content]:
    """Return whose the data is, as far as the layers tell."""
    parts: list[Content] = []
    if credits_:
        rows: list[list[Content]] = [
            [own.layer, own.attribution, own.licence, own.source, own.date, _links(own.links)]
            for own in credits_
        ]
        heads = ["Layer", "To be named", "Licence", "Source", "Date", "More"]
        parts.append(table("Whose the data is, as the layers tell", heads, rows))
    else:
        parts.append(tag("p", "No layer tells where its data comes from."))
    parts.append(
        tag(
            "p",
            "Layers that are made from data of others stay under the licence of that data where it "
            "says so, as that of OpenStreetMap does. What no layer tells is not in this list.",
            class_="note",
        )
    )
    return parts


def _links(links: tuple[str, ...]) -> Html:
    """Return addresses: of the web as links, of any other kind as text."""
    parts = []
    for at, link in enumerate(links):
        web = link.startswith(("https://", "http://"))
        parts += [text(", ")] if at else []
        parts.append(tag("a", link, href=link, rel="noreferrer noopener") if web else text(link))
    return Html("".join(own.markup for own in parts))


def _foot(report: Report) -> Html:
    return tag(
        "footer",
        tag(
            "p",
            f"Written on {report.date} by ",
            tag("a", f"Platwright {report.version}", href=HOME, rel="noreferrer noopener"),
            ", free software under the GNU General Public License, version 3 or later. The licence "
            "of the program lays no claim on the designs.",
        ),
    )
