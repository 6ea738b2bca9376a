"""Modbus request and reply over pymodbus (pinned: its minor releases break its API): retries, reconnection, errors.

Hardware and simulated instruments are reached through the same clients; only the socket or port under them differs.
"""

from __future__ import annotations

import logging
import struct
from collections.abc import Callable
from typing import cast

from pymodbus import ModbusException
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException
from pymodbus.framer import FramerRTU
from pymodbus.pdu import ModbusPDU

from instruments.clock import Clock, sleep_until
from instruments.errors import InstrumentError, LinkError, MalformedReply, NoReply, RequestRejected, one_line
from instruments.logger import logger
from instruments.protocols.modbus_codes import ACKNOWLEDGED, BUSY, EXCEPTIONS, TCP_PREFIX_BYTES, ends_at_a_frame_end
from instruments.transport.port_failures import silence_remedy
from instruments.transport.rtu import NeverSilent, RtuLine
from instruments.transport.serial import BROKEN, SerialPort

SHORTEST_RTU_BYTES = 5
#: This many printable characters in a row are the greeting of another kind of server; it is shown up to this length.
MIN_TEXT, LONGEST_TEXT = 6, 40
LINE = "check line settings and cable"
ADDRESS = "check host and tcp_port in the bench file"


def explain_rtu(received: bytes, address: int) -> str:
    """Return why bytes on a serial line are no reply of unit `address`, and what to do."""
    if len(received) >= SHORTEST_RTU_BYTES and received[0] != address and _is_frame(received):
        return _other_unit(received[0], address)
    return _bytes(received, LINE)


def explain_tcp(received: bytes, sent: bytes, address: int) -> str:
    """Return why bytes on a TCP link are no reply to a request of unit `address`, and what to do."""
    if other := other_server(received):
        return other
    if len(received) <= TCP_PREFIX_BYTES:
        return _bytes(received, LINE)
    if protocol := int.from_bytes(received[2:4], "big"):
        return f"the reply has protocol number {protocol} instead of 0 (Modbus TCP); {ADDRESS}"
    if received[:2] != sent[:2]:
        number, requested = (int.from_bytes(each[:2], "big") for each in (received, sent))
        return (
            f"the reply to request {number} arrived instead of that to request {requested}; find the second "
            "Modbus master on this link"
        )
    if received[TCP_PREFIX_BYTES] != address:
        return _other_unit(received[TCP_PREFIX_BYTES], address)
    return _bytes(received, LINE)


def other_server(received: bytes) -> str:
    """Return what answered where bytes begin as those of no Modbus instrument do; empty where they may be of one."""
    if received.startswith(b"HTTP/") or b"<html" in received[:200].lower():
        return f"an HTTP server answered, not a Modbus instrument; {ADDRESS}"
    beginning = received[:MIN_TEXT]
    if len(beginning) == MIN_TEXT and beginning.isascii() and beginning.decode().isprintable():
        return (
            f"text arrived ({one_line(received[:LONGEST_TEXT].decode('latin-1'))}) instead of a Modbus reply; {ADDRESS}"
        )
    return ""


def _is_frame(data: bytes) -> bool:
    return FramerRTU.check_CRC(data[:-2], int.from_bytes(data[-2:], "big"))


def _other_unit(answered: int, address: int) -> str:
    return (
        f"unit {answered} answered instead of unit {address}; set address in the bench file, or find the second device"
    )


def _bytes(received: bytes, advice: str) -> str:
    return f"{len(received)} bytes arrived that are not a Modbus reply; {advice}"


#: Failures are raised, not logged; without a handler pymodbus would write them to standard error.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())
log = logger(__name__)

Client = ModbusTcpClient | ModbusSerialClient
Request = Callable[[Client], ModbusPDU]
Check = Callable[[ModbusPDU], bool]
DISCONNECTED: tuple[type[Exception], ...] = (ConnectionException, *BROKEN)
#: Pauses before each further try, s; on a serial line the wait for silence takes their place.
RETRY_PAUSES_S = (0.1, 1.0)
TRIES = 1 + len(RETRY_PAUSES_S)
#: Exceptions that pymodbus's decoders do not catch when bytes are malformed.
UNDECODABLE = (IndexError, KeyError, ValueError, struct.error)
CHECK = "check power, cable and address"
#: Bytes that come without end are no reply: no more are awaited after this, clock s.
LONGEST_REPLY_S = 5.0


class RefusedRegister(RequestRejected):
    """A Modbus exception reply; `code` is its number."""

    def __init__(self, device: str, register: str, code: int) -> None:
        reason = EXCEPTIONS.get(code, "without giving a reason")
        super().__init__(device, f"refused to {register}: Modbus exception {code}, {reason}")
        self.code = code


