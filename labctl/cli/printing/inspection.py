"""An inspection as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from labctl.cli.output import console, print_warnings

if TYPE_CHECKING:
    from labctl.answers.inspection import InspectionResponse
    from labctl.answers.recording_head import LeftOut


def print_left_out(left_out: Sequence[LeftOut]) -> None:
    """Print what was left out of a recording by choice, each kind on one line."""
    for entry in left_out:
        place_text = f" of {entry.channel}" if entry.channel else ""
        console.print(
            f"left out: {entry.n} of {entry.of} readings{place_text} ({entry.what}: {entry.why})", soft_wrap=True
        )


def print_inspection(answer: InspectionResponse) -> None:
    """Print the findings of an inspection, what was left out, and what can be."""
    console.print(f"{answer.source}: unit {answer.serial}, motion {answer.motion}, {answer.readings} {answer.kind}")
    print_warnings(answer.warnings)
    print_left_out(answer.left_out)
    if not answer.warnings:
        console.print("nothing is wrong with it that an inspection can find")
    kinds = sorted({warning.what for warning in answer.warnings if warning.may_leave_out})
    if kinds and answer.recording is None:
        options = " ".join(f"--leave-out {kind}" for kind in kinds)
        console.print(f"to leave these readings out: labctl import {answer.source} {options}", style="dim")
    elif kinds:
        console.print(f"to leave these readings out, import the file again with --leave-out {kinds[0]}", style="dim")
