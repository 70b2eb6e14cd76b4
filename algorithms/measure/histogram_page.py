"""Histograms as one page that needs no other file and no network."""

from __future__ import annotations

import html
from collections.abc import Sequence

from .histogram import Histogram

#: Size of one chart, and room below it for the names of the classes, in pixels.
WIDTH, HEIGHT, BELOW = 420, 150, 84
GOOD, BAD, INK, LINE = "#4f86b5", "#b5302a", "#4a443b", "#d8d2c6"
_STYLE = f"""
body {{ font: 15px/1.45 system-ui, sans-serif; color: {INK}; background: #fff; margin: 2em auto;
        max-width: 72em; padding: 0 1em }}
h1 {{ font-size: 1.5em }} h2 {{ font-size: 1.05em; margin: 0 0 .3em }}
.charts {{ display: grid; grid-template-columns: repeat(auto-fill, minmax({WIDTH}px, 1fr));
          gap: 2em }}
table {{ border-collapse: collapse; margin: 1em 0 2em }}
td {{ padding: .15em 1.2em .15em 0; border-bottom: 1px solid {LINE} }}
td + td {{ text-align: right; font-variant-numeric: tabular-nums }}
p {{ margin: .2em 0 .6em }} svg {{ max-width: 100% }}
"""


def histogram_page(
    title: str, figures: Sequence[tuple[str, str]], found: Sequence[Histogram]
) -> str:
    """Write a page with figures and histograms.

    Parameters
    ----------
    title
        Heading, as plain text.
    figures
        What is told above the charts: names and values.
    found
        The histograms; classes above the limit of their measure are red.

    Returns
    -------
    str
        An HTML document with its drawings inside (SVG).
    """
    rows = "".join(
        f"<tr><td>{html.escape(name)}</td><td>{html.escape(value)}</td></tr>\n"
        for name, value in figures
    )
    charts = "\n".join(_chart(one) for one in found)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        f"<h1>{html.escape(title)}</h1>\n<table>\n{rows}</table>\n"
        f'<div class="charts">\n{charts}\n</div>\n</body>\n</html>\n'
    )


def _chart(found: Histogram) -> str:
    """Draw one histogram."""
    measure, labels = found.measure, found.labels()
    unit = f" ({measure.unit})" if measure.unit else ""
    top = max(int(found.counts.max(initial=0)), 1)
    whole = max(int(found.counts.sum()), 1)
    step = WIDTH / len(labels)
    parts = []
    for at, (label, count, low) in enumerate(zip(labels, found.counts.tolist(), measure.bounds)):
        bad = measure.limit is not None and low >= measure.limit
        tall = count / top * (HEIGHT - 22)
        x, y = at * step + step * 0.08, HEIGHT - tall
        says = f"{label}{unit and ' ' + measure.unit}: {count} ({100 * count / whole:.1f} %)"
        parts.append(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{step * 0.84:.1f}" height="{tall:.1f}" '
            f'fill="{BAD if bad else GOOD}"><title>{html.escape(says)}</title></rect>'
        )
        middle = at * step + step / 2
        if count:
            parts.append(
                f'<text x="{middle:.1f}" y="{y - 4:.1f}" text-anchor="middle">{count}</text>'
            )
        parts.append(
            f'<text transform="translate({middle + 4:.1f} {HEIGHT + 8}) rotate(-55)" '
            f'text-anchor="end">{html.escape(label)}</text>'
        )
    mean = "" if found.mean != found.mean else f"mean {found.mean:.4g}{unit and ' ' + measure.unit}"
    return (
        f"<section><h2>{html.escape(measure.title + unit)}</h2><p>{html.escape(mean)}</p>"
        f'<svg viewBox="-32 0 {WIDTH + 40} {HEIGHT + BELOW}" width="{WIDTH}" role="img" '
        f'aria-label="{html.escape(measure.title)}" font-size="11" fill="{INK}">'
        f'<line x1="0" y1="{HEIGHT}" x2="{WIDTH}" y2="{HEIGHT}" stroke="{LINE}"/>'
        f"{''.join(parts)}</svg></section>"
    )
