"""Settings of a chamber on a Watlow F4 or F4T, as a bench file gives them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from instruments.bench_config import ChamberSettings


class WatlowSettings(ChamberSettings):
    """Line, addressing and wiring of both controllers: a serial port for the F4, a host for the F4T."""

    baudrate: int = 19200
    address: int = Field(default=1, ge=1, le=247)
    word_order: Literal["little", "big"] = "little"  #: of 32-bit floats (watlow-f4t): low word first by default
    write_function: Literal[6, 16] = 6  #: tried first (watlow-f4); the other one follows an "illegal function"
    alarm_inputs: tuple[Literal[1, 2, 3, 4], ...] = ()  #: digital inputs that carry alarms, if wired (watlow-f4)
    enable_event: int | None = Field(default=None, ge=1, le=8)  #: event output that switches the chamber, if wired
