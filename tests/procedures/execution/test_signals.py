"""Scopes that hold signals back, and what they leave behind."""

from __future__ import annotations

import signal
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager

import pytest

from procedures.execution.signals import ENDING, defer_signals, ignore_signals, shutdown_hook, signal_handlers

Scope = Callable[[], AbstractContextManager[None]]


def handlers() -> dict[signal.Signals, object]:
    return {number: signal.getsignal(number) for number in ENDING}


@pytest.fixture
def heard() -> list[int]:
    """Numbers of the signals that reach the handlers outside of every scope."""
    numbers: list[int] = []
    for number in ENDING:
        signal.signal(number, lambda number, _frame: numbers.append(number))
    return numbers


SCOPES: list[Scope] = [ignore_signals, defer_signals, lambda: shutdown_hook(lambda: None)]


@pytest.mark.parametrize("scope", SCOPES)
def test_a_scope_restores_the_handlers_it_found(scope: Scope, heard: list[int]) -> None:
    before = handlers()
    with scope():
        assert all(now is not before[number] for number, now in handlers().items())
    assert handlers() == before
    with pytest.raises(RuntimeError), scope():
        raise RuntimeError
    assert handlers() == before
    assert heard == []


@pytest.mark.parametrize("scope", SCOPES)
def test_another_thread_than_the_main_one_changes_nothing(scope: Scope) -> None:
    def inside() -> dict[signal.Signals, object]:
        with scope():
            return handlers()

    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(inside).result() == handlers()


def test_a_handler_that_was_replaced_meanwhile_is_left_alone(heard: list[int]) -> None:
    before = handlers()
    with signal_handlers(dict.fromkeys(ENDING, signal.SIG_IGN)):
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
    assert handlers() == {**before, signal.SIGTERM: signal.SIG_DFL}
    assert heard == []


def test_a_shutdown_hook_is_called_before_the_handler_that_was_there(heard: list[int]) -> None:
    with shutdown_hook(lambda: heard.append(-1)):
        signal.raise_signal(signal.SIGTERM)
    signal.raise_signal(signal.SIGTERM)
    assert heard == [-1, signal.SIGTERM, signal.SIGTERM]


def test_an_ignored_signal_is_noted_and_a_deferred_one_comes_once_after_the_block(heard: list[int]) -> None:
    noted: list[int] = []
    with ignore_signals(noted.append):
        signal.raise_signal(signal.SIGHUP)
    assert (noted, heard) == ([signal.SIGHUP], [])
    with defer_signals():
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        assert heard == []
    assert heard == [signal.SIGINT]
