"""Settings of a chamber on a Watlow F4 or F4T, as a bench file gives them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from instruments.bench_config import ChamberSettings
from instruments.protocols.serial_options import SerialOptions


class WatlowSettings(ChamberSettings):
    """Line, addressing and wiring of both controllers: a serial port for the F4, a host for the F4T."""

    baudrate: int = 19200
    line: SerialOptions = Field(default_factory=SerialOptions)  #: parity, echo, RS-485 direction (watlow-f4)
    address: int = Field(default=1, ge=1, le=247)
    word_order: Literal["little", "big"] = "little"  #: of 32-bit floats (watlow-f4t): low word first by default
    write_function: Literal[6, 16] = 6  #: tried first (watlow-f4); the other one follows an "illegal function"
    alarm_inputs: tuple[Literal[1, 2, 3, 4], ...] = ()  #: digital inputs that carry alarms, if wired (watlow-f4)
    alarm_registers: bool = True  #: 101, 102 and 106 are input error and alarms (watlow-f4), where they exist
    #: Control by the cascade loop (watlow-f4t); by default where the part number has one.
    cascade: bool | None = None
    #: Module and output, from 1, that is on while the chamber runs, if wired (watlow-f4t).
    run_output: tuple[Annotated[int, Field(ge=1, le=6)], Annotated[int, Field(ge=1, le=6)]] | None = None
    enable_event: int | None = Field(default=None, ge=1, le=8)  #: event output that switches the chamber, if wired
