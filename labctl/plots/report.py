"""A criticism as one page that needs nothing else: no server, no network."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from labctl.answers.comparison import ComparisonResponse
from labctl.answers.criticism import CriticisedErrors, CriticismResponse, NotTestable, Suspect, WorstDataSet
from labctl.answers.ladder import LadderResponse
from labctl.plots.page import figure_part, table_part, whole_page
from labctl.plots.registry import pictures_of


def report_html(
    criticism: CriticismResponse, ladder: LadderResponse | None = None, comparison: ComparisonResponse | None = None
) -> str:
    """Return the page: the verdict in words, the figures behind it, then the pictures with how to read them."""
    pictures = pictures_of(criticism, ladder, comparison)
    title = f"{criticism.serial}, version {criticism.version}, against recording {criticism.recording}"
    first, *others = [escape(line) for line in criticism.text]
    parts = [
        f"<h1>{escape(title)}</h1>",
        f'<p class="verdict">{first}</p>',
        *(f"<p>{line}</p>" for line in others),
        _errors(criticism.error),
        _suspects(criticism.suspects),
        *(figure_part(picture) for picture in pictures),
        _worst(criticism.worst),
        _not_testable(criticism.not_testable),
    ]
    return whole_page(title, parts, drawn=bool(pictures))


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g}"


def _errors(error: CriticisedErrors) -> str:
    figures = (
        *([("as applied to the output", direct)] if (direct := error["direct_form_rms_dps"]) is not None else []),
        ("residual RMS", error["rms_dps"]),
        ("at temperatures left out of the fit", error["heldout_rms_dps"]),
        ("noise floor", error["noise_floor_dps"]),
    )
    return table_part(("RMS error", "deg/s"), [(word, _number(figure)) for word, figure in figures])


def _name_of(suspect: Suspect) -> str:
    return suspect["effect"] + ("" if suspect.get("physical", True) else " (not physical)")


def _suspects(suspects: Sequence[Suspect]) -> str:
    rows = [
        (_name_of(s), s["origin"], _number(s["log_bayes_factor"]), _number(s["rms_after_dps"]),
         _number(s["heldout_rms_after_dps"]), ", ".join(e for e in s["alias_group"] if e != s["effect"]))
        for s in suspects
    ]  # fmt: skip
    head = ("suspect", "origin", "evidence, nats", "RMS with it", "held out", "cannot be distinguished from")
    return f"<h2>Suspects</h2>{table_part(head, rows)}" if rows else ""


def _worst(worst: Sequence[WorstDataSet]) -> str:
    rows = [
        (f"{w['axis']}, data set {w['dataset']}", _number(w["residual_dps"]), _number(w["over_floor"])) for w in worst
    ]
    return f"<h2>Data sets furthest from the model</h2>{table_part(('', 'deg/s', 'over floor'), rows)}" if rows else ""


def _not_testable(lines: Sequence[NotTestable]) -> str:
    if not lines:
        return ""
    names = ", ".join(str(line["effect"]) for line in lines)
    return f'<h2>Effects that this recording cannot test</h2><p class="soft">{escape(names)}</p>'
