"""A process that gets no processor is late, not silent; what one that stands still was asked is seen."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from instruments.clock import VirtualClock
from labctl.processes import liveness
from labctl.processes.liveness import Silence, run_delays_s
from labctl.processes.supervisor_watch import SupervisorWatch, is_stopped, unheard_end
from labctl.stop.places import ProcessId
from procedures.execution.signals import ENDING
from tests.helpers.signal_defaults import default_signals
from tests.helpers.waiting import eventually


@pytest.fixture
def sleeper() -> Iterator[subprocess.Popen[bytes]]:
    with default_signals():  # one that is ignored is not kept for a process that stands still
        process = subprocess.Popen([sys.executable, "-c", "import signal; signal.pause()"])
    with process:
        yield process
        process.kill()


@pytest.fixture
def delays(monkeypatch: pytest.MonkeyPatch) -> dict[int, float]:
    """How long each thread of a process has waited for a processor, s."""
    found = {11: 5.0, 12: 0.5}
    monkeypatch.setattr(liveness, "run_delays_s", lambda _: dict(found))
    return found


def test_time_without_a_processor_does_not_count(delays: dict[int, float]) -> None:
    clock = VirtualClock()
    silence = Silence(11, excused_s=7.0, clock=clock)
    clock.sleep(4.0)
    assert silence.s == 4.0
    delays[12] += 3.0
    assert (silence.late_s, silence.s) == (3.0, 1.0)
    delays[11] += 1.0  # the two waited at the same time
    assert silence.s == 1.0
    clock.sleep(20.0)
    delays[12] += 20.0
    assert silence.s == 24.0 - 7.0  # not without end
    silence.restart()
    assert (silence.late_s, silence.s) == (0.0, 0.0)


def test_a_thread_that_began_since_counts_whole(delays: dict[int, float]) -> None:
    clock = VirtualClock()
    silence = Silence(11, excused_s=7.0, clock=clock)
    clock.sleep(4.0)
    delays[13] = 2.5
    assert silence.s == 1.5


def test_the_delays_are_those_of_the_kernel(sleeper: subprocess.Popen[bytes]) -> None:
    assert list(run_delays_s(sleeper.pid)) == [sleeper.pid]
    assert run_delays_s(sleeper.pid)[sleeper.pid] >= 0.0
    sleeper.kill()
    sleeper.wait()
    assert run_delays_s(sleeper.pid) == {}


@pytest.mark.parametrize("number", ENDING)
def test_a_request_to_end_is_seen_that_a_process_cannot_hear(
    sleeper: subprocess.Popen[bytes], number: signal.Signals
) -> None:
    assert (is_stopped(sleeper.pid), unheard_end(sleeper.pid)) == (False, False)
    known = ProcessId.of(sleeper.pid)
    os.kill(sleeper.pid, signal.SIGSTOP)
    eventually(lambda: is_stopped(sleeper.pid))
    assert (known.lives, known.stands_still, unheard_end(sleeper.pid)) == (True, True, False)
    os.kill(sleeper.pid, number)
    ended: list[str] = []
    watch = SupervisorWatch(sleeper.pid, lambda: ended.append("asked"))
    watch.start()
    eventually(lambda: bool(ended))
    watch.close()
    assert (ended, unheard_end(sleeper.pid)) == (["asked"], True)
    os.kill(sleeper.pid, signal.SIGCONT)
    sleeper.wait()
    assert (known.lives, known.stands_still, unheard_end(sleeper.pid)) == (False, False, False)


THREADS = """
import signal, sys, threading
never = threading.Event()
def work(ending, told):
    if ending:
        signal.pthread_sigmask(signal.SIG_BLOCK, ending)
    print(int(bool(ending)), threading.get_native_id(), flush=True)
    told.set()
    never.wait()
signal.signal(signal.SIGTERM, lambda *_: None)
for ending in ((), (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)):
    told = threading.Event()
    threading.Thread(target=work, args=(ending, told), daemon=True).start()
    told.wait()
sys.stdin.readline()
"""


def test_a_request_that_another_thread_was_given_is_seen_and_one_that_blocks_all_is_none() -> None:
    with subprocess.Popen([sys.executable, "-c", THREADS], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as threaded:
        try:
            assert threaded.stdout is not None
            said = dict(threaded.stdout.readline().split() for _ in range(2))
            os.kill(threaded.pid, signal.SIGSTOP)
            eventually(lambda: is_stopped(threaded.pid))
            assert not unheard_end(threaded.pid)
            assert ctypes.CDLL(None).tgkill(threaded.pid, int(said[b"0"]), int(signal.SIGTERM)) == 0
            assert unheard_end(threaded.pid)
        finally:
            threaded.kill()


HANDLES = """
import signal, sys
for number in map(int, sys.argv[1:]):
    signal.signal(number, lambda *_: None)
print("ready", flush=True)
while True:
    sum(range(1000))
"""


@pytest.mark.parametrize("number", ENDING)
def test_a_request_in_the_instant_of_the_stop_is_seen_too(number: signal.Signals) -> None:
    """The kernel enters the handler and then stops the process: no signal waits, but the handler has not run."""
    command = [sys.executable, "-c", HANDLES, *(str(int(each)) for each in ENDING)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as busy:
        try:
            assert busy.stdout is not None
            busy.stdout.readline()
            assert not unheard_end(busy.pid)
            os.kill(busy.pid, signal.SIGSTOP)
            os.kill(busy.pid, number)
            eventually(lambda: unheard_end(busy.pid))
        finally:
            busy.kill()
