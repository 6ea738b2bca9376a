"""A simulated Modbus instrument: pymodbus frames and decodes, a table of registers answers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from pymodbus.framer import FramerRTU, FramerSocket
from pymodbus.pdu import DecodePDU, ExceptionResponse, ModbusPDU
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersResponse,
    ReadInputRegistersResponse,
    WriteMultipleRegistersResponse,
    WriteSingleRegisterResponse,
)

from instruments.simulators.faults import Faults

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3


@dataclass(frozen=True)
class Register:
    """One 16-bit register: what it holds at a time, and what writing it does (None: it cannot be written)."""

    get: Callable[[float], int]
    put: Callable[[int, float], bool] | None = None  #: returns whether the value is accepted


class ModbusDevice:
    """Bytes in, bytes out, on a map of registers."""

    def __init__(
        self, framing: Literal["rtu", "tcp"], registers: dict[int, Register], faults: Faults, address: int = 1
    ) -> None:
        self._framer: Any = (FramerRTU if framing == "rtu" else FramerSocket)(DecodePDU(is_server=True))
        self._registers, self._faults, self._address = registers, faults, address
        self._rtu = framing == "rtu"
        self._pending = b""
        self._out = bytearray()

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes; every whole request in them is answered."""
        self._pending += data
        while self._pending:
            used, request = self._framer.handleFrame(self._pending, self._address if self._rtu else 0, 0)
            self._pending = self._pending[used:]
            if request is None:
                if not used:
                    return
                continue
            if self._rtu and request.dev_id != self._address:
                continue
            self._answer(request, t_s)

    def transmit(self, t_s: float) -> bytes:  # noqa: ARG002  a reply goes out at once
        """Return what was answered."""
        sent, self._out = bytes(self._out), bytearray()
        return sent

    def next_byte_s(self, t_s: float) -> float | None:  # noqa: ARG002
        """Nothing comes unasked."""
        return None

    def _answer(self, request: ModbusPDU, t_s: float) -> None:
        if self._faults.strike(["lost_reply", "silence"], t_s) is not None:
            return
        fault = self._faults.strike(["modbus_exception"], t_s)
        response = ExceptionResponse(request.function_code, fault.value) if fault else self._respond(request, t_s)
        response.dev_id, response.transaction_id = request.dev_id, request.transaction_id
        frame = self._framer.buildFrame(response)
        if self._faults.strike(["wrong_crc"], t_s) is not None:
            frame = frame[:-1] + bytes([frame[-1] ^ 0x55])
        self._out += frame

    def _respond(self, request: ModbusPDU, t_s: float) -> ModbusPDU:
        code, start = request.function_code, request.address
        if code in {3, 4}:
            wanted = range(start, start + request.count)
            if any(number not in self._registers for number in wanted):
                return ExceptionResponse(code, ILLEGAL_ADDRESS)
            words = [self._registers[number].get(t_s) & 0xFFFF for number in wanted]
            kind = ReadHoldingRegistersResponse if code == 3 else ReadInputRegistersResponse
            return kind(registers=words)
        if code in {6, 16}:
            words = list(request.registers)
            for offset, word in enumerate(words):
                register = self._registers.get(start + offset)
                if register is None or register.put is None:
                    return ExceptionResponse(code, ILLEGAL_ADDRESS)
                if not register.put(word, t_s):
                    return ExceptionResponse(code, ILLEGAL_VALUE)
            if code == 6:
                return WriteSingleRegisterResponse(address=start, registers=words)
            return WriteMultipleRegistersResponse(address=start, count=len(words))
        return ExceptionResponse(code, ILLEGAL_FUNCTION)


def constant(value: int) -> Register:
    """Return a register that always holds the same."""
    return Register(lambda _: value)
