"""A serial port that knows what has arrived, also while this computer is busy.

Linux hands received bytes on to a terminal or a serial port in a thread of the kernel. Where the processor is busy that
thread has to wait, for up to seconds, while this process runs: bytes that have arrived cannot be read, and an
instrument that answered seems silent. A poll of an empty port returns only after that thread has run.
"""

from __future__ import annotations

import select
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import serial
from serial.rs485 import RS485

#: Whether the system has a poll.
CAN_POLL = hasattr(select, "poll")


def settle(port: serial.Serial) -> None:
    """Wait until the system has handed on what arrived at a port before; a port that is not open is left as it is."""
    if not CAN_POLL:
        return
    with suppress(OSError, ValueError, serial.SerialException):  # what reads the port reports its failure
        poll = select.poll()
        poll.register(port.fileno(), select.POLLIN)
        poll.poll(0)


class SettledSerial(serial.Serial):  # type: ignore[misc]  # its type depends on the system
    """A port of this system. Bytes count as waiting, or are dropped, once they have arrived."""

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read without waiting; 0 where none has arrived."""
        if waiting := super().in_waiting:
            return waiting
        settle(self)
        return super().in_waiting

    def reset_input_buffer(self) -> None:
        """Drop the bytes that have arrived."""
        super().reset_input_buffer()
        settle(self)
        super().reset_input_buffer()


class SettledRS485(RS485, SettledSerial):  # type: ignore[misc]  # its type depends on the system
    """The same with the direction of an RS-485 line switched in every write."""


def unopened(url: str, settings: Mapping[str, object], *, switches_direction: bool = False) -> serial.Serial:
    """Return a port of a system's name or a pyserial address that is not open; `settings` are those of pyserial.

    `switches_direction`: the direction of an RS-485 line is switched by RTS.
    """
    made: Any
    if "://" in url and not switches_direction:
        made = serial.serial_for_url
        port: serial.Serial = made(url, do_not_open=True, **settings)
        return port
    made = SettledRS485 if switches_direction else SettledSerial
    port = made(**settings)
    port.port = url
    return port
