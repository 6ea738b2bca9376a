"""Progress and time left on the terminal."""

from __future__ import annotations

from collections.abc import Iterable
from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text

from labctl.cli.output import stderr
from labctl.cli.turn_text import turn_text

if TYPE_CHECKING:
    from labctl.answers.campaigns import CampaignResponse

#: Widths of the bar: the other columns of its line take 27 characters.
BAR_WIDTH, MIN_BAR_WIDTH, OTHER_COLUMNS = 28, 8, 27


class _TwoLines(Progress):
    """The step on a line of its own, shortened to the terminal, above the bar and the times, which are never cut."""

    def get_renderables(self) -> Iterable[RenderableType]:
        for task in self.tasks:
            yield Text(task.description, no_wrap=True, overflow="ellipsis")
        yield self.make_tasks_table(self.tasks)


class CampaignProgress:
    """Two lines on standard error: the step; then a bar, wall time gone and left."""

    def __init__(self, *, quiet: bool = False, title: str = "", console: Console = stderr) -> None:
        self._title = title
        self._progress = _TwoLines(
            BarColumn(bar_width=min(BAR_WIDTH, max(MIN_BAR_WIDTH, console.width - OTHER_COLUMNS))),
            TaskProgressColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(elapsed_when_finished=False),
            console=console,
            disable=quiet or not console.is_terminal,
            transient=True,
        )
        self._task = self._progress.add_task(title or "starting", total=1.0)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
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
        self._progress.update(self._task, completed=answer.progress, description=step)
