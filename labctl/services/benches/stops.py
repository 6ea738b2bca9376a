"""The stops of one bench: those that are still to be carried out, and those that keep the bench from moving by itself.

The latch lies outside process and database (labctl.stop.latch). What drives the bench reads it before anything moves,
carries out what is open, writes each stop into the audit trail once, and notes in the latch that it did.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from datetime import datetime, timedelta

from instruments.clock import WallClock
from labctl.answers.benches import BenchStop
from labctl.errors import BenchBusy
from labctl.log import get_logger
from labctl.stop.latch import LatchState, StopRequest
from labctl.stop.places import place_of
from labctl.store import Store

log = get_logger()

#: The clocks of the one who asks and of the audit trail are the same, but for the time of a transaction.
EARLIER = timedelta(minutes=1)
#: A disk that stands still delays what waits for the latch by so much at most, s.
WRITTEN_WITHIN_S = 2.0
#: From here on it is reported that the bench is not stopped.
LATE = timedelta(seconds=3)


class BenchStops:
    """The latch of one bench, and the audit rows of its stops. Any thread may use it."""

    def __init__(self, store: Store, bench: str) -> None:
        """Use the latch of a bench, by its name, beside the database."""
        self._store, self._bench = store, bench
        self.place = place_of(store.location, bench)
        self._latch = self.place.latch
        self._guard = threading.Lock()
        self._recorded: set[str] = set()
        self._writing: set[threading.Thread] = set()
        self._seen: tuple[tuple[int, int], LatchState] = ((0, 0), LatchState())

    def prepare(self) -> None:
        """Make the folder of the bench, and let `labctl stop` find it. A folder that cannot be made is logged."""
        try:
            self._latch.prepare()
        except OSError as error:
            log.error("latch.unwritable", bench=self._bench, error=str(error))
        self.place.register()

    @property
    def state(self) -> LatchState:
        """What the latch says now, with what is being written into it."""
        for thread in tuple(self._writing):  # left in the set until it has ended, so that every reader waits for it
            thread.join(WRITTEN_WITHIN_S)
            self._writing.discard(thread)
        stamp = self._latch.stamp
        if stamp == (0, 0) or stamp != self._seen[0]:
            self._seen = (stamp, self._latch.state())
        return self._seen[1]

    def remember(self, stop: StopRequest) -> None:
        """Write a stop into the latch, in a thread of its own: a stop never waits for a disk."""

        def write() -> None:
            try:
                self._latch.request(stop)
            except OSError as error:
                log.error("latch.unwritable", bench=self._bench, error=str(error))

        thread = threading.Thread(target=write, name="latch", daemon=True)
        thread.start()  # before a reader can see it: only a thread that was started can be waited for
        self._writing.add(thread)

    def record(self, stop: StopRequest, at: datetime) -> None:
        """Write a stop into the audit trail, unless it is there. Raises StoreError."""
        with self._guard:
            if stop.id in self._recorded or self._is_recorded(stop):
                return
            about = f"campaign {stop.campaign}" if stop.campaign is not None else f"bench {self._bench}"
            act = "campaign abort" if stop.campaign is not None else "bench stop"
            detail = {"reason": stop.reason, "stop": stop.id, "asked_at": stop.at, "asked_via": stop.via}
            self._store.audit.record(at, act, about, detail, who=stop.by or None)
            self._recorded.add(stop.id)

    def _is_recorded(self, stop: StopRequest) -> bool:
        try:
            since = datetime.fromisoformat(stop.at) - EARLIER
        except ValueError:  # a stop without a time: it is in the trail of this process, or not at all
            return False
        rows = self._store.audit.rows(since=since)
        return any(row.detail.get("stop") == stop.id for row in rows)

    def carried_out(self, stops: Sequence[StopRequest], text: str) -> None:
        """Note that stops were carried out. A latch that cannot be written keeps them open, which is logged."""
        try:
            self._latch.carried_out([stop.id for stop in stops], text)
        except OSError as error:
            log.error("latch.unwritable", bench=self._bench, error=str(error))

    def note_closed(self, campaign: int, text: str) -> None:
        """Note that the open stops of a campaign that no process ran were carried out, with its end."""
        if stops := [stop for stop in self.state.open if stop.campaign == campaign]:
            self._recorded.update(stop.id for stop in stops)
            self.carried_out(stops, text)

    def refuse_moving(self, by: str | None, known: frozenset[str]) -> None:
        """Return why the bench must not move again yet; `None` as the person: no person asks for it.

        `known`: the stops that had been asked for when the person asked. One that came later was not meant to be taken
        back. Raises BenchBusy while a stop is not carried out, without a person while one holds, and for a later one.
        """
        state = self.state
        if state.open:
            raise BenchBusy(
                f"bench {self._bench} is being stopped ({state.open[-1].reason}); wait until it is in its safe "
                "state, then start again"
            )
        if state.held and by is None:
            raise BenchBusy(self._held_text(state))
        if later := [stop for stop in state.held if stop.id not in known]:
            raise BenchBusy(
                f"bench {self._bench} was stopped ({later[-1].reason}) after this was asked for, so that it does not "
                "move; ask again when it may"
            )
        if state.held and by is not None:
            self.take_back(by)

    def take_back(self, by: str) -> bool:
        """Take back, in a person's name, every stop that holds and was carried out; returns whether there was one."""
        state = self.state
        still = {stop.id for stop in state.open}
        held = [stop for stop in state.held if stop.id not in still]
        if held:
            self._latch.take_back([stop.id for stop in held], by)
            log.warning("stop.taken_back", bench=self._bench, by=by, stops=[stop.reason for stop in held])
        return bool(held)

    def _held_text(self, state: LatchState) -> str:
        stop = state.held[-1]
        return (
            f"bench {self._bench} was stopped at {stop.at[:19].replace('T', ' ')} UTC ({stop.reason}) and does "
            "not move by itself until a person starts or resumes a campaign, or runs `labctl bench clear "
            f"{self._bench} --by NAME`"
        )

    def late_text(self, hindrance: str) -> str:
        """Return what is known of a stop that was asked for more than `LATE` ago and is open; empty where none is."""
        return late_stop(self.state, self._bench, hindrance)

    def describe(self, hindrance: str = "", *, stopping: bool = False) -> BenchStop | None:
        """Return the newest stop that is open or holds; None where there is none.

        `stopping`: whether what drives the bench makes it safe now; `hindrance`: what keeps it from that.
        """
        return describe_stop(self.state, self._bench, hindrance, stopping=stopping)


