"""The end of a bench process: what is under way is answered, what comes later is refused, and neither takes long."""

from __future__ import annotations

import threading
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, cast

import pytest

from instruments.clock import WallClock
from labctl.errors import BenchSilent
from labctl.processes import bench_rpc
from labctl.processes.bench_methods import method_of
from labctl.processes.bench_rpc import BenchRpc
from labctl.processes.held_address import HeldAddress
from labctl.processes.rpc import RpcClient, RpcServer
from labctl.processes.supervision import Supervision
from labctl.services.local_bench import LocalBench
from labctl.store import Store
from tests.helpers.patience import WAIT_S

AT = datetime(2026, 1, 5, 8, tzinfo=UTC)
RENEW, RENEWAL = "store.Leases.renew", ("bench", "owner", AT, AT)


class SlowStore:
    """A store whose transaction lasts until `go_on` is set, and that notes a use after it was closed."""

    location = ""

    def __init__(self) -> None:
        self.begun, self.go_on = threading.Event(), threading.Event()
        self.is_closed, self.used_closed = False, False

    def run(self, *_: Any) -> bool:
        self.begun.set()
        self.go_on.wait(WAIT_S)
        self.used_closed |= self.is_closed
        return True


class Bench:
    """The calls of a bench process over their socket, with one that is under way."""

    def __init__(self, folder: Path) -> None:
        self.store = SlowStore()
        local = LocalBench(cast(Store, self.store), WallClock(), None)
        self.calls = BenchRpc(
            cast(Store, self.store), local, cast(Supervision, None), cast(HeldAddress, None), WallClock()
        )
        self.server = RpcServer(folder / "calls", self.calls.answer, method_of)
        self.server.start()
        self.caller, self.other = (RpcClient(folder / "calls", WAIT_S, method_of) for _ in range(2))
        assert self.caller.call("bench.describe") is None  # its connection is kept
        self.answers: list[object] = []
        self.asking = threading.Thread(target=lambda: self.answers.append(self.other.call(RENEW, *RENEWAL)))
        self.asking.start()
        self.store.begun.wait(WAIT_S)

    def leave(self) -> None:
        """Let what is under way end, and close the connections."""
        self.store.go_on.set()
        self.asking.join(WAIT_S)
        self.caller.close()
        self.other.close()

    def end(self) -> None:
        """Close in the order of the process."""
        self.server.close()
        self.calls.close()
        self.store.is_closed = True


def test_a_call_that_is_under_way_is_answered_before_the_database_is_closed(tmp_path: Path) -> None:
    bench = Bench(tmp_path)
    ending = threading.Thread(target=bench.end)
    ending.start()
    while not bench.calls._under_way._is_over:
        threading.Event().wait(0.01)
    with pytest.raises(BenchSilent, match="the bench process is ending; wait for its restart, then try again"):
        bench.caller.call(RENEW, *RENEWAL)  # over the connection that is kept
    assert ending.is_alive()
    bench.leave()
    ending.join(WAIT_S)
    assert (bench.answers, bench.store.used_closed) == ([True], False)


def test_a_call_that_does_not_end_is_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench_rpc, "UNDER_WAY_S", 0.05)
    bench = Bench(tmp_path)
    bench.end()
    assert bench.store.is_closed
    bench.leave()
