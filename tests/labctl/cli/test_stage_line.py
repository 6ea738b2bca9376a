"""Stages on a terminal: each in the place of the one before; nothing where there is no terminal."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from labctl.cli import stage_line as module
from labctl.cli.stage_line import stage_line
from labctl.progress import report_stage


def shown(monkeypatch: pytest.MonkeyPatch, *, terminal: bool) -> str:
    text = io.StringIO()
    monkeypatch.setattr(module, "stderr", Console(file=text, force_terminal=terminal, color_system=None))
    with stage_line():
        report_stage("reducing the recording")
        report_stage("fitting the model")
    report_stage("after it")
    return text.getvalue()


def test_each_stage_replaces_the_one_before_and_none_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    clear = "\r\x1b[2K"
    assert shown(monkeypatch, terminal=True) == (
        f"{clear}reducing the recording ...{clear}fitting the model ...{clear}"
    )


def test_nothing_is_shown_without_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    assert shown(monkeypatch, terminal=False) == ""
