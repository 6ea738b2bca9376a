"""The one adapter around pymodbus (pinned: its minor releases break its API): links, register types, errors, retries.

A simulated instrument is reached through the same clients: only the socket or port under them is another, and it
answers in the calling thread, so that virtual time stays deterministic.
"""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING, Any, Literal

from pymodbus import FramerType, ModbusException
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.pdu import ModbusPDU

from instruments.clock import Clock
from instruments.errors import LinkError, NoReply, Refused

if TYPE_CHECKING:
    from instruments.simulators.device import SimulatedDevice

RETRIES = 3
PAUSE_S = 0.03
EXCEPTIONS = {
    1: "it does not know the function",
    2: "it has no such register, or the register cannot be written",
    3: "it does not accept the value",
    4: "it failed inside",
    6: "it is busy",
}


class _PairedTcpClient(ModbusTcpClient):
    """A Modbus TCP client on one end of a socket pair; the instrument answers at the other while it sends."""

    def __init__(self, device: SimulatedDevice, clock: Clock, **settings: Any) -> None:
        super().__init__("simulated", **settings)
        self._device, self._clock = device, clock
        self._far: socket.socket | None = None

    def connect(self) -> bool:
        """Open the pair."""
        if self.socket is None:
            self.socket, self._far = socket.socketpair()
            self.socket.settimeout(self.comm_params.timeout_connect)
        return True

    def close(self) -> None:
        """Close both ends."""
        super().close()
        if self._far is not None:
            self._far.close()
            self._far = None

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:
        """Send a request, and let the instrument answer it."""
        sent = super().send(request, addr)
        assert self._far is not None
        self._device.receive(self._far.recv(65536), self._clock.now_s())
        answer = self._device.transmit(self._clock.now_s())
        if answer:
            self._far.sendall(answer)
        return int(sent)


class _SimulatedRtuClient(ModbusSerialClient):
    """A Modbus RTU client on a simulated serial port."""

    def __init__(self, device: SimulatedDevice, clock: Clock, **settings: Any) -> None:
        super().__init__("simulated", framer=FramerType.RTU, **settings)
        self._device, self._clock = device, clock

    def connect(self) -> bool:
        """Open the port."""
        from instruments.simulators.sim_serial import SimSerial  # noqa: PLC0415  a real bench never loads it

        if self.socket is None:
            self.socket = SimSerial(self._device, self._clock, timeout=self.comm_params.timeout_connect)
            self.last_frame_end = None
        return True


def connect_tcp(
    host: str, tcp_port: int, *, device: str, clock: Clock, timeout_s: float, at: SimulatedDevice | None
) -> ModbusTcpClient:
    """Open a Modbus TCP link; `at` is the simulated instrument where the address is one. Raises LinkError."""
    settings: dict[str, Any] = {"timeout": clock.wall_s(timeout_s), "retries": 0, "reconnect_delay": 0}
    client = _PairedTcpClient(at, clock, **settings) if at else ModbusTcpClient(host, port=tcp_port, **settings)
    if not client.connect():
        raise LinkError(device, f"no Modbus TCP at {host}:{tcp_port}; check address, cable and that it is switched on")
    return client


def connect_rtu(
    url: str, *, device: str, clock: Clock, baudrate: int, timeout_s: float, at: SimulatedDevice | None
) -> ModbusSerialClient:
    """Open a Modbus RTU link; `at` is the simulated instrument where the address is one. Raises LinkError."""
    settings: dict[str, Any] = {"baudrate": baudrate, "timeout": clock.wall_s(timeout_s), "retries": 0}
    client = (
        _SimulatedRtuClient(at, clock, **settings) if at else ModbusSerialClient(url, framer=FramerType.RTU, **settings)
    )
    if not client.connect():
        raise LinkError(device, f"serial port {url} cannot be opened; check its name, the cable and who else uses it")
    return client


Client = ModbusTcpClient | ModbusSerialClient


class Registers:
    """The registers of one instrument: typed reads and writes, bounded retries, every failure an instrument error."""

    def __init__(self, device: str, address: int, clock: Clock, open_client: Any) -> None:
        self._device, self._address, self._clock = device, address, clock
        self._open_client = open_client
        self._client: Client | None = None

    def read_int16(self, register: int, what: str) -> int:
        """Get a signed 16-bit register."""
        raw = self.read(register, 1, what)[0]
        return raw - 0x10000 if raw >= 0x8000 else raw

    def read(self, register: int, count: int, what: str, *, function: Literal[3, 4] = 3) -> list[int]:
        """Get `count` unsigned 16-bit registers."""

        def ask(client: Client) -> ModbusPDU:
            read = client.read_holding_registers if function == 3 else client.read_input_registers
            return read(register, count=count, device_id=self._address)

        found = list(self._exchange(ask, register, f"read {what}").registers)
        if len(found) != count:
            raise LinkError(self._device, f"sent {len(found)} registers instead of {count} for {what}")
        return found

    def read_float(self, register: int, what: str, word_order: Literal["little", "big"]) -> float:
        """Get a 32-bit float of two registers."""
        words = self.read(register, 2, what)
        value = ModbusTcpClient.convert_from_registers(words, ModbusTcpClient.DATATYPE.FLOAT32, word_order=word_order)
        return float(value)  # type: ignore[arg-type]

    def write_float(self, register: int, value: float, what: str, word_order: Literal["little", "big"]) -> None:
        """Set a 32-bit float of two registers (function 16)."""
        words = ModbusTcpClient.convert_to_registers(value, ModbusTcpClient.DATATYPE.FLOAT32, word_order=word_order)
        self._exchange(
            lambda client: client.write_registers(register, words, device_id=self._address), register, f"write {what}"
        )

    def write(self, register: int, value: int, what: str, *, function: Literal[6, 16] = 6) -> None:
        """Set one 16-bit register; a negative value as two's complement."""
        word = value & 0xFFFF

        def ask(client: Client) -> ModbusPDU:
            if function == 6:
                return client.write_register(register, word, device_id=self._address)
            return client.write_registers(register, [word], device_id=self._address)

        self._exchange(ask, register, f"write {what}")

    def _exchange(self, ask: Any, register: int, what: str) -> ModbusPDU:
        failure: Exception | None = None
        for attempt in range(RETRIES):
            if attempt:
                self._clock.sleep(PAUSE_S * 2**attempt)
            try:
                client = self._connected()
                answer: ModbusPDU = ask(client)
            except (ModbusException, OSError) as error:
                failure = error
                self.close()  # a late reply of this request dies with its link
                continue
            if answer.isError():
                code = int(getattr(answer, "exception_code", 0))
                reason = EXCEPTIONS.get(code, "no reason that is known")
                raise Refused(self._device, f"refused to {what} (register {register}): exception {code}, {reason}")
            return answer
        raise NoReply(
            self._device,
            f"did not {what} (register {register}) in {RETRIES} tries ({failure}); check power, cable, address "
            f"{self._address} and baud rate",
        ) from failure

    def _connected(self) -> Client:
        if self._client is None:
            self._client = self._open_client()
        elif not self._client.connected:
            self._client.connect()
        return self._client

    def close(self) -> None:
        """Control the link: close it."""
        if self._client is not None:
            self._client.close()
            self._client = None
