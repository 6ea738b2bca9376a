"""Calls of other processes that the bench process answers."""

from __future__ import annotations

import contextlib
import threading
from multiprocessing.connection import Connection
from typing import Any

from instruments.clock import Clock
from labctl.acting_user import acting
from labctl.errors import BenchSilent
from labctl.log import get_logger
from labctl.log.context import for_request
from labctl.processes.bench_methods import Beat, method_of
from labctl.processes.documents import answer
from labctl.processes.held_address import HeldAddress
from labctl.processes.rpc import Answer, UnderWay, answer_with
from labctl.processes.rpc_methods import Call
from labctl.processes.settings import BenchSettings
from labctl.processes.supervision import Supervision
from labctl.services.commands.acts.catalogue import BENCH_ACTS
from labctl.services.commands.context import CommandContext
from labctl.services.local_bench import LocalBench
from labctl.store import Store

log = get_logger()

#: Longest interval between two messages to a watcher, s.
BEAT_S = 1.0
#: Shortest interval between two messages to a watcher, s.
MIN_BEAT_S = 0.1
#: Time to answer the pending calls when the process ends, s.
UNDER_WAY_S = 2.0


class BenchRpc:
    """Answers the calls of other processes."""

    def __init__(
        self, store: Store, local: LocalBench, supervision: Supervision, address: HeldAddress, clock: Clock
    ) -> None:
        """`clock` gives the date of the service, which may be simulated."""
        self._store, self._local, self._supervision, self._address = store, local, supervision, address
        self._under_way = UnderWay()
        self._watchers: set[Connection] = set()
        self._context = CommandContext(lambda: store, clock, local.control)

    @property
    def is_watched(self) -> bool:
        """Whether a web process is connected, which answers at the service's address."""
        return bool(self._watchers)

    def answer(self, call: Call, connection: Connection) -> Answer | None:
        """Answer a call; None where the connection is kept for a watcher or a supervisor."""
        if call.name == "address.give_back":
            self._address.give_back()
            return Answer()
        if call.name == "watch":
            self._watch(connection)
            return None
        if not self._under_way.begin():
            return Answer(raised=BenchSilent("the bench process is ending; wait for its restart, then try again"))
        try:
            if call.name == "supervise":
                return self._supervise(call, connection)
            with acting(call.actor), for_request(call.request_id):
                return answer_with(lambda: self._value(call))
        finally:
            self._under_way.end()

    def close(self) -> None:
        """Refuse every call from now on, and wait for those that use bench and database, `UNDER_WAY_S` at most.

        No stop waits for it: a stop has a socket and a thread of its own.
        """
        if left := self._under_way.close(UNDER_WAY_S):
            log.warning("calls.under_way", count=left, waited_s=UNDER_WAY_S)

    def _supervise(self, call: Call, connection: Connection) -> Answer | None:
        wanted = call.arguments["wanted"]
        assert isinstance(wanted, BenchSettings)  # by the types of the method
        answer = answer_with(lambda: self._supervision.take_charge(wanted, connection))
        return None if answer.raised is None else answer

    def _value(self, call: Call) -> Any:
        area, _, name = call.name.partition(".")
        if area == "store":
            return self._store.run(name, (), call.arguments)
        if area == "control":
            return BENCH_ACTS[name].execute(self._context, call.arguments["request"])
        if call.name == "bench.live":
            campaign = call.arguments["campaign"]
            assert isinstance(campaign, int)  # by the types of the method
            return self._local.runs(campaign), self._local.status(campaign)
        if call.name == "bench.describe":
            return self._local.describe()
        if call.name == "bench.live_state":
            return self._local.live_state(watched=bool(call.arguments["watched"]))
        if call.name == "bench.live_history":
            return self._local.live_history()
        raise KeyError(call.name)

    def _watch(self, connection: Connection) -> None:
        """Send the state to a watcher at every change until it disconnects, in the thread of its connection."""
        changed, never, form = threading.Event(), threading.Event(), method_of("watch").result
        remove = self._local.listen(changed.set)
        self._watchers.add(connection)
        try:
            with contextlib.suppress(OSError):
                while True:
                    local = self._local
                    beat = Beat(local.running, local.stops, local.schedule_trouble, local.not_stopped)
                    connection.send_bytes(answer(form, beat))
                    changed.wait(BEAT_S)
                    changed.clear()
                    never.wait(MIN_BEAT_S)
        finally:
            self._watchers.discard(connection)
            remove()
            connection.close()
