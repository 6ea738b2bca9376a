"""Instruments that answer from a wire log, in virtual time: the same request gets the recorded bytes.

Each port goes through its own events in their order, and the clock is moved to the time of each event. So the readings
and their times are those of the session. Where labctl sends something else than it sent then, the replay is over.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from instruments.clock import VirtualClock
from instruments.errors import InstrumentError, one_line
from instruments.transport.wire_log.document import Event, Kind
from instruments.transport.wire_log.record import WireRecord

#: Bytes of a request that a message shows.
SHOWN_BYTES = 80
RECEIVED: frozenset[Kind] = frozenset({"received", "arrived"})
#: In real time a session waits longer than it asks to; bytes count as in time when they came so much later, s.
LATE_S = 1.0


class ReplayOver(InstrumentError):
    """The replay cannot go on: a request differs from the recorded one, or the log has no more of this port."""


@dataclass(frozen=True)
class Difference:
    """Where a replay left the recorded session."""

    port: str
    request: int  #: its number on this port, from 1
    t_s: float  #: clock time of the replay
    recorded: str  #: what the session did there
    found: str  #: what the replay does there
    is_end: bool = False  #: the log was truncated there: no request differs

    @property
    def text(self) -> str:
        """The difference as a sentence."""
        place = f"request {self.request} to {self.port} at {self.t_s:.3f} s"
        if self.is_end:
            return f"the log ends before {place}: {self.found}"
        return f"{place} differs: the session {self.recorded}, this replay {self.found}"


def _nothing(_: Difference) -> None:
    """Do nothing: the session finds out by itself."""


class Replay:
    """Goes through the events of one session. `on_over` is called once when the replay cannot go on."""

    def __init__(self, record: WireRecord, clock: VirtualClock) -> None:
        self.record, self.clock = record, clock
        self.difference: Difference | None = None
        self.requests = 0  #: that were sent as recorded
        self.on_over: Callable[[Difference], None] = _nothing
        self._sent: dict[str, int] = {}

    def take(self, port: str) -> Event:
        """Take the next event of a port; the clock goes to its time."""
        event = self.record.take(port)
        self.clock.reach(event.t_s)
        return event

    def sent(self, port: str, data: bytes, method: str = "") -> None:
        """Compare a request with the next one of the port; raises ReplayOver where it differs, OSError as recorded.

        A request that was sent in one piece may come in several, and the other way round. What was received and is not
        read by now is dropped.
        """
        self.refuse_over(port)
        number = self._sent.get(port, 0) + 1
        rest = data
        while True:
            event = self._after_received(port)
            if event is None or event.kind not in {"sent", "failed"}:
                raise self._over(port, number, event, f"sends {shown(data)}")
            if event.kind == "failed":
                raise failure_of(self.take(port))
            if len(rest) < len(event.data) and event.data.startswith(rest):  # the other pieces are still to come
                self.take(port)
                self.record.put_back(replace(event, data=event.data[len(rest) :]))
                break
            if not rest.startswith(event.data) or event.more.get("method", "") != method:
                raise self._over(port, number, event, f"sends {shown(data, method)}")
            self.take(port)
            rest = rest[len(event.data) :]
            if not rest:
                break
        self._sent[port] = number
        self.requests += 1

    def opened(self, port: str) -> None:
        """Go to the next opening of a port; raises ReplayOver where there is none, OSError as recorded."""
        self.refuse_over(port)
        while (event := self._after_received(port)) is not None and event.kind == "closed":
            self.record.take(port)
        if event is None or event.kind == "sent":
            raise self._over(port, self._sent.get(port, 0) + 1, event, "opens the port")
        self.take(port)
        if event.kind == "failed":
            raise failure_of(event)

    def closed(self, port: str) -> None:
        """Note that a port is closed; what it received and nothing has read is dropped."""
        event = self._after_received(port)
        if event is not None and event.kind == "closed":
            self.record.take(port)

    def refuse_over(self, port: str) -> None:
        """Raise OSError once the replay is over: to what makes the bench safe the instruments are gone."""
        if self.difference is not None:
            raise OSError(f"the replay is over, port {port} does not answer any more")

    def not_sent(self) -> list[str]:
        """Return the ports to which requests of the session were not sent again, each with their number."""
        return [f"{number} to {port}" for port, number in self.record.left("sent").items()]

    def _after_received(self, port: str) -> Event | None:
        """Return the next event that is not one of receiving; what nothing has read is dropped."""
        while (event := self.record.next(port)) is not None and is_received(event):
            self.record.take(port)
        return event

    def _over(self, port: str, number: int, event: Event | None, actual: str) -> ReplayOver:
        cut = False
        if event is None:
            self.record.read_to_end()
            cut = self.record.result is None
        self.difference = Difference(port, number, self.clock.now_s(), did(event), actual, cut)
        self.on_over(self.difference)
        return ReplayOver("replay", self.difference.text)


def is_received(event: Event) -> bool:
    """Return whether an event is one of receiving bytes, also in vain."""
    return event.kind in RECEIVED or event.more.get("at") in RECEIVED


def did(event: Event | None) -> str:
    """Return what an event is, after "the session"."""
    if event is None:
        return "used this port no more"
    if event.kind == "sent":
        return f"sent {shown(event.data, str(event.more.get('method', '')))}"
    return {"opened": "opened it", "closed": "closed it", "failed": "failed"}.get(event.kind, event.kind)


def shown(data: bytes, method: str = "") -> str:
    """Return bytes for a message, printable ones as text, cut to `SHOWN_BYTES`."""
    cut = data[:SHOWN_BYTES]
    text = one_line(repr(cut.decode("ascii"))) if cut.isascii() and _is_text(cut) else cut.hex(" ")
    more = f" (the first {SHOWN_BYTES} of {len(data)} bytes)" if len(data) > SHOWN_BYTES else ""
    return " ".join(filter(None, (method, text + more)))


def _is_text(data: bytes) -> bool:
    return all(0x20 <= byte < 0x7F or byte in b"\r\n\t" for byte in data)


def failure_of(event: Event) -> OSError:
    """Return the recorded failure of an operation."""
    return OSError(str(event.more.get("text_of_error", "the operation failed")))
