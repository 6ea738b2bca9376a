"""The part of a serial port that the drivers use, and the exceptions of a port whose wire is gone."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import serial

from instruments.protocols.serial_options import Rs485Options

#: Names of pyserial's parities.
PARITIES: dict[str, str] = {"none": serial.PARITY_NONE, "odd": serial.PARITY_ODD, "even": serial.PARITY_EVEN}


@dataclass(frozen=True)
class Line:
    """Electrical settings of a port beyond its bit rate, with 8 data bits. None: as the system leaves it."""

    parity: Literal["none", "odd", "even"] = "none"
    stop_bits: Literal[1, 2] = 1
    dtr: bool | None = None
    rts: bool | None = None
    echo: bool = False  #: what is sent comes back, and is dropped
    rs485: Rs485Options | None = None  #: None: the adapter switches the direction


#: 8 data bits, no parity, one stop bit.
EIGHT_N_1 = Line()


class SerialPort(Protocol):
    """An open port of pyserial, real or simulated; the type stub of pyserial declares these for single systems only."""

    @property
    def timeout(self) -> float | None:
        """Longest wait of `read`, s; None: without end."""
        ...

    @timeout.setter
    def timeout(self, timeout: float | None, /) -> None: ...

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read without waiting."""
        ...

    def read(self, size: int = 1, /) -> bytes:
        """Read `size` bytes, or as many as arrive before the time-out; raises an error of `BROKEN`."""
        ...

    def write(self, data: bytes, /) -> int | None:
        """Send bytes; raises an error of `BROKEN`."""
        ...

    def reset_input_buffer(self) -> None:
        """Drop unread bytes; raises an error of `BROKEN`."""
        ...

    def close(self) -> None:
        """Close the port; safe to call twice."""
        ...


@runtime_checkable
class StampingPort(Protocol):
    """A port that knows when its newest byte came."""

    @property
    def newest_s(self) -> float | None:
        """Clock time of the newest byte that was received; None where it is not known."""
        ...


def _terminal_error() -> type[Exception]:
    """Return the error of the system's terminals; OSError on a system without terminals."""
    try:
        error_class: type[Exception] = importlib.import_module("termios").error
    except ImportError:
        return OSError
    return error_class


#: Emptying the buffers of a port that went away raises the terminal's own error, which is not an OSError.
BROKEN: tuple[type[Exception], ...] = (serial.SerialException, OSError, _terminal_error())
