"""The progress of a campaign on terminals of several widths, as rich draws it."""

from __future__ import annotations

import io
import re
from types import SimpleNamespace
from typing import Any

import pytest
from rich.console import Console

from labctl.cli.progress_bar import CampaignProgress

STEP = "data set 12 of 15: +100 deg/s at 25 deg C, z up"


def drawn(width: int) -> list[str]:
    """Return the lines of the display at 40 %, as they stand on a terminal of `width` columns."""
    console = Console(file=io.StringIO(), force_terminal=True, width=width, height=24, color_system=None)
    answer: Any = SimpleNamespace(turn=None, step_text=STEP, step=30, steps=50, progress=0.4)
    bar = CampaignProgress(title="demo", console=console)
    bar.update(answer)
    with console.capture() as capture:
        console.print(bar._progress.get_renderable())
    return [line.rstrip() for line in capture.get().splitlines()]


@pytest.mark.parametrize("width", [60, 80, 120])
def test_bar_and_times_are_whole_and_the_step_is_on_a_line_of_its_own(width: int) -> None:
    step, bar = drawn(width)
    assert max(len(step), len(bar)) <= width
    assert step.startswith("demo step 30/50 data set 12 of 15: +100 deg/s")
    assert re.fullmatch(r"[━╸╺ ]{28}  40% (\d:\d\d:\d\d|-:--:--) left (\d:\d\d:\d\d|-:--:--)", bar), bar


def test_a_step_that_is_too_long_is_shortened_visibly() -> None:
    step, _ = drawn(60)
    assert step.endswith("…")
    assert drawn(80)[0].endswith("z up")


def test_on_a_narrow_terminal_the_bar_gives_way_before_the_times() -> None:
    assert re.search(r"left (\d:\d\d:\d\d|-:--:--)$", drawn(40)[1])
