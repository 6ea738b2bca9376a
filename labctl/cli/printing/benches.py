"""Benches as text: a check, with a line per fault, what to do and what was found of each instrument; and the state."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from labctl.cli.output import console

if TYPE_CHECKING:
    from collections.abc import Iterator

    from labctl.answers.benches import BenchCheckResponse, BenchStatus, DeviceCheck

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


def print_status(bench: BenchStatus) -> None:
    """Print the state of a bench, what a lost process left on it, and which process drives it, a line each."""
    left = [f"not in its safe state; campaigns that did not end: {campaign}" for campaign in bench.left]
    remarks = [each for each in [bench.unconfirmed, *_attempts(bench), *left] if each]
    well = "no campaign was begun on the bench yet" if bench.last_used_at is None else "the safe state is confirmed"
    driver = [] if bench.driver is None else [bench.driver.text]
    for line in [*(remarks or [well]), *driver]:
        console.print(f"{bench.name:18} {line}", soft_wrap=True)


def _attempts(bench: BenchStatus) -> Iterator[str]:
    """Yield how labctl went on with a safe state that was not confirmed."""
    if bench.attempts:
        yield f"labctl tried {bench.attempts} more times to set the safe state, last at {bench.attempted_at}"
    if bench.confirmed_at:
        yield (
            f"labctl confirmed the safe state at {bench.confirmed_at}; a person must still inspect the bench, then run "
            "`labctl bench clear`"
        )
