"""What several recordings say together, as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from labctl.cli.output import console, format_number

if TYPE_CHECKING:
    from labctl.answers.joint import JointJson


def print_joint(joint: JointJson | None) -> None:
    """Print what several recordings say together, if there are several."""
    if joint is None:
        return
    numbers = ", ".join(map(str, joint["recordings"]))
    console.print(f"  recordings         {numbers}, fitted together")
    for line in joint["held_out"]:
        error = f"{format_number(line['rms_dps'])} deg/s RMS" if line["rms_dps"] is not None else line["why"]
        console.print(f"  recording {line['recording']:<10} predicted by a fit to the others: {error}")
    for sentence in joint["text"]:
        console.print(f"  {sentence}", soft_wrap=True)
