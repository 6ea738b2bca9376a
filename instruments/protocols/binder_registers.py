"""Binder controllers MK 53 and MK 56 over Modbus: registers as data.

From SiLab-Bonn/basil 85c4116, HL/binder_mk53.py and HL/binder_mk56.py. Floats have their low word first and are written
by function 16. A MK 53 has two set points, of its manual and of its basic mode; which of them is in force depends on
the mode.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from instruments.bench_config import ChamberSettings
from instruments.protocols.modbus_registers import Register, WordOrder
from instruments.protocols.port_or_host import PortOrHostSettings

SOURCE = "SiLab-Bonn/basil 85c4116"
RESOLUTION_C = 0.1
#: Bits of the mode of a MK 53: basic, manual, and automatic: a program.
BASIC, MANUAL, AUTOMATIC = 0x1000, 0x0800, 0x0400


@dataclass(frozen=True)
class BinderMap:
    """Where one controller keeps what."""

    air: Register
    setpoint: Register  #: the one that counts now
    write: tuple[Register, ...]  #: where a set point is written
    mode: Register | None  #: None: the controller does not tell


def _c(number: int, meaning: str, access: Literal["r", "rw", "w"] = "r") -> Register:
    return Register(number, meaning, "float32", "deg C", -200.0, 500.0, access, SOURCE)


MAPS: dict[str, BinderMap] = {
    "mk53": BinderMap(
        _c(0x11A9, "air temperature"),
        _c(0x1077, "set point"),
        (_c(0x1581, "set point of the manual mode", "rw"), _c(0x156F, "set point of the basic mode", "rw")),
        Register(0x1A22, "mode", source=SOURCE),
    ),
    "mk56": BinderMap(
        _c(0x1004, "air temperature"), _c(0x10B2, "set point"), (_c(0x114C, "set point to be held", "rw"),), None
    ),
}


class BinderSettings(PortOrHostSettings, ChamberSettings):
    """A serial port, or a host whose adapter carries Modbus RTU, and the controller."""

    tcp_port: int = 10001
    controller: Literal["mk53", "mk56"] = "mk56"
    baudrate: int = Field(default=9600, gt=0)
    address: int = Field(default=1, ge=1, le=247)
    word_order: WordOrder = "little"