class ModbusLink:
    """One Modbus instrument behind a client: one request at a time, bounded retries, every failure an InstrumentError.

    After a failure the link is closed, and opened again for the next try. A late reply is distinguished from the answer
    to a new request by its transaction number, which goes on counting (TCP); on RTU, which has none, the next request
    waits until the line was silent for longer than the longest latency. A later reply than that can still be taken for
    an answer of the same length. For one thread; `pause_s` is the least time between two requests, s.
    """

    def __init__(
        self, device: str, address: int, clock: Clock, open_client: Callable[[], Client], *, pause_s: float = 0.0
    ) -> None:
        self.device, self.address = device, address
        self._clock = clock
        self._open_client = open_client
        self._pause_s = pause_s
        self._client: Client | None = None
        self._earliest_request_s = 0.0
        self._sent = self._received = b""
        self._sent_s = 0.0
        self._line = RtuLine(device, clock)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Faults of the line that requests survived and that need a repair."""
        return tuple(self._line.remarks)

    def exchange(self, purpose: str, ask: Request, fits: Check) -> ModbusPDU:
        """Return the reply to a request, tried up to three times.

        `purpose` names the request in messages; `fits` tells whether a reply belongs to it. Raises the failure of the
        last try: NoReply, MalformedReply, LinkError or RefusedRegister. Only the exceptions "needs time" and "busy" are
        tried again.
        """
        start_s = self._clock.now_s()
        failure: InstrumentError | None = None
        for attempt, pause_s in enumerate((0.0, *RETRY_PAUSES_S), start=1):
            if failure is not None:
                log.warning("link.retry", extra={"device": self.device, "attempt": attempt, "reason": str(failure)})
            if not self._line.is_doubtful:
                self._clock.sleep(pause_s)
            try:
                reply = self._exchange_once(purpose, ask, fits)
            except RefusedRegister as refused:
                if refused.code not in {ACKNOWLEDGED, BUSY}:
                    raise
                failure = refused
            except LinkError as error:
                failure = error
                self._give_up(error)
            else:
                if failure is not None:
                    self._doubt(start_s)  # one of several equal requests was answered, perhaps the first
                return reply
        assert failure is not None
        if isinstance(failure, RefusedRegister):
            raise failure
        text = str(failure).removeprefix(f"{self.device}: ")
        spent_s = self._clock.now_s() - start_s
        raise type(failure)(self.device, f"{text} ({TRIES} tries in {spent_s:.2g} s)") from failure

    def close(self) -> None:
        """Close the link; safe to call twice. The next request opens it again."""
        if self._client is not None:
            self._client.close()

    def _exchange_once(self, purpose: str, ask: Request, fits: Check) -> ModbusPDU:
        """Return the reply to one try; raises NoReply, MalformedReply, LinkError or RefusedRegister."""
        sleep_until(self._clock, self._earliest_request_s)
        self._sent = self._received = b""
        try:
            client = self._connected()
            reply = ask(client)
        except DISCONNECTED as error:
            if not self._is_serial and (advice := other_server(self._received)):  # it is no Modbus server
                raise MalformedReply(self.device, f"cannot {purpose}, {advice}") from error
            # pymodbus's own text is the client's address in memory
            detail = "" if isinstance(error, ConnectionException) else f" ({one_line(error)})"
            text = f"cannot {purpose}, the link was lost{detail}; check cable and power"
            raise LinkError(self.device, text) from error
        except (ModbusException, *UNDECODABLE) as error:
            if self._received:
                advice = self._explain()
                raise MalformedReply(self.device, f"cannot {purpose}, {advice}") from error
            raise NoReply(
                self.device, f"no answer to {purpose}; check {self._silence_remedy} {self.address}"
            ) from error
        finally:
            self._earliest_request_s = self._clock.now_s() + self._pause_s
        if reply.isError():
            raise RefusedRegister(self.device, purpose, reply.exception_code)
        if not fits(reply) or (isinstance(client, ModbusTcpClient) and not ends_at_a_frame_end(self._received)):
            raise MalformedReply(
                self.device, f"cannot {purpose}, the reply belongs to another request; {CHECK} {self.address}"
            )
        return reply

    @property
    def _silence_remedy(self) -> str:
        host = "" if self._client is None else str(self._client.comm_params.host)
        return f"{silence_remedy(host)} and address"

    def _connected(self) -> Client:
        client = self._client
        if client is None:
            client = self._client = self._open_client()
            # pymodbus's own hook; its other way in is the constructor
            client.transaction.trace_packet = self._trace
        elif not client.connect():
            raise LinkError(self.device, "the link cannot be opened again; check cable and power")
        if self._line.is_doubtful and client.socket is not None:
            self._line.await_silence(cast("SerialPort", client.socket))
        return client

    @property
    def _is_serial(self) -> bool:
        return isinstance(self._client, ModbusSerialClient)

    def _give_up(self, error: LinkError) -> None:
        """Close the link after a failed try; after a time-out or a malformed reply a late reply may still come.

        Raises NeverSilent again: no further try helps.
        """
        if isinstance(error, NoReply | MalformedReply):
            self._doubt()
        self.close()
        if isinstance(error, NeverSilent):
            raise error

    def _doubt(self, asked_s: float | None = None) -> None:
        if self._is_serial:
            self._line.doubt(asked_s)

    def _explain(self) -> str:
        """Return what the bytes since the last request are, as they are no reply, and what to do."""
        if self._is_serial:
            return explain_rtu(self._received, self.address)
        return explain_tcp(self._received, self._sent, self.address)

    def _trace(self, sending: bool, data: bytes) -> bytes:
        """Keep what was sent and what came since: it distinguishes silence from malformed bytes.

        Raises TimeoutError, as pymodbus does for silence, where bytes come without end.
        """
        if sending:
            self._sent, self._received, self._sent_s = data, b"", self._clock.now_s()
            self._line.send(data)
            return data
        self._received = self._line.clean(data) if self._is_serial else data
        if self._clock.now_s() > self._sent_s + LONGEST_REPLY_S:
            raise TimeoutError
        return self._received
