"""A simulated Modbus instrument: pymodbus frames and decodes the bytes, a map of register cells gives the values."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

from pymodbus.framer import FramerRTU, FramerSocket
from pymodbus.pdu import DecodePDU, ExceptionResponse, ModbusPDU
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersResponse,
    ReadInputRegistersResponse,
    WriteMultipleRegistersResponse,
    WriteSingleRegisterResponse,
)

from instruments.protocols.modbus_codes import (
    ILLEGAL_ADDRESS,
    ILLEGAL_FUNCTION,
    ILLEGAL_VALUE,
    READ_HOLDING,
    READ_INPUT,
    WRITE_MULTIPLE,
    WRITE_SINGLE,
)
from instruments.protocols.modbus_registers import WordOrder
from instruments.simulators.links.faults import Faults
from instruments.simulators.links.replies import Replies

FUNCTIONS = frozenset({READ_HOLDING, READ_INPUT, WRITE_SINGLE, WRITE_MULTIPLE})
ANY_UNIT = frozenset({0, 255})  #: unit numbers that every Modbus TCP instrument takes for its own
MAX_FRAME_BYTES = 264


@dataclass(frozen=True)
class Cell:
    """A quantity in `words` consecutive registers: its words at a clock time, and the effect of writing it."""

    get: Callable[[float], Sequence[int]]
    put: Callable[[list[int], float], bool] | None = None  #: returns whether the value is accepted; None: read-only
    words: int = 1


def constant(value: int) -> Cell:
    """Return a read-only register with a constant value."""
    return Cell(lambda _: (value,))


def int16(get: Callable[[float], float], put: Callable[[int, float], bool] | None = None) -> Cell:
    """Return a signed 16-bit register; its value is rounded to whole counts."""

    def write(words: list[int], t_s: float) -> bool:
        assert put is not None
        return put(words[0] - 0x10000 if words[0] >= 0x8000 else words[0], t_s)

    return Cell(lambda t_s: (round(get(t_s)) & 0xFFFF,), write if put else None)


def items(start: int, stride: int, values: list[int]) -> dict[int, Cell]:
    """Return a read-only register for each item of a list, at `start`, `start` + `stride` ..."""
    return {start + stride * n: int16(partial(_item, values, n)) for n in range(len(values))}


def _item(values: list[int], n: int, _t_s: float) -> int:
    return values[n]


def float32(order: WordOrder, get: Callable[[float], float], put: Callable[[float, float], bool] | None = None) -> Cell:
    """Return a 32-bit float in two registers."""
    way = 1 if order == "big" else -1

    def read(t_s: float) -> tuple[int, ...]:
        return tuple(struct.unpack(">HH", struct.pack(">f", get(t_s)))[::way])

    def write(words: list[int], t_s: float) -> bool:
        assert put is not None
        (value,) = struct.unpack(">f", struct.pack(">HH", *words[::way]))
        return put(value, t_s)

    return Cell(read, write if put else None, words=2)


def uint32(order: WordOrder, get: Callable[[float], float], put: Callable[[int, float], bool] | None = None) -> Cell:
    """Return an unsigned 32-bit number in two registers."""
    way = 1 if order == "big" else -1

    def read(t_s: float) -> tuple[int, ...]:
        value = int(get(t_s))
        return (value >> 16, value & 0xFFFF)[::way]

    def write(words: list[int], t_s: float) -> bool:
        assert put is not None
        high, low = words[::way]
        return put(high << 16 | low, t_s)

    return Cell(read, write if put else None, words=2)


class ModbusDevice(Replies):
    """Bytes in, bytes out, on a map of cells by their first register.

    `absent` is the value of a register that does not exist; None: exception 2, as the standard requires.
    """

    def __init__(
        self, framing: Literal["rtu", "tcp"], cells: Mapping[int, Cell], faults: Faults, address: int = 1
    ) -> None:
        super().__init__()
        self.functions = FUNCTIONS
        self.absent: int | None = None
        self.faults = faults
        self._rtu = framing == "rtu"
        self._decoder = DecodePDU(is_server=True)
        self._framer: Any = (FramerRTU if self._rtu else FramerSocket)(self._decoder)
        self._units = frozenset({address}) if self._rtu else ANY_UNIT | {address}
        self._cells = dict(cells)
        self._pending = b""

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes and answer every whole request to this address in them."""
        if self._pending and not self._is_whole(self._pending + data) and self._is_whole(data):
            self._pending = b""  # bytes that never became a request
        self._pending += data
        while self._pending:
            used, unit_id, transaction, pdu = self._framer.decode(self._pending)
            if not used:
                if len(self._pending) > MAX_FRAME_BYTES or self._cannot_be_a_frame():
                    self._pending = b""
                return
            self._pending = self._pending[used:]
            if pdu and unit_id in self._units:
                self._reply_to(pdu, unit_id, transaction, t_s)

    def _is_whole(self, data: bytes) -> bool:
        return bool(self._framer.decode(data)[3])

    def _cannot_be_a_frame(self) -> bool:
        return not self._rtu and self._pending[2:4].strip(b"\0") != b""  # TCP: the protocol number is 0

    def _reply_to(self, pdu: bytes, unit_id: int, transaction: int, t_s: float) -> None:
        if self.faults.trigger(["lost_reply", "silence"], t_s) is not None:
            return
        fault = self.faults.trigger(["modbus_exception"], t_s)
        response = ExceptionResponse(pdu[0], fault.value) if fault else self._respond(pdu, t_s)
        response.dev_id, response.transaction_id = unit_id, transaction
        frame = bytearray(self._framer.buildFrame(response))
        if self.faults.trigger(["wrong_crc"], t_s) is not None:
            frame[-1 if self._rtu else 2] ^= 0x55  # TCP frames carry no checksum; their protocol number breaks instead
        self._out += frame

    def _respond(self, pdu: bytes, t_s: float) -> ModbusPDU:
        code = pdu[0]
        if code not in self.functions:
            return ExceptionResponse(code, ILLEGAL_FUNCTION)
        request = self._decoder.decode(pdu)
        if request is None:
            return ExceptionResponse(code, ILLEGAL_VALUE)
        return (self._read_reply if code in {READ_HOLDING, READ_INPUT} else self._write_reply)(request, t_s)

    def _read_reply(self, request: ModbusPDU, t_s: float) -> ModbusPDU:
        words = self._read(request.address, request.count, t_s)
        if words is None:
            return ExceptionResponse(request.function_code, ILLEGAL_ADDRESS)
        reply = ReadHoldingRegistersResponse if request.function_code == READ_HOLDING else ReadInputRegistersResponse
        return reply(registers=words)

    def _write_reply(self, request: ModbusPDU, t_s: float) -> ModbusPDU:
        code, words = request.function_code, list(request.registers)
        if not words or (code == WRITE_MULTIPLE and len(words) != request.count):
            return ExceptionResponse(code, ILLEGAL_VALUE)
        if refusal := self._write(request.address, words, t_s):
            return ExceptionResponse(code, refusal)
        if code == WRITE_SINGLE:
            return WriteSingleRegisterResponse(address=request.address, registers=words)
        return WriteMultipleRegistersResponse(address=request.address, count=len(words))

    def _read(self, start: int, count: int, t_s: float) -> list[int] | None:
        """Return `count` words, or None where one is not there."""
        words: list[int] = []
        while len(words) < count:
            number = start + len(words)
            if number in self._cells:
                words += self._cells[number].get(t_s)
            elif number - 1 in self._cells and self._cells[number - 1].words == 2:
                words.append(self._cells[number - 1].get(t_s)[1])
            elif self.absent is not None:
                words.append(self.absent & 0xFFFF)
            else:
                return None
        return words[:count]

    def _write(self, start: int, words: list[int], t_s: float) -> int:
        """Take words from register `start` on; returns an exception code, 0 when all were accepted."""
        done = 0
        while done < len(words):
            cell = self._cells.get(start + done)
            if cell is None or cell.put is None or done + cell.words > len(words):
                return ILLEGAL_ADDRESS
            if not cell.put(words[done : done + cell.words], t_s):
                return ILLEGAL_VALUE
            done += cell.words
        return 0