def late_stop(state: LatchState, bench: str, hindrance: str = "") -> str:
    """Return what is known of a stop of a latch that is late; empty where none is."""
    now = WallClock().utc()
    for stop in state.unconfirmed:
        try:
            late = now - datetime.fromisoformat(stop.at) > LATE
        except ValueError:  # no time is known, so it may be long ago
            late = True
        if late:
            return f"bench {bench}: {hindrance or 'no process has confirmed the stop'}"
    return ""


def describe_stop(state: LatchState, bench: str, hindrance: str = "", *, stopping: bool = False) -> BenchStop | None:
    """Return the newest stop of a latch that is open or holds, and how far it is; None where there is none."""
    if not state.held:
        return None
    stop = state.held[-1]
    is_open = any(each.id == stop.id for each in state.open)
    phase = "stopped" if not is_open else "stopping" if stopping else "asked"
    text = {
        "asked": f"bench {bench}: the stop is asked for, and no process has confirmed it",
        "stopping": f"bench {bench} is being stopped",
        "stopped": f"bench {bench} was stopped; nothing moves by itself until a person lets it",
    }[phase]
    if hindrance:
        text = f"{text}: {hindrance}"
    return BenchStop(id=stop.id, at=stop.at, by=stop.by, reason=stop.reason, campaign=stop.campaign, phase=phase,
                     text=text)  # fmt: skip
