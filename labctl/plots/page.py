"""Parts of pages that need nothing else: no server, no network."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from html import escape

from plotly.offline import get_plotlyjs

from labctl.plots.registry import Picture

STYLE = """
:root { color-scheme: light dark; --ink: #24292f; --soft: #57606a; --paper: #ffffff; --line: #d0d7de; }
@media (prefers-color-scheme: dark) { :root { --ink: #d5dbe1; --soft: #9198a1; --paper: #14181d; --line: #343b44; } }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 72rem;
       margin: 2rem auto; padding: 0 1rem; }
h1, li { overflow-wrap: anywhere; } h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin: 2.5rem 0 .3rem; }
.verdict { font-size: 1.25rem; font-weight: 600; } .soft, figcaption { color: var(--soft); }
figure { margin: 0; } figcaption { max-width: 60rem; font-size: .92rem; }
table { border-collapse: collapse; font-size: .92rem; } th, td { padding: .2rem .8rem; text-align: right;
        border-bottom: 1px solid var(--line); vertical-align: top; }
th:first-child, td:first-child, .words { text-align: left; }
"""
DRAW = """
for (const place of document.querySelectorAll("div[data-figure]")) {
  const figure = JSON.parse(document.getElementById(place.dataset.figure).textContent);
  Plotly.newPlot(place, figure.data, figure.layout, {displaylogo: false, responsive: true});
}
"""


def whole_page(title: str, parts: Iterable[str], *, drawn: bool) -> str:
    """Return an HTML document of its parts; with `drawn` it carries what draws the figures in them."""
    scripts = f"<script>{get_plotlyjs()}</script>\n<script>{DRAW}</script>" if drawn else ""
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style></head>\n<body>\n"
        + "\n".join(part for part in parts if part)
        + f"\n{scripts}\n</body>\n</html>\n"
    )


def figure_part(picture: Picture) -> str:
    """Return a picture with its caption; its numbers stand beside it as JSON."""
    data = picture.figure.to_json().replace("</", "<\\/")
    effects = ", ".join(picture.effects)
    drawn = f"<br>Effects that would be visible here: {escape(effects)}." if effects else ""
    return (
        f'<h2 id="{picture.id}">{escape(picture.title)}</h2>\n<figure>'
        f"<figcaption>{escape(picture.caption)}{drawn}</figcaption>"
        f'<div data-figure="numbers-{picture.id}"></div></figure>\n'
        f'<script type="application/json" id="numbers-{picture.id}">{data}</script>'
    )


def table_part(head: Sequence[str], rows: Sequence[Sequence[str]], words: Collection[int] = ()) -> str:
    """Return a table; empty without rows. The columns `words` hold words, aligned left as the first is."""

    def line(cells: Sequence[str], tag: str) -> str:
        marks = [' class="words"' if column in words else "" for column in range(len(cells))]
        return (
            "<tr>"
            + "".join(f"<{tag}{m}>{escape(cell)}</{tag}>" for cell, m in zip(cells, marks, strict=True))
            + "</tr>"
        )

    return f"<table>{line(head, 'th')}{''.join(line(row, 'td') for row in rows)}</table>" if rows else ""
