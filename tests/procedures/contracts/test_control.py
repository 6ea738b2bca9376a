"""Requests to a running campaign from another thread."""

from __future__ import annotations

from procedures.contracts.control import Control


def test_the_last_request_counts_and_an_abort_is_final() -> None:
    control = Control()
    control.pause("lunch")
    assert (control.request.pause, control.request.reason) == (True, "lunch")
    control.resume("back")
    assert (control.request.pause, control.request.abort) == (False, False)
    control.abort("smoke")
    control.resume("no, wait")
    assert (control.request.abort, control.request.reason) == (True, "smoke")
    assert not control.request.resumable


def test_a_lost_bench_interrupts_when_it_is_polled_and_not_when_the_request_is_read() -> None:
    losses = [""]
    control = Control(lambda: losses[-1])
    assert not control.poll().abort
    losses.append("the lease is another's")
    assert not control.request.abort
    request = control.poll()
    assert (request.abort, request.resumable, request.reason) == (True, True, "the lease is another's")
    losses.append("")
    assert control.poll() == request


def test_an_abort_is_not_made_an_interruption_by_a_lost_bench() -> None:
    control = Control(lambda: "the lease is another's")
    control.abort("smoke")
    assert (control.poll().reason, control.poll().resumable) == ("smoke", False)
