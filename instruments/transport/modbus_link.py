"""Modbus request and reply over pymodbus (pinned: its minor releases break its API): retries, reconnection, errors.

Hardware and simulated instruments are reached through the same clients; only the socket or port under them differs.
"""

from __future__ import annotations

import logging
import struct
from collections.abc import Callable

from pymodbus import ModbusException
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException
from pymodbus.pdu import ModbusPDU

from instruments.clock import Clock, sleep_until
from instruments.errors import InstrumentError, LinkError, MalformedReply, NoReply, RequestRejected
from instruments.protocols.modbus_codes import ACKNOWLEDGED, BUSY, EXCEPTIONS, ends_at_a_frame_end
from instruments.transport.serial import BROKEN

#: Failures are raised, not logged; without a handler pymodbus would write them to standard error.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())
log = logging.getLogger(__name__)

Client = ModbusTcpClient | ModbusSerialClient
Request = Callable[[Client], ModbusPDU]
Check = Callable[[ModbusPDU], bool]
DISCONNECTED: tuple[type[Exception], ...] = (ConnectionException, *BROKEN)
#: Pauses before each further try, s. A late reply of the failed try arrives meanwhile and is dropped.
RETRY_PAUSES_S = (0.1, 1.0)
TRIES = 1 + len(RETRY_PAUSES_S)
#: Exceptions that pymodbus's decoders do not catch when bytes are malformed.
UNDECODABLE = (IndexError, KeyError, ValueError, struct.error)
CHECK = "check power, cable and address"


class RefusedRegister(RequestRejected):
    """A Modbus exception reply; `code` is its number."""

    def __init__(self, device: str, what: str, code: int) -> None:
        reason = EXCEPTIONS.get(code, "without giving a reason")
        super().__init__(device, f"refused to {what}: Modbus exception {code}, {reason}")
        self.code = code


class ModbusLink:
    """One Modbus instrument behind a client: one request at a time, bounded retries, every failure an InstrumentError.

    After a failure the link is closed, and opened again for the next try. Transaction numbers go on counting (TCP) and
    unread bytes are dropped before each request (RTU), so a late reply is never taken for the answer to a new request.
    For one thread; `pause_s` is the least time between two requests, s.
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
        self._received = b""

    def exchange(self, what: str, ask: Request, fits: Check) -> ModbusPDU:
        """Return the reply to a request, tried up to three times.

        `what` names the request in messages; `fits` tells whether a reply belongs to it. Raises the failure of the last
        try: NoReply, MalformedReply, LinkError or RefusedRegister. Only the exceptions "needs time" and "busy" are
        tried again.
        """
        start_s = self._clock.now_s()
        failure: InstrumentError | None = None
        for attempt, pause_s in enumerate((0.0, *RETRY_PAUSES_S), start=1):
            if failure is not None:
                log.warning("link.retry", extra={"device": self.device, "attempt": attempt, "reason": str(failure)})
            self._clock.sleep(pause_s)
            try:
                return self._exchange_once(what, ask, fits)
            except RefusedRegister as refused:
                if refused.code not in {ACKNOWLEDGED, BUSY}:
                    raise
                failure = refused
            except LinkError as error:
                failure = error
                self.close()
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

    def _exchange_once(self, what: str, ask: Request, fits: Check) -> ModbusPDU:
        """Return the reply to one try; raises NoReply, MalformedReply, LinkError or RefusedRegister."""
        sleep_until(self._clock, self._earliest_request_s)
        self._received = b""
        try:
            client = self._connected()
            reply = ask(client)
        except DISCONNECTED as error:
            text = f"cannot {what}, the link is gone ({error}); check cable and power"
            raise LinkError(self.device, text) from error
        except (ModbusException, *UNDECODABLE) as error:
            if self._received:
                text = (
                    f"cannot {what}, {len(self._received)} bytes came that are no reply; check line settings and cable"
                )
                raise MalformedReply(self.device, text) from error
            raise NoReply(self.device, f"no answer to {what}; {CHECK} {self.address}") from error
        finally:
            self._earliest_request_s = self._clock.now_s() + self._pause_s
        if reply.isError():
            raise RefusedRegister(self.device, what, reply.exception_code)
        if not fits(reply) or (isinstance(client, ModbusTcpClient) and not ends_at_a_frame_end(self._received)):
            raise MalformedReply(
                self.device, f"cannot {what}, the reply belongs to another request; {CHECK} {self.address}"
            )
        return reply

    def _connected(self) -> Client:
        if self._client is None:
            self._client = self._open_client()
            # pymodbus's own hook; its other way in is the constructor
            self._client.transaction.trace_packet = self._record_received
        elif not self._client.connect():
            raise LinkError(self.device, "the link cannot be opened again; check cable and power")
        return self._client

    def _record_received(self, sending: bool, data: bytes) -> bytes:
        """Keep the bytes since the last request: they distinguish silence from malformed bytes."""
        self._received = b"" if sending else data
        return data
