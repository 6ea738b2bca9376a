"""Settings of a STIM300, as a bench file gives them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from instruments.bench_config import GyroSettings
from instruments.protocols.serial_options import SerialOptions


class DatagramOptions(SerialOptions):
    """Configuration of the unit's output: datagram, line end, bit rate in bit/s. The unit is asked whether it is so."""

    datagram: Literal[
        0x90, 0x91, 0x92, 0x93, 0x94, 0xA5, 0xA6, 0xA7, 0xF0, 0xF1, 0xF2, 0xF3, 0xF4, 0xF5, 0xF6, 0xF7,
        0x98, 0x99, 0x9A, 0x9B, 0x9C, 0xAD, 0xAE, 0xAF,
    ] = 0x94  # fmt: skip
    crlf: bool = False
    baudrate: int = 460_800
    ask: bool = True  #: False where no wire leads from the computer to the unit


class Stim300Settings(GyroSettings):
    """Settings of a STIM300, as a bench file gives them."""

    options: DatagramOptions = Field(default_factory=DatagramOptions)
