"""What a person who turns a unit reads: what was covered, what is asked for, and how sure the coefficients are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

from rich.control import Control
from rich.segment import ControlType

from labctl.cli.output import console, stderr
from labctl.shown_unit import size_text

if TYPE_CHECKING:
    from labctl.answers.live import LiveResponse
    from labctl.fitting.live import LiveState


#: So long nothing is said of what the readings lack, s.
BEGINNING_S = 5.0


class LivePrinter:
    """Prints on standard error: a line after each rest, the next request, and on a terminal how long it rests."""

    def __init__(self) -> None:
        self._printed: tuple[object, ...] = ()
        self._line_is_open = False
        self._said: set[str] = set()

    def show(self, state: LiveState) -> None:
        """Show a state; nothing is printed where nothing has changed."""
        question = state.request.text if state.request is not None else ""
        now = (state.covered, question)
        if now != self._printed:
            self._clear()
            self._printed = now
            stderr.print(_progress(state))
            if question:
                stderr.print(f"next: {question}")
        for text in state.left_out:
            if text not in self._said:
                self._said.add(text)
                self.say(text)
        if stderr.is_terminal:
            self._clear()
            wanted_s = state.request.rest_s if state.request is not None else 0.0
            doing = f"at rest for {state.still_s:.1f} s of {wanted_s:g} s" if state.still_s > 0 else "in motion"
            stderr.print(f"{state.t_s:.0f} s: {doing}", style="dim", end="")
            self._line_is_open = True

    def say(self, text: str) -> None:
        """Print a remark."""
        self._clear()
        stderr.print(f"labctl: {text}")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._clear()

    def _clear(self) -> None:
        if self._line_is_open:
            stderr.control(Control(ControlType.CARRIAGE_RETURN, (ControlType.ERASE_IN_LINE, 2)))
            self._line_is_open = False


def _progress(state: LiveState) -> str:
    parts = [f"{state.t_s:.0f} s: {state.rests} rests, {len(state.covered)} of {state.wanted} poses"]
    worst = state.worst
    if worst is not None:
        limit = "" if worst.limit is None else f" (limit {size_text(worst.limit, worst.unit, worst.name)})"
        shown = size_text(worst.expanded, worst.unit, worst.name)
        parts.append(f"largest U: {worst.name} of {worst.axis}, {shown}{limit}")
    elif not state.covered and state.t_s > BEGINNING_S:
        parts.append(state.missing[-1])
    if state.turns_left:
        parts.append(f"about {state.turns_left} more turns")
    if state.damaged or state.lost:
        parts.append(f"{state.damaged} lines or frames damaged, {state.lost} readings lost")
    return "; ".join(parts)


def print_live(answer: LiveResponse) -> None:
    """Print the result of a live calibration."""
    console.print(
        f"recording {answer.recording} of {answer.serial}: {answer.readings} readings in {answer.duration_s:.0f} s, "
        f"{answer.rests} rests, {len(answer.poses)} of {answer.poses_asked} poses"
    )
    if answer.fit is not None:
        from labctl.cli.printing.calibrations import print_fit

        print_fit(answer.fit)
        return
    for coefficient in answer.coefficients:
        unit_symbol, name = coefficient.unit, coefficient.name
        limit = "" if coefficient.limit is None else f", limit {size_text(coefficient.limit, unit_symbol, name)}"
        console.print(
            f"{coefficient.axis} {name}: {size_text(coefficient.value, unit_symbol, name)}, U = "
            f"{size_text(coefficient.expanded, unit_symbol, name)} (k = 2{limit})"
        )
    console.print(f"not complete: {answer.text}" if not answer.complete else f"no version: {answer.refused}")
    for text in answer.missing:
        console.print(f"missing: {text}", soft_wrap=True)
    if answer.coefficients:
        console.print(f"next: labctl fit {answer.serial} --recording {answer.recording} --model poses", style="dim")
