"""The present stage of a long computation, on one line of the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.control import Control
from rich.segment import ControlType

from labctl.cli.output import stderr
from labctl.progress import reporting_to


@contextmanager
def stage_line() -> Iterator[None]:
    """Show the stages of what is computed inside on standard error, each in the place of the one before.

    Nothing is shown where standard error is no terminal, and nothing is left at the end.
    """
    if not stderr.is_terminal:
        yield
        return

    def clear() -> None:
        stderr.control(Control(ControlType.CARRIAGE_RETURN, (ControlType.ERASE_IN_LINE, 2)))

    def show(stage: str) -> None:
        clear()
        stderr.print(f"{stage} ...", style="dim", end="")

    try:
        with reporting_to(show):
            yield
    finally:
        clear()
