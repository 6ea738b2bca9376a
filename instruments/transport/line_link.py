"""Requests and replies as lines of text, over a serial port or a TCP socket: retries, reconnection, errors.

A socket is a port by pyserial's address `socket://HOST:PORT`. A reply carries no number, so that after a reply that did
not come in time the next request waits until the line was silent for longer than the longest latency.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from instruments.clock import Clock
from instruments.errors import InstrumentError, LinkError, MalformedReply, NoReply, RequestRejected
from instruments.logger import logger
from instruments.protocols.text_lines.line_syntax import LineSyntax
from instruments.transport.factory import Ports
from instruments.transport.port_failures import silence_remedy
from instruments.transport.rtu import RtuLine
from instruments.transport.serial import BROKEN, EIGHT_N_1, Line, SerialPort

log = logger(__name__)

#: Pauses before each further try, s.
RETRY_PAUSES_S = (0.1, 1.0)
TRIES = 1 + len(RETRY_PAUSES_S)
#: A reply is never longer than this; a device that sends on without a line end is given up there.
LONGEST_REPLY_BYTES = 4096
#: Bytes of a reply that a message shows.
SHOWN_BYTES = 60


class LineLink:
    """One device behind a port: one request at a time, bounded retries, every failure an InstrumentError."""

    def __init__(
        self, device: str, url: str, ports: Ports, clock: Clock, syntax: LineSyntax, *, baudrate: int,
        timeout_s: float = 1.0, line: Line = EIGHT_N_1,
    ) -> None:  # fmt: skip
        self.device, self.url = device, url
        self._ports, self._clock, self._syntax = ports, clock, syntax
        self._baudrate, self._timeout_s, self._settings = baudrate, timeout_s, line
        self._port: SerialPort | None = None
        self._line = RtuLine(device, clock)
        self._earliest_s = 0.0
        self.awaits_slow = False  #: whether a request that takes long is not answered yet
        self.openings = 0  #: how often the port was opened: what was set over an earlier one may be forgotten

    def ask(
        self, request: str, reply: str, purpose: str, *, tries: int = TRIES, timeout_s: float | None = None
    ) -> re.Match[str]:
        """Return the reply to a request as the match of the pattern `reply` with the whole line; tried three times.

        A request that must not be executed twice gets one try, one that takes long a time-out of its own. `purpose`
        names the request in messages. Raises the failure
        of the last try: NoReply, MalformedReply or LinkError; RequestRejected at once where the device refuses.
        """
        begun_s = self._clock.now_s()
        failure: LinkError | None = None
        for attempt, pause_s in enumerate((0.0, *RETRY_PAUSES_S)[:tries], start=1):
            if failure is not None:
                log.warning("link.retry", extra={"device": self.device, "attempt": attempt, "reason": str(failure)})
            self._clock.sleep(pause_s)
            try:
                self.awaits_slow = timeout_s is not None  # for good where what waits is ended
                match = self._ask_once(request, reply, purpose, timeout_s or self._timeout_s)
                self.awaits_slow = False
                return match
            except RequestRejected:
                self.awaits_slow = False
                raise
            except LinkError as error:
                failure = error
                if isinstance(error, NoReply | MalformedReply):
                    self._line.doubt()
        assert failure is not None
        text = str(failure).removeprefix(f"{self.device}: ")
        spent_s = self._clock.now_s() - begun_s
        count = "1 try" if tries == 1 else f"{tries} tries"
        raise type(failure)(self.device, f"{text} ({count} in {spent_s:.2g} s)") from failure

    def tell(self, request: str, purpose: str) -> None:
        """Send a request that has no reply; raises LinkError."""
        try:
            self._send(request)
        except BROKEN as error:
            raise self._broken(purpose, error) from error
        finally:
            self._earliest_s = self._clock.now_s() + self._syntax.pause_s

    def send_at_once(self, requests: Sequence[str], purpose: str) -> None:
        """Send requests without waiting for anything, whatever is under way; their replies are dropped later.

        Each is sent twice: the first may end a line that another process left half sent. Without a line end there is
        none, and two requests would be one. A link on which a slow request is under way takes no other: it is opened
        anew. Raises LinkError.
        """
        try:
            if self.awaits_slow:
                self.close()
            self.awaits_slow = False
            port = self._opened()
            for request in requests:
                data = self._encoded(request) * (2 if self._syntax.end else 1)
                self._line.send(data)
                port.write(data)
        except BROKEN as error:
            raise self._broken(purpose, error) from error
        finally:
            self._line.doubt(self._clock.now_s())
            self._earliest_s = self._clock.now_s() + self._syntax.pause_s

    def close(self) -> None:
        """Close the port; safe to call twice. The next request opens it again."""
        if self._port is not None:
            self._port.close()
            self._port = None

    def _ask_once(self, request: str, reply: str, purpose: str, timeout_s: float) -> re.Match[str]:
        try:
            line = self._receive(self._send(request), purpose, timeout_s)
        except BROKEN as error:
            raise self._broken(purpose, error) from error
        finally:
            self._earliest_s = self._clock.now_s() + self._syntax.pause_s
        if (match := re.fullmatch(reply, line)) is not None:
            return match
        if self._syntax.refusal and (refused := re.fullmatch(self._syntax.refusal, line)):
            why = self._syntax.reason(refused["why"])
            raise RequestRejected(self.device, f"refused to {purpose}: {why}; check its mode at its panel")
        raise MalformedReply(
            self.device,
            f"answered {line[:SHOWN_BYTES]!r} to the request to {purpose}; check driver, line settings and cable",
        )

    def _send(self, request: str) -> SerialPort:
        """Send a request on a silent line; returns the open port."""
        self._clock.sleep(self._earliest_s - self._clock.now_s())
        port = self._opened()
        self._line.await_silence(port)
        port.reset_input_buffer()
        data = self._encoded(request)
        self._line.send(data)
        port.write(data)
        return port

    def _opened(self) -> SerialPort:
        if self._port is None:
            self._port = self._ports.serial(
                self.url, device=self.device, baudrate=self._baudrate, timeout_s=self._timeout_s, line=self._settings
            )
            self.openings += 1
        return self._port

    @property
    def _reply_end(self) -> bytes:
        return re.escape(self._syntax.reply_end.encode(self._syntax.encoding)) or rb"[\r\n]+"

    def _encoded(self, request: str) -> bytes:
        return (request + self._syntax.end).encode(self._syntax.encoding)

    def _receive(self, port: SerialPort, purpose: str, timeout_s: float) -> str:
        """Return the next line that is not empty, without its end; raises NoReply, MalformedReply, one of BROKEN."""
        deadline_s = self._clock.now_s() + timeout_s
        data, end = b"", self._reply_end
        while True:
            data += port.read(max(port.in_waiting, 1))
            lines = re.split(end, data.lstrip(b"\r\n"))
            if len(lines) > 1:
                return lines[0].decode(self._syntax.encoding, errors="replace").strip()
            if len(data) > LONGEST_REPLY_BYTES:
                raise MalformedReply(
                    self.device,
                    f"sent {len(data)} bytes without a line end when asked to {purpose}; check the baud rate and that "
                    f"{self.url} is this device",
                )
            if timeout_s > self._timeout_s:
                self._clock.sleep(0.0)  # a stop ends a long wait
            if self._clock.now_s() >= deadline_s - 1e-9:
                raise self._silent(data, purpose)

    def _silent(self, data: bytes, purpose: str) -> LinkError:
        if data.strip():
            text = data.decode(self._syntax.encoding, errors="replace")[:SHOWN_BYTES]
            return MalformedReply(
                self.device, f"sent {text!r} without a line end when asked to {purpose}; check baud rate and cable"
            )
        return NoReply(
            self.device,
            f"no answer to the request to {purpose} on {self.url}; check {silence_remedy(self.url)} and line settings",
        )

    def _broken(self, purpose: str, error: Exception) -> InstrumentError:
        self.close()
        return LinkError(
            self.device, f"cannot {purpose}, the link {self.url} was lost ({error}); check cable and power"
        )
