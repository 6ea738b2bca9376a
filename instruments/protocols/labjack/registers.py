"""Registers of LabJack T7 and T4 over Modbus TCP, high word first, and what their calibration constants mean.

From LabJack's T-series data sheet (3.2.4 Low-Level Stream, A-5 calibration constants), its Modbus map and its C
examples (t7_modbus_tcp_stream: stream.c, calibration.c).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from instruments.protocols.modbus_registers import Register

SOURCE = "LabJack T-series Modbus map"
PRODUCT_ID = Register(60000, "product", "float32", source=SOURCE)
SERIAL_NUMBER = Register(60028, "serial number", "uint32", source=SOURCE)
T4, T7 = 4, 7

AIN_RANGE = Register(40000, "range of input", "float32", "V", access="rw", source=SOURCE)
AIN_NEGATIVE = Register(41000, "negative channel of input", access="rw", source=SOURCE)
SINGLE_ENDED = 199

SCAN_RATE = Register(4002, "scan rate", "float32", "Hz", access="rw", source=SOURCE)
NUMBER_OF_ADDRESSES = Register(4004, "number of stream addresses", "uint32", access="rw", source=SOURCE)
SAMPLES_PER_PACKET = Register(4006, "samples per packet", "uint32", access="rw", source=SOURCE)
SETTLING = Register(4008, "stream settling", "float32", "us", access="rw", source=SOURCE)
RESOLUTION_INDEX = Register(4010, "stream resolution index", "uint32", access="rw", source=SOURCE)
BUFFER_BYTES = Register(4012, "stream buffer", "uint32", "bytes", access="rw", source=SOURCE)
AUTO_TARGET = Register(4016, "stream target", "uint32", access="rw", source=SOURCE)
ETHERNET = 1
DATA_TYPE = Register(4018, "stream data type", "uint32", access="rw", source=SOURCE)
NUMBER_OF_SCANS = Register(4020, "number of scans", "uint32", access="rw", source=SOURCE)
SCAN_LIST = Register(4100, "stream address", "uint32", access="rw", source=SOURCE)
ENABLE = Register(4990, "stream enable", "uint32", access="rw", source=SOURCE)
#: The device takes a power of two up to this.
LARGEST_BUFFER = 32768
MAX_SAMPLES_PER_PACKET = 512

FLASH_POINTER = Register(61810, "flash pointer", "uint32", access="rw", source=SOURCE)
FLASH = Register(61812, "flash", "float32", source=SOURCE)
CONSTANTS_AT = 0x3C4000
#: Constants of one read; the flash is read in this many at most.
FRAME = 13
#: Slopes of the two sides of a T7's centre may differ by this share: one line is taken for both.
LARGEST_KINK = 2e-5


@dataclass(frozen=True)
class Scaling:
    """Volts = slope * (code - centre)."""

    slope_v: float
    centre: float
    kink: float = 0.0  #: by which share the slope below the centre differs


def t7_scaling(constants: Sequence[float], gain: int) -> Scaling:
    """Return the scaling of the high-speed converter of a T7 at gain index 0 to 3 (10 V, 1 V, 0.1 V, 0.01 V)."""
    positive, negative, centre, _ = constants[4 * gain : 4 * gain + 4]
    return Scaling(positive, centre, abs(-negative / positive - 1.0))


def t4_scaling(constants: Sequence[float], channel: int) -> Scaling:
    """Return the scaling of an input of a T4: 0 to 3 take high voltages, each with its own constants."""
    first = 2 * channel if channel < 4 else 8
    slope, offset = constants[first : first + 2]
    return Scaling(slope, -offset / slope)


def gain_index(range_v: float) -> int:
    """Return the gain index of a range; raises ValueError for none of a T7."""
    ranges = (10.0, 1.0, 0.1, 0.01)
    if range_v not in ranges:
        raise ValueError(
            f"range_v {range_v:g} V is not a range of a T7; choose one of {', '.join(f'{each:g}' for each in ranges)}"
        )
    return ranges.index(range_v)
