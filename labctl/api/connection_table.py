"""All open connections: which of them make room for a new one, and which have run out of time."""

from __future__ import annotations

import asyncio
import ipaddress
from collections import defaultdict
from collections.abc import Iterable
from enum import IntEnum
from typing import Protocol

from labctl.api.connection_limits import ConnectionLimits

#: Without an address: a socket in the file system, which only this machine reaches.
LOCAL = "local"
IPV6_NETWORK_BITS = 64
#: What a client needs at most to send what it has begun.
YOUNG_S = 1.0


class Phase(IntEnum):
    """What is awaited on a connection, in the order in which connections are closed to make room."""

    HEADERS = 0
    IDLE = 1
    BODY = 2
    ANSWER = 3


class Connection(Protocol):
    """What the table knows of a connection."""

    phase: Phase
    since: float  #: s of the loop's clock: when the phase began; in BODY, when something came last
    source: str
    reserved: bool

    def check(self, now: float) -> None:
        """End the connection if its time is up."""

    def cut(self) -> None:
        """Close the connection at once, whatever has not been sent."""


def source_of(address: str | None) -> str:
    """Return what connections are counted by: an address, LOCAL for this machine, a network for IPv6."""
    if address is None:
        return LOCAL
    try:
        parsed = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if isinstance(parsed, ipaddress.IPv6Address):
        if parsed.ipv4_mapped is None:
            network = ipaddress.ip_network((int(parsed), IPV6_NETWORK_BITS), strict=False)
            return LOCAL if parsed.is_loopback else str(network)
        parsed = parsed.ipv4_mapped
    return LOCAL if parsed.is_loopback else str(parsed)


class ConnectionTable:
    """The open connections of one server.

    Where there is no room, a connection closes that has waited for the rest of its headers, else for a request, else
    for more of a body, each the longest; one that has waited for less than YOUNG_S only where there is no other. So a
    new client always comes in. A connection that is being answered is not closed; when all are, a new one comes from
    the reserve, where only `/health` and acting requests are answered.
    """

    def __init__(self, limits: ConnectionLimits) -> None:
        self.limits = limits
        self._all: dict[Connection, None] = {}  #: in the order in which they came
        self._by_source: defaultdict[str, dict[Connection, None]] = defaultdict(dict)
        self._look: asyncio.TimerHandle | None = None
        self._late = False  #: the last look came late, and was left out

    def __len__(self) -> int:
        return len(self._all)

    def admit(self, connection: Connection, loop: asyncio.AbstractEventLoop) -> bool:
        """Take in a new connection; returns False where there is no room even in the reserve."""
        source = connection.source
        if len(self._by_source[source]) >= self._most_of(source):
            self._make_room(self._by_source[source], loop.time())
        elif len(self._all) >= self.limits.total:
            self._make_room(self._all, loop.time())
        self._all[connection] = None
        self._by_source[source][connection] = None
        connection.reserved = self._crowded(source)
        if connection.reserved and sum(each.reserved for each in self._all) > self.limits.reserve:
            self.release(connection)
            return False
        if self._look is None:
            self._look_later(loop)
        return True

    def on_reserve(self, connection: Connection) -> bool:
        """Return whether a connection still holds a place of the reserve; it keeps none once there is room."""
        connection.reserved &= self._crowded(connection.source)
        return connection.reserved

    def release(self, connection: Connection) -> None:
        """Forget a connection that is closed."""
        self._all.pop(connection, None)
        same = self._by_source[connection.source]
        same.pop(connection, None)
        if not same:
            del self._by_source[connection.source]

    def _crowded(self, source: str) -> bool:
        same = self._by_source.get(source, ())
        return len(self._all) > self.limits.total or len(same) > self._most_of(source)

    def _most_of(self, source: str) -> int:
        return self.limits.local if source == LOCAL else self.limits.per_address

    def _make_room(self, among: Iterable[Connection], now: float) -> None:
        waiting = [each for each in among if each.phase is not Phase.ANSWER]
        if not waiting:
            return

        def order(each: Connection) -> tuple[int, float]:
            return (each.phase if now - each.since > YOUNG_S else Phase.ANSWER, each.since)

        oldest = min(waiting, key=order)
        self.release(oldest)
        oldest.cut()

    def _look_later(self, loop: asyncio.AbstractEventLoop) -> None:
        due = loop.time() + self.limits.look_s
        self._look = loop.call_at(due, self._check, loop, due) if self._all else None

    def _check(self, loop: asyncio.AbstractEventLoop, due: float) -> None:
        """Compare times; not right after the loop stood still, when what clients have sent is not read yet."""
        now = loop.time()
        self._late = not self._late and now - due > self.limits.look_s
        self._look_later(loop)
        for each in () if self._late else tuple(self._all):
            each.check(now)
