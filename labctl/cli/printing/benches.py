"""The check of a bench as text: a line per fault, with what to do, and what was found of each instrument."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from labctl.cli.output import console

if TYPE_CHECKING:
    from labctl.answers.benches import BenchCheckResponse, DeviceCheck

MARKS = {"good": Text("answers", "green"), "doubtful": Text("doubt  ", "yellow"), "bad": Text("failed ", "red")}


def print_check(answer: BenchCheckResponse) -> None:
    """Print what was found of each instrument; what is wrong comes first, a line each."""
    for device in answer.devices:
        _print_device(device)
    wrong = sum(finding.state == "bad" for device in answer.devices for finding in device.findings)
    doubts = sum(finding.state == "doubtful" for device in answer.devices for finding in device.findings)
    words = f"{wrong} wrong, {doubts} doubtful" if wrong or doubts else "nothing is wrong"
    console.print(f"{answer.bench} at {answer.checked_at:%Y-%m-%d %H:%M:%S} UTC: {words}")


def _print_device(device: DeviceCheck) -> None:
    good = [finding for finding in device.findings if finding.state == "good"]
    release = f"[{device.driver} of {device.distribution} {device.version}]"
    for finding in device.findings:
        if finding.state != "good":
            console.print(MARKS[finding.state], f"  {device.device:8} ", sep="", end="")
            console.print(finding.text, soft_wrap=True)
    if good:
        first, *others = (finding.text for finding in good)
        console.print(MARKS["good"], f"  {device.device:8} ", sep="", end="")
        console.print(f"{first}  {release}", soft_wrap=True)
        if others:
            console.print(f"{'':19}{'; '.join(others)}", soft_wrap=True)
