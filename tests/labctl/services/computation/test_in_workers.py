"""Work in worker processes: what comes back, within which limits, and that each end of a worker is one clear error."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from instruments.errors import NoReply
from labctl.acting_user import Actor, acting
from labctl.errors import ComputationEnded, DataRefused, TooBusy
from labctl.processes.web_process import WORKER_MODULES
from labctl.progress import Cancelled, reporting_to
from labctl.services.computation import InThreads, InWorkers, Limits
from labctl.store import Store, open_store
from tests.helpers import computations as work
from tests.helpers.patience import WAIT_S

LIMITS = Limits(at_once=1, waiting=2, memory_mib=64, niceness=1)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(str(tmp_path / "lab.sqlite"), write=True) as opened:
        yield opened


@pytest.fixture
def workers(store: Store) -> Iterator[InWorkers]:
    made = InWorkers(store, LIMITS, preload=WORKER_MODULES)
    yield made
    made.close()


def test_result_stages_and_actor_are_those_of_threads(store: Store, workers: InWorkers) -> None:
    for computation in (InThreads(store), workers):
        stages: list[str] = []
        with acting(Actor("another user")), reporting_to(stages.append):
            assert computation.run(work.who_asks, "yes") == ("yes", "another user")
        assert stages == ["first", "second"]


def test_an_error_comes_back_as_it_was_raised(workers: InWorkers) -> None:
    with pytest.raises(DataRefused, match="it is wrong") as refused:
        workers.run(work.fail_with, DataRefused("it is wrong", [{"said": "so"}]))
    assert refused.value.warnings == [{"said": "so"}]
    with pytest.raises(NoReply, match="table: silent") as silent:
        workers.run(work.fail_with, NoReply("table", "silent"))
    assert silent.value.device == "table"
    with pytest.raises(ZeroDivisionError) as wrong:
        workers.run(work.fail_with, ZeroDivisionError("a mistake"))
    assert "computations.py" in "".join(wrong.value.__notes__)


def test_memory_is_bounded(workers: InWorkers) -> None:
    assert workers.run(work.take_memory, 16) == 16 << 20
    with pytest.raises(ComputationEnded, match="memory limit 64 MiB"):
        workers.run(work.take_memory, 128)


def test_a_worker_that_is_killed_is_one_clear_error(workers: InWorkers) -> None:
    with pytest.raises(ComputationEnded, match=r"was killed \(SIGKILL.*memory limit 64 MiB"):
        workers.run(work.die)
    assert workers.run(work.who_asks, "yes")[0] == "yes"


def test_a_deadline_ends_a_computation(store: Store, tmp_path: Path) -> None:
    hasty = InWorkers(store, replace(LIMITS, deadline_s=0.0))
    held = work.Held(tmp_path)
    with pytest.raises(ComputationEnded, match="ended after 0 s"):
        hasty.run(work.hold, held.pipe)
    hasty.close()


def test_a_worker_is_nice_and_inherits_nothing_that_is_open(
    store: Store, workers: InWorkers, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "/now")
    niceness, space, variable, opened = workers.run(work.surroundings)
    assert niceness >= LIMITS.niceness
    assert 64 << 20 < space < 4 << 30
    assert variable == "/now"
    assert not [path for path in opened if ".lock" in path]
    assert len([path for path in opened if "lab.sqlite" in path]) <= 3  # its own: the file, its log and the log's index


def test_a_client_that_leaves_ends_its_worker_at_once(workers: InWorkers, tmp_path: Path) -> None:
    held = work.Held(tmp_path)
    pending = workers.submit(work.hold, held.pipe)
    held.wait_for_begin()
    pending.leave()
    held.wait_for_end()
    with pytest.raises(Cancelled):
        pending.future.result(WAIT_S)
    assert workers.run(work.who_asks, "yes")[0] == "yes"


class Client:
    """Hears stages."""

    def __init__(self) -> None:
        self.stages: list[str] = []
        self._heard = threading.Event()

    def __call__(self, stage: str) -> None:
        self.stages.append(stage)
        self._heard.set()

    def wait(self) -> None:
        assert self._heard.wait(WAIT_S)


def test_one_of_two_that_ask_the_same_may_leave(workers: InWorkers, tmp_path: Path) -> None:
    clients = Client(), Client()
    held = work.Held(tmp_path)
    one = workers.submit(work.hold, held.pipe, key="same", progress=clients[0])
    held.wait_for_begin()
    two = workers.submit(work.hold, held.pipe, key="same", progress=clients[1])
    other = workers.submit(work.who_asks, "no", key="same")
    assert (two.same, other.same, other.future is one.future) == (True, False, True)
    for client in clients:
        client.wait()
    one.leave()
    other.leave()
    assert not two.future.done()
    two.leave()
    held.wait_for_end()
    assert [client.stages for client in clients] == [["held"], ["held"]]


def test_the_queue_is_bounded_and_in_order(workers: InWorkers, tmp_path: Path) -> None:
    held = work.Held(tmp_path)
    first = workers.submit(work.hold, held.pipe)
    held.wait_for_begin()
    stages: list[str] = []
    begun: list[str] = []
    second = workers.submit(work.who_asks, "second", progress=stages.append)
    third = workers.submit(work.who_asks, "third", progress=begun.append)
    with pytest.raises(TooBusy, match="1 computations are running and 2 are waiting") as busy:
        workers.submit(work.who_asks, "fourth")
    assert busy.value.retry_after_s >= 1
    assert stages == ["waiting for earlier computations: 1"]
    second.leave()
    fourth = workers.submit(work.who_asks, "fourth", progress=lambda stage: begun.append(f"4 {stage}"))
    first.leave()
    held.wait_for_end()
    assert third.future.result(WAIT_S)[0] == "third"
    assert fourth.future.result(WAIT_S)[0] == "fourth"
    assert begun.index("second") < begun.index("4 first")
    assert stages == ["waiting for earlier computations: 1"]


def test_closing_ends_what_runs_and_refuses_what_waits(store: Store, tmp_path: Path) -> None:
    workers = InWorkers(store, LIMITS)
    held = work.Held(tmp_path)
    pending = [workers.submit(work.hold, held.pipe), workers.submit(work.who_asks, "never")]
    held.wait_for_begin()
    workers.close()
    held.wait_for_end()
    for each in pending:
        with pytest.raises(ComputationEnded, match="the service is stopping"):
            each.future.result(WAIT_S)
    with pytest.raises(ComputationEnded, match="the service is stopping"):
        workers.submit(work.serials)


def test_what_writes_stays_here_until_a_worker_can_write(tmp_path: Path) -> None:
    location = str(tmp_path / "other.sqlite")
    with open_store(location, write=True) as store:
        workers = InWorkers(store, LIMITS)
        assert workers.run(work.process, writes=True) == work.process(store)
        assert workers.run(work.process) != work.process(store)
        workers.close()
    with open_store(location, write=False) as store:
        workers = InWorkers(store, LIMITS, address=work.Writable(location))
        assert workers.run(work.process, writes=True) != work.process(store)
        workers.close()
