"""A criticism as one page that needs nothing else: no server, no network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from plotly.offline import get_plotlyjs

from labctl.json_types.answers import ComparisonJson, CriticismJson, LadderJson
from labctl.json_types.criticism import CriticisedErrors, NotTestable, Suspect, WorstDataSet
from labctl.plots.registry import Picture, pictures_of

STYLE = """
:root { color-scheme: light dark; --ink: #24292f; --soft: #57606a; --paper: #ffffff; --line: #d0d7de; }
@media (prefers-color-scheme: dark) { :root { --ink: #d5dbe1; --soft: #9198a1; --paper: #14181d; --line: #343b44; } }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 72rem;
       margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin: 2.5rem 0 .3rem; }
.verdict { font-size: 1.25rem; font-weight: 600; } .soft, figcaption { color: var(--soft); }
figure { margin: 0; } figcaption { max-width: 60rem; font-size: .92rem; }
table { border-collapse: collapse; font-size: .92rem; } th, td { padding: .2rem .8rem; text-align: right;
        border-bottom: 1px solid var(--line); } th:first-child, td:first-child { text-align: left; }
"""
DRAW = """
for (const place of document.querySelectorAll("div[data-figure]")) {
  const figure = JSON.parse(document.getElementById(place.dataset.figure).textContent);
  Plotly.newPlot(place, figure.data, figure.layout, {displaylogo: false, responsive: true});
}
"""


def report_html(
    criticism: CriticismJson, ladder: LadderJson | None = None, comparison: ComparisonJson | None = None
) -> str:
    """Return the page: the verdict in words, the figures behind it, then the pictures with how to read them."""
    pictures = pictures_of(criticism, ladder, comparison)
    title = f"{criticism['serial']}, version {criticism['version']}, against recording {criticism['recording']}"
    first, *others = [escape(line) for line in criticism["text"]]
    parts = [
        f"<h1>{escape(title)}</h1>",
        f'<p class="verdict">{first}</p>',
        *(f"<p>{line}</p>" for line in others),
        _errors(criticism["error"]),
        _suspects(criticism["suspects"]),
        *(f"<p>To distinguish them:  {escape(str(e['do']))}.</p>" for e in criticism["experiments"]),
        *(_figure(picture) for picture in pictures),
        _worst(criticism.get("worst", ())),
        _not_testable(criticism["not_testable"]),
    ]
    scripts = f"<script>{get_plotlyjs()}</script>\n<script>{DRAW}</script>" if pictures else ""
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style></head>\n<body>\n"
        + "\n".join(part for part in parts if part)
        + f"\n{scripts}\n</body>\n</html>\n"
    )


def _figure(picture: Picture) -> str:
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


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    def line(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    return f"<table>{line(head, 'th')}{''.join(line(row, 'td') for row in rows)}</table>" if rows else ""


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _errors(error: CriticisedErrors) -> str:
    figures = (
        ("left after the fit", error.get("rms_dps")),
        ("at temperatures left out of the fit", error.get("heldout_rms_dps")),
        ("noise floor", error.get("noise_floor_dps")),
    )
    return _table(("RMS error", "deg/s"), [(word, _number(figure)) for word, figure in figures])


def _name_of(suspect: Suspect) -> str:
    return suspect["effect"] + ("" if suspect.get("physical", True) else " (not physical)")


def _suspects(suspects: Sequence[Suspect]) -> str:
    rows = [
        (_name_of(s), s["origin"], _number(s["log_bayes_factor"]), _number(s["rms_after_dps"]),
         _number(s["heldout_rms_after_dps"]), ", ".join(e for e in s["alias_group"] if e != s["effect"]))
        for s in suspects
    ]  # fmt: skip
    head = ("suspect", "origin", "evidence, nats", "RMS with it", "held out", "cannot be distinguished from")
    return f"<h2>Suspects</h2>{_table(head, rows)}" if rows else ""


def _worst(worst: Sequence[WorstDataSet]) -> str:
    rows = [
        (f"{w['axis']}, data set {w['dataset']}", _number(w["residual_dps"]), _number(w["over_floor"])) for w in worst
    ]
    return f"<h2>Data sets furthest from the model</h2>{_table(('', 'deg/s', 'over floor'), rows)}" if rows else ""


def _not_testable(lines: Sequence[NotTestable]) -> str:
    if not lines:
        return ""
    names = ", ".join(str(line["effect"]) for line in lines)
    return f'<h2>Effects that this recording cannot test</h2><p class="soft">{escape(names)}</p>'
