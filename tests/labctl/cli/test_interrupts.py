"""Interrupted commands: one line, an exit status, and the handlers of signals as they were."""

from __future__ import annotations

import signal

import pytest
import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.interrupts import ending_is_an_interrupt, process_of_one_command
from labctl.errors import Stopped
from procedures.execution.signals import ENDING


def handlers() -> dict[signal.Signals, object]:
    return {number: signal.getsignal(number) for number in ENDING}


def interrupt_twice() -> None:
    """Act as a command that is interrupted, and once more while it closes what it had opened."""
    try:
        with ending_is_an_interrupt():
            signal.raise_signal(signal.SIGTERM)
    finally:
        signal.raise_signal(signal.SIGINT)
        assert set(handlers().values()) == {signal.SIG_IGN}


@pytest.mark.parametrize("number", ENDING)
def test_a_signal_ends_a_command_and_the_handlers_are_restored(
    number: signal.Signals, capsys: pytest.CaptureFixture[str]
) -> None:
    before = handlers()
    with pytest.raises(typer.Exit) as ended, one_clear_line(), ending_is_an_interrupt():
        signal.raise_signal(number)
    assert ended.value.exit_code == 130
    assert capsys.readouterr().err == "labctl: interrupted\n"
    assert handlers() == before


def test_later_signals_are_ignored_until_the_line_is_written(capsys: pytest.CaptureFixture[str]) -> None:
    before = handlers()
    with pytest.raises(typer.Exit), one_clear_line():
        interrupt_twice()
    assert capsys.readouterr().err == "labctl: interrupted\n"
    assert handlers() == before


def test_a_command_without_a_signal_leaves_the_handlers_as_they_were() -> None:
    before = handlers()
    with one_clear_line(), ending_is_an_interrupt():
        assert all(now is not before[number] for number, now in handlers().items())
    assert handlers() == before


@pytest.mark.parametrize("error", [KeyboardInterrupt(), Stopped("campaign 1 was stopped")])
def test_a_process_that_ends_with_its_command_ignores_signals_to_its_exit(error: BaseException) -> None:
    with pytest.raises(typer.Exit), process_of_one_command(), one_clear_line():
        raise error
    assert set(handlers().values()) == {signal.SIG_IGN}


def stop_and_interrupt(times: int) -> None:
    """Act as a campaign that was stopped, while what it had opened is closed in spite of further signals."""
    try:
        if times == 0:
            raise Stopped("campaign 1 was stopped")
        stop_and_interrupt(times - 1)
    finally:
        if times:
            raise KeyboardInterrupt


@pytest.mark.parametrize("times", [0, 1, 3])
def test_signals_while_a_stopped_campaign_is_closed_take_nothing_from_the_message(
    times: int, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(typer.Exit) as ended, one_clear_line():
        stop_and_interrupt(times)
    assert ended.value.exit_code == 130
    assert capsys.readouterr().err == "labctl: campaign 1 was stopped\n"
