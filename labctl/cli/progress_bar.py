"""Progress and time left on the terminal."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from labctl.cli.output import stderr
from labctl.cli.turn_text import turn_text

if TYPE_CHECKING:
    from labctl.services.schemas.campaigns import CampaignResponse


class CampaignProgress:
    """A progress bar on standard error: step, temperatures, rate, wall time gone and left."""

    def __init__(self, *, quiet: bool = False, title: str = "") -> None:
        self._title = title
        self._progress = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(bar_width=28),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(elapsed_when_finished=False),
            console=stderr,
            disable=quiet or not stderr.is_terminal,
            transient=True,
        )
        self._task = self._progress.add_task(title or "starting", total=1.0)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self._progress.stop()

    @property
    def is_shown(self) -> bool:
        """Whether the bar is displayed: standard error is a terminal, and it was not turned off."""
        return not self._progress.disable

    def update(self, answer: CampaignResponse) -> None:
        """Show where the campaign is now."""
        text = turn_text(answer) or answer.step_text
        step = f"{self._title} step {answer.step or 0}/{answer.steps} {text}".strip()
        self._progress.update(self._task, completed=answer.progress, description=step[:64].ljust(64))
