"""The one adapter around pymodbus (pinned: its minor releases break its API): links, registers, errors, retries.

A driver declares its registers as data and asks for their values; everything that can go wrong on the way comes out as
an instrument error that names device, quantity and register. A simulated instrument is reached through the same
clients: only the socket or port under them is another.
"""

from __future__ import annotations

import logging
import struct
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

from pymodbus import FramerType, ModbusException
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException
from pymodbus.pdu import ModbusPDU

from instruments.clock import Clock, sleep_until
from instruments.errors import InstrumentError, LimitError, LinkError, MalformedReply, NoReply, RequestRejected
from instruments.protocols.modbus_registers import Register, WordOrder
from instruments.transport.serial import BROKEN

if TYPE_CHECKING:
    from instruments.simulators.device import SimulatedDevice

#: What goes wrong is raised, not printed; without a handler pymodbus would write it to standard error.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())

Client = ModbusTcpClient | ModbusSerialClient
LOST: tuple[type[Exception], ...] = (ConnectionException, *BROKEN)
#: How long to wait before each further try. A late reply of the failed try arrives meanwhile, and is thrown away.
RETRY_PAUSES_S = (0.1, 1.0)
TRIES = 1 + len(RETRY_PAUSES_S)
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ACKNOWLEDGED, BUSY = 1, 2, 5, 6
EXCEPTIONS = {
    ILLEGAL_FUNCTION: "it does not know the function",
    ILLEGAL_ADDRESS: "it has no such register, or the register cannot be written",
    3: "it does not accept the value",
    4: "it failed inside",
    ACKNOWLEDGED: "it needs more time",
    BUSY: "it is busy",
}
#: What pymodbus's decoders let out when bytes are not what they expect.
UNDECODABLE = (IndexError, KeyError, ValueError, struct.error)
CHECK = "check power, cable and address"


class RefusedRegister(RequestRejected):
    """A Modbus exception reply; `code` is its number."""

    def __init__(self, device: str, what: str, code: int) -> None:
        reason = EXCEPTIONS.get(code, "for no reason that is known")
        super().__init__(device, f"refused to {what}: Modbus exception {code}, {reason}")
        self.code = code


def connect_tcp(
    host: str, tcp_port: int, *, device: str, clock: Clock, timeout_s: float, at: SimulatedDevice | None
) -> ModbusTcpClient:
    """Open a Modbus TCP link; `at` is the simulated instrument where the address is one. Raises LinkError."""
    wall_s = clock.wall_s(timeout_s)
    if at is None:
        client = ModbusTcpClient(host, port=tcp_port, timeout=wall_s, retries=0)
    else:
        from instruments.simulators.links.modbus_clients import PairedTcpClient  # noqa: PLC0415  a real bench never loads it

        client = PairedTcpClient(at, clock, timeout_s, timeout=wall_s, retries=0)
    if not _connect(client):
        raise LinkError(device, f"no Modbus TCP at {host}:{tcp_port}; check address, cable and that it is switched on")
    return client


def connect_rtu(
    url: str, *, device: str, clock: Clock, baudrate: int, timeout_s: float, at: SimulatedDevice | None
) -> ModbusSerialClient:
    """Open a Modbus RTU link (8N1); `at` is the simulated instrument where the address is one. Raises LinkError."""
    wall_s = clock.wall_s(timeout_s)
    if at is None:
        client = ModbusSerialClient(url, framer=FramerType.RTU, baudrate=baudrate, timeout=wall_s, retries=0)
    else:
        from instruments.simulators.links.modbus_clients import SimulatedRtuClient  # noqa: PLC0415  a real bench: never

        client = SimulatedRtuClient(at, clock, timeout_s, baudrate=baudrate, timeout=wall_s, retries=0)
    if not _connect(client):
        raise LinkError(device, f"serial port {url} cannot be opened; check its name, the cable and who else uses it")
    return client


