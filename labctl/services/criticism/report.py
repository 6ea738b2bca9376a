"""A criticism as a page to keep or to send: everything in one file."""

from __future__ import annotations

from pathlib import Path

from labctl.plots import report_html
from labctl.services.criticism.ladder import ladder
from labctl.services.schemas.criticism import CriticismResponse
from labctl.store import Store


def write_report(store: Store, answer: CriticismResponse, path: Path) -> None:
    """Write a criticism with its pictures and the unit's ladder. Raises OSError where the file cannot be written."""
    steps = ladder(store, answer.serial)
    path.write_text(report_html(answer.model_dump(mode="json"), steps.model_dump(mode="json")), encoding="utf-8")
