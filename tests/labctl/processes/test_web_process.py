"""The web process is asked to end more than once, and ends once."""

from __future__ import annotations

import signal

from labctl.processes.web_process import until_sigterm


def test_the_first_request_ends_the_block_and_later_ones_interrupt_nothing() -> None:
    reached = []
    with until_sigterm():
        reached.append("serving")
        signal.raise_signal(signal.SIGTERM)
        reached.append("served on")
    signal.raise_signal(signal.SIGTERM)
    reached.append("closed")
    assert reached == ["serving", "closed"]


def test_a_block_that_ends_by_itself_is_not_interrupted_afterwards() -> None:
    with until_sigterm():
        pass
    signal.raise_signal(signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