class Registers:
    """The registers of one instrument: typed reads and writes, bounded retries, every failure an instrument error.

    After a failure the link is closed and opened again for the next try; transaction ids go on counting (TCP) and
    unread bytes are dropped before each request (RTU), so a late reply is never taken for the answer to a new request.
    For one thread; `pause_s` is the least time between two requests.
    """

    def __init__(
        self,
        device: str,
        address: int,
        clock: Clock,
        open_client: Callable[[], Client],
        *,
        pause_s: float = 0.0,
        word_order: WordOrder = "little",
        write_function: Literal[6, 16] = 6,
    ) -> None:
        self._device, self._address, self._clock = device, address, clock
        self._open_client = open_client
        self._pause_s, self._word_order = pause_s, word_order
        self._write_function: Literal[6, 16] = write_function
        self._client: Client | None = None
        self._quiet_until_s = 0.0
        self._heard = b""

    def get(self, register: Register) -> float:
        """Get the value of a register; raises Garbled when it lies outside what the register can hold."""
        value = register.decode(self.words(register), self._word_order)
        if not register.holds(value):
            raise MalformedReply(
                self._device,
                f"{register} reads {value:g} {register.unit}, possible are {register.low:g} to {register.high:g}; "
                "check the sensor, the word order and that the bench file names the right driver",
            )
        return value

    def get_int(self, register: Register) -> int:
        """Get the value of a 16-bit register; raises as `get` does."""
        return int(self.get(register))

    def words(self, register: Register, count: int | None = None) -> list[int]:
        """Get `count` unsigned 16-bit words from a register on; by default as many as it takes."""
        asked = register.words if count is None else count
        function = register.read_function

        def ask(client: Client) -> ModbusPDU:
            read = client.read_holding_registers if function == 3 else client.read_input_registers
            return read(register.number, count=asked, device_id=self._address)

        def fits(answer: ModbusPDU) -> bool:
            return answer.function_code == function and len(answer.registers) == asked

        return list(self._exchange(f"read {register}", ask, fits).registers)

    def put(self, register: Register, value: float) -> None:
        """Set a register: an integer as two's complement, a float as two words. Raises LimitError, RefusedRegister.

        A 16-bit register is written by the preferred function; where the instrument does not know it, by the other
        one from then on. A float always takes function 16.
        """
        if register.access == "r":
            raise LimitError(self._device, f"{register} can only be read; nothing was sent")
        if not register.holds(value):
            raise LimitError(
                self._device,
                f"{register} takes {register.low:g} to {register.high:g} {register.unit}, not {value:g}; "
                "nothing was sent",
            )
        words = register.encode(value, self._word_order)
        if len(words) > 1:
            self._write(register, words, 16)
            return
        try:
            self._write(register, words, self._write_function)
        except RefusedRegister as refused:
            if refused.code != ILLEGAL_FUNCTION:
                raise
            self._write_function = 16 if self._write_function == 6 else 6
            self._write(register, words, self._write_function)

    def close(self) -> None:
        """Control the link: close it; safe to call twice. The next request opens it again."""
        if self._client is not None:
            self._client.close()  # type: ignore[no-untyped-call]  # pymodbus left this one untyped

    def _write(self, register: Register, words: list[int], function: Literal[6, 16]) -> None:
        def ask(client: Client) -> ModbusPDU:
            if function == 6:
                return client.write_register(register.number, words[0], device_id=self._address)
            return client.write_registers(register.number, words, device_id=self._address)

        def fits(answer: ModbusPDU) -> bool:
            echoed = answer.registers == words if function == 6 else answer.count == len(words)
            return answer.function_code == function and answer.address == register.number and echoed

        self._exchange(f"write {register}", ask, fits)

    def _exchange(self, what: str, ask: Callable[[Client], ModbusPDU], fits: Callable[[ModbusPDU], bool]) -> ModbusPDU:
        """Ask, up to three times; returns the answer or raises what went wrong at the last try."""
        begun_s = self._clock.now_s()
        failure: InstrumentError | None = None
        for pause_s in (0.0, *RETRY_PAUSES_S):
            self._clock.sleep(pause_s)
            try:
                return self._answer(what, ask, fits)
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
        text = str(failure).removeprefix(f"{self._device}: ")
        spent_s = self._clock.now_s() - begun_s
        raise type(failure)(self._device, f"{text} ({TRIES} tries in {spent_s:.2g} s)") from failure

    def _answer(self, what: str, ask: Callable[[Client], ModbusPDU], fits: Callable[[ModbusPDU], bool]) -> ModbusPDU:
        """Ask once; raises NoReply, Garbled, LinkError or RefusedRegister."""
        sleep_until(self._clock, self._quiet_until_s)
        self._heard = b""
        try:
            client = self._connected()
            answer = ask(client)
        except LOST as error:
            text = f"cannot {what}, the link is gone ({error}); check cable and power"
            raise LinkError(self._device, text) from error
        except (ModbusException, *UNDECODABLE) as error:
            if self._heard:
                text = f"cannot {what}, {len(self._heard)} bytes came that are no reply; check line settings and cable"
                raise MalformedReply(self._device, text) from error
            raise NoReply(self._device, f"no answer to {what}; {CHECK} {self._address}") from error
        finally:
            self._quiet_until_s = self._clock.now_s() + self._pause_s
        if answer.isError():
            raise RefusedRegister(self._device, what, answer.exception_code)
        if not fits(answer) or (isinstance(client, ModbusTcpClient) and not _whole_frames(self._heard)):
            raise MalformedReply(
                self._device, f"cannot {what}, the reply belongs to another request; {CHECK} {self._address}"
            )
        return answer

    def _connected(self) -> Client:
        if self._client is None:
            self._client = self._open_client()
            self._client.transaction.trace_packet = self._listen  # pymodbus's own hook, else given to its constructor
        elif not _connect(self._client):
            raise LinkError(self._device, "the link cannot be opened again; check cable and power")
        return self._client

    def _listen(self, sending: bool, data: bytes) -> bytes:
        """Keep what came since the last request, to tell silence from noise."""
        self._heard = b"" if sending else data
        return data


def _connect(client: Client) -> bool:
    return bool(client.connect())


def _whole_frames(data: bytes) -> bool:
    """Return whether bytes of a Modbus TCP stream end where a frame ends: it has no checksum that would tell."""
    while data:
        length = 6 + int.from_bytes(data[4:6], "big")
        if len(data) < length:
            return False
        data = data[length:]
    return True
