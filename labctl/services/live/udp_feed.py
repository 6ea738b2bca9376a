"""Lines that a sender puts into datagrams: one or more whole lines in each."""

from __future__ import annotations

import socket
from contextlib import suppress

from labctl.errors import BadInput
from labctl.services.live.line_feed import MOST_BYTES

UDP = "udp://"
#: Where it listens unless the address names another place: what other computers send does not arrive.
LOOPBACK = "127.0.0.1"
#: Largest datagram.
LARGEST = 1 << 16


class UdpFeed:
    """A port at which one sender's datagrams arrive; those of a second sender are not taken."""

    may_lose = True

    def __init__(self, address: str) -> None:
        """Take udp://HOST:PORT, the place to listen at; raises BadInput for another form."""
        host, _, port = address.removeprefix(UDP).rpartition(":")
        if not address.startswith(UDP) or not port.isdecimal() or not 0 < int(port) < 65536:
            raise BadInput(
                f"{address}: no address of a stream; give udp://HOST:PORT, HOST being the address of this computer at "
                f"which the datagrams arrive ({LOOPBACK}: from this computer alone; 0.0.0.0: from every network)"
            )
        self.name, self._place = address, (host.strip("[]") or LOOPBACK, int(port))
        self._socket: socket.socket | None = None
        self._is_known = False  #: whether the sender is

    def open(self) -> None:
        family = socket.AF_INET6 if ":" in self._place[0] else socket.AF_INET
        made = socket.socket(family, socket.SOCK_DGRAM)
        try:
            made.bind(self._place)
        except OSError as error:
            made.close()
            raise BadInput(
                f"{self.name}: cannot listen there ({error}); name an address of this computer and a free port"
            ) from error
        made.setblocking(False)
        self._socket, self._is_known = made, False

    def take(self) -> bytes | None:
        """Return the lines that have arrived, each whole: a datagram without a line end is a line. It has no end."""
        found = b""
        while self._socket is not None and len(found) < MOST_BYTES:
            try:
                data, sender = self._socket.recvfrom(LARGEST)
                if not self._is_known:
                    self._socket.connect(sender)
                    self._is_known = True
            except BlockingIOError:
                return found
            except ConnectionRefusedError:  # the sender is gone: another datagram may come, or silence ends it
                continue
            found += data if data.endswith(b"\n") or not data else data + b"\n"
        return found

    def close(self) -> None:
        if self._socket is not None:
            with suppress(OSError):
                self._socket.close()
            self._socket = None
