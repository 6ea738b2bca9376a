"""Link to an ACUTROL 3000: messages out, replies in, by Ethernet or serial port; every failure an InstrumentError."""

from __future__ import annotations

from collections.abc import Callable
from typing import NoReturn

from instruments.clock import Clock
from instruments.errors import LinkError, MalformedReply, NoReply, RequestRejected
from instruments.protocols.acutrol3000 import commands as acl
from instruments.protocols.acutrol3000.settings import Acutrol3000Settings
from instruments.transport.factory import Ports
from instruments.transport.serial import BROKEN, SerialPort

REPLY_S = 1.0
#: After a reply that came late or damaged, the link is read until it is silent for so long: longer than a late reply.
QUIET_S, LONGEST_QUIET_S = 1.5, 5.0
#: The reply to a stop is awaited for so long; the stop itself waits for nothing.
STOP_REPLY_S = 0.3


class AcutrolLink:
    """The link to one controller, opened at first use; `opened` is called each time, for what has to be sent again.

    The first reply shows whether replies come with an error code and their length, or as lines.
    """

    def __init__(
        self, device: str, settings: Acutrol3000Settings, ports: Ports, clock: Clock, opened: Callable[[], None]
    ) -> None:
        self._device, self._ports, self._clock, self._opened = device, ports, clock, opened
        self._baudrate = settings.baudrate
        self.url = settings.address_url
        self._port: SerialPort | None = None
        self._headed: bool | None = None
        self._unsure = False  #: whether a late or damaged reply may still come

    def close(self) -> None:
        """Close the link; safe to call twice."""
        port, self._port = self._port, None
        if port is not None:
            port.close()

    def ask(self, message: str) -> str:
        """Return the reply to a message. Raises RequestRejected, NoReply, MalformedReply, LinkError."""
        return self.timed(message)[0]

    def timed(self, message: str) -> tuple[str, float, float]:
        """Return the reply to a message, and the clock times at which it was sent and answered. Raises as `ask`."""
        try:
            port = self._open()
            self._clear(port)
            if self._headed is None and message != acl.IDENTIFY:
                self._exchange(port, acl.IDENTIFY)
            return self._exchange(port, message)
        except BROKEN as error:
            self._fail(error)

    def send_stop(self, message: str) -> None:
        """Send a message before anything else is done, whatever is under way; then drop what is answered.

        Raises LinkError.
        """
        try:
            port = self._open()
            port.write(message.encode("ascii") + acl.LINE_END)
            self._drain(port, STOP_REPLY_S, STOP_REPLY_S)
        except BROKEN as error:
            self._fail(error)

    def _open(self) -> SerialPort:
        if self._port is None:
            self._port = self._ports.serial(self.url, device=self._device, baudrate=self._baudrate, timeout_s=REPLY_S)
            self._headed, self._unsure = None, False
            self._opened()
        return self._port

    def _clear(self, port: SerialPort) -> None:
        """Drop what no message has asked for."""
        if self._unsure:
            self._drain(port, QUIET_S, LONGEST_QUIET_S)
            self._unsure = False
        elif port.in_waiting:
            port.reset_input_buffer()

    def _exchange(self, port: SerialPort, message: str) -> tuple[str, float, float]:
        """Send a message and return its reply with both times."""
        sent_s = self._clock.now_s()
        port.write(message.encode("ascii") + acl.LINE_END)
        try:
            error, text = self._reply(port, sent_s + REPLY_S)
        except LinkError:
            self._unsure = True
            raise
        if error:
            raise RequestRejected(
                self._device,
                f"rejected {message!r} with error {error} {text!r}; check axis, limits and mode at the controller",
            )
        return text, sent_s, self._clock.now_s()

    def _reply(self, port: SerialPort, deadline_s: float) -> tuple[int, str]:
        first = b""
        if self._headed is not False:
            first = self._read(port, acl.WORD_BYTES, deadline_s)
            self._headed = acl.is_headed(first) if self._headed is None else self._headed
        if not self._headed:
            return 0, self._line(port, first, deadline_s)
        try:
            head = acl.head_of(first + self._read(port, acl.HEAD_BYTES - len(first), deadline_s))
        except ValueError as error:
            raise MalformedReply(self._device, f"{self.url}: {error}; check the cable and baud rate") from error
        return head.error, self._text(self._read(port, head.length, deadline_s))

    def _line(self, port: SerialPort, first: bytes, deadline_s: float) -> str:
        """Return a reply that is a line of text, without its end."""
        data = bytearray(first)
        while not data.endswith(b"\n") and len(data) <= acl.LONGEST:
            data += self._read(port, 1, deadline_s)
        return self._text(bytes(data))

    def _text(self, data: bytes) -> str:
        """Return the text of a reply; raises MalformedReply for characters that no reply has."""
        text = data.rstrip(b"\0\r\n").decode("latin-1").strip()
        if not text.isascii() or not all(each.isprintable() or each in "\r\n\t" for each in text):
            raise MalformedReply(
                self._device, f"{self.url}: {text!r} is not a valid reply; check the cable and baud rate"
            )
        return text

    def _read(self, port: SerialPort, size: int, deadline_s: float) -> bytes:
        """Return so many bytes; raises NoReply where they do not come by the deadline."""
        received = b""
        while len(received) < size:
            left_s = deadline_s - self._clock.now_s()
            if left_s <= 0:
                raise NoReply(
                    self._device,
                    f"{self.url} gave no complete answer within {REPLY_S:.1f} s; check power, cable and "
                    "address, and that the interface of the controller is active",
                )
            port.timeout = self._ports.port_timeout_s(self.url, left_s, device=self._device)
            received += bytes(port.read(size - len(received)))
        return received

    def _drain(self, port: SerialPort, quiet_s: float, longest_s: float) -> None:
        """Read until nothing has come for a while; bounded."""
        until_s = self._clock.now_s() + longest_s
        port.timeout = self._ports.port_timeout_s(self.url, quiet_s, device=self._device)
        while port.read(acl.HEAD_BYTES) and self._clock.now_s() < until_s:
            continue

    def _fail(self, error: Exception) -> NoReturn:
        self.close()
        raise LinkError(
            self._device, f"the link {self.url} broke ({error}); check the cable, then try again"
        ) from error
