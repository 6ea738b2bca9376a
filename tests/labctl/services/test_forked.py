"""A computation in a fork: the same result, the same errors, and nothing left behind."""

from __future__ import annotations

import os
import threading
from contextlib import closing

import numpy as np
import pytest

from labctl.errors import BadInput
from labctl.services import forked
from labctl.services.forked import Forked, can_fork


@pytest.fixture(params=[False, True], ids=["here", "in a fork"])
def forks(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    monkeypatch.setattr(forked, "can_fork", lambda: request.param)
    return bool(request.param)


def test_the_result_is_the_same_here_and_in_a_fork(forks: bool) -> None:
    with closing(Forked(lambda: (os.getpid(), np.arange(3e5)))) as computed:
        assert computed.is_forked == forks
        by, values = computed.result()
    assert (by != os.getpid()) == forks
    assert np.array_equal(values, np.arange(3e5))


def test_an_error_is_raised_where_the_result_is_asked_for(forks: bool) -> None:
    def fail() -> int:
        raise BadInput("no such data set")

    with closing(Forked(fail)) as computed, pytest.raises(BadInput, match="no such data set"):
        computed.result()


def test_a_fork_that_is_killed_is_replaced_by_work_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forked, "can_fork", lambda: True)
    own = os.getpid()

    def work() -> int:
        if os.getpid() != own:
            os._exit(9)
        return os.getpid()

    with closing(Forked(work)) as computed:
        assert computed.result() == own


def test_a_result_that_nobody_wants_does_not_keep_its_fork(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(forked, "can_fork", lambda: True)
    computed = Forked(lambda: threading.Event().wait(600))
    computed.close()
    assert not computed._process.is_alive()


def test_a_process_with_several_threads_is_not_forked() -> None:
    over = threading.Event()
    thread = threading.Thread(target=over.wait)
    thread.start()
    try:
        assert not can_fork()
    finally:
        over.set()
        thread.join()
