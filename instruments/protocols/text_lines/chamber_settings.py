"""Settings of chambers that are spoken to in lines of text, as a bench file gives them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from instruments.bench_config import ChamberSettings
from instruments.protocols.port_or_host import PortOrHostSettings
from instruments.protocols.serial_options import SerialOptions


class LineChamberSettings(PortOrHostSettings, ChamberSettings):
    """A serial port, or a host and its TCP port."""

    baudrate: int = Field(default=9600, gt=0)
    options: SerialOptions = Field(default_factory=SerialOptions)
    #: What the safe state is: the safe set point, or that and then heating and cooling switched off.
    safe_state: Literal["setpoint", "off"] = "setpoint"


class EspecSettings(LineChamberSettings):
    """An Espec P-300 or SCP-220."""

    tcp_port: int = 10001
    unit: int | None = Field(default=None, ge=1, le=16)  #: number on an RS-485 line; not on TCP, nor on RS-232
    #: Whether the panel is locked while labctl controls the chamber. Not by default: a person may need it for a stop.
    lock_panel: bool = False


class SimServSettings(LineChamberSettings):
    """A Weiss or Votsch chamber with SimServ."""

    tcp_port: int = 2049
    chamber_index: int = Field(default=1, ge=1)
    variable: int = Field(default=1, ge=1)  #: number of the control variable that is the temperature


class Ascii2Settings(LineChamberSettings):
    """A Weiss or Votsch chamber with ASCII-2."""

    tcp_port: int = 2049
    unit: int = Field(default=1, ge=0, le=31)
    start_channel: int = Field(default=1, ge=0, le=31)  #: digital channel, from 0, that starts the chamber
    alarm_channel: int | None = Field(default=None, ge=0, le=31)  #: digital channel that shows a fault, if there is one


class ThermotronSettings(LineChamberSettings):
    """A Thermotron 3800, 8200 or 8800."""

    tcp_port: int = 8888
    channel: int = Field(default=1, ge=1, le=8)  #: of the air temperature
    acknowledges: bool = True  #: answers a command by 0 (8800); false: by nothing (3800)
    command_pause_s: float = Field(default=0.0, ge=0)  #: after each request; a 3800 needs 1 s
