"""Scopes that hold signals back, and what they leave behind."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager

import pytest

from procedures.execution.signals import ENDING, defer_signals, ignore_signals, shutdown_hook, signal_handlers
from tests.helpers.patience import WAIT_S

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


def test_a_shutdown_hook_is_called_once_and_the_handler_that_was_there_for_every_signal(heard: list[int]) -> None:
    called: list[str] = []
    with shutdown_hook(lambda: called.append(threading.current_thread().name)):
        signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGHUP)
    signal.raise_signal(signal.SIGTERM)
    assert called == ["shutdown-hook"]
    assert heard == [signal.SIGTERM, signal.SIGHUP, signal.SIGTERM]


def test_a_shutdown_hook_may_take_a_lock_that_the_main_thread_holds_when_the_signal_comes(heard: list[int]) -> None:
    lock, taken = threading.Lock(), list[bool]()
    with shutdown_hook(lambda: taken.append(lock.acquire(timeout=WAIT_S))), lock:
        signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGTERM)
    assert (taken, heard) == ([True], [signal.SIGTERM, signal.SIGTERM])


def test_without_a_signal_a_shutdown_hook_is_not_called_also_not_by_a_handler_that_was_kept(heard: list[int]) -> None:
    called: list[int] = []
    with shutdown_hook(lambda: called.append(1)):
        kept = signal.getsignal(signal.SIGTERM)
    assert callable(kept)
    kept(signal.SIGTERM, None)
    assert (called, heard) == ([], [signal.SIGTERM])


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
