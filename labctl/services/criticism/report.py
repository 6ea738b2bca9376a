"""A criticism as a page to keep or to send: everything in one file."""

from __future__ import annotations

from pathlib import Path

from labctl.answers.criticism import CriticismResponse
from labctl.plots import report_html
from labctl.services.criticism.comparison import drawn_comparison
from labctl.services.criticism.ladder import ladder
from labctl.store import Store


def write_report(store: Store, answer: CriticismResponse, path: Path) -> None:
    """Write a criticism with its pictures and the unit's ladder. Raises OSError where the file cannot be written."""
    steps = ladder(store, answer.serial)
    compared = drawn_comparison(store, answer.serial, answer.version, answer.recording)
    page = report_html(answer, steps, compared)
    path.write_text(page, encoding="utf-8")
