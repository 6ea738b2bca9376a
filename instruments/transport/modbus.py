"""Typed reads and writes of the registers of one Modbus instrument."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

from pymodbus.pdu import ModbusPDU

from instruments.clock import Clock
from instruments.errors import LimitError, MalformedReply
from instruments.protocols.modbus_codes import (
    ILLEGAL_ADDRESS,
    ILLEGAL_FUNCTION,
    ILLEGAL_VALUE,
    READ_HOLDING,
    WRITE_MULTIPLE,
    WRITE_SINGLE,
)
from instruments.protocols.modbus_registers import Register, WordOrder
from instruments.transport.modbus_link import Client, ModbusLink, RefusedRegister

WriteFunction = Literal[6, 16]


class Registers:
    """The registers of one instrument, read and written by value. Every failure is an InstrumentError.

    `word_order` is the order of the two words of a 32-bit float; `write_function` is tried first for 16-bit registers.
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
        write_function: WriteFunction = WRITE_SINGLE,
    ) -> None:
        self._link = ModbusLink(device, address, clock, open_client, pause_s=pause_s)
        self._word_order: WordOrder = word_order
        self._write_function: WriteFunction = write_function
        self._absent: set[tuple[Register, int]] = set()

    @property
    def remarks(self) -> tuple[str, ...]:
        """Faults of the line that requests survived and that need a repair, one text each."""
        return self._link.remarks

    def get(self, register: Register) -> float:
        """Get the value of a register, in its unit or counts.

        Raises MalformedReply for a value that the register cannot hold, and what `words` raises.
        """
        return self._value(register, self.words(register))

    def get_block(self, register: Register, counts: Sequence[int]) -> tuple[float, list[int]]:
        """Get the value of a register and the words from it on, by the first of `counts` that the instrument has.

        A reply of another length than asked for never fits, so that on a line without numbered replies a late one to
        another request is refused. Raises as `get` does.
        """
        for count in counts:
            if (register, count) in self._absent:
                continue
            try:
                words = self.words(register, count)
            except RefusedRegister as refused:
                if refused.code not in {ILLEGAL_ADDRESS, ILLEGAL_VALUE} or count == counts[-1]:
                    raise
                self._absent.add((register, count))
            else:
                return self._value(register, words[: register.words]), words
        return self.get(register), []

    def get_int(self, register: Register) -> int:
        """Get the value of a 16-bit register; raises as `get` does."""
        return int(self.get(register))

    def words(self, register: Register, count: int | None = None) -> list[int]:
        """Get `count` unsigned 16-bit words from a register on; by default the words of the register.

        Raises NoReply, MalformedReply, LinkError or RefusedRegister.
        """
        words = register.words if count is None else count
        function = register.read_function

        def ask(client: Client) -> ModbusPDU:
            read = client.read_holding_registers if function == READ_HOLDING else client.read_input_registers
            return read(register.number, count=words, device_id=self._link.address)

        def fits(reply: ModbusPDU) -> bool:
            return reply.function_code == function and len(reply.registers) == words

        return list(self._link.exchange(f"read {register}", ask, fits).registers)

    def put(self, register: Register, value: float) -> None:
        """Set a register: an integer as two's complement, a float as two words.

        A 16-bit register is written by the preferred function; after the exception "illegal function" this and every
        later write use the other one. A float always takes function 16.

        Raises LimitError (nothing was sent), RefusedRegister, NoReply, MalformedReply or LinkError.
        """
        self._check_writable(register, value)
        words = register.encode(value, self._word_order)
        if len(words) > 1:
            self._write(register, words, WRITE_MULTIPLE)
            return
        try:
            self._write(register, words, self._write_function)
        except RefusedRegister as refused:
            if refused.code != ILLEGAL_FUNCTION:
                raise
            self._write_function = WRITE_MULTIPLE if self._write_function == WRITE_SINGLE else WRITE_SINGLE
            self._write(register, words, self._write_function)

    def close(self) -> None:
        """Close the link; safe to call twice. The next request opens it again."""
        self._link.close()

    def _value(self, register: Register, words: list[int]) -> float:
        value = register.decode(words, self._word_order)
        if register.is_plausible(value):
            return value
        other: WordOrder = "big" if self._word_order == "little" else "little"
        if register.kind == "float32" and register.is_plausible(exchanged := register.decode(words, other)):
            advice = (
                f"with its two words exchanged the value is {exchanged:g}: set word_order = '{other}' in the bench file"
            )
        elif register.below and value < register.low:
            advice = f"this value is {register.below}: check the sensor and its wires at the controller"
            raise MalformedReply(self._link.device, f"{register} reads {value:g} {register.unit}; {advice}")
        else:
            advice = "check the sensor, the word order and that the bench file names the right driver"
        raise MalformedReply(
            self._link.device,
            f"{register} reads {value:g} {register.unit}, outside the possible range of {register.low:g} to "
            f"{register.high:g}; {advice}",
        )

    def _check_writable(self, register: Register, value: float) -> None:
        if register.access == "r":
            raise LimitError(self._link.device, f"{register} can only be read; nothing was sent: correct the driver")
        if not register.holds(value):
            raise LimitError(
                self._link.device,
                f"{register} takes {register.low:g} to {register.high:g} {register.unit}, not {value:g}; nothing was "
                "sent: give a value within these limits"
                "",
            )

    def _write(self, register: Register, words: list[int], function: WriteFunction) -> None:
        def ask(client: Client) -> ModbusPDU:
            if function == WRITE_SINGLE:
                return client.write_register(register.number, words[0], device_id=self._link.address)
            return client.write_registers(register.number, words, device_id=self._link.address)

        def fits(reply: ModbusPDU) -> bool:
            echoed = reply.registers == words if function == WRITE_SINGLE else reply.count == len(words)
            return reply.function_code == function and reply.address == register.number and echoed

        self._link.exchange(f"write {register}", ask, fits)
