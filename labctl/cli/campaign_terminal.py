"""The terminal of a campaign that runs in the foreground: progress, prompts, and signals that end it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager

from labctl.cli.interrupts import ending_is_an_interrupt
from labctl.cli.output import stderr
from labctl.cli.progress_bar import CampaignProgress
from labctl.cli.terminal_operator import TerminalOperator, ask_bench_clear
from labctl.services.commands.foreground_control import CampaignTerminal, OpenTerminal


def campaign_terminal(*, quiet: bool) -> OpenTerminal:
    """Return a function that opens the terminal for one campaign; `quiet`: without a progress bar."""

    @contextmanager
    def opened() -> Iterator[CampaignTerminal]:
        with (
            ending_is_an_interrupt(),
            closing(TerminalOperator()) as operator,
            CampaignProgress(quiet=quiet) as progress,
        ):
            observe = progress.update if progress.is_shown else None
            yield CampaignTerminal(observe, operator.answer_prompts, _say, ask_bench_clear)

    return opened


def _say(text: str) -> None:
    """Print a remark on standard error, beside the answer."""
    stderr.print(f"labctl: {text}")
