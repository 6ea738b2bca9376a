"""A Modbus RTU client whose port is opened as every port of a bench: with line settings, locked, or with a reason."""

from __future__ import annotations

from typing import cast

import serial
from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient

from instruments.clock import Clock, Deadline, wait_s
from instruments.errors import MalformedReply
from instruments.logger import logger
from instruments.protocols.modbus_codes import READ_FUNCTIONS
from instruments.transport.opened_port import open_port
from instruments.transport.serial import BROKEN, Line, SerialPort

# The line of a Modbus RTU instrument between requests: silence after a time-out, echoes and stray bytes.
#
# A reply on RTU carries no number: only silence tells that no reply to an earlier request is still to come.

log = logger(__name__)

#: The line has to be silent for this much longer than the longest latency that was seen.
SILENCE_FACTOR = 1.25
#: Lower limit of the longest latency, s, the time-out of a request: a reply that did not come within it may come later.
MIN_LATENCY_S = 1.0
#: Upper limit of the longest latency, s: one reply after minutes must not make every later failure take minutes.
LARGEST_LATENCY_S = 5.0
#: A line that is never silent is given up after this long, s.
LONGEST_DRAIN_S = 20.0
POLL_S = 0.02
#: What an RS-485 driver makes of the line when it is switched on or off; no unit of a serial line has these numbers.
STRAY_BYTES = b"\x00\xff"


class NeverSilent(MalformedReply):
    """Something sends on the line all the time: no further try helps."""


class RtuLine:
    """State of one line. `remarks` lists, for a technician, the faults that requests survived."""

    def __init__(self, device: str, clock: Clock) -> None:
        self._device, self._clock = device, clock
        self._sent = b""
        self._sent_s = 0.0
        self._latency_s = MIN_LATENCY_S
        self._doubtful_since_s: float | None = None
        self._echoes = False
        self.remarks: list[str] = []

    @property
    def is_doubtful(self) -> bool:
        """Whether a reply to an earlier request may still come."""
        return self._doubtful_since_s is not None

    def send(self, frame: bytes) -> None:
        """Note a request that is sent now."""
        self._sent, self._sent_s = frame, self._clock.now_s()

    def doubt(self, asked_s: float | None = None) -> None:
        """Note that a reply may come late. `asked_s`: since when the answer was awaited; default: the last request."""
        self._note_latency(self._sent_s if asked_s is None else asked_s)
        self._doubtful_since_s = self._clock.now_s()

    def await_silence(self, port: SerialPort) -> None:
        """Read and drop until the line was silent for longer than the longest latency; at once when nothing is due.

        Raises NeverSilent for such a line, and an error of `BROKEN`.
        """
        if self._doubtful_since_s is None:
            return
        begun_s = self._clock.now_s()
        silent_until_s = self._doubtful_since_s + SILENCE_FACTOR * self._latency_s
        while True:
            now_s = self._clock.now_s()
            if waiting := port.in_waiting:
                port.read(waiting)
                self._note_latency(self._sent_s)
                silent_until_s = now_s + SILENCE_FACTOR * self._latency_s
            elif now_s >= silent_until_s - 1e-9:
                break
            if now_s - begun_s >= LONGEST_DRAIN_S:
                raise NeverSilent(
                    self._device,
                    f"labctl sent no request for {LONGEST_DRAIN_S:g} s, but the line was never silent for "
                    f"{SILENCE_FACTOR * self._latency_s:.2g} s; find a second Modbus master, or a device that "
                    "sends by itself, on this line",
                )
            self._clock.sleep(min(POLL_S, silent_until_s - now_s))
        self._doubtful_since_s = None

    def clean(self, data: bytes) -> bytes:
        """Return received bytes without the adapter's echo of the request and without stray bytes before a reply.

        The echo of a read is never a reply. The echo of a write looks like its reply, so it is dropped only once the
        echo of a read was seen; every driver reads before it writes.
        """
        is_read = self._sent[1:2] and self._sent[1] in READ_FUNCTIONS
        if is_read or self._echoes:
            if data.startswith(self._sent):
                self._echoes = True
                self._remark("the RS-485 adapter echoes each request; switch its local echo off")
                data = data[len(self._sent) :]
            elif self._sent.startswith(data):
                return b""  # the beginning of an echo: more is to come
        kept = data.lstrip(STRAY_BYTES)
        if kept and len(kept) < len(data):
            self._remark("stray bytes arrive before replies; check termination and bias of the RS-485 line")
        return kept

    def _note_latency(self, since_s: float) -> None:
        self._latency_s = min(max(self._latency_s, self._clock.now_s() - since_s), LARGEST_LATENCY_S)

    def _remark(self, text: str) -> None:
        if text not in self.remarks:
            self.remarks.append(text)
            log.warning("link.line", extra={"device": self._device, "reason": text})


#: What opening a port raises.
NOT_OPENED: tuple[type[Exception], ...] = (*BROKEN, ValueError)


class RtuClient(ModbusSerialClient):
    """pymodbus opens its port itself, and keeps to itself why it could not."""

    def __init__(self, url: str, clock: Clock, *, baudrate: int, timeout_s: float, line: Line) -> None:
        """Make a client that is not connected yet; `timeout_s` is in s of the clock."""
        super().__init__(url, framer=FramerType.RTU, baudrate=baudrate, timeout=wait_s(clock, timeout_s), retries=0)
        self._url, self._clock, self._baudrate, self._timeout_s, self._line = url, clock, baudrate, timeout_s, line
        self.failure: Exception | None = None  #: why the port could not be opened

    def connect(self) -> bool:
        """Open the port where it is closed; returns whether it is open."""
        if self.socket is None:
            self.failure = None
            try:
                port = open_port(
                    self._url,
                    baudrate=self._baudrate,
                    timeout_s=wait_s(self._clock, self._timeout_s),
                    line=self._line,
                    inter_byte_timeout_s=self.inter_byte_timeout or None,
                )
            except NOT_OPENED as error:
                self.failure = error
            else:
                self.socket = cast("serial.Serial", port)
        return self.socket is not None

    def recv(self, size: int | None) -> bytes:
        """Read what has come, within the time-out; what had come when it ended counts.

        pymodbus counts in real time, and does not look again after a sleep in which the time-out ended.
        """
        deadline = Deadline(self._clock, self._timeout_s)
        while not (data := super().recv(size)):
            is_over = deadline.is_over
            if (waiting := cast("SerialPort", self.socket).in_waiting) or is_over:
                return super().recv(waiting) if waiting else data
        return data
